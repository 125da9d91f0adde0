"""Contents of a plan: enumerations, edges, processes, shared settings, guard policy.

Each enumeration of the plan and of the language is a Literal here; ``get_args`` gives its words.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from msgspec import Meta

from tfcompose.foundation.geometry import Pose
from tfcompose.model.fields import documented_field

#: Who moves an edge: nobody, joint states, or its owner.
EdgeKind = Literal["static", "joint", "dynamic"]
#: How a joint moves; of planar and floating ones joint states say nothing.
JointType = Literal["revolute", "continuous", "prismatic", "planar", "floating"]

#: What a process is: one of tfcompose's own, one that is started elsewhere, a program, or a node
#: in a container.
ProcessKind = Literal["static", "joints", "guard", "simulate", "external", "run", "component"]
#: After which ends a process is started again.
RestartPolicy = Literal["no", "on-failure", "always"]
#: The first signal that ends a process.
StopSignal = Literal["SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2"]
#: What makes a process ready.
ReadyKind = Literal["edges", "topic", "service", "lifecycle", "log", "exit", "time"]
#: What must have happened to another process before one is started.
StartCondition = Literal["started", "ready", "done"]
#: The states of a lifecycle node that it can be brought into, or be waited for in.
LifecycleState = Literal["inactive", "active"]
#: How much a node's loggers write.
LogLevel = Literal["debug", "info", "warn", "error", "fatal"]
#: What a stand-in does.
SimulationKind = Literal["circle", "fixed", "joints"]
#: Where a process's output goes: to the terminal of up and into its log, or to one of them.
OutputPlace = Literal["both", "log", "screen"]
#: How the kernel schedules a process (sched(7)); fifo and rr are real-time policies.
SchedulingPolicy = Literal["other", "batch", "idle", "fifo", "rr"]
#: How well the pose of a frame is known that a driver publishes.
PoseKnowledge = Literal["exact", "nominal", "unknown"]

#: Whose time the whole plan runs by.
Clock = Literal["wall", "sim"]
#: How far ROS looks for other nodes; None in a plan: as far as the environment says.
Discovery = Literal["localhost", "subnet", "off"]
#: The middleware that all processes use.
Rmw = Literal["fastdds", "cyclonedds", "zenoh"]
#: The release of ROS that all processes are from.
Distro = Literal["jazzy", "kilted"]
#: What keeps several robots in one domain apart: topics below their namespaces, or frames with a
#: prefix.
Isolation = Literal["none", "topics", "frames", "both"]
#: Who publishes what is ours below the base.
StatePublisher = Literal["tfcompose", "stock"]
#: Who publishes the frames inside a sensor.
SensorPublisher = Literal["driver", "tfcompose"]

#: What the guard does with what a process sends and does not own: nothing, report it, or hold it
#: back.
GuardMode = Literal["off", "watch", "strict"]
#: What an edge is that nobody declared.
UnknownEdges = Literal["ignore", "warn", "error"]
#: What follows a violation: words, the end of the process that surely did it, or the end of
#: everything.
OnViolation = Literal["report", "stop-offender", "stop"]
#: How a strict guard fences processes off; auto: by partition where their rmw is Fast DDS, else by
#: remapping.
FenceWay = Literal["auto", "partition", "remap"]


#: An edge is silent after four periods, and never before this: what a loaded machine can delay.
_SILENT_AT_LEAST_S = 0.6
_SILENT_PERIODS = 4.0
#: It is too slow below this part of the rate that is declared, and from then on up to that one.
_SLOW_BELOW, _SLOW_UP_TO = 0.8, 0.9
#: How often a process is started again in a row, unless it says so itself.
MAX_RESTARTS = 5


def silent_after_s(period_s: float) -> float:
    """Return how long an edge that comes every ``period_s`` seconds may be quiet."""
    return max(_SILENT_AT_LEAST_S, _SILENT_PERIODS * period_s)


#: A time or rate.
AboveZero = Annotated[float, Meta(gt=0)]


class SourceLine(NamedTuple):
    """A line of a robot file; the file is relative to the robot's."""

    file: str
    line: int


