"""The robot: frames, edges, bodies, joints and processes, with every name, pose and owner decided.

A ``Robot`` can hold a wrong robot: two parents, a cycle, two owners can all be said, and a rule says so with both
places. Lengths are metres, angles radians, rates hertz; an edge's pose is the pose of its child in its parent.
"""

from __future__ import annotations

import math
import re
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.frozen import dataclass
from tfcompose.plan import EdgeKind, GuardPolicy, ProcessKind, Ready, RosSettings, Simulation, StopRule
from tfcompose.pose import angle_between

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.diagnostic import Span
    from tfcompose.pose import Pose, Vector

STATIC, JOINTS, GUARD = "static", "joints", "guard"
BUILT_IN = (STATIC, JOINTS, GUARD)

#: How names of optical frames end: REP-103's suffix, the spelling of newer ZED wrappers, and a short one.
OPTICAL_ENDINGS = ("_optical_frame", "_frame_optical", "_optical")


def is_optical(frame: str) -> bool:
    """Return whether the frame's name says that z is its viewing direction."""
    return frame.endswith(OPTICAL_ENDINGS)


@dataclass(frozen=True, slots=True)
class Asset:
    """A file of triangles or an image, as it was addressed and where it is.

    ``path`` is where it was found, or where it has to be: absolute, or relative like the robot's own file; empty where
    nobody here can say. ``package`` and ``inside`` are the package that it is in and the path there, if it is in one.
    """

    uri: str
    at: Span | None = None
    path: str = ""
    package: str = ""
    inside: str = ""


@dataclass(frozen=True, slots=True)
class Material:
    """A colour (red, green, blue and opacity from 0 to 1) or a texture, with a name."""

    name: str
    rgba: tuple[float, float, float, float] | None = None
    texture: Asset | None = None
    at: Span | None = None


@dataclass(frozen=True, slots=True)
class Shape:
    """A body's shape and its pose in the link.

    ``size``: box x, y, z · cylinder and capsule radius, length (a capsule's without its ends) · sphere radius · mesh
    its scale along x, y, z.
    """

    kind: Literal["box", "cylinder", "sphere", "capsule", "mesh"]
    size: tuple[float, ...]
    pose: Pose
    material: Material | None = None
    mesh: Asset | None = None


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass in kg, the pose of the centre of mass in the link, and the tensor about it (xx, xy, xz, yy, yz, zz).

    ``of_shapes`` holds, where the tensor was given, the traces of those that the visual and the collision shapes would
    have at one density. The trace is the same in all axes.
    """

    mass: float
    pose: Pose
    tensor: tuple[float, float, float, float, float, float]
    of_shapes: tuple[float, ...] = ()
    at: Span | None = None


@dataclass(frozen=True, slots=True)
class Link:
    """The body on a frame."""

    name: str
    at: Span
    visuals: tuple[Shape, ...] = ()
    collisions: tuple[Shape, ...] = ()
    inertial: Inertial | None = None


@dataclass(frozen=True, slots=True)
class Limit:
    """What a joint can do: rad or m, N m or N, rad/s or m/s."""

    lower: float | None = None
    upper: float | None = None
    effort: float | None = None
    velocity: float | None = None


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What slows a joint down: N m s/rad and N m, or N s/m and N."""

    damping: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True, slots=True)
class SafetyController:
    """Where a controller begins to hold a joint back, and how hard."""

    soft_lower_limit: float = 0.0
    soft_upper_limit: float = 0.0
    k_position: float = 0.0
    k_velocity: float = 0.0


