"""Sensors in a URDF: chains of fixed frames whose names and poses are those of a preset.

A preset is recognised by frames inside of it: by one at least whose position, which is not 0, is the vendor's. Where
several presets fit equally well, a generic one is taken, or the one whose name is in the sensor's or in a mesh's; else
none is, and a note asks which it is.
"""

from __future__ import annotations

import itertools
import math
import posixpath
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.findings import RejectedError
from tfcompose.geometry import Pose, angle_between
from tfcompose.resolve.poses import rotation_of
from tfcompose.resolve.presets import TFCOMPOSE, filled, holds

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.language.preset import PresetFrame, PresetSpec
    from tfcompose.model import Edge, Robot
    from tfcompose.resolve.presets import Library

#: As near as a pose must be to a preset's to be taken for it: rotations are often written with -1.57.
NEAR, NEAR_RAD = 1e-6, 2e-3
#: As near as it must be to be left to the preset.
EQUAL = 1e-13
#: Every camera has frames that are turned as optical ones are: that alone names no vendor.
GENERIC = "generic"
_MOST_CHOICES = 256


@dataclass(frozen=True, slots=True)
class Recognised:
    """A sensor that a preset describes: ``mount`` is its edge, ``inside`` the edges to the frames that it brings.

    ``own_xyz`` and ``own_rotation`` are those of its frames whose position, or rotation, is not the preset's to the
    last digit. ``body`` is the frame on which the preset has a body, empty without one; ``driven`` tells whether the
    preset starts a driver.
    """

    name: str
    preset: str
    mount: Edge
    inside: tuple[Edge, ...]
    options: dict[str, Any] = field(default_factory=dict)
    own_xyz: frozenset[str] = frozenset()
    own_rotation: frozenset[str] = frozenset()
    body: str = ""
    driven: bool = False

    @property
    def edges(self) -> tuple[Edge, ...]:
        """All its edges, its mount first."""
        return (self.mount, *self.inside)


@dataclass(frozen=True, slots=True)
class _Fit:
    """One way in which a preset fits; ``usual`` counts the options that are as by default."""

    sensor: Recognised
    usual: int

    @property
    def quality(self) -> tuple[int, int, int]:
        """How well it fits: frames explained, values that are the preset's to the last digit, options by default."""
        own = len(self.sensor.own_xyz) + len(self.sensor.own_rotation)
        return (len(self.sensor.inside), -own, self.usual)


@dataclass(frozen=True, slots=True)
class _Match:
    """A frame of a preset in the robot: its edge, and whether its position and rotation are its own.

    ``tells`` is whether its pose is one that not every sensor has.
    """

    edge: Edge
    own_xyz: bool
    own_rotation: bool
    tells: bool


def recognised(robot: Robot, library: Library, reserved: frozenset[str]) -> tuple[list[Recognised], dict[str, str]]:
    """Return the sensors of the robot, and for each mount where none could be decided on a note with the reason.

    ``reserved`` are words that something else in the source uses: a joint of that name stays a joint.
    """
    fits = sorted(_Search(robot, library, reserved).fits(), key=lambda fit: fit.quality, reverse=True)
    taken: set[str] = set()
    sensors: list[Recognised] = []
    undecided: dict[str, str] = {}
    for fit in fits:
        frames = {edge.child for edge in fit.sensor.edges}
        if frames & taken or any(sensor.name == fit.sensor.name for sensor in sensors):
            continue
        rivals = [one for one in fits if one.quality[:2] == fit.quality[:2] and one.sensor.mount == fit.sensor.mount]
        chosen = _chosen(rivals, fit, robot)
        taken |= frames
        if chosen:
            sensors.append(chosen)
        else:
            several = ", ".join(dict.fromkeys(one.sensor.preset for one in rivals))
            entry = f"sensors: {{{fit.sensor.name}: {{preset: …, parent: {fit.sensor.mount.parent}}}}}"
            undecided[fit.sensor.mount.child] = (
                f"which of these is it? its frames fit several sensors equally well: {several}; then write {entry}, "
                "with its pose, in the place of these frames"
            )
    order = [edge.child for edge in robot.edges]
    return sorted(sensors, key=lambda one: order.index(one.mount.child)), undecided


def _chosen(rivals: list[_Fit], best: _Fit, robot: Robot) -> Recognised | None:
    if len({one.sensor.preset for one in rivals}) == 1:
        return best.sensor
    generic = [one.sensor for one in rivals if one.sensor.preset.startswith(f"{GENERIC}/")]
    named = sorted((one.sensor for one in rivals if _names_model(one.sensor, robot)), key=lambda one: -len(one.preset))
    if named:  # of d435 and d435i, both in a name, the longer one
        return named[0]
    return generic[0] if generic else None


