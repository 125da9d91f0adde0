"""Sensors in somebody else's robot: chains of fixed frames whose names and poses are those of a preset.

A preset is recognised by frames inside of it: by one at least whose position, which is not 0, is the vendor's. Where
several presets fit equally well, a generic one is taken, or the one whose name is in the sensor's; else none is, and a
note says so.
"""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.findings import RejectedError
from tfcompose.geometry import Pose, angle_between
from tfcompose.imported import Recognised
from tfcompose.resolve.poses import rotation_of
from tfcompose.resolve.presets import TFCOMPOSE, filled, holds

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.language.preset import PresetFrame, PresetSpec
    from tfcompose.model import Edge, Robot
    from tfcompose.resolve.presets import Library

#: As near (m, rad) as a pose must be to a preset's to be taken for it.
NEAR = 1e-6
#: As near as it must be for the preset's to be written in its stead.
EQUAL = 1e-13
#: Every camera has frames that are turned as optical ones are: that alone names no vendor.
GENERIC = "generic"
_MOST_CHOICES = 256


@dataclass(frozen=True, slots=True)
class _Fit:
    """One way in which a preset fits; ``usual`` counts the options that are as by default."""

    found: Recognised
    usual: int

    @property
    def good(self) -> tuple[int, int, int]:
        """How well it fits: frames explained, values that are the preset's to the last digit, options by default."""
        own = len(self.found.own_xyz) + len(self.found.own_turn)
        return (len(self.found.inside), -own, self.usual)


def recognised(robot: Robot, library: Library, named: frozenset[str]) -> tuple[list[Recognised], dict[str, str]]:
    """Return the sensors of the robot, and for each mount where none could be decided on a note that says why.

    ``named`` are words that something else in the source uses: a joint of that name stays a joint.
    """
    fits = sorted(_Search(robot, library, named).all(), key=lambda fit: fit.good, reverse=True)
    taken: set[str] = set()
    sensors: list[Recognised] = []
    undecided: dict[str, str] = {}
    for fit in fits:
        frames = {edge.child for edge in (fit.found.mount, *fit.found.inside)}
        if frames & taken or any(sensor.name == fit.found.name for sensor in sensors):
            continue
        rivals = [one for one in fits if one.good[:2] == fit.good[:2] and one.found.mount == fit.found.mount]
        chosen = _chosen(rivals, fit)
        taken |= frames
        if chosen:
            sensors.append(chosen)
        else:
            several = ", ".join(dict.fromkeys(one.found.preset for one in rivals))
            undecided[fit.found.mount.child] = f"a sensor, by its frames: {several} fit equally well"
    order = [edge.child for edge in robot.edges]
    return sorted(sensors, key=lambda one: order.index(one.mount.child)), undecided


def _chosen(rivals: list[_Fit], best: _Fit) -> Recognised | None:
    if len({one.found.preset for one in rivals}) == 1:
        return best.found
    generic = [one.found for one in rivals if one.found.preset.startswith("generic/")]
    named = sorted((one.found for one in rivals if _says(one.found)), key=lambda one: -len(one.preset))
    if named:  # of d435 and d435i, both in a name, the longer one
        return named[0]
    return generic[0] if generic else None


def _says(found: Recognised) -> bool:
    """Whether the sensor's name says which model it is."""
    name = re.sub("[^a-z0-9]", "", found.name.lower())
    return re.sub("[^a-z0-9]", "", found.preset.partition("/")[2].lower()) in name


