"""The language of ``robot.yaml``, version 1: what a user writes, typed.

The descriptions and examples here are what an editor shows; ``schemas/robot.schema.json`` is made from them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.bodies import LINK, LinkSpec
from tfcompose.validate.edges import PARENTS, MountKeys
from tfcompose.validate.fields import (
    ANYTHING,
    NAMESPACE,
    TEXT,
    XYZ,
    choice,
    integer,
    text,
)
from tfcompose.validate.hardware import HARDWARE, XML, HardwareSpec
from tfcompose.validate.joints import JointSpec
from tfcompose.validate.part import PART, PartSpec
from tfcompose.validate.posed import Turned
from tfcompose.validate.process import DriverSpec, ProcessSpec, process
from tfcompose.validate.schema import Model, key, listing, mapping, record

if TYPE_CHECKING:
    from tfcompose.geometry import Vector
    from tfcompose.plan import Clock, Discovery


class FrameSpec(MountKeys):
    """A bare frame. Without a parent it is a root, said so."""


class FrameOverride(Turned):
    """One frame of a sensor: its own value, or another name. What is left out is the preset's."""

    xyz: Vector | None = key(XYZ, None)
    parent: str | None = key(TEXT, None, "the frame of this sensor that this unit's driver hangs it on")
    name: str | None = key(TEXT, None, "another name for this frame")


class SensorSpec(MountKeys):
    """A sensor on its mount; its frames are named after it."""

    preset: str = key(TEXT, about="vendor/model", examples=("realsense/d435i", "generic/lidar2d"))
    parent: tuple[str, ...] = key(PARENTS, about="the frame that the mount hangs on", examples=("base_link",))
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

    mode: str = key(
        choice("off", "watch", "strict"),
        "watch",
        "strict: what a process of the plan sends and does not own is held back",
    )
    unknown_edges: str = key(choice("ignore", "warn", "error"), "warn", "an edge that nobody declared")
    on_violation: str = key(
        choice("report", "stop-offender", "stop"),
        "report",
        "stop-offender ends the plan's own process that surely did it, stop ends everything",
    )
    allow: tuple[AllowedEdge, ...] = key(listing(record(AllowedEdge)), ())
    fence: str = key(
        choice("auto", "partition", "remap"),
        "auto",
        "how strict fences processes off: by a DDS partition, which needs Fast DDS, or by remapping /tf and /tf_static",
    )


class RosSpec(Model):
    """What all processes share."""

    namespace: str = key(NAMESPACE, "")
    frame_prefix: str = key(TEXT, "", "written in front of every frame as it is; with its slash", ("robot1/",))
    shared_frames: tuple[str, ...] = key(listing(TEXT), (), "frames that never get the prefix", (["map"],))
    isolate: str = key(
        choice("none", "topics", "frames", "both"),
        "none",
        "topics: /tf moves below the namespace; frames: the namespace is the prefix, unless one is given",
    )
    domain_id: int | None = key(integer(0, 232), None, "left out: the environment's")
    discovery: Discovery | None = key(choice("localhost", "subnet", "off"), None, "left out: the environment's")
    clock: Clock = key(choice("wall", "sim"), "wall", "one clock for the whole plan")
    state_publisher: str = key(
        choice("tfcompose", "stock"),
        "tfcompose",
        "stock: robot_state_publisher publishes all below base that is ours",
    )


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
    packages: dict[str, str] = key(
        mapping(TEXT),
        {},
        "where packages are that are not installed; relative to the file that writes it",
        ({"ur_description": "../third_party/ur_description"},),
    )
    links: dict[str, LinkSpec] = key(mapping(LINK), {}, "bodies")
    joints: dict[str, JointSpec] = key(mapping(record(JointSpec)), {}, "edges between bodies")
    ros2_control: dict[str, HardwareSpec] = key(
        mapping(HARDWARE), {}, "what drives the joints: ros2_control's hardware"
    )
    xml: dict[str, str] = key(
        XML,
        {},
        "raw URDF beside links and joints: <gazebo>, <transmission>, …; a text, or texts by any name",
        ({"wheels": '<gazebo reference="wheel_left_link"><mu1>1.2</mu1></gazebo>'},),
    )
    frames: dict[str, FrameSpec] = key(mapping(record(FrameSpec)), {}, "bare frames: the skeleton")
    sensors: dict[str, SensorSpec] = key(mapping(record(SensorSpec)), {})
    parts: dict[str, PartSpec] = key(mapping(PART), {}, "other robots as subtrees, or beside each other")
    processes: dict[str, ProcessSpec] = key(mapping(process(ProcessSpec)), {}, "what is started, or expected to run")
    profiles: dict[str, Any] = key(mapping(ANYTHING), {}, "named overlays, chosen with --profile")
    guard: GuardSpec = key(record(GuardSpec), GuardSpec())
    preset_path: tuple[str, ...] = key(
        listing(TEXT, single=True),
        (),
        "folders with presets of your own, VENDOR/MODEL.yaml; relative to this file",
        (["presets"],),
    )
    rules: dict[str, str] = key(
        mapping(choice("off", "warning", "error")), {}, "how much a finding matters, by its code", ({"TF405": "off"},)
    )