def _names_model(sensor: Recognised, robot: Robot) -> bool:
    """Whether the model's name is in the sensor's, or in that of a mesh on its frames."""
    links = [robot.links[edge.child] for edge in sensor.edges if edge.child in robot.links]
    shapes = [shape for link in links for shape in (*link.visuals, *link.collisions)]
    files = [posixpath.basename(shape.mesh.uri) for shape in shapes if shape.mesh]
    model = _squeezed(sensor.preset.partition("/")[2])
    return any(model in _squeezed(text) for text in (sensor.name, *files))


def _squeezed(text: str) -> str:
    return re.sub("[^a-z0-9]", "", text.lower())


@dataclass(slots=True)
class _Search:
    robot: Robot
    library: Library
    reserved: frozenset[str]
    edges: dict[str, Edge] = field(default_factory=dict)

    def fits(self) -> Iterator[_Fit]:
        """Yield every way in which a preset fits somewhere."""
        fixed = (edge for edge in self.robot.edges if not (edge.joint or edge.free or edge.joint_name in self.reserved))
        self.edges = {edge.child: edge for edge in fixed}
        for name in self.library.names:
            try:
                plain = self.library.get(name)
                for choices in _choices(plain):
                    yield from self._of_preset(name, self.library.get(name, choices), choices)
            except RejectedError:
                continue  # lint reports what is wrong with it

    def _of_preset(self, name: str, preset: PresetSpec, choices: Mapping[str, str]) -> Iterator[_Fit]:
        if not preset.frames:
            return
        pattern = re.escape(filled(preset.mount, "\0", preset.words)).replace(re.escape("\0"), "(.+?)")
        for child, mount in self.edges.items():
            match = re.fullmatch(pattern, child)
            if match and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", match[1]):
                yield from self._at_mount(name, preset, choices, match[1], mount)

    def _at_mount(
        self, name: str, preset: PresetSpec, choices: Mapping[str, str], sensor: str, mount: Edge
    ) -> Iterator[_Fit]:
        matches = {key: self._match(preset, sensor, key, frame) for key, frame in preset.frames.items()}
        if not any(match and match.tells for match in matches.values()):
            return
        for options in _options(preset):
            every = dict(choices) | options
            wanted = [key for key, frame in preset.frames.items() if holds(frame.when, every, TFCOMPOSE)]
            inside = [match for key in wanted if (match := matches[key])]
            if len(inside) < len(wanted) or not any(match.tells for match in inside):
                continue
            given = {key: value for key, value in every.items() if value != preset.options[key].default}
            yield _Fit(
                Recognised(
                    sensor,
                    name,
                    mount,
                    tuple(match.edge for match in inside),
                    given,
                    frozenset(match.edge.child for match in inside if match.own_xyz),
                    frozenset(match.edge.child for match in inside if match.own_rotation),
                    filled(preset.body.frame, sensor, preset.words) if preset.body else "",
                    preset.driver is not None,
                ),
                len(every) - len(given),
            )

    def _match(self, preset: PresetSpec, sensor: str, pattern: str, frame: PresetFrame) -> _Match | None:
        """Return where the robot has a preset's frame, or None where it has none, or another one, of that name."""
        edge = self.edges.get(filled(pattern, sensor, preset.words))
        if edge is None or edge.parent != filled(frame.parent, sensor, preset.words):
            return None
        rotation = rotation_of(frame, pattern)
        unknown = frame.xyz is None and rotation is None
        nominal = Pose(frame.xyz or edge.pose.xyz, rotation or (edge.pose if unknown else Pose()).quat_xyzw)
        far, twist = math.dist(nominal.xyz, edge.pose.xyz), angle_between(nominal.quat_xyzw, edge.pose.quat_xyzw)
        if far > NEAR or twist > NEAR_RAD:
            return None
        rotates = rotation is not None and rotation != Pose().quat_xyzw
        tells = (frame.xyz is not None and any(frame.xyz)) or (preset.vendor == GENERIC and rotates)
        return _Match(edge, frame.xyz is None or far > EQUAL, unknown or twist > EQUAL, tells)


def _choices(preset: PresetSpec) -> Iterator[dict[str, str]]:
    """Yield the values that the preset's choices can have."""
    several = {key: list(option.variants) for key, option in preset.options.items() if option.type == "choice"}
    for values in itertools.islice(itertools.product(*several.values()), _MOST_CHOICES):
        yield dict(zip(several, values, strict=True))


def _options(preset: PresetSpec) -> Iterator[dict[str, Any]]:
    """Yield the values that its other options can have, of which only those matter that frames depend on."""
    used = {option for frame in preset.frames.values() for option in frame.when}
    several: dict[str, list[Any]] = {}
    for key, option in preset.options.items():
        if option.type == "bool":
            several[key] = [False, True] if key in used else [option.default]
        elif option.type == "set":
            several[key] = [*_subsets(option.values)] if key in used else [option.default]
    for values in itertools.islice(itertools.product(*several.values()), 4 * _MOST_CHOICES):
        yield dict(zip(several, values, strict=True))


def _subsets(values: tuple[str, ...]) -> Iterator[list[str]]:
    for count in range(1, len(values) + 1):
        for some in itertools.combinations(values, count):
            yield list(some)
