"""Contents of a plan: enumerations, edges, processes, shared settings, guard policy.

Each enumeration of the plan and the language is a Literal in this module. ``get_args`` returns its
values.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from msgspec import Meta

from tfcompose.foundation.geometry import Offset, Pose, norm, normalise, offset_of
from tfcompose.model.fields import documented_field

#: What moves an edge: nothing, joint states, or its owner.
EdgeKind = Literal["static", "joint", "dynamic"]
#: Type of a moving joint. Joint states do not describe planar and floating joints.
JointType = Literal["revolute", "continuous", "prismatic", "planar", "floating"]

#: Kind of a process: a process of tfcompose, a process started elsewhere, a program, or a node in
#: a container.
ProcessKind = Literal["static", "joints", "guard", "simulate", "external", "run", "component"]
#: Exits after which a process is restarted.
RestartPolicy = Literal["no", "on-failure", "always"]
#: The first signal that stops a process.
StopSignal = Literal["SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2"]
#: Condition for the readiness of a process.
ReadyKind = Literal["edges", "topic", "service", "lifecycle", "log", "exit", "time"]
#: State that another process must reach before a process starts.
StartCondition = Literal["started", "ready", "done"]
#: States of a lifecycle node that the guard can wait for or bring the node into.
LifecycleState = Literal["inactive", "active"]
#: Level of a node's loggers.
LogLevel = Literal["debug", "info", "warn", "error", "fatal"]
#: Kind of simulation.
SimulationKind = Literal["circle", "fixed", "joints"]
#: Destination of a process's output: the terminal of ``up``, the log, or both.
OutputPlace = Literal["both", "log", "screen"]
#: Kernel scheduling policy (sched(7)). fifo and rr are real-time policies.
SchedulingPolicy = Literal["other", "batch", "idle", "fifo", "rr"]
#: Precision of the preset's pose for a frame that a driver publishes.
PoseKnowledge = Literal["exact", "nominal", "unknown"]

#: The clock of the plan.
Clock = Literal["wall", "sim"]
#: Range of ROS's discovery. None in a plan means the environment's setting.
Discovery = Literal["localhost", "subnet", "off"]
#: The middleware of all processes.
Rmw = Literal["fastdds", "cyclonedds", "zenoh"]
#: The ROS release of all processes.
Distro = Literal["jazzy", "kilted"]
#: How robots in a ROS domain are isolated: topics below namespaces, or frames with a prefix.
Isolation = Literal["none", "topics", "frames", "both"]
#: The publisher of tfcompose's edges below the base.
StatePublisher = Literal["tfcompose", "stock"]
#: The publisher of the frames inside a sensor.
SensorPublisher = Literal["driver", "tfcompose"]

#: What the guard does about an edge from a process that does not own it: nothing, report it, or
#: block it.
GuardMode = Literal["off", "watch", "strict"]
#: Severity of an undeclared edge.
UnknownEdges = Literal["ignore", "warn", "error"]
#: Reaction to a violation: report it, stop the process that certainly caused it, or stop the
#: robot.
OnViolation = Literal["report", "stop-offender", "stop"]
#: How a strict guard isolates processes. ``auto`` uses a partition for Fast DDS, otherwise
#: remapping.
FenceWay = Literal["auto", "partition", "remap"]


#: An edge is silent after four periods, but not before this time in seconds, which allows for
#: delays on a loaded machine.
_SILENT_AT_LEAST_S = 0.6
_SILENT_PERIODS = 4.0
#: An edge becomes slow below the first fraction of its declared rate, and stays slow up to the
#: second.
_SLOW_BELOW, _SLOW_UP_TO = 0.8, 0.9
#: Default limit for consecutive restarts of a process.
MAX_RESTARTS = 5


def silent_after_s(period_s: float) -> float:
    """Return how long an edge with this period may be silent, in seconds."""
    return max(_SILENT_AT_LEAST_S, _SILENT_PERIODS * period_s)


#: A time or a rate.
AboveZero = Annotated[float, Meta(gt=0)]


class SourceLine(NamedTuple):
    """A line of a robot file. ``file`` is relative to the folder of the main robot file."""

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
    """A moving joint: a motion along or about an axis, after the edge's pose."""

    name: str
    type: JointType
    #: A unit vector in the child's frame at q = 0.
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    #: The joint that it mimics. Its position is ``multiplier`` · q(mimic) + ``offset``.
    mimic: str | None = None
    multiplier: float = 1.0
    #: In rad, or in m for a prismatic joint.
    offset: float = 0.0

    def nearest(self, motion: Pose) -> Pose:
        """Return the motion nearest to ``motion`` that the joint allows.

        Both are poses of the child, in m, in the child at q = 0. Of a rotation, a turning joint
        keeps the part about its axis (swing-twist decomposition). Planar and floating joints are
        not limited here.
        """
        (x, y, z), (qx, qy, qz, qw) = self.axis, motion.quat_xyzw
        if self.type == "prismatic":
            along = sum(a * b for a, b in zip(self.axis, motion.xyz, strict=True))
            return Pose((x * along, y * along, z * along))
        if self.type not in {"revolute", "continuous"}:
            return motion
        twist = x * qx + y * qy + z * qz
        if not norm((twist, qw)):  # half a turn about another axis: no position is nearer
            return Pose()
        return Pose(quat_xyzw=normalise((x * twist, y * twist, z * twist, qw)))