@dataclass(slots=True)
class _Search:
    robot: Robot
    library: Library
    named: frozenset[str]
    edges: dict[str, Edge] = field(default_factory=dict)

    def all(self) -> Iterator[_Fit]:
        """Yield every way in which a preset fits somewhere."""
        fixed = (edge for edge in self.robot.edges if not (edge.joint or edge.free or edge.joint_name in self.named))
        self.edges = {edge.child: edge for edge in fixed}
        for name in self.library.names:
            try:
                plain = self.library.get(name)
                for choices in _choices(plain):
                    yield from self._fits(name, self.library.get(name, choices), choices)
            except RejectedError:
                continue  # its own lint says what is wrong with it

    def _fits(self, name: str, preset: PresetSpec, choices: Mapping[str, str]) -> Iterator[_Fit]:
        if not preset.frames:
            return
        pattern = re.escape(filled(preset.mount, "\0", preset.words)).replace(re.escape("\0"), "(.+?)")
        for child, mount in self.edges.items():
            match = re.fullmatch(pattern, child)
            if match and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", match[1]):
                yield from self._at(name, preset, choices, match[1], mount)

    def _at(
        self, name: str, preset: PresetSpec, choices: Mapping[str, str], sensor: str, mount: Edge
    ) -> Iterator[_Fit]:
        matched = {key: self._match(preset, sensor, key, frame) for key, frame in preset.frames.items()}
        if not any(fit and fit[3] for fit in matched.values()):
            return
        for options in _options(preset, matched):
            whole = dict(choices) | options
            wanted = [key for key, frame in preset.frames.items() if holds(frame.when, whole, TFCOMPOSE)]
            fits = [matched[key] for key in wanted]
            if not fits or not any(fit and fit[3] for fit in fits) or not all(fits):
                continue
            inside = [fit for fit in fits if fit]
            given = {key: value for key, value in whole.items() if value != preset.options[key].default}
            yield _Fit(
                Recognised(
                    sensor,
                    name,
                    mount,
                    tuple(fit[0] for fit in inside),
                    given,
                    frozenset(fit[0].child for fit in inside if fit[1]),
                    frozenset(fit[0].child for fit in inside if fit[2]),
                    filled(preset.body.frame, sensor, preset.words) if preset.body else "",
                    preset.driver is not None,
                ),
                len(whole) - len(given),
            )

    def _match(
        self, preset: PresetSpec, sensor: str, pattern: str, frame: PresetFrame
    ) -> tuple[Edge, bool, bool, bool] | None:
        """Return the edge of a preset's frame, whether position and rotation are its own, and whether it says much."""
        edge = self.edges.get(filled(pattern, sensor, preset.words))
        if edge is None or edge.parent != filled(frame.parent, sensor, preset.words):
            return None
        turned = rotation_of(frame, pattern)
        unknown = frame.xyz is None and turned is None
        nominal = Pose(frame.xyz or edge.pose.xyz, turned or (edge.pose if unknown else Pose()).quat_xyzw)
        far, twist = math.dist(nominal.xyz, edge.pose.xyz), angle_between(nominal.quat_xyzw, edge.pose.quat_xyzw)
        if far > NEAR or twist > NEAR:
            return None
        turns = turned is not None and turned != Pose().quat_xyzw
        says = (frame.xyz is not None and any(frame.xyz)) or (preset.vendor == GENERIC and turns)
        return edge, frame.xyz is None or far > EQUAL, unknown or twist > EQUAL, says


def _choices(preset: PresetSpec) -> Iterator[dict[str, str]]:
    """Yield the values that the preset's choices can have."""
    several = {key: list(option.variants) for key, option in preset.options.items() if option.type == "choice"}
    for values in itertools.islice(itertools.product(*several.values()), _MOST_CHOICES):
        yield dict(zip(several, values, strict=True))


def _options(preset: PresetSpec, matched: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the values that its other options can have, of which only those matter that frames depend on."""
    asked = {option for key in matched for option in preset.frames[key].when}
    several: dict[str, list[Any]] = {}
    for key, option in preset.options.items():
        if option.type == "bool":
            several[key] = [False, True] if key in asked else [option.default]
        elif option.type == "set":
            several[key] = [*_subsets(option.values)] if key in asked else [option.default]
    for values in itertools.islice(itertools.product(*several.values()), 4 * _MOST_CHOICES):
        yield dict(zip(several, values, strict=True))


def _subsets(values: tuple[str, ...]) -> Iterator[list[str]]:
    for count in range(1, len(values) + 1):
        for some in itertools.combinations(values, count):
            yield list(some)