@dataclass(frozen=True, slots=True)
class EdgePattern:
    """Edges by frame names; ``*`` and ``?`` are wildcards."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    parent: str = documented_field("*", "the parent frame", "camera_color_optical_frame")
    child: str = documented_field("*", "the child frame", "tag36h11:*")


@dataclass(frozen=True, slots=True)
class PlanJoint:
    """A moving joint: motion along an axis, on top of the edge's pose."""

    name: str
    type: JointType
    #: A unit vector in the child's frame at q = 0.
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    #: The joint that it follows: its position is ``multiplier`` · q(mimic) + ``offset``.
    mimic: str | None = None
    multiplier: float = 1.0
    #: In radians; in metres for a prismatic joint.
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class PlanEdge:
    """One TF edge and the process that publishes it."""

    #: The nominal parent of a child that changes parents.
    parent: str
    child: str
    kind: EdgeKind
    owner: str
    #: The full name of the publishing node.
    node: str
    #: The identity where ``pose_known`` is False.
    pose: Pose
    #: In hertz; None: the plan does not say.
    rate: float | None
    source: SourceLine
    joint: PlanJoint | None = None
    #: The other parents that the owner may attach the child to.
    switched: tuple[str, ...] = ()
    #: False if only the owner knows the child's pose.
    pose_known: bool = True

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"

    @property
    def silent_after_s(self) -> float | None:
        """How long a moving edge may be quiet, in seconds, or None if it says no rate."""
        if not self.rate or self.kind == "static":
            return None
        return silent_after_s(1 / self.rate)

    def is_slow(self, rate: float, speed: float, *, was_slow: bool = False) -> bool:
        """Return whether it comes too seldom, at ``rate`` in hertz.

        Time goes by ``speed`` times as fast as the time of day, as in a simulation.
        """
        share = _SLOW_UP_TO if was_slow else _SLOW_BELOW
        return rate < share * speed * (self.rate or 0.0)

    def may_hang_on(self, parent: str) -> bool:
        """Return whether the owner may publish the child below this parent."""
        return parent == self.parent or parent in self.switched


