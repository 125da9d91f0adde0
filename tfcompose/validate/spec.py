"""The language of ``robot.yaml``, version 1: what a user writes, typed.

The descriptions and examples here are what an editor shows; ``schemas/robot.schema.json`` is made from them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.calibration import CALIBRATION, CalibrationSpec
from tfcompose.validate.fields import (
    ANYTHING,
    AXIS,
    BOOLEAN,
    INERTIA_,
    JOINT_EFFORT,
    JOINT_SPEED,
    MASS_,
    NAME,
    NUMBER_,
    POSITION,
    RATE_,
    RGBA,
    SIZE,
    SIZES,
    TEXT,
    XYZ,
    choice,
    integer,
    text,
)
from tfcompose.validate.posed import Posed, Turned
from tfcompose.validate.process import DriverSpec, ProcessSpec, process
from tfcompose.validate.schema import Model, Problems, Type, key, listing, mapping, record

if TYPE_CHECKING:
    from tfcompose.load import Path
    from tfcompose.pose import Vector


class EdgeKeys(Posed):
    """What may stand wherever a parent is."""

    parent: str | None = key(TEXT, None, "the frame that this one hangs on", ("base_link",))
    relative_to: str | None = key(TEXT, None, "the pose is given in this frame; the parent stays the parent")
    owner: str | None = key(TEXT, None, "the process that publishes this edge", ("base_drive",))
    rate: float | None = key(RATE_, None, "how often the owner sends it", ("50 Hz",))
    static: bool | None = key(BOOLEAN, None, "the foreign owner sends it on /tf_static")


class MountKeys(EdgeKeys):
    """What may stand where something is bolted on, and so can be measured."""

    calibration: CalibrationSpec | None = key(
        CALIBRATION,
        None,
        "a file with the measured pose; the pose beside it is nominal",
        ("calibration/hand_eye.yaml",),
    )


class Cylinder(Model):
    """A cylinder along z, its middle at the origin."""

    radius: float = key(SIZE)
    length: float = key(SIZE)


class Sphere(Model):
    """A sphere around the origin."""

    radius: float = key(SIZE)


class Material(Model):
    """A colour, and a name for it."""

    name: str | None = key(NAME, None, "left out: named after the colour", ("blue",))
    rgba: tuple[float, float, float, float] = key(RGBA, (0.5, 0.5, 0.5, 1.0), "red, green, blue, opacity: 0 to 1")


class Shape(Posed):
    """One shape and where it is in its link; one of box, cylinder and sphere."""

    box: Vector | None = key(SIZES, None, "lengths along x, y, z", ([0.5, 0.4, 0.15],))
    cylinder: Cylinder | None = key(record(Cylinder), None)
    sphere: Sphere | None = key(record(Sphere), None)
    material: Material | None = key(record(Material), None)


class Tensor(Model):
    """A moment of inertia about the centre of mass, in kg m²."""

    ixx: float = key(INERTIA_)
    iyy: float = key(INERTIA_)
    izz: float = key(INERTIA_)
    ixy: float = key(INERTIA_, 0.0)
    ixz: float = key(INERTIA_, 0.0)
    iyz: float = key(INERTIA_, 0.0)


class Inertial(Posed):
    """Mass and its distribution; the pose is that of the centre of mass."""

    mass: float = key(MASS_, about="of the whole link", examples=("10 kg",))
    inertia: Tensor | None = key(record(Tensor), None, "about the centre of mass; computed from the shapes if left out")


def _shape(value: Any, path: Path, problems: Problems) -> Any:
    """Read a shape, and refuse one that has no form."""
    if isinstance(value, dict) and not FORMS & set(value) and set(value) <= set(Shape.KEYS):
        problems.refuse("TF102", path, "a shape without a form", "give one of box, cylinder and sphere", on_key=True)
    return record(Shape).read(value, path, problems)


FORMS = frozenset({"box", "cylinder", "sphere"})
SHAPES = listing(Type(_shape, Shape), single=True)


class LinkSpec(MountKeys):
    """A body, in URDF's words. With a parent it has a fixed edge."""

    visual: tuple[Shape, ...] = key(SHAPES, (), "one shape, or a list")
    collision: tuple[Shape, ...] = key(
        Type(SHAPES.read, {"anyOf": [{"const": "same"}, *SHAPES.schema["anyOf"]]}),
        (),
        "one shape, or a list; same: those of visual",
        ("same",),
    )
    inertial: Inertial | None = key(record(Inertial), None)


def _link(value: Any, path: Path, problems: Problems) -> Any:
    """Read a body; its collision can be that of its visual, and its inertia follows from its shapes."""
    if not isinstance(value, dict):
        return record(LinkSpec).read(value, path, problems)
    if value.get("collision") == "same":
        value = value | {"collision": value.get("visual", [])}
    inertial = value.get("inertial")
    if isinstance(inertial, dict) and "inertia" not in inertial and not (value.get("visual") or value.get("collision")):
        at, advice = (*path, "inertial"), "give a visual or a collision shape, or inertia: {ixx, iyy, izz}"
        problems.refuse("TF102", at, "no shape and no inertia: the mass has no distribution", advice, on_key=True)
    return record(LinkSpec).read(value, path, problems)


class Limit(Model):
    """What a joint can do; radians, or metres for a prismatic joint."""

    lower: float | None = key(POSITION, None)
    upper: float | None = key(POSITION, None)
    effort: float | None = key(JOINT_EFFORT, None, "N m, or N")
    velocity: float | None = key(JOINT_SPEED, None, "rad/s, or m/s")


