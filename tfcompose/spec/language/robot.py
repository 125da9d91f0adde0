"""The language of ``robot.yaml``, version 1, as typed models.

Editors and ``tfcompose schema --reference`` show the descriptions and examples from these models.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Discriminator, Field, PrivateAttr, Strict, Tag
from pydantic_core import PydanticCustomError

from tfcompose.foundation.findings import Span
from tfcompose.foundation.units import (
    NUMBER,
    JointPosition,
    Measure,
    Number,
    Quantity,
    Truth,
    UnitError,
    example,
    format_value,
    invalid,
    quantity,
    with_article,
)
from tfcompose.model.fields import documented_field
from tfcompose.model.plan import (
    GuardPolicy,
    Isolation,
    JointType,
    RosSettings,
    SensorPublisher,
    StatePublisher,
)
from tfcompose.model.plan.middleware import ENDPOINT
from tfcompose.model.robot import Dynamics, Limit, ReferencePositions, SafetyController
from tfcompose.spec.language.args import Args
from tfcompose.spec.language.bodies import LinkSpec
from tfcompose.spec.language.hosts import HostName, HostSpec
from tfcompose.spec.language.optics import OpticsSpec
from tfcompose.spec.language.pose import (
    CalibrationFiles,
    EdgeKeys,
    MountKeys,
    Parents,
    Posed,
    Rotated,
)
from tfcompose.spec.language.process import ContainerSpec, Driver, ProcessSpec
from tfcompose.spec.language.rules import RuleSetting, ZoneSpec
from tfcompose.spec.language.spec import (
    Entry,
    Spec,
    below,
    inherit_field,
    key,
    measure_of,
    several,
)
from tfcompose.spec.language.values import (
    Axis,
    Boolean,
    Integral,
    Matches,
    Namespace,
    NoMapping,
    OneOrMore,
    Parameters,
    Text,
    Texts,
    Xyz,
)
from tfcompose.spec.load import Path, Spans


class FrameSpec(MountKeys):
    """A frame without a body. Without a parent it is a root."""

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Yield faults of the combination of keys, with paths below the frame."""
        yield from super().check(data)
        if "owner" in data and "parent" not in data:
            advice = (
                f"write owner: {data['owner']} on the child of the edge that it publishes, or add"
                " parent"
            )
            yield (
                ("owner",),
                invalid(
                    "TF102", "owner without a parent: a root has no edge", advice, on_key=True
                ),
            )


# Joints and their hardware


class Mimic(Spec):
    """A joint that follows another one.

    Its position is multiplier · position of the other joint + offset.
    """

    joint: Text = key(..., "the joint that it follows", "finger_left_joint")
    multiplier: Number = key(1.0, "the factor")
    offset: JointPosition = key(0.0, "the offset")


def _only_one(value: Any) -> Any:
    if isinstance(value, list):
        raise invalid(
            "TF103", f"expected a string, got {format_value(value)}", "a joint has one parent"
        )
    return [value]


#: Whether joints of a type slide. For these, numbers without a unit are metres, otherwise radians.
_SLIDES = {"revolute": False, "continuous": False, "prismatic": True}