@dataclass(frozen=True, slots=True)
class ReferencePositions:
    """Where a joint's reference switch changes; URDF calls it calibration."""

    rising: float | None = None
    falling: float | None = None


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint that can move; ``axis`` is a unit vector in the child's frame, for planar the plane's normal."""

    name: str
    type: Literal["revolute", "continuous", "prismatic", "planar", "floating"]
    at: Span
    axis: Vector = (1.0, 0.0, 0.0)
    limit: Limit | None = None
    mimic: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0
    axis_length: float = 1.0  # as it was written
    dynamics: Dynamics | None = None
    safety: SafetyController | None = None
    reference: ReferencePositions | None = None


@dataclass(frozen=True, slots=True)
class Interface:
    """An interface of ros2_control, with its parameters as texts."""

    name: str
    params: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Component:
    """A joint, sensor or gpio of a hardware component."""

    kind: str
    name: str
    at: Span
    command: tuple[Interface, ...] = ()
    state: tuple[Interface, ...] = ()
    params: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Hardware:
    """A hardware component of ros2_control: the plugin and what it drives."""

    name: str
    plugin: str
    type: str
    at: Span
    params: dict[str, str] = field(default_factory=dict)
    components: tuple[Component, ...] = ()
    rw_rate: int | None = None
    is_async: bool | None = None


#: All that stands between quotes, or between two tags, but for blanks.
_HELD = re.compile(r"""(=\s*["']\s*|>\s*)([^<>"'\s]+)(?=\s*["'<])""")


@dataclass(frozen=True, slots=True)
class Block:
    """Elements that stand in the URDF as the user wrote them."""

    name: str
    at: Span
    text: str

    def renamed(self, names: Mapping[str, str]) -> Block:
        """Return the block with other names: of what an attribute or an element holds, if that is a name alone."""

        def other(found: re.Match[str]) -> str:
            return found[1] + names.get(found[2], found[2])

        return replace(self, text=_HELD.sub(other, self.text))


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor as the rules see it: the frames that it brings, and its driver.

    ``driver`` is the name of the driver's process, empty without one; ``switch`` holds the parameters that keep the
    driver from publishing frames (None: there are none), ``publishes`` says that it may. ``claims`` are the edges
    outside the sensor that it publishes by default and does not own, each with the parameters that keep it from that.
    ``serial_option`` is the preset's option for a serial number, empty where it has none.
    """

    name: str
    preset: str
    kind: str
    at: Span
    mount: str
    frames: tuple[str, ...] = ()
    driver_frames: tuple[str, ...] = ()
    driver: str = ""
    switch: dict[str, Any] | None = None
    publishes: bool = False
    claims: dict[str, dict[str, Any]] = field(default_factory=dict)
    serial_option: str = ""
    serial: str | None = None
    tf_at: Span | None = None


@dataclass(frozen=True, slots=True)
class AsWritten:
    """The numbers of one value of a pose or joint limit as the file has them, in SI, each with its place.

    ``path`` leads to the value (``sensors``, ``camera``, ``rpy``); ``with_unit`` says of each number whether it stands
    there with a unit, and ``place`` where the number of an index stands.
    """

    path: tuple[str | int, ...]
    numbers: tuple[float, ...]
    with_unit: tuple[bool, ...]
    place: Callable[[int], Span] = field(compare=False, repr=False)

    @property
    def key(self) -> str:
        """The value's key: ``xyz``, ``rpy``, ``look``, …."""
        return str(self.path[-1])

    @property
    def entry(self) -> str:
        """The name of the frame, link, joint, sensor or process that the value belongs to."""
        return str(self.path[1])


@dataclass(frozen=True, slots=True)
class Calibration:
    """A pose that was measured: that of ``child`` in ``parent``, frames of the robot.

    ``nominal`` is the same by the pose that is written beside it, if one is. ``named_at`` is the place in the robot
    file, ``at`` the entry in the calibration file, ``entry`` its pose as it stands there; ``inverted`` says that it was
    taken the other way round. The limits (m, rad) say how far from nominal is too far.
    """

    parent: str
    child: str
    pose: Pose
    entry: Pose
    at: Span
    format: str
    named_at: Span
    limit_m: float
    limit_rad: float
    inverted: bool = False
    nominal: Pose | None = None

    @property
    def name(self) -> str:
        """The measurement, its direction and its source, as people read them."""
        turned = ", inverted" if self.inverted else ""
        source = f"from {self.at.file}:{self.at.line} ({self.format}{turned})"
        return f"pose of {self.child} in {self.parent}, {source}"

    def off(self, pose: Pose) -> tuple[float, float]:
        """Return how far ``pose`` is from the nominal one, in metres and radians; 0 if there is none."""
        if self.nominal is None:
            return (0.0, 0.0)
        far = math.dist(pose.xyz, self.nominal.xyz)
        return (far, angle_between(pose.quat_xyzw, self.nominal.quat_xyzw))


@dataclass(frozen=True, slots=True)
class Edge:
    """A frame and its parent, and who publishes where the one is in the other.

    ``switched`` holds the further parents between which the owner may change it, as a tool changer does; ``parent`` is
    the nominal one.
    ``joint`` moves by joint states. ``free`` is a planar or floating joint, of which joint states say nothing.
    ``other_axes``: the vendor's name for the frame does not say whether it is optical, or says it wrongly. ``node`` is
    the full name of the node that publishes the edge, where the owner has several.
    """

    parent: str
    child: str
    kind: EdgeKind
    pose: Pose
    owner: str
    at: Span
    rate: float | None = None
    joint: Joint | None = None
    joint_name: str = ""
    given: bool = True
    owner_at: Span | None = None
    child_at: Span | None = None
    sensor: str | None = None
    nominal: bool = False
    rate_at: Span | None = None
    calibration: Calibration | None = None
    switched: tuple[str, ...] = ()
    free: Joint | None = None
    other_axes: bool = False
    node: str = ""

    @property
    def name(self) -> str:
        """The edge as people read it."""
        return f"{self.parent} → {self.child}"