@dataclass(frozen=True, slots=True)
class PlanEdge:
    """A TF edge and the process that publishes it."""

    #: The parent; for a child that changes parents, the nominal parent.
    parent: str
    child: str
    kind: EdgeKind
    owner: str
    #: The full name of the publishing node.
    node: str
    #: The pose of the child in the parent; the identity if ``pose_known`` is False.
    pose: Pose
    #: Rate in Hz, None if the plan states none.
    rate: float | None
    source: SourceLine
    joint: PlanJoint | None = None
    #: Other parents to which the owner may attach the child.
    switched: tuple[str, ...] = ()
    #: False if only the owner knows the child's pose.
    pose_known: bool = True
    #: The sensor that it mounts; empty: none.
    mounts: str = ""
    #: The poses before each adjustment on the running robot, the built one first.
    earlier: tuple[Pose, ...] = ()

    @property
    def name(self) -> str:
        """The edge for display."""
        return f"{self.parent} → {self.child}"

    @property
    def adjustment(self) -> Offset | None:
        """How far an adjusted pose is from the built one; None if nothing adjusted it."""
        return offset_of(self.earlier[0], self.pose) if self.earlier else None

    def nearest_pose(self, pose: Pose) -> Pose:
        """Return the pose, at some position of the edge's joint, that is nearest to ``pose``.

        Raises:
            ZeroDivisionError: if all four components of the quaternion of ``pose`` are 0.
        """
        if self.joint is None:
            return self.pose
        return self.pose @ self.joint.nearest(self.pose.inverse() @ pose)

    @property
    def silent_after_s(self) -> float | None:
        """How long a moving edge may be silent, in seconds, None without a rate."""
        if not self.rate or self.kind == "static":
            return None
        return silent_after_s(1 / self.rate)

    def is_slow(self, rate: float, speed: float, *, was_slow: bool = False) -> bool:
        """Return whether the edge arrives too rarely at ``rate`` Hz.

        ``speed`` is the real-time factor of the clock, as in a simulation.
        """
        share = _SLOW_UP_TO if was_slow else _SLOW_BELOW
        return rate < share * speed * (self.rate or 0.0)

    def may_hang_on(self, parent: str) -> bool:
        """Return whether the owner may publish the child below this parent."""
        return parent == self.parent or parent in self.switched