class JointSpec(EdgeKeys):
    """An edge between bodies, with URDF's terms.

    Planar and floating joints need an owner, because joint states do not describe them.
    """

    type: Literal["fixed", JointType] = key(..., "how the joint moves", "revolute")
    parent: Annotated[Texts, BeforeValidator(_only_one, Text)] = key(
        ..., "the parent link", "base_link"
    )
    child: Text = key(..., "the child link, which moves", "wheel_left_link")
    axis: Axis = key(
        (1.0, 0.0, 0.0),
        "the axis in the child's frame, default x as in URDF; for a planar joint the normal of "
        "the plane",
        [0, 0, 1],
    )
    offset: JointPosition = key(
        0.0,
        "correction of the joint's zero: at the reported position q the child is where q + offset "
        "would place it",
        "0.4 deg",
    )
    limit: Limit | None = key(
        None,
        "limits of position, velocity and effort",
        {"lower": "-90 deg", "upper": "90 deg", "velocity": 2},
    )
    mimic: Mimic | None = key(
        None, "the joint that it follows", {"joint": "finger_left_joint", "multiplier": -1}
    )
    dynamics: Dynamics | None = key(None, "damping and friction", {"damping": 0.1})
    safety_controller: SafetyController | None = key(
        None,
        "soft limits and gains for a controller",
        {"soft_upper_limit": "80 deg", "k_velocity": 10},
    )
    calibration: ReferencePositions | None = key(
        None,
        "the positions of the reference switch, as in URDF; not a measured pose",
        {"rising": "10 deg"},
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield lengths for joints that rotate and angles for joints that slide."""
        yield from super().check(data)
        kind = data.get("type")
        if not isinstance(kind, str) or kind not in _SLIDES:
            return
        for name, field in cls.model_fields.items():
            annotation, value = field.rebuild_annotation(), data.get(name)
            values: dict[Path, tuple[Any, Any]] = {(name,): (annotation, value)}
            if isinstance(value, dict):
                values = {
                    (name, step): (below(annotation, step), inner) for step, inner in value.items()
                }
            for path, (kind_of_value, number) in values.items():
                measure = measure_of(kind_of_value)
                if measure and measure.sliding and isinstance(number, (str, Quantity)):
                    yield from _wrong_unit(kind, path, number, measure)


class JointZeroSpec(Spec):
    """A correction of a joint that a part has."""

    offset: JointPosition = key(..., "correction of the joint's zero", "0.4 deg")


def _is_zero(entry: Any) -> bool:
    """Return whether an entry of ``joints`` corrects a joint of a part, instead of adding one."""
    return isinstance(entry, JointZeroSpec) or (
        isinstance(entry, dict) and entry.keys() == {"offset"}
    )


class _JointForms:
    """JSON Schema of an entry of ``joints``: validators name the wrong key, as for one model."""

    @staticmethod
    def __get_pydantic_json_schema__(schema: Any, handler: Any) -> dict[str, Any]:
        joint, zero = handler(schema)["anyOf"]
        return {
            "if": {"required": ["offset"], "maxProperties": 1},
            "then": zero,
            "else": joint,
        }


#: A joint, or the correction of a part's.
JointEntry = Annotated[
    Annotated[JointSpec, Tag("[joint]")] | Annotated[JointZeroSpec, Tag("[zero]")],
    Discriminator(lambda entry: "[zero]" if _is_zero(entry) else "[joint]"),
    _JointForms,
]


def _wrong_unit(
    kind: str, path: Path, value: str | Quantity, measure: Measure
) -> Iterator[tuple[Path, PydanticCustomError]]:
    try:
        dimension = (quantity(value) if isinstance(value, str) else value).dimension
    except UnitError:
        return  # another check rejects it
    turning, sliding = measure.dimensions
    dimensions, opposite = (sliding, turning) if _SLIDES[kind] else (turning, sliding)
    if dimension == opposite:
        moves = "slides" if _SLIDES[kind] else "turns"
        what = value if isinstance(value, str) else with_article(opposite)
        message = f"a {kind} joint {moves}: {path[-1]} cannot be {what}"
        yield path, invalid("TF104", message, f"for example {example(dimensions)}", keeps=True)


def _scalar(value: Any) -> str:
    """Return the text of a parameter in XML, where parameters have no types."""
    if isinstance(value, Quantity):
        if value.dimension != NUMBER:
            raise invalid("TF104", f"{format_value(value)} has a unit, and a parameter has none")
        value = value.value
    value = value.value if isinstance(value, Truth) else value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (str, int)):
        return str(value)
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)  # noqa: PLR2004 (exact)
    raise invalid(
        "TF103", f"expected a string, a number, true or false, got {format_value(value)}"
    )


#: A parameter in XML, as its text.
XmlParameters = dict[str, Annotated[str, BeforeValidator(_scalar, str | float | bool)]]


def _by_name(value: Any) -> Any:
    """Return interfaces by name, from a list of names or a mapping."""
    if not isinstance(value, list):
        return value
    wrong = [index for index, name in enumerate(value) if not isinstance(name, str)]
    if wrong:
        got = {index: f"expected a string, got {format_value(value[index])}" for index in wrong}
        raise several(*(((index,), invalid("TF103", message)) for index, message in got.items()))
    return {name: {} for name in value}


Interfaces = Annotated[
    dict[str, XmlParameters], BeforeValidator(_by_name, Texts | dict[str, XmlParameters])
]


class ComponentSpec(Spec):
    """A joint, sensor or gpio of a hardware component."""

    command: Interfaces = key(
        {}, "its command interfaces", ["velocity"], {"position": {"min": -1, "max": 1}}
    )
    state: Interfaces = key({}, "its state interfaces", ["position", "velocity"])
    params: XmlParameters = key({}, "its parameters", {"gear_ratio": 30})


class HardwareSpec(Entry):
    """A hardware component of ros2_control: a plugin with its joints, sensors and gpios."""

    plugin: Text = key(..., "the class of the plugin", "mock_components/GenericSystem")
    type: Literal["system", "actuator", "sensor"] = key("system", "the kind of component")
    params: XmlParameters = key({}, "the plugin's parameters", {"device": "/dev/ttyUSB0"})
    rw_rate: Annotated[int, Strict(), Field(ge=0, le=100_000), Integral] | None = key(
        None, "reads and writes per second; 0 (default): the rate of the controller manager", 100
    )
    is_async: Boolean | None = key(None, "true: it is read and written in its own thread")
    joints: dict[str, ComponentSpec] = key(
        {},
        "its joints, by their names in the robot file",
        {"wheel_left_joint": {"command": ["velocity"], "state": ["position"]}},
    )
    sensors: dict[str, ComponentSpec] = key(
        {}, "its sensors by name", {"force": {"state": ["force.x"]}}
    )
    gpios: dict[str, ComponentSpec] = key(
        {}, "its inputs and outputs by name", {"gripper": {"command": ["open"]}}
    )

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield keys that ros2_control rejects for a component of this type."""
        yield from super().check(data)
        joints = data.get("joints", {})
        if data.get("type") == "actuator" and isinstance(joints, dict) and len(joints) != 1:
            message = f"an actuator has one joint, and this one has {len(joints)}"
            yield (
                (),
                invalid(
                    "TF106", message, "type: system takes any number", on_key=True, keeps=True
                ),
            )
        for section in ("joints", "sensors", "gpios"):
            components = data.get(section)
            for name, component in components.items() if isinstance(components, dict) else ():
                is_sensor = data.get("type") == "sensor" or section == "sensors"
                if is_sensor and isinstance(component, dict) and component.get("command"):
                    advice = (
                        "type: system, or gpios"
                        if data.get("type") == "sensor"
                        else "gpios take commands"
                    )
                    yield (
                        (section, name, "command"),
                        invalid("TF106", "a sensor takes no commands", advice, keeps=True),
                    )


Blocks = Annotated[
    dict[str, Text],
    BeforeValidator(
        lambda value: {"": value} if isinstance(value, str) else value, Text | dict[str, Text]
    ),
]


# Sensors


class FrameOverride(Rotated):
    """One frame of a sensor: its pose in this unit, or another name.

    Keys that are left out are as in the preset.
    """

    xyz: Xyz | None = key(None, "position in the parent", [0, 0.0148, 0])
    parent: Text | None = key(
        None, "its parent frame as published by the driver of this unit", "camera_link"
    )
    name: Text | None = key(None, "another name for this frame", "front_lens")
    joint: Text | None = key(
        None, "the name of its joint in URDF; default: PARENT_to_CHILD", "camera_color_joint"
    )


class SensorSpec(MountKeys):
    """A sensor and its mount. Its frames begin with its name."""

    preset: Text = key(..., "the model, as vendor/model", "realsense/d435i", "generic/lidar2d")
    parent: Parents = key(..., "the frame on which the sensor is mounted", "base_link")
    place: Text | None = key(
        None,
        "the frame of the sensor whose pose is given; the pose of the mount is computed",
        "camera_color_optical_frame",
    )
    options: Parameters = key(
        {}, "the preset's own options: streams, imu, …", {"streams": ["color", "depth"]}
    )
    tf: SensorPublisher | None = key(
        None, "the publisher of the frames inside the sensor; default: as in the preset"
    )
    driver: Driver | None = key(
        None,
        "changes to the preset's driver, the name of a process, or none",
        "none",
        {"restart": "always"},
    )
    frames: dict[str, FrameOverride] = key(
        {},
        "poses and names of frames of this unit",
        {"camera_imu_frame": {"xyz": [0, 0.01, 0]}},
    )
    optics: dict[str, OpticsSpec] = key(
        {},
        "fields of view of its streams, merged over the preset",
        {"depth": {"horizontal": "75 deg", "far": "4 m"}},
    )


# Parts

_WHERE = "relative to this file, package://NAME/PATH or $(find NAME)/PATH"


class Origin(Posed):
    """A pose for a block parameter of a macro."""


#: A macro's parameter. A mapping is a pose; any other value is passed on unchanged.
MacroParameter = Annotated[
    Annotated[Origin, Tag("[origin]")] | Annotated[NoMapping, Tag("[value]")],
    Discriminator(lambda value: "[origin]" if isinstance(value, dict) else "[value]"),
]

#: Kinds of parts, and keys that are valid only for that kind.
PART_KINDS = {
    "spec": ("vars", "profiles", "args"),
    "urdf": (),
    "xacro": ("args", "macro", "params", "include"),
}
_MACRO_KEYS = ("params", "include")
#: Kind of a file by its ending. xacro also reads plain URDF, so ``xacro: FILE.urdf`` is valid.
_ENDINGS = {".urdf": "urdf", ".xacro": "xacro", ".yaml": "spec", ".yml": "spec"}


class PartSpec(MountKeys):
    """Another robot as a part: a robot file, URDF or xacro.

    The rest of the file refers to its names with the prefix.
    """

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (*MountKeys.EXCLUSIVE, frozenset(PART_KINDS))
    NEEDS_PARENT: ClassVar[str] = (
        "the pose of a part without a parent comes from its own file: add parent: FRAME, or change"
        " the start pose in the process that publishes its first moving edge"
    )

    spec: Text | None = key(None, "a robot file, relative to this file", "rover.yaml")
    urdf: Text | None = key(
        None, f"a URDF file: {_WHERE}", "package://ur_description/urdf/ur5e.urdf"
    )
    xacro: Text | None = key(
        None, f"a xacro file: {_WHERE}", "$(find ur_description)/urdf/ur.urdf.xacro"
    )
    args: Parameters = key(
        {}, "arguments of the xacro file, or of the robot file", {"name": "ur", "ur_type": "ur5e"}
    )
    macro: Text | None = key(
        None,
        "the macro of the xacro file to call; its parent and origin may come from the part",
        "hokuyo_ust10",
    )
    params: dict[str, MacroParameter] = key(
        {},
        "the macro's parameters; for a block parameter, a pose or a string that begins with <",
        {"name": "front", "parent_link": "base_link", "origin": {"xyz": [0.3, 0, 0.1]}},
    )
    include: OneOrMore = key((), "more xacro files that the macro needs", ["common.xacro"])
    prefix: Text | None = key(
        None,
        "prefix of the part's frames and joints, including its slash",
        "robot1/",
    )
    namespace: Namespace | None = key(
        None,
        "makes the part a separate robot, with its own processes static and joints; relative to "
        "ros.namespace",
        "robot1",
    )
    profiles: OneOrMore = key((), "profiles of the robot file", ["demo"])
    vars: Parameters = key({}, "values for variables of the robot file", {"mast": "40 cm"})
    root: Text | None = key(
        None,
        "the frame, without the prefix, whose subtree is the part; default: the complete part",
        "base_link",
    )
    place: Text | None = key(
        None,
        "the frame of the part whose pose is given; the pose of the mount is computed",
        "tool0",
    )
    owner: Text | None = key(
        None, "the process that publishes every edge of the part", "arm_driver"
    )

    @property
    def is_alone(self) -> bool:
        """Whether the part is a separate robot with its own joint states."""
        return bool((self.namespace or "").strip("/"))

    @classmethod
    def check(cls, data: dict[str, Any]) -> Iterator[tuple[Path, PydanticCustomError]]:
        """Also yield a part without a kind, and keys of another kind of part."""
        yield from super().check(data)
        kind = next((kind for kind in PART_KINDS if kind in data), None)
        if kind is None:
            if data.keys() <= cls.model_fields.keys():
                advice = "give spec, urdf or xacro"
                yield (
                    (),
                    invalid("TF102", "a part without a robot", advice, on_key=True, keeps=True),
                )
            return
        for name in dict.fromkeys(
            name for names in PART_KINDS.values() for name in names if name in data
        ):
            kinds = [part_kind for part_kind, names in PART_KINDS.items() if name in names]
            if kind not in kinds:
                message = f"{name} goes with {' and '.join(kinds)}, not with {kind}"
                yield (name,), invalid("TF107", message, on_key=True, keeps=True)
        for name in _MACRO_KEYS:
            if name in data and "macro" not in data:
                yield (
                    (name,),
                    invalid(
                        "TF102", f"{name} without a macro", "macro: NAME", on_key=True, keeps=True
                    ),
                )
        file = data[kind]
        ending = next(
            (ending for ending in _ENDINGS if isinstance(file, str) and file.endswith(ending)), ""
        )
        suffix_kind = _ENDINGS.get(ending, kind)
        if suffix_kind != kind and (kind, suffix_kind) != ("xacro", "urdf"):
            what = "a robot file" if suffix_kind == "spec" else f"a {ending[1:]} file"
            yield (
                (kind,),
                invalid("TF106", f"{file} is {what}", f"{suffix_kind}: instead of {kind}:"),
            )


# The robot


@dataclass(frozen=True, slots=True)
class RosSpec(RosSettings):
    """ROS settings of all processes."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"extra": "forbid"}

    namespace: Namespace = inherit_field(RosSettings, "namespace")
    domain_id: Annotated[int, Strict(), Field(ge=0, le=232), Integral] | None = inherit_field(
        RosSettings, "domain_id"
    )
    router: (
        Annotated[Text, Matches(ENDPOINT, "an endpoint of Zenoh such as tcp/10.0.0.2:7447")] | None
    ) = inherit_field(RosSettings, "router")
    isolate: Isolation = documented_field(
        "none",
        "topics: /tf moves into the namespace; frames: the namespace is the prefix, unless "
        "frame_prefix is set",
    )
    state_publisher: StatePublisher = documented_field(
        "tfcompose",
        "stock: robot_state_publisher publishes tfcompose's edges below base",
    )


class RobotOverlays(Entry):
    """Overlays of single robots, so that one robot file serves several of them."""

    by: Literal["hostname"] = key(
        "hostname", "the source of a robot's name: the hostname of its computer", "hostname"
    )
    folder: Text = key(
        "overlays", "folder of the overlays, HOSTNAME.yaml, relative to this file", "overlays"
    )


class RobotSpec(Spec):
    """One robot."""

    _spans: Spans = PrivateAttr()

    tfcompose: Literal[1] = key(..., "the version of this language", 1)
    robot: Annotated[
        Text, Matches(r"[a-z][a-z0-9_]*", "a robot's name: lower case letters, digits and _")
    ] = key(..., "the robot's name", "rover")
    include: OneOrMore = key(
        (), "files that this file extends and overrides, relative to this file", ["base.yaml"]
    )
    calibrations: CalibrationFiles = key(
        (), "calibration files; every entry is applied", ["calibration/kit.yaml"]
    )
    base: Text | None = key(
        None,
        "the root link of the URDF; default: base_link, or the only root",
        "base_footprint",
    )
    ground: Text | None = key(
        None,
        "the frame on the floor below the base; default: base_footprint, if there is one",
        "floor",
    )
    vars: Parameters = key(
        {}, "quantities, numbers or strings; use them as ${name}", {"mast": "30 cm"}
    )
    args: Args = key(
        {},
        "build-time arguments, set as NAME:=VALUE; use them as ${args.NAME}",
        {"cameras": {"default": 2, "max": 8}, "sim": False},
    )
    ros: RosSpec = key(RosSpec(), "ROS settings of all processes", {"namespace": "robot1"})
    packages: dict[str, Text] = key(
        {},
        "folders of packages that are not installed, relative to this file",
        {"ur_description": "../third_party/ur_description"},
    )
    links: dict[str, LinkSpec] = key(
        {},
        "bodies, with URDF's terms",
        {"base_link": {"visual": {"box": [0.5, 0.4, 0.15]}, "collision": "same"}},
    )
    joints: dict[str, JointEntry] = key(
        {},
        "edges between bodies, with URDF's terms; offset alone corrects the joint of a part",
        {
            "lift_joint": {
                "type": "prismatic",
                "parent": "base_link",
                "child": "lift",
                "axis": [0, 0, 1],
            }
        },
    )
    ros2_control: dict[str, HardwareSpec] = key(
        {},
        "the hardware of ros2_control",
        {"base": {"plugin": "mock_components/GenericSystem"}},
    )
    xml: Blocks = key(
        {},
        "raw URDF in addition to links and joints: <gazebo>, <transmission>, …; one string, or "
        "several by name",
        {"wheels": '<gazebo reference="wheel_left_link"><mu1>1.2</mu1></gazebo>'},
    )
    frames: dict[str, FrameSpec] = key(
        {},
        "frames without a body: the skeleton of the tree, and points of interest",
        {"odom": {"parent": "map", "owner": "slam"}},
    )
    sensors: dict[str, SensorSpec] = key(
        {},
        "sensors and their mounts",
        {"laser": {"preset": "generic/lidar2d", "parent": "base_link"}},
    )
    parts: dict[str, PartSpec] = key(
        {},
        "other robots, as subtrees or as separate trees",
        {"arm": {"urdf": "arm.urdf", "parent": "base_link"}},
    )
    containers: dict[str, ContainerSpec] = key(
        {}, "processes that load components", {"perception": {"isolation": "isolated"}}
    )
    processes: dict[str, ProcessSpec] = key(
        {}, "processes to start, to simulate, or to expect", {"base_drive": {"external": True}}
    )
    hosts: dict[HostName, HostSpec] = key(
        {}, "the computers that processes can run on", {"brain": {"ssh": "robot@10.0.0.2"}}
    )
    profiles: Parameters = key(
        {},
        "named overlays, chosen with --profile",
        {"demo": {"sensors": {"laser": {"driver": "none"}}}},
    )
    overlays: RobotOverlays | None = key(
        None,
        "overlays of single robots, chosen with --robot; up chooses by the hostname",
        {"by": "hostname", "folder": "overlays"},
    )
    guard: GuardPolicy = key(GuardPolicy(), "the checks of the live tree", {"mode": "strict"})
    preset_path: OneOrMore = key(
        (),
        "folders with your own presets, VENDOR/MODEL.yaml, relative to this file",
        ["presets"],
    )
    coverage: dict[str, ZoneSpec] = key(
        {},
        "zones that sensors must see",
        {
            "front": {
                "frame": "base_link",
                "center": [1, 0, 0.2],
                "box": [1, 1, 0.4],
                "by": ["lidar"],
                "least": "90 %",
            }
        },
    )
    rules: dict[str, RuleSetting] = key(
        {},
        "severity and limit of findings, by code",
        {"TF405": "off", "TF641": {"limit": "30 %"}},
    )

    @property
    def spans(self) -> Spans:
        """Spans of the keys and values of the file."""
        return self._spans

    def carry(self, spans: Spans) -> None:
        """Store the spans of the source from which the spec was validated."""
        self._spans = spans

    def span_of(self, path: Path) -> Span:
        """Return the span of the value at a path, or of the nearest enclosing mapping or list."""
        return self._spans.span_of(path)

    def key_span(self, path: Path) -> Span:
        """Return the span of the key at a path, or of the nearest enclosing key."""
        return self._spans.key_span(path)
