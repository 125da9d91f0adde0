"""A sensor's preset: its frames, body and driver as data.

In names, ``{name}`` stands for the sensor's name, and a key of ``words`` for the key's value. In a
driver's parameters and arguments, ``{prefix}`` stands for the robot's frame prefix.
"""

import re
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Tag

from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.units import Mass, Rate
from tfcompose.model.plan import SensorPublisher
from tfcompose.spec.language.bodies import ShapeSpec
from tfcompose.spec.language.node_preset import Fact
from tfcompose.spec.language.optics import OpticsSpec
from tfcompose.spec.language.pose import Rotated
from tfcompose.spec.language.reading import SpecRefusal
from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.values import (
    Anything,
    Boolean,
    Matches,
    NoMapping,
    Parameters,
    Text,
    Xyz,
)
from tfcompose.spec.load import Path

UNKNOWN = "unknown"

#: A position, or "unknown", which becomes None.
KnownXyz = Annotated[
    Xyz | None,
    BeforeValidator(lambda value: None if value == UNKNOWN else value, Literal["unknown"] | Xyz),
]
SensorKind = Literal[
    "camera", "stereo", "rgbd", "lidar2d", "lidar3d", "imu", "gnss", "radar", "ultrasonic"
]
_WHEN = (
    "required values of options (for a set: a required member), and of tf: driver or "
    "tfcompose; all must match"
)


class PresetOption(Spec):
    """An option for the user."""

    type: Literal["set", "bool", "text", "choice"] = key(..., "the kind of value", "set")
    values: tuple[Text, ...] = key((), "the allowed members of a set", ["color", "depth"])
    variants: dict[str, Parameters] = key({}, "for a choice: the overlay of each value")
    default: Anything = key(None, "the value if none is set", ["color", "depth"])
    about: Text = key("", "its effect")


class ByDriver(Rotated):
    """Differences if the driver publishes the frame; keys that are left out are the same."""

    parent: Text = key(..., "the parent frame", "{name}_link")
    xyz: Xyz | None = key(None, "position in that parent", [0, 0.0148, 0])


class PresetFrame(Rotated):
    """A frame inside the sensor, in its parent."""

    parent: Text = key(..., "the parent frame", "{name}_link")
    xyz: KnownXyz = key(
        (0.0, 0.0, 0.0),
        "position: x forward, y left, z up; unknown where the vendor does not say, and then a"
        " rotation that is left out is unknown as well",
        [0, -0.05, 0],
        UNKNOWN,
    )
    nominal: Boolean = key(False, "true: calibration or the device overrides the value")
    driver: Literal["static", "dynamic"] | None = key(
        None, "how the driver publishes this edge by default: static on /tf_static, dynamic on /tf"
    )
    by_driver: ByDriver | None = key(None, "differences if the driver publishes it")
    when: Parameters = key({}, _WHEN, {"streams": "depth"})
    other_axes: Boolean = key(
        False, "true: its name does not show, or misstates, whether it is optical"
    )
    about: Text = key("", "what it is")


class Body(Spec):
    """The sensor's body, on one of its frames."""

    frame: Text = key(..., "the frame of the body", "{name}_link")
    shape: ShapeSpec = key(..., "its shape", {"box": [0.025, 0.09, 0.025]})
    mass: Mass | None = key(
        None, "the mass, if the vendor's value is credible; the inertia is computed", "72 g"
    )


class PresetOptics(OpticsSpec):
    """The field of view of a stream. It exists if its frame exists."""

    frame: Text = key(..., "the frame that it is in", "{name}_depth_optical_frame")
    when: Parameters = key({}, _WHEN, {"streams": "depth"})


class Chosen(Spec):
    """A value that depends on an option: the value of the option, if it is set.

    Or one of two, by a condition.
    """

    option: Text | None = key(
        None, "the option with the value; if it is not set, the parameter is omitted", "serial"
    )
    when: Parameters | None = key(None, _WHEN, {"streams": "depth"})
    value: Anything = key(True, "the value if the condition is true")
    otherwise: Anything = key(False, "the value if the condition is false")


class DriverClaim(Spec):
    """An edge outside the sensor that its driver publishes by default.

    tfcompose turns it off unless the driver owns the edge.
    """

    parent: Text = key(..., "the parent frame", "map")
    child: Text = key(..., "the child frame", "odom")
    off: Parameters = key(..., "the parameters that turn it off", {"publish_tf": False})
    about: Text = key("", "what it is")


#: A parameter; a mapping describes how its value depends on an option.
Parameter = Annotated[
    Annotated[Chosen, Tag("[chosen]")] | Annotated[NoMapping, Tag("[value]")],
    Discriminator(lambda value: "[chosen]" if isinstance(value, dict) else "[value]"),
]


