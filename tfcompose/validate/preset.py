"""A sensor's preset: its frames, body and driver as data.

In names ``{name}`` stands for the sensor's name, and a word of ``words`` for what it says there. In a driver's
parameters and arguments there is also ``{prefix}``, the robot's frame prefix.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.bodies import SHAPE, Shape
from tfcompose.validate.fields import ANYTHING, BOOLEAN, MASS_, RATE_, TEXT, XYZ, choice, text
from tfcompose.validate.posed import Turned
from tfcompose.validate.schema import Model, Problems, Type, key, listing, mapping, record

if TYPE_CHECKING:
    from tfcompose.geometry import Vector
    from tfcompose.load import Path
    from tfcompose.plan import LifecycleState

KINDS = ("camera", "stereo", "rgbd", "lidar2d", "lidar3d", "imu", "gnss", "radar", "ultrasonic")
UNKNOWN = "unknown"

Condition = dict[str, Any]
CONDITION = mapping(ANYTHING)


def _position(value: Any, path: Path, problems: Problems) -> Any:
    """Read a position; of one that is unknown nothing is left."""
    return None if value == UNKNOWN else XYZ.read(value, path, problems)


def _parameter(value: Any, path: Path, problems: Problems) -> Any:
    """Read a parameter: a mapping says what its value depends on."""
    return (record(Chosen) if isinstance(value, dict) else ANYTHING).read(value, path, problems)


class Option(Model):
    """One choice that the user has."""

    type: str = key(choice("set", "bool", "text", "choice"))
    values: tuple[str, ...] = key(listing(TEXT), (), "what a set may hold")
    variants: dict[str, Any] = key(mapping(mapping(ANYTHING)), {}, "of a choice: value → what it lays over the preset")
    default: Any = key(ANYTHING, None)
    about: str = key(TEXT, "")


class ByDriver(Turned):
    """What is otherwise when the driver publishes the frame; what is left out is the same."""

    parent: str = key(TEXT)
    xyz: Vector | None = key(XYZ, None)


class PresetFrame(Turned):
    """A frame inside the sensor, in its parent."""

    parent: str = key(TEXT)
    xyz: Vector | None = key(
        Type(_position, {"anyOf": [{"const": UNKNOWN}, XYZ]}),
        (0.0, 0.0, 0.0),
        "x forward, y left, z up; unknown: the vendor does not say, and without a rotation that is unknown as well",
        ([0, -0.05, 0], UNKNOWN),
    )
    nominal: bool = key(BOOLEAN, default=False, about="calibration or the device overrides the value; else it is exact")
    driver: str | None = key(
        choice("static", "dynamic"), None, "the driver publishes this edge, on /tf_static or /tf, unless switched off"
    )
    by_driver: ByDriver | None = key(record(ByDriver), None, "the driver hangs it on another frame")
    when: Condition = key(
        CONDITION, {}, "option → the value that it has, or, for a set, holds; tf → driver or tfcompose; all must hold"
    )
    other_axes: bool = key(
        BOOLEAN, default=False, about="its name does not say whether it is optical, or says it wrongly"
    )
    about: str = key(TEXT, "")


class Body(Model):
    """The sensor's body, on one of its frames."""

    frame: str = key(TEXT)
    shape: Shape = key(SHAPE)
    mass: float | None = key(MASS_, None, "where the vendor's is credible; the inertia is computed")


class Chosen(Model):
    """A value that an option decides: the option's own, if given; or one of two, by a condition."""

    option: str | None = key(TEXT, None, "the value is this option's; without one the parameter is left out")
    when: Condition | None = key(CONDITION, None)
    value: Any = key(ANYTHING, default=True, about="when the condition holds")
    otherwise: Any = key(ANYTHING, default=False, about="when it does not")


class Claim(Model):
    """An edge outside the sensor that its driver publishes by default. Switched off, unless the driver owns it."""

    parent: str = key(TEXT)
    child: str = key(TEXT)
    off: dict[str, Any] = key(mapping(ANYTHING), about="the parameters that keep the driver from it")
    about: str = key(TEXT, "")


PARAMETERS = mapping(Type(_parameter, {"anyOf": [{"not": {"type": "object"}}, Chosen]}))


class PresetDriver(Model):
    """The vendor's driver: what is started, and with what."""

    package: str = key(TEXT)
    executable: str | None = key(TEXT, None, "a node, which gets a parameter file")
    launch: str | None = key(TEXT, None, "or a launch file of the package, which gets arguments")
    node: str = key(TEXT, about="the name of the node that publishes")
    namespace: str = key(TEXT, "")
    lifecycle: LifecycleState | None = key(
        choice("active"), None, "a lifecycle node, which does nothing until it is active"
    )
    versions: str = key(TEXT, "", "for which the preset was read")
    params: dict[str, Any] = key(PARAMETERS, {}, "parameters of the node; left out if they hold an empty {prefix}")
    args: dict[str, Any] = key(PARAMETERS, {}, "arguments of the launch file")
    naming: dict[str, str] = key(mapping(TEXT), {}, "parameters, or arguments, that give a frame its name")
    prefixed: bool = key(BOOLEAN, default=False, about="a parameter takes the robot's frame prefix")
    tf: str = key(choice("driver", "tfcompose"), "driver", "who publishes the frames that the driver can, by default")
    on: dict[str, Any] = key(mapping(ANYTHING), {}, "parameters, or arguments, that make it publish them")
    off: dict[str, Any] | None = key(
        mapping(ANYTHING), None, "those that keep it from it; left out: there is no switch"
    )
    claims: tuple[Claim, ...] = key(listing(record(Claim)), (), "edges outside the sensor")
    about: str = key(TEXT, "")


class Topic(Model):
    """What the driver publishes."""

    type: str = key(TEXT, examples=("sensor_msgs/Image",))
    frame: str = key(TEXT, about="the frame of its header")
    hard_coded: bool = key(BOOLEAN, default=False, about="no parameter changes that frame, and no preset has it")
    rate: float | None = key(RATE_, None, "by default")
    when: Condition = key(CONDITION, {})


class Fact(Model):
    """Where the figures are from."""

    repository: str = key(TEXT)
    path: str = key(TEXT)
    commit: str = key(TEXT)
    about: str = key(TEXT, "", "what is from there, if not all; whether it is not the vendor's")


class PresetSpec(Model):
    """One model of sensor."""

    preset: int = key(choice(1), about="the version of this language")
    extends: str | None = key(
        TEXT, None, "a preset that this one is laid over; null removes; a name with _ is no preset by itself"
    )
    vendor: str = key(TEXT)
    model: str = key(TEXT)
    kind: str = key(choice(*KINDS))
    about: str = key(TEXT)
    mount: str = key(TEXT, about="the frame that a person bolts on; it has no entry under frames")
    root: str | None = key(TEXT, None, "the frame from which on the driver publishes; left out: the mount")
    words: dict[str, str] = key(
        mapping(text(r"[A-Za-z0-9_]*", "a part of a frame's name")), {}, "used in names as {word}"
    )
    options: dict[str, Option] = key(mapping(record(Option)), {})
    frames: dict[str, PresetFrame] = key(mapping(record(PresetFrame)), {}, "name → where it is")
    body: Body | None = key(record(Body), None)
    driver: PresetDriver | None = key(record(PresetDriver), None)
    topics: dict[str, Topic] = key(mapping(record(Topic)), {}, "below the driver's node, if they begin with ~/")
    source: tuple[Fact, ...] = key(listing(record(Fact)), ())