#: In an ``argv``, ``${plan}``, ``${build_dir}`` and ``${params_file}`` stand for what only the
#: starting machine knows. As its first word ``${tfcompose}`` is this program,
#: ``${executable:PACKAGE/NAME}`` a package's, and ``${launch:PACKAGE/FILE}`` a package's launch
#: file; the words after that are the launch file's arguments, ``name:=value``.
PROGRAM = "${tfcompose}"
_AT_START = re.compile(r"\$\{(?:file:|build_dir\}|params_file\})")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Motion of a simulated joint: between two positions, or without them in full turns."""

    #: The time there and back, or of a full turn.
    period_s: AboveZero
    #: In radians, or metres for a prismatic joint.
    lower: float | None = None
    upper: float | None = None

    def __post_init__(self) -> None:
        if (self.lower is None) != (self.upper is None):
            raise ValueError("has one of lower and upper without the other")


@dataclass(frozen=True, slots=True)
class Simulation:
    """A simulation of an owner: a body on a circle, one at rest, or joint states."""

    kind: SimulationKind
    #: In hertz.
    rate: AboveZero
    radius: float = 0.0
    speed: float = 0.0
    #: Initial positions (rad or m); joints without a ``sweep`` stay there.
    joints: dict[str, float] = field(default_factory=dict)
    sweep: dict[str, Sweep] = field(default_factory=dict)
    pose: Pose = field(default_factory=Pose)


@dataclass(frozen=True, slots=True)
class Ready:
    """The condition under which a process counts as ready."""

    kind: ReadyKind
    #: The full name of a topic or service, the lifecycle state of the process's nodes, or a
    #: regular expression for a line of its output.
    text: str = ""
    #: The exit code, or the seconds after the start.
    number: float = 0.0
    #: None: the launcher's default.
    timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class StopRule:
    """The signals that end a process, and the time between them."""

    signal: StopSignal = "SIGINT"
    #: From a signal to the next one; None: the launcher's default.
    timeout_s: float | None = None
    #: From SIGTERM to SIGKILL; None: ``timeout_s``.
    kill_timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class Schedule:
    """Kernel scheduling of a process."""

    #: The processors that it may run on; empty: any.
    cpus: tuple[int, ...] = ()
    #: A policy of sched(7).
    policy: SchedulingPolicy = "other"
    #: 1 to 99 with a real-time policy, else 0.
    priority: int = 0


#: A node's parameter that is not a list.
ParameterValue = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Driven:
    """A sensor that a process drives."""

    sensor: str
    preset: str
    #: True: the driver owns the frames inside the sensor.
    publishes: bool
    #: Parameters or arguments that keep the driver from publishing edges it does not own.
    switch: dict[str, ParameterValue] = field(default_factory=dict)
    #: Whether the pose of each frame that the driver publishes inside the sensor is exact, nominal
    #: or unknown.
    frames: dict[str, PoseKnowledge] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Component:
    """A node that a container loads; it has no process of its own in the operating system."""

    #: The process that loads it.
    container: str
    package: str
    #: A class of ``package``.
    plugin: str
    #: By full names, with dots. A value is a boolean, a number, a text or a list of one kind, as
    #: ``components.json_value`` has them.
    params: dict[str, Any] = field(default_factory=dict)
    #: Options for the container, such as ``use_intra_process_comms``.
    extra_arguments: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PlanProcess:
    """A process to start, an ``external`` one to expect, or a ``component`` to load."""

    name: str
    kind: ProcessKind
    argv: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    params_file: str | None = None
    remap: dict[str, str] = field(default_factory=dict)
    #: Full names.
    nodes: tuple[str, ...] = ()
    restart: RestartPolicy = "no"
    #: None: the launcher's default.
    max_restarts: int | None = None
    #: True: the robot stops when the process exits; None: when it fails; False: never.
    required: bool | None = None
    stop: StopRule = field(default_factory=StopRule)
    log_level: LogLevel | None = None
    #: The state that the guard brings a node to after the start.
    lifecycle: dict[str, LifecycleState] = field(default_factory=dict)
    after: dict[str, StartCondition] = field(default_factory=dict)
    #: None: when the edges that it owns are live, or, without any, when it was started.
    ready: Ready | None = None
    host: str | None = None
    owns: tuple[tuple[str, str], ...] = ()
    #: The file beside the plan that it sends as ``robot_description``; None: the plan's.
    description: str | None = None
    #: The sensors that it is the driver of, by their presets.
    drives: tuple[Driven, ...] = ()
    #: By full name of a node: its parameters that decide which TF it publishes.
    switches: dict[str, dict[str, ParameterValue]] = field(default_factory=dict)
    #: The namespace of its nodes, without a leading slash; None: the plan's.
    namespace: str | None = None
    simulate: Simulation | None = None
    #: In seconds from its end; None: longer each time.
    restart_delay: float | None = None
    #: A wrapper command, such as gdb, valgrind or nice.
    prefix: tuple[str, ...] = ()
    schedule: Schedule | None = None
    component: Component | None = None
    output: OutputPlace = "both"
    #: True: it writes to a pseudo-terminal.
    emulate_tty: bool = False
    #: As in proc_pid_oom_score_adj(5); None: the launcher's.
    oom_score_adj: int | None = None
    #: Soft and hard RLIMIT_NOFILE of getrlimit(2), None: the launcher's.
    open_files: int | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """The texts in which places of files can stand: its command, variables and folder."""
        return (*self.argv, *self.env.values(), self.cwd or "")

    @property
    def is_state_publisher(self) -> bool:
        """Whether it is ROS's own robot_state_publisher, which the plan starts."""
        return self.argv[:1] == (_STATE_PUBLISHER,)

    @property
    def topics(self) -> tuple[str, str]:
        """The topics (moving, fixed) on which it publishes TF."""
        return self.remap.get("/tf", "/tf"), self.remap.get("/tf_static", "/tf_static")

    @property
    def restart_limit(self) -> int:
        """How often it is started again in a row."""
        return MAX_RESTARTS if self.max_restarts is None else self.max_restarts


def is_known_at_launch(value: Any) -> bool:
    """Return whether a value holds a path that only the launcher knows."""
    if isinstance(value, str):
        return bool(_AT_START.search(value))
    items = (
        value.values()
        if isinstance(value, dict)
        else value
        if isinstance(value, (list, tuple))
        else ()
    )
    return any(is_known_at_launch(item) for item in items)


