"""TF503: upper case name."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Robot


def upper_case_name(robot: Robot) -> Iterator[Finding]:
    """A frame's name has upper case letters.

    tf2 tells ``Base_link`` from ``base_link``, people do not: a lookup fails, and the two names look the same. ROS
    names are lower case with underscores, ``left_wheel_link``. Only frames that the file names are judged, not those
    of presets, and all together are one finding; a robot whose vendor's names are upper case says
    ``rules: {TF503: off}``.
    """
    presets = [sensor for sensor in robot.sensors if sensor.name == sensor.name.lower()]
    inside = {frame for sensor in presets for frame in (sensor.mount, *sensor.frames)}
    bad = {name: at for name, at in robot.frames.items() if name != name.lower() and name not in inside}
    if bad:
        first, *others = bad
        known = {name.lower(): name for name in robot.frames if name == name.lower()}
        more = f" and {len(others)} more" if others else ""
        message = f"upper case in the frame name {first}{more}"
        notes = [
            Note(f"{known[name.lower()]} is another frame", at) for name, at in bad.items() if name.lower() in known
        ]
        notes += [Note(f"{name} is one too", bad[name]) for name in others[:SHOWN]]
        yield finding("TF503", message, bad[first], help=_better(first), notes=notes)


SHOWN = 5


def _better(name: str) -> str:
    apart = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    return f"for example {apart}"
