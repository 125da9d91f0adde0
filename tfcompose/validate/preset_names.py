"""Whether what a preset names is there: frames, options and their values; and whether its frames are one tree."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import did_you_mean
from tfcompose.validate.preset import Chosen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.load import Path
    from tfcompose.validate.preset import PresetSpec
    from tfcompose.validate.schema import Problems

_HOLE = re.compile(r"\{([^{}]*)\}")
_TF = ("driver", "tfcompose")


def check_names(preset: PresetSpec, problems: Problems) -> None:
    """Refuse what the preset names and does not have."""
    _frames(preset, problems)
    _options(preset, problems)
    driver = preset.driver
    if driver and (driver.executable is None) == (driver.launch is None):
        problems.refuse("TF606", ("driver",), "one of executable and launch says what is started", on_key=True)
    if driver and driver.args and not driver.launch:
        problems.refuse("TF606", ("driver", "args"), "a node takes params; args are a launch file's", on_key=True)


def _frames(preset: PresetSpec, problems: Problems) -> None:
    known = [preset.mount, *preset.frames]
    for path, name in _named_frames(preset):
        if name not in known:
            advice = did_you_mean(name, known, f"there is {', '.join(known)}")
            problems.refuse("TF606", path, f"{preset.model} has no frame {name}", advice)
    for name in known:
        for word in _HOLE.findall(name):
            if word != "name" and word not in preset.words:
                problems.refuse("TF606", ("words",), f"{name}: no word {word}", "there is {name}, and what words has")
    if preset.mount in preset.frames:
        message = f"{preset.mount} is the mount; where it is, the robot says"
        problems.refuse("TF606", ("frames", preset.mount), message, on_key=True)
    for name in preset.frames:
        above, steps = name, 0
        while above in preset.frames and steps <= len(preset.frames):
            above, steps = preset.frames[above].parent, steps + 1
        if above in preset.frames:
            problems.refuse("TF606", ("frames", name), f"{name} is above itself", on_key=True)


def _named_frames(preset: PresetSpec) -> Iterator[tuple[Path, str]]:
    """Yield each frame that is named somewhere, and where."""
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
    for name, topic in preset.topics.items():
        if not topic.hard_coded:
            yield ("topics", name, "frame"), topic.frame


def _options(preset: PresetSpec, problems: Problems) -> None:
    for name, option in preset.options.items():
        known: tuple[str, ...] = tuple(option.variants) if option.type == "choice" else option.values
        given = option.default if isinstance(option.default, list) else [option.default]
        if option.type in {"choice", "set"}:
            for value in given:
                if value not in known:
                    message = f"the option {name} cannot be {value!r}"
                    problems.refuse("TF606", ("options", name), message, f"one of: {', '.join(known)}", on_key=True)
    for path, condition in _conditions(preset):
        for name, wanted in condition.items():
            _condition(preset, (*path, name), wanted, problems)
    driver = preset.driver
    for section in ("params", "args") if driver else ():
        for name, value in getattr(driver, section).items():
            if isinstance(value, Chosen) and value.option and value.option not in preset.options:
                at = ("driver", section, name)
                advice = did_you_mean(value.option, preset.options)
                problems.refuse("TF606", at, f"{preset.model} has no option {value.option}", advice)


def _condition(preset: PresetSpec, path: Path, wanted: Any, problems: Problems) -> None:
    name = str(path[-1])
    option = preset.options.get(name)
    if option is None and name != "tf":
        advice = did_you_mean(name, [*preset.options, "tf"], "the word tf, or an option")
        problems.refuse("TF606", path, f"{preset.model} has no option {name}", advice, on_key=True)
        return
    known = {"set": option.values, "choice": tuple(option.variants), "bool": (True, False)} if option else {}
    values: tuple[Any, ...] = known.get(option.type, ()) if option else _TF
    for one in wanted if isinstance(wanted, list) else [wanted]:
        if values and one not in values:
            advice = f"one of: {', '.join(map(str, values))}"
            problems.refuse("TF606", path, f"{name} is never {one!r}", advice)


def _conditions(preset: PresetSpec) -> Iterator[tuple[Path, dict[str, Any]]]:
    for name, frame in preset.frames.items():
        yield ("frames", name, "when"), frame.when
    for name, topic in preset.topics.items():
        yield ("topics", name, "when"), topic.when
    driver = preset.driver
    for section in ("params", "args") if driver else ():
        for name, value in getattr(driver, section).items():
            if isinstance(value, Chosen) and value.when:
                yield ("driver", section, name, "when"), value.when