@dataclass(frozen=True, slots=True)
class RosSettings:
    """ROS settings of all processes."""

    namespace: str = documented_field(
        "", "the namespace of nodes and topics without a leading slash", "robot1"
    )
    domain_id: int | None = documented_field(None, "the ROS domain; default: the environment's", 7)
    discovery: Discovery | None = documented_field(
        None, "the range of discovery; default: the environment's"
    )
    rmw: Rmw | None = documented_field(
        None, "the middleware of all processes; default: the environment's", "zenoh"
    )
    distro: Distro | None = documented_field(
        None,
        "the ROS release; default: the environment's",
        "kilted",
    )
    router: str | None = documented_field(
        None,
        "with rmw: zenoh, the router's address for every process; default: port 7447 of its "
        "own computer",
        "tcp/10.0.0.2:7447",
    )
    clock: Clock = documented_field(
        "wall", "one clock for the whole plan; sim: the time of /clock"
    )
    frame_prefix: str = documented_field(
        "", "prefix of every frame name, including its slash", "robot1/"
    )
    shared_frames: tuple[str, ...] = documented_field(
        (), "frames that never get the prefix", ["map"]
    )


@dataclass(frozen=True, slots=True)
class PlanHost:
    """A computer that processes run on, and the way to reach it."""

    #: user@address, or a name in the ssh configuration.
    ssh: str
    port: int | None = None
    #: The interpreter that runs tfcompose there: a program or its path.
    python: str | None = None
    #: Files to source before it.
    setup: tuple[str, ...] = ()
    #: Labels of its Kubernetes node; empty: its host name is the host's.
    node_selector: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class GuardPolicy:
    """The checks of the live tree."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    mode: GuardMode = documented_field(
        "watch", "strict: also block edges that a process of the plan sends but does not own"
    )
    unknown_edges: UnknownEdges = documented_field("warn", "severity of an undeclared edge")
    on_violation: OnViolation = documented_field(
        "report",
        "stop-offender: stop the process of the plan that is proven to have caused the error; "
        "stop: stop the robot",
    )
    allow: tuple[EdgePattern, ...] = documented_field(
        (), "edges that need no declaration", [{"child": "tag36h11:*"}]
    )
    fence: FenceWay = documented_field(
        "auto",
        "how a strict guard separates processes: by a DDS partition (Fast DDS only), or by "
        "remapping /tf and /tf_static",
    )


@dataclass(frozen=True, slots=True)
class PlanClaim:
    """An edge that a node publishes by default and another process owns."""

    node: str
    parent: str
    child: str
    #: The setting that stops it; empty: there is none.
    switch: str


def switch_text(switch: dict[str, Any]) -> str:
    """Return parameters as they are written in YAML."""
    return ", ".join(
        f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in switch.items()
    )


VERSION: Literal[3] = 3

#: The file beside the plan that holds the whole robot's description.
DESCRIPTION = "robot.urdf"
#: The file beside it that holds what a stock robot_state_publisher is given.
STOCK_DESCRIPTION = "robot.state_publisher.urdf"
_NOWHERE = SourceLine("", 0)
_STATE_PUBLISHER = "${executable:robot_state_publisher/robot_state_publisher}"
#: What no name of a node may hold.
_NO_NAME = re.compile(r"\W")


@dataclass(frozen=True, slots=True)
class Plan:
    """A compiled robot: everything that ``tfcompose up`` needs."""

    version: Literal[3] = field(default=VERSION, kw_only=True)
    robot: str
    spec_digest: str
    #: The robot file's name.
    file: str = field(default="", kw_only=True)
    #: The profiles that are merged over the robot file, in order.
    profiles: tuple[str, ...] = field(default=(), kw_only=True)
    description: str = field(default=DESCRIPTION, kw_only=True)
    base: str | None
    #: The host whose processes, those that are not ``external``, this plan starts. None: all;
    #: empty: the processes without a host.
    host: str | None = field(default=None, kw_only=True)
    ros: RosSettings
    edges: tuple[PlanEdge, ...]
    processes: tuple[PlanProcess, ...]
    claims: tuple[PlanClaim, ...] = field(default=(), kw_only=True)
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    #: The robot file's arguments, as the plan was built with them.
    args: dict[str, ParameterValue] = field(default_factory=dict, kw_only=True)
    #: The variables that the robot file names, as they were at the build.
    environment: dict[str, str] = field(default_factory=dict, kw_only=True)
    #: The computers that processes may name; empty: the file does not say how to reach them.
    hosts: dict[str, PlanHost] = field(default_factory=dict, kw_only=True)
    #: Sections of tools, by their keys.
    sections: dict[str, Any] = field(default_factory=dict, kw_only=True)

    def process(self, name: str) -> PlanProcess:
        """Return the process of that name.

        Raises:
            KeyError: if there is none.
        """
        for process in self.processes:
            if process.name == name:
                return process
        raise KeyError(name)

    @property
    def started(self) -> tuple[PlanProcess, ...]:
        """The processes that are started, in the plan's order.

        All but external ones, and what containers load.
        """
        return tuple(
            process for process in self.processes if process.kind not in ("external", "component")
        )

    @property
    def managed(self) -> tuple[PlanProcess, ...]:
        """What is started or loaded, in the plan's order: all but external processes."""
        return tuple(process for process in self.processes if process.kind != "external")

    @property
    def components(self) -> tuple[PlanProcess, ...]:
        """What containers load, in the plan's order."""
        return tuple(process for process in self.processes if process.component)

    def guards_of(self, host: str | None) -> tuple[str, ...]:
        """Return the nodes of the guard of a host's share.

        None or empty: of the machine that has no name here.
        """
        own = [
            node for process in self.processes if process.kind == "guard" for node in process.nodes
        ]
        # No two nodes have one name.
        return tuple(node.removesuffix(_name_end(self.host)) + _name_end(host) for node in own)

    def claim_on(self, nodes: tuple[str, ...], parent: str, child: str) -> PlanClaim | None:
        """Return what is known of one of the nodes publishing the edge by default, or None."""
        ends = (parent, child)
        return next(
            (
                claim
                for claim in self.claims
                if claim.node in nodes and (claim.parent, claim.child) == ends
            ),
            None,
        )

    def allows_undeclared(self, parent: str, child: str) -> bool:
        """Whether nobody needs to have declared the edge.

        By policy, or because it is another robot's.
        """
        policy, ros = self.guard, self.ros
        if (
            ros.frame_prefix
            and not child.startswith(ros.frame_prefix)
            and child not in ros.shared_frames
        ):
            return True
        return policy.unknown_edges == "ignore" or any(
            fnmatchcase(parent, pattern.parent) and fnmatchcase(child, pattern.child)
            for pattern in policy.allow
        )

    def edges_of(self, owner: str) -> tuple[PlanEdge, ...]:
        """Return the edges that the process publishes, in the plan's order."""
        return tuple(edge for edge in self.edges if edge.owner == owner)

    def start_settings(self, process: PlanProcess) -> tuple[Any, ...]:
        """Return all of the plan that decides how the process runs.

        An edge's place in the robot file does not, nor the pose of an edge of the stock
        robot_state_publisher, which takes another description while it runs, nor for the guard
        that of one which ``static`` publishes.
        """
        guards = process.kind == "guard"
        edges = self.edges if guards else self.edges_of(process.name)
        fence = (self.robot, self.guard.fence) if self.guard.mode == "strict" else None
        unplaced = {
            other.name
            for other in self.processes
            if other.is_state_publisher or (guards and other.kind == "static")
        }
        anywhere = [
            *(replace(edge, source=_NOWHERE) for edge in edges if edge.owner not in unplaced),
            *(
                replace(edge, source=_NOWHERE, pose=Pose())
                for edge in edges
                if edge.owner in unplaced
            ),
        ]
        describes = self.describes(process)
        return process, self.ros, fence, anywhere, self.guard if guards else None, describes

    def describes(self, process: PlanProcess) -> bool:
        """Return whether the process publishes a robot's description.

        ``static`` does, and ``joints`` where there is no ``static`` beside it.
        """
        static = f"{process.name.removesuffix('joints')}static"
        return process.kind == "static" or (
            process.kind == "joints" and all(process.name != static for process in self.processes)
        )


def _name_end(host: str | None) -> str:
    return f"_{_NO_NAME.sub('_', host)}" if host else ""
