"""The plan: what is started, and which TF edge each process owns.

The plan is the border between the compiler and everything that runs on a robot; ``tfcompose.planfile`` writes and
reads it. Poses are the pose of the child in the parent: metres, unit quaternions x y z w. Rates are
in hertz.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from tfcompose.pose import Pose

VERSION = 1

EdgeKind = Literal["static", "joint", "dynamic"]
ProcessKind = Literal["static", "joints", "guard", "simulate", "external", "run"]
GuardMode = Literal["off", "watch", "strict"]

#: What stands in an ``argv`` for values that only the starting machine knows.
PLACEHOLDERS = ("${python}", "${plan}", "${build_dir}", "${params_file}")

EDGE_KINDS: tuple[EdgeKind, ...] = ("static", "joint", "dynamic")
PROCESS_KINDS: tuple[ProcessKind, ...] = ("static", "joints", "guard", "simulate", "external", "run")


@dataclass(frozen=True, slots=True)
class Joint:
    """A moving joint: its edge's pose at position q is the edge's ``pose`` followed by the motion along ``axis``.

    ``axis`` is a unit vector in the child's frame at q = 0. With ``mimic`` the position is
    ``multiplier`` · q(mimic) + ``offset``. Positions are radians, or metres for a prismatic joint.
    """

    name: str
    type: str
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    mimic: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class PlanEdge:
    """One TF edge and the process that publishes it. ``node`` is the publishing node's full name."""

    parent: str
    child: str
    kind: EdgeKind
    owner: str
    node: str
    pose: Pose
    rate: float | None
    source: tuple[str, int]
    joint: Joint | None = None

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"


@dataclass(frozen=True, slots=True)
class Simulation:
    """A stand-in for an owner: a body on a circle, one that stays, or joint states."""

    kind: Literal["circle", "fixed", "joints"]
    rate: float
    radius: float = 0.0
    speed: float = 0.0
    pose: Pose = field(default_factory=Pose)
    joints: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PlanProcess:
    """What is started, or, with kind ``external``, expected to run."""

    name: str
    kind: ProcessKind
    argv: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    params_file: str | None = None
    remap: dict[str, str] = field(default_factory=dict)
    nodes: tuple[str, ...] = ()
    restart: str = "no"
    after: dict[str, str] = field(default_factory=dict)
    ready: str | None = None
    host: str | None = None
    owns: tuple[tuple[str, str], ...] = ()
    simulate: Simulation | None = None


@dataclass(frozen=True, slots=True)
class RosSettings:
    """What every process of the plan shares. ``shared_frames`` are those that do not begin with ``frame_prefix``."""

    namespace: str = ""
    domain_id: int | None = None
    discovery: str | None = None
    clock: str = "wall"
    frame_prefix: str = ""
    shared_frames: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class GuardPolicy:
    """What the guard does. ``allow`` holds (parent, child) patterns of edges that need no declaration."""

    mode: GuardMode = "watch"
    unknown_edges: Literal["ignore", "warn", "error"] = "warn"
    on_violation: Literal["report", "stop"] = "report"
    allow: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that ``tfcompose up`` needs, and nothing that it has to compile."""

    robot: str
    spec_digest: str
    base: str | None
    ros: RosSettings
    edges: tuple[PlanEdge, ...]
    processes: tuple[PlanProcess, ...]
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    description: str = "robot.full.urdf"
    version: int = VERSION

    def process(self, name: str) -> PlanProcess:
        """Return the process of that name.

        Raises:
            KeyError: if there is none.
        """
        for process in self.processes:
            if process.name == name:
                return process
        raise KeyError(name)

    def edges_of(self, owner: str) -> tuple[PlanEdge, ...]:
        """Return the edges that the process publishes, in the plan's order."""
        return tuple(edge for edge in self.edges if edge.owner == owner)