class PresetProcess(Spec):
    """A process of the vendor's driver: what is started, and with what."""

    package: Text = key(..., "its package", "realsense2_camera")
    executable: Text | None = key(
        None, "a node, which takes a parameter file", "realsense2_camera_node"
    )
    launch: Text | None = key(
        None, "a launch file of the package, which takes arguments", "launch/rs_launch.py"
    )
    node: Text = key(..., "the name of the node that publishes", "{name}")
    namespace: Text = key("", "the namespace of that node")
    lifecycle: Literal["active"] | None = key(
        None, "a lifecycle node that does nothing until it is active"
    )
    params: dict[str, Parameter] = key(
        {}, "parameters of the node; omitted if they contain an empty {prefix}"
    )
    args: dict[str, Parameter] = key({}, "arguments of the launch file")


class FurtherProcess(PresetProcess):
    """Another process of the driver. It publishes no frames."""

    when: Parameters = key({}, _WHEN, {"streams": "depth"})


class PresetDriver(PresetProcess):
    """The vendor's driver. Its first process publishes the frames."""

    also: dict[Text, FurtherProcess] = key(
        {}, "its other processes, by the suffix that follows the sensor's name and a _"
    )
    versions: Text = key("", "the versions that this describes", "4.55 to 4.57")
    naming: dict[str, Text] = key(
        {}, "parameters, or arguments, for frame names", {"base_frame_id": "{name}_link"}
    )
    prefixed: Boolean = key(False, "true: a parameter gets the robot's frame prefix")
    tf: SensorPublisher = key(
        "driver", "the default publisher of the frames that the driver can publish"
    )
    by_default: Boolean = key(True, "false: it publishes them only if a parameter turns this on")
    on: Parameters = key({}, "parameters, or arguments, that turn this on", {"publish_tf": True})
    off: Parameters | None = key(
        None,
        "parameters, or arguments, that turn this off; left out: it cannot be turned off",
        {"publish_tf": False},
    )
    claims: tuple[DriverClaim, ...] = key((), "edges outside the sensor that it publishes")
    about: Text = key("", "notes")


class PresetTopic(Spec):
    """A topic that the driver publishes."""

    type: Text = key(..., "its type", "sensor_msgs/Image")
    frame: Text = key(..., "the frame of its header", "{name}_color_optical_frame")
    hard_coded: Boolean = key(
        False, "true: no parameter changes this frame, and the preset does not declare it"
    )
    rate: Rate | None = key(None, "its default rate")
    when: Parameters = key({}, _WHEN, {"streams": "color"})


class PresetSpec(Spec):
    """One model of sensor."""

    preset: Literal[1] = key(..., "the version of this language", 1)
    extends: Text | None = key(
        None,
        "the preset that this one is merged over; null removes a key; names with a leading _ "
        "are only for extension",
        "realsense/_d400",
    )
    vendor: Text = key(..., "the manufacturer", "Intel RealSense")
    model: Text = key(..., "the model name", "D435i")
    kind: SensorKind = key(..., "the kind of sensor", "rgbd")
    about: Text = key(..., "a description in one sentence")
    mount: Text = key(
        ...,
        "the frame of the mounting point; it has no entry under frames",
        "{name}_bottom_screw_frame",
    )
    root: Text | None = key(
        None, "the root of the frames that the driver publishes; default: the mount", "{name}_link"
    )
    words: dict[str, Annotated[Text, Matches(r"[A-Za-z0-9_]*", "a part of a frame's name")]] = key(
        {}, "values for {word} in names", {"side": "left"}
    )
    options: dict[str, PresetOption] = key({}, "the options for the user")
    frames: dict[str, PresetFrame] = key({}, "the frames by name")
    body: Body | None = key(None, "the sensor's body")
    optics: dict[str, PresetOptics] = key({}, "the field of view of each stream")
    driver: PresetDriver | None = key(None, "the vendor's driver")
    topics: dict[str, PresetTopic] = key(
        {}, "topics that the driver publishes; relative to its node if the name begins with ~/"
    )
    source: tuple[Fact, ...] = key((), "sources of the numbers")


_HOLE = re.compile(r"\{([^{}]*)\}")
_TF = ("driver", "tfcompose")


def wrong_names(preset: PresetSpec) -> Iterator[SpecRefusal]:
    """Yield names of frames, options and values that the preset uses but does not define.

    Also yield faults of a preset whose frames do not form a single tree.
    """
    yield from _frames(preset)
    yield from _options(preset)
    for path, process in _processes(preset):
        if (process.executable is None) == (process.launch is None):
            yield SpecRefusal("TF606", path, "give either executable or launch", on_key=True)
        if process.args and not process.launch:
            yield SpecRefusal(
                "TF606",
                (*path, "args"),
                "a node takes params; args are a launch file's",
                on_key=True,
            )


def _processes(preset: PresetSpec) -> Iterator[tuple[Path, PresetProcess]]:
    """Yield the processes of the driver with their paths."""
    if preset.driver:
        yield ("driver",), preset.driver
        for name, process in preset.driver.also.items():
            yield ("driver", "also", name), process