#: Placeholders in an ``argv``. ``${plan}``, ``${build_dir}`` and ``${params_file}`` stand for
#: paths that only the starting machine knows. The first word can be ``${tfcompose}`` for
#: tfcompose, ``${executable:PACKAGE/NAME}`` for a program of a package, or
#: ``${launch:PACKAGE/FILE}`` for a launch file of a package, which is followed by its arguments,
#: ``name:=value``.
PROGRAM = "${tfcompose}"
_AT_START = re.compile(r"\$\{(?:file:|build_dir\}|params_file\})")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Motion of a simulated joint between two positions, or in full turns without positions."""

    #: Duration of a motion to the other end and back, or of a full turn.
    period_s: AboveZero
    #: Lower end in rad, or in m for a prismatic joint.
    lower: float | None = None
    upper: float | None = None

    def __post_init__(self) -> None:
        if (self.lower is None) != (self.upper is None):
            raise ValueError("has one of lower and upper without the other")


@dataclass(frozen=True, slots=True)
class Simulation:
    """A simulation of an owner: a body on a circle, a body at rest, or joint states."""

    kind: SimulationKind
    #: Rate in Hz.
    rate: AboveZero
    radius: float = 0.0
    speed: float = 0.0
    #: Initial positions in rad or m. Joints without a ``sweep`` stay there.
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
    """The signals that stop a process, and the time between them."""

    signal: StopSignal = "SIGINT"
    #: Time from a signal to the next signal, None for the launcher's default.
    timeout_s: float | None = None
    #: Time from SIGTERM to SIGKILL, None for ``timeout_s``.
    kill_timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class Schedule:
    """Kernel scheduling of a process."""

    #: CPUs that the process may use; empty for all.
    cpus: tuple[int, ...] = ()
    #: A policy of sched(7).
    policy: SchedulingPolicy = "other"
    #: 1 to 99 for a real-time policy, otherwise 0.
    priority: int = 0


#: The value of a node's parameter that is not a list.
ParameterValue = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Driven:
    """A sensor that a process drives."""

    sensor: str
    preset: str
    #: Whether the driver owns the frames inside the sensor.
    publishes: bool
    #: Parameters or arguments that stop the driver from publishing edges that it does not own.
    switch: dict[str, ParameterValue] = field(default_factory=dict)
    #: Precision of the pose of each frame that the driver publishes inside the sensor.
    frames: dict[str, PoseKnowledge] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Component:
    """A node that a container loads. It has no process in the operating system."""

    #: The process that loads the component.
    container: str
    package: str
    #: A class of ``package``.
    plugin: str
    #: Parameters by full name, with dots. A value is a boolean, a number, a string or a list of
    #: one of these types, in the form of ``components.json_value``.
    params: dict[str, Any] = field(default_factory=dict)
    #: Options for the container, such as ``use_intra_process_comms``.
    extra_arguments: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PlanProcess:
    """A process to start, an ``external`` process to expect, or a ``component`` to load."""

    name: str
    kind: ProcessKind
    argv: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    params_file: str | None = None
    remap: dict[str, str] = field(default_factory=dict)
    #: Full names of the nodes.
    nodes: tuple[str, ...] = ()
    restart: RestartPolicy = "no"
    #: None: the launcher's default.
    max_restarts: int | None = None
    #: If True, the robot stops when the process exits; if None, when it fails; if False, never.
    required: bool | None = None
    stop: StopRule = field(default_factory=StopRule)
    log_level: LogLevel | None = None
    #: The state into which the guard brings each node after the start.
    lifecycle: dict[str, LifecycleState] = field(default_factory=dict)
    after: dict[str, StartCondition] = field(default_factory=dict)
    #: None: the process is ready when its edges are live; without edges, when it has started.
    ready: Ready | None = None
    host: str | None = None
    owns: tuple[tuple[str, str], ...] = ()
    #: The file next to the plan that the process publishes as ``robot_description``, None for the
    #: plan's.
    description: str | None = None
    #: The sensors whose driver it is, by their presets.
    drives: tuple[Driven, ...] = ()
    #: Parameters that decide which TF a node publishes, by full name of the node.
    switches: dict[str, dict[str, ParameterValue]] = field(default_factory=dict)
    #: The namespace of its nodes, without a leading slash; None for the plan's.
    namespace: str | None = None
    simulate: Simulation | None = None
    #: Delay from its end to the restart in seconds, None for increasing delays.
    restart_delay: float | None = None
    #: A wrapper command, such as gdb, valgrind or nice.
    prefix: tuple[str, ...] = ()
    schedule: Schedule | None = None
    component: Component | None = None
    output: OutputPlace = "both"
    #: Whether it writes to a pseudo-terminal.
    emulate_tty: bool = False
    #: As in proc_pid_oom_score_adj(5), None for the launcher's value.
    oom_score_adj: int | None = None
    #: Soft and hard RLIMIT_NOFILE of getrlimit(2), None for the launcher's values.
    open_files: int | None = None

    @property
    def texts(self) -> tuple[str, ...]:
        """The texts that may contain paths: command line, environment variables and folder."""
        return (*self.argv, *self.env.values(), self.cwd or "")

    @property
    def is_state_publisher(self) -> bool:
        """Whether it is ROS's robot_state_publisher, started by the plan."""
        return self.argv[:1] == (_STATE_PUBLISHER,)

    @property
    def topics(self) -> tuple[str, str]:
        """The topics (moving, fixed) on which it publishes TF."""
        return self.remap.get("/tf", "/tf"), self.remap.get("/tf_static", "/tf_static")

    @property
    def restart_limit(self) -> int:
        """Maximum number of consecutive restarts."""
        return MAX_RESTARTS if self.max_restarts is None else self.max_restarts