class Mimic(Model):
    """The joint follows another one: multiplier · q + offset."""

    joint: str = key(TEXT)
    multiplier: float = key(NUMBER_, 1.0)
    offset: float = key(POSITION, 0.0)


class JointSpec(EdgeKeys):
    """An edge between bodies, in URDF's words."""

    type: str = key(choice("fixed", "revolute", "continuous", "prismatic"))
    parent: str = key(TEXT, about="the link that this joint hangs on")
    child: str = key(TEXT, about="the link that moves")
    axis: Vector = key(AXIS, (1.0, 0.0, 0.0), "in the child's frame; as in URDF the default is x", ([0, 0, 1],))
    limit: Limit | None = key(record(Limit), None)
    mimic: Mimic | None = key(record(Mimic), None)


class FrameSpec(MountKeys):
    """A bare frame. Without a parent it is a root, said so."""


class FrameOverride(Turned):
    """One frame of a sensor: its own value, or another name. What is left out is the preset's."""

    xyz: Vector | None = key(XYZ, None)
    name: str | None = key(TEXT, None, "another name for this frame")


class SensorSpec(MountKeys):
    """A sensor on its mount; its frames are named after it."""

    preset: str = key(TEXT, about="vendor/model", examples=("realsense/d435i", "generic/lidar2d"))
    parent: str = key(TEXT, about="the frame that the mount hangs on", examples=("base_link",))
    place: str | None = key(TEXT, None, "the pose is this frame's; the mount edge is solved for")
    options: dict[str, Any] = key(mapping(ANYTHING), {}, "the preset's own choices: streams, imu, …")
    tf: str | None = key(choice("driver", "tfcompose"), None, "who publishes the frames inside the sensor")
    driver: DriverSpec | None = key(
        process(
            DriverSpec,
            lambda value: {"process": value} if isinstance(value, str) else value,
            {"type": "string"},
        ),
        None,
        "keys over the preset's, the name of a process, or none",
    )
    frames: dict[str, FrameOverride] = key(mapping(record(FrameOverride)), {}, "this unit's own values and names")


class AllowedEdge(Model):
    """Edges that need no declaration; * and ? are wildcards."""

    child: str = key(TEXT, "*")
    parent: str = key(TEXT, "*")


class GuardSpec(Model):
    """What watches the live tree."""

    mode: str = key(choice("off", "watch"), "watch")
    unknown_edges: str = key(choice("ignore", "warn", "error"), "warn", "an edge that nobody declared")
    on_violation: str = key(choice("report", "stop"), "report")
    allow: tuple[AllowedEdge, ...] = key(listing(record(AllowedEdge)), ())


class RosSpec(Model):
    """What all processes share."""

    namespace: str = key(
        text(r"(/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?", "a namespace such as robot1 or fleet/robot1"), ""
    )
    frame_prefix: str = key(TEXT, "", "written in front of every frame as it is; with its slash", ("robot1/",))
    shared_frames: tuple[str, ...] = key(listing(TEXT), (), "frames that never get the prefix", (["map"],))
    isolate: str = key(
        choice("none", "topics", "frames", "both"),
        "none",
        "topics: /tf moves below the namespace; frames: the namespace is the prefix, unless one is given",
    )
    domain_id: int | None = key(integer(0, 232), None, "left out: the environment's")
    discovery: str | None = key(choice("localhost", "subnet", "off"), None, "left out: the environment's")
    clock: str = key(choice("wall", "sim"), "wall", "one clock for the whole plan")


class RobotSpec(Model):
    """One robot."""

    tfcompose: int = key(choice(1), about="the version of this language", examples=(1,))
    robot: str = key(text(r"[a-z][a-z0-9_]*", "a robot's name: lower case letters, digits and _"), examples=("rover",))
    include: tuple[str, ...] = key(
        listing(TEXT, single=True), (), "files that this one is laid over; relative to this file", (["base.yaml"],)
    )
    calibrations: tuple[str, ...] = key(
        listing(TEXT, single=True), (), "files with measured poses; every entry is applied", (["calibration/kit.yaml"],)
    )
    base: str | None = key(TEXT, None, "where the URDF begins; left out: base_link, or the only root")
    vars: dict[str, Any] = key(mapping(ANYTHING), {}, "quantities, numbers or texts, used as ${name}")
    ros: RosSpec = key(record(RosSpec), RosSpec())
    links: dict[str, LinkSpec] = key(mapping(Type(_link, LinkSpec)), {}, "bodies")
    joints: dict[str, JointSpec] = key(mapping(record(JointSpec)), {}, "edges between bodies")
    frames: dict[str, FrameSpec] = key(mapping(record(FrameSpec)), {}, "bare frames: the skeleton")
    sensors: dict[str, SensorSpec] = key(mapping(record(SensorSpec)), {})
    processes: dict[str, ProcessSpec] = key(mapping(process(ProcessSpec)), {}, "what is started, or expected to run")
    profiles: dict[str, Any] = key(mapping(ANYTHING), {}, "named overlays, chosen with --profile")
    guard: GuardSpec = key(record(GuardSpec), GuardSpec())
    rules: dict[str, str] = key(
        mapping(choice("off", "warning", "error")), {}, "how much a finding matters, by its code", ({"TF405": "off"},)
    )