def _frames(preset: PresetSpec) -> Iterator[SpecRefusal]:
    frames = [preset.mount, *preset.frames]
    for path, name in _named_frames(preset):
        if name not in frames:
            advice = did_you_mean(name, frames, f"its frames: {', '.join(frames)}")
            yield SpecRefusal("TF606", path, f"{preset.model} has no frame {name}", advice)
    for name in frames:
        for hole in _HOLE.findall(name):
            if hole != "name" and hole not in preset.words:
                yield SpecRefusal(
                    "TF606",
                    ("words",),
                    f"{name}: unknown placeholder {hole}",
                    "write {name}, or a placeholder that words defines",
                )
    if preset.mount in preset.frames:
        message = f"{preset.mount} is the mount: the robot file sets its pose"
        yield SpecRefusal("TF606", ("frames", preset.mount), message, on_key=True)
    for name in preset.frames:
        above, steps = name, 0
        while above in preset.frames and steps <= len(preset.frames):
            above, steps = preset.frames[above].parent, steps + 1
        if above in preset.frames:
            yield SpecRefusal("TF606", ("frames", name), f"{name} is above itself", on_key=True)


def _named_frames(preset: PresetSpec) -> Iterator[tuple[Path, str]]:
    """Yield each use of a frame's name, with its path."""
    for name, frame in preset.frames.items():
        yield ("frames", name, "parent"), frame.parent
        if frame.by_driver:
            yield ("frames", name, "by_driver", "parent"), frame.by_driver.parent
    if preset.root:
        yield ("root",), preset.root
    if preset.body:
        yield ("body", "frame"), preset.body.frame
    for name, frame_name in (preset.driver.naming if preset.driver else {}).items():
        yield ("driver", "naming", name), frame_name
    for name, optics in preset.optics.items():
        yield ("optics", name, "frame"), optics.frame
    for name, topic in preset.topics.items():
        if not topic.hard_coded:
            yield ("topics", name, "frame"), topic.frame


def _options(preset: PresetSpec) -> Iterator[SpecRefusal]:
    for name, option in preset.options.items():
        variants: tuple[str, ...] = (
            tuple(option.variants) if option.type == "choice" else option.values
        )
        if option.type in {"choice", "set"}:
            chosen = option.default if option.type == "set" else [option.default]
            for value in chosen if isinstance(chosen, list) else [chosen]:
                if value not in variants:
                    message = f"the option {name} cannot be {value!r}"
                    yield SpecRefusal(
                        "TF606",
                        ("options", name),
                        message,
                        f"one of: {', '.join(variants)}",
                        on_key=True,
                    )
    for path, condition in _conditions(preset):
        for name, condition_values in condition.items():
            yield from _condition(preset, (*path, name), condition_values)
    for path, value in _chosen_options(preset):
        if value.option and value.option not in preset.options:
            advice = did_you_mean(value.option, preset.options)
            yield SpecRefusal(
                "TF606", path, f"{preset.model} has no option {value.option}", advice
            )


def _condition(preset: PresetSpec, path: Path, value: Any) -> Iterator[SpecRefusal]:
    name = str(path[-1])
    option = preset.options.get(name)
    if option is None and name != "tf":
        advice = did_you_mean(name, [*preset.options, "tf"], "use tf, or an option of the preset")
        yield SpecRefusal(
            "TF606", path, f"{preset.model} has no option {name}", advice, on_key=True
        )
        return
    by_type = (
        {"set": option.values, "choice": tuple(option.variants), "bool": (True, False)}
        if option
        else {}
    )
    values: tuple[Any, ...] = by_type.get(option.type, ()) if option else _TF
    for choice in value if isinstance(value, list) else [value]:
        if values and choice not in values:
            advice = f"one of: {', '.join(map(str, values))}"
            yield SpecRefusal("TF606", path, f"{name} is never {choice!r}", advice)


def _conditions(preset: PresetSpec) -> Iterator[tuple[Path, dict[str, Any]]]:
    for name, frame in preset.frames.items():
        yield ("frames", name, "when"), frame.when
    for name, optics in preset.optics.items():
        yield ("optics", name, "when"), optics.when
    for name, topic in preset.topics.items():
        yield ("topics", name, "when"), topic.when
    for name, process in preset.driver.also.items() if preset.driver else ():
        yield ("driver", "also", name, "when"), process.when
    for path, value in _chosen_options(preset):
        if value.when:
            yield (*path, "when"), value.when


def _chosen_options(preset: PresetSpec) -> Iterator[tuple[Path, Chosen]]:
    """Yield the parameters and arguments that depend on options, with their paths."""
    for path, process in _processes(preset):
        for section, table in (("params", process.params), ("args", process.args)):
            for name, value in table.items():
                if isinstance(value, Chosen):
                    yield (*path, section, name), value