def is_known_at_launch(value: Any) -> bool:
    """Return whether a value contains a path that only the launcher knows."""
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
    """A computer that runs processes, and how to reach it."""

    #: user@address, or a name in the ssh configuration.
    ssh: str
    port: int | None = None
    #: The Python interpreter, by name or path, that runs tfcompose there.
    python: str | None = None
    #: Files to source before the interpreter starts.
    setup: tuple[str, ...] = ()
    #: Labels of its Kubernetes node; if empty, the node is identified by the host's name.
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
    #: The setting that stops the publication; empty without one.
    switch: str


def switch_text(switch: dict[str, Any]) -> str:
    """Return parameters as YAML text."""
    return ", ".join(
        f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in switch.items()
    )


VERSION: Literal[3] = 3

#: The file next to the plan with the description of the complete robot.
DESCRIPTION = "robot.urdf"
#: The file next to the plan with the description for a stock robot_state_publisher.
STOCK_DESCRIPTION = "robot.state_publisher.urdf"
_NOWHERE = SourceLine("", 0)
_STATE_PUBLISHER = "${executable:robot_state_publisher/robot_state_publisher}"
#: Characters that are invalid in the name of a node.
_NO_NAME = re.compile(r"\W")


@dataclass(frozen=True, slots=True)
class Plan:
    """A compiled robot: all information that ``tfcompose up`` needs."""

    version: Literal[3] = field(default=VERSION, kw_only=True)
    robot: str
    spec_digest: str
    #: The robot file's name.
    file: str = field(default="", kw_only=True)
    #: Profiles that are merged over the robot file, in order.
    profiles: tuple[str, ...] = field(default=(), kw_only=True)
    #: Overlays that are merged over the robot file, in order: files, relative to the robot file,
    #: and settings as ``--set PATH=VALUE``.
    overlays: tuple[str, ...] = field(default=(), kw_only=True)
    description: str = field(default=DESCRIPTION, kw_only=True)
    base: str | None
    #: The host whose processes this plan starts, except ``external`` processes. None for all
    #: processes; empty for processes without a host.
    host: str | None = field(default=None, kw_only=True)
    ros: RosSettings
    edges: tuple[PlanEdge, ...]
    processes: tuple[PlanProcess, ...]
    claims: tuple[PlanClaim, ...] = field(default=(), kw_only=True)
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    #: Values of the robot file's arguments at the build.
    args: dict[str, ParameterValue] = field(default_factory=dict, kw_only=True)
    #: Values of the environment variables that the robot file uses, at the build.
    environment: dict[str, str] = field(default_factory=dict, kw_only=True)
    #: Computers that processes may name; empty if the robot file declares none.
    hosts: dict[str, PlanHost] = field(default_factory=dict, kw_only=True)
    #: Sections of tools, by their keys.
    sections: dict[str, Any] = field(default_factory=dict, kw_only=True)

    def process(self, name: str) -> PlanProcess:
        """Return the process with this name.

        Raises:
            KeyError: if there is no such process.
        """
        for process in self.processes:
            if process.name == name:
                return process
        raise KeyError(name)

    @property
    def started(self) -> tuple[PlanProcess, ...]:
        """The processes to start, in order.

        External processes and components are not included.
        """
        return tuple(
            process for process in self.processes if process.kind not in ("external", "component")
        )

    @property
    def managed(self) -> tuple[PlanProcess, ...]:
        """The processes to start or load, in order: all except external processes."""
        return tuple(process for process in self.processes if process.kind != "external")

    @property
    def components(self) -> tuple[PlanProcess, ...]:
        """The components that containers load, in order."""
        return tuple(process for process in self.processes if process.component)

    def guards_of(self, host: str | None) -> tuple[str, ...]:
        """Return the guard's nodes on a host.

        None or an empty name means the machine that the plan does not name.
        """
        guards = [
            node for process in self.processes if process.kind == "guard" for node in process.nodes
        ]
        # Each host's guard needs a unique node name.
        return tuple(node.removesuffix(_name_end(self.host)) + _name_end(host) for node in guards)

    def claim_on(self, nodes: tuple[str, ...], parent: str, child: str) -> PlanClaim | None:
        """Return the claim of one of the nodes to the edge, None without a claim."""
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
        """Return whether the edge needs no declaration.

        That is so by policy, or because the edge belongs to another robot.
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

    @property
    def adjusted(self) -> tuple[PlanEdge, ...]:
        """The edges whose poses were adjusted on the running robot."""
        return tuple(edge for edge in self.edges if edge.earlier)

    def is_adjustable(self, edge: PlanEdge) -> bool:
        """Return whether the edge's publisher takes another pose while it runs.

        It is ``static``, or the stock robot_state_publisher that this plan starts.
        """
        owner = self.process(edge.owner)
        return edge.kind == "static" and (owner.kind == "static" or owner.is_state_publisher)

    def edges_of(self, owner: str) -> tuple[PlanEdge, ...]:
        """Return the edges that the process publishes, in order."""
        return tuple(edge for edge in self.edges if edge.owner == owner)

    def start_settings(self, process: PlanProcess) -> tuple[Any, ...]:
        """Return all values in the plan that determine how the process runs.

        An edge's place in the robot file is not included. The poses of edges of ``static`` and of
        the stock robot_state_publisher are not included either, because these processes accept new
        poses while they run.
        """
        guards = process.kind == "guard"
        edges = self.edges if guards else self.edges_of(process.name)
        fence = (self.robot, self.guard.fence) if self.guard.mode == "strict" else None
        unplaced = {
            publisher.name
            for publisher in self.processes
            if publisher.is_state_publisher or publisher.kind == "static"
        }
        anywhere = [
            *(replace(edge, source=_NOWHERE) for edge in edges if edge.owner not in unplaced),
            *(
                replace(edge, source=_NOWHERE, pose=Pose(), earlier=())
                for edge in edges
                if edge.owner in unplaced
            ),
        ]
        describes = self.describes(process)
        return process, self.ros, fence, anywhere, self.guard if guards else None, describes

    def describes(self, process: PlanProcess) -> bool:
        """Return whether the process publishes a robot description.

        ``static`` does, and ``joints`` does if there is no ``static``.
        """
        static = f"{process.name.removesuffix('joints')}static"
        return process.kind == "static" or (
            process.kind == "joints" and all(process.name != static for process in self.processes)
        )


def _name_end(host: str | None) -> str:
    return f"_{_NO_NAME.sub('_', host)}" if host else ""