class AsInFile(str):
    """A parameter as it stands without quotes in somebody's parameter file: what it is, is for ROS to say."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Node:
    """One ROS node of a process, by its full name; ``lifecycle`` is the state that it is brought into.

    ``path`` leads to the mapping that holds its ``params``.
    """

    name: str
    at: Span
    path: tuple[str | int, ...] = ()
    params: dict[str, Any] = field(default_factory=dict)
    lifecycle: str | None = None


@dataclass(frozen=True, slots=True)
class Process:
    """A process of the plan, before it is a command line.

    It runs a ``package``'s ``executable``, a ``launch`` file (``package/file``), or else the command ``argv``, which
    for the others holds the arguments. ``part`` is the ``Part`` that it belongs to, if any. ``describes`` says that its
    parameter ``robot_description`` is the URDF for a stock robot_state_publisher.
    """

    name: str
    kind: ProcessKind
    at: Span
    nodes: tuple[Node, ...] = ()
    package: str | None = None
    executable: str | None = None
    launch: str | None = None
    argv: tuple[str, ...] = ()
    remap: dict[str, str] = field(default_factory=dict)
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    log_level: str | None = None
    host: str | None = None
    required: bool = False
    restart: str = "no"
    max_restarts: int | None = None
    stop: StopRule = field(default_factory=StopRule)
    ready: Ready | None = None
    after: dict[str, str] = field(default_factory=dict)
    simulate: Simulation | None = None
    rate: float | None = None
    part: str = ""
    describes: bool = False

    @property
    def node(self) -> str:
        """The full name of the first node, which is the only one of most processes."""
        return self.nodes[0].name if self.nodes else ""

    @property
    def params(self) -> dict[str, Any]:
        """The parameters of the first node."""
        return self.nodes[0].params if self.nodes else {}


@dataclass(frozen=True, slots=True)
class Part:
    """A part that is a robot of its own beside others, with its own ``static``, ``joints`` and description.

    ``robot`` has the names of the part's own file; in the robot that holds it, frames and joints have ``prefix`` too.
    """

    name: str
    prefix: str
    robot: Robot


@dataclass(frozen=True, slots=True)
class Claim:
    """An edge that a node publishes by default and somebody else owns; ``switch`` are the parameters that stop it."""

    node: str
    parent: str
    child: str
    switch: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot, resolved.

    ``frames`` holds every frame that was declared, with its place; ``base`` is where the URDF begins, or None where the
    tree has no single root; ``sensors`` are those with a known preset, ``as_written`` the numbers of poses and limits
    before they became poses, ``unused`` the variables that nothing uses; ``written`` is the plain data that the robot
    was made from, profiles laid over it; ``broken`` holds the entries (section, name) that were refused
    already, of a part how its names begin. ``parts`` are those that are robots of their own.
    """

    name: str
    file: str
    frames: dict[str, Span]
    edges: tuple[Edge, ...]
    links: dict[str, Link]
    processes: tuple[Process, ...]
    base: str | None
    ros: RosSettings = field(default_factory=RosSettings)
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    sensors: tuple[MountedSensor, ...] = ()
    as_written: tuple[AsWritten, ...] = field(default=(), compare=False, repr=False)
    unused: dict[str, Span] = field(default_factory=dict, compare=False)
    written: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)
    broken: frozenset[tuple[str, str]] = frozenset()
    claims: tuple[Claim, ...] = ()
    parts: tuple[Part, ...] = ()
    hardware: tuple[Hardware, ...] = ()
    blocks: tuple[Block, ...] = ()

    def final(self, frame: str) -> str:
        """Return the frame's name on the live tree: with the prefix, unless it is shared."""
        return frame if frame in self.ros.shared_frames else f"{self.ros.frame_prefix}{frame}"

    def excuses(self, name: str) -> bool:
        """Return whether a frame, process or joint may be missing only because an entry was refused already."""
        return any(
            name == entry
            or (section == "sensors" and name.startswith(f"{entry}_"))
            or (section == "parts" and name.startswith(entry))
            for section, entry in self.broken
        )

    def parent_edge(self, child: str) -> Edge | None:
        """Return the first edge whose child is the frame, or None for a root."""
        return next((edge for edge in self.edges if edge.child == child), None)

    def roots(self) -> list[str]:
        """Return the declared frames that no edge has as its child, in the order of declaration."""
        children = {edge.child for edge in self.edges}
        return [frame for frame in self.frames if frame not in children]

    def children(self) -> dict[str, list[Edge]]:
        """Return the edges of each parent, in the order of declaration."""
        table: dict[str, list[Edge]] = {}
        for edge in self.edges:
            table.setdefault(edge.parent, []).append(edge)
        return table
