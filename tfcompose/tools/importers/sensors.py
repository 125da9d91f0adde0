"""Sensors in a URDF: chains of fixed frames with the names and poses of a preset.

At least one inner frame identifies a preset: its position is the vendor's and not 0. If frames
have other names, a frame or mesh name must contain the model's name as well. If several presets
fit equally well, the generic one is used, or the one whose model is named. Otherwise none is used,
and a note asks which it is, as it does if only a vendor's name was found.
"""

from __future__ import annotations

import difflib
import itertools
import math
import posixpath
import re
from dataclasses import dataclass, field
from operator import itemgetter
from typing import TYPE_CHECKING, Any, get_args

from tfcompose.compiler.resolve.poses import rotation_of
from tfcompose.compiler.resolve.presets import DRIVER, TFCOMPOSE, fill_name, holds
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.geometry import Pose, angle_between
from tfcompose.foundation.text import list_names
from tfcompose.spec.language.pose import ROTATIONS
from tfcompose.spec.language.preset import SensorKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from tfcompose.compiler.resolve.presets import Library
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.language.preset import PresetFrame, PresetSpec

#: As near as a pose must be to a preset's to be taken for it: rotations are often written with
#: -1.57.
NEAR, NEAR_RAD = 1e-6, 2e-3
#: As near as it must be to be left to the preset.
EQUAL = 1e-13
#: As far as a nominal frame of a device that was calibrated may be from it, where the driver
#: publishes it.
CALIBRATED, CALIBRATED_RAD = 0.02, 0.06
#: Every camera has frames that are turned as optical ones are: that alone names no vendor.
GENERIC = "generic"
_MOST_CHOICES = 256
_MOST_NAMED = 8


@dataclass(frozen=True, slots=True)
class Recognised:
    """A sensor that a preset describes."""

    name: str
    preset: str
    #: The edge to the sensor.
    mount: Edge
    #: The edges to the sensor's inner frames.
    inside: tuple[Edge, ...]
    options: dict[str, Any] = field(default_factory=dict)
    #: Frames whose position differs from the preset's.
    own_xyz: frozenset[str] = frozenset()
    #: Frames whose rotation differs from the preset's.
    own_rotation: frozenset[str] = frozenset()
    #: The frame on which the preset has a body; empty if it has none.
    body: str = ""
    #: Whether the preset starts a driver.
    driven: bool = False
    #: The preset's names of frames that have other names here.
    names: dict[str, str] = field(default_factory=dict)
    #: Frames that the driver can publish.
    sent: frozenset[str] = frozenset()

    @property
    def edges(self) -> tuple[Edge, ...]:
        """All its edges, its mount first."""
        return (self.mount, *self.inside)


@dataclass(frozen=True, slots=True)
class _Fit:
    """One way in which a preset fits."""

    sensor: Recognised
    #: The number of options that have their defaults.
    usual: int

    @property
    def quality(self) -> tuple[int, int, int, int]:
        """How well a preset fits: frames, names and values to the last digit, defaults."""
        own = len(self.sensor.own_xyz) + len(self.sensor.own_rotation)
        return (len(self.sensor.inside), -len(self.sensor.names), -own, self.usual)


@dataclass(frozen=True, slots=True)
class _FrameMatch:
    """A preset's frame found in the robot."""

    edge: Edge
    #: Whether the position differs from the preset's.
    own_xyz: bool
    #: Whether the rotation differs from the preset's.
    own_rotation: bool
    #: Whether the pose identifies the sensor: few other sensors have it.
    tells: bool


def recognise(
    robot: Robot, library: Library, publisher: str = TFCOMPOSE
) -> tuple[list[Recognised], dict[str, str]]:
    """Return the sensors, and a note for each undecided mount.

    ``publisher``: look for frames as tfcompose publishes them, or as drivers do.
    """
    search = _Search(robot, library, publisher)
    fits = sorted(search.fits(), key=lambda fit: fit.quality, reverse=True)
    used_frames: set[str] = set()
    sensors: list[Recognised] = []
    undecided: dict[str, str] = {}
    for fit in fits:
        frames = {edge.child for edge in fit.sensor.edges}
        if frames & used_frames or any(sensor.name == fit.sensor.name for sensor in sensors):
            continue
        rivals = [
            rival
            for rival in fits
            if rival.quality[:3] == fit.quality[:3] and rival.sensor.mount == fit.sensor.mount
        ]
        chosen = search.choose(rivals)
        used_frames |= frames
        if chosen:
            sensors.append(chosen)
        else:
            presets = search.other_model(fit.sensor) or [rival.sensor.preset for rival in rivals]
            undecided[fit.sensor.mount.child] = _question(
                fit.sensor.name, fit.sensor.mount, presets
            )
    used_frames |= {above for frame in used_frames for above in search.above(frame)}
    for mount, presets in search.edges_naming_presets():
        if mount.child not in used_frames:
            undecided[mount.child] = _question(_sensor_name(mount.child), mount, presets)
            used_frames |= {mount.child, *search.below(mount.child), *search.above(mount.child)}
    order = [edge.child for edge in robot.edges]
    return sorted(sensors, key=lambda sensor: order.index(sensor.mount.child)), undecided


def _question(name: str, mount: Edge, presets: list[str]) -> str:
    first, *more = dict.fromkeys(presets)
    what = (
        f"is it one of {list_names([first, *more], _MOST_NAMED)}?" if more else f"is it {first}?"
    )
    entry = f"sensors: {{{name}: {{preset: {'…' if more else first}, parent: {mount.parent}}}}}"
    return f"{what} If so, write {entry}, with its pose, in the place of these frames"


#: Suffixes of a sensor's name in the name of its mount frame.
_MOUNTS = re.compile(r"(?<=.)_(?:(?:base|camera|mount)_)?(?:link|frame|mount|base|center)$")


def _sensor_name(mount: str) -> str:
    """Return what a sensor is called whose mount is not called as its preset has it."""
    return re.sub(r"\W+", "_", _MOUNTS.sub("", mount)).strip("_") or "sensor"


def _words(*texts: str) -> frozenset[str]:
    """Return the words of some names, each also joined to its neighbours.

    Of ``VLP-16_base`` also ``vlp16``.
    """
    joined: set[str] = set()
    for text in texts:
        tokens = re.findall("[a-z0-9]+", text.lower())
        joined |= {
            "".join(tokens[begin:end])
            for end in range(len(tokens) + 1)
            for begin in range(max(end - 3, 0), end)
        }
    return frozenset(joined)


@dataclass(slots=True)
class _Search:
    robot: Robot
    library: Library
    publisher: str = TFCOMPOSE
    edges: dict[str, Edge] = field(default_factory=dict)
    _children: dict[str, list[Edge]] = field(default_factory=dict)
    _words_at: dict[str, frozenset[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.edges = {
            edge.child: edge for edge in self.robot.edges if not (edge.joint or edge.free)
        }
        for edge in self.edges.values():
            self._children.setdefault(edge.parent, []).append(edge)

    def fits(self) -> Iterator[_Fit]:
        """Yield every way in which a preset fits somewhere."""
        for name in self.library.names:
            try:
                plain = self.library.get(name)
                for choices in _choices(plain):
                    yield from self._of_preset(name, self.library.get(name, choices), choices)
            except RejectedError:
                continue  # lint reports what is wrong with it

    def choose(self, rivals: list[_Fit]) -> Recognised | None:
        """Return the equally good fit that other facts single out, or None."""
        rivals = [rival for rival in rivals if not self.other_model(rival.sensor)]
        if not rivals:
            return None
        if len({rival.sensor.preset for rival in rivals}) == 1:
            return rivals[0].sensor
        generic = [
            rival.sensor for rival in rivals if rival.sensor.preset.startswith(f"{GENERIC}/")
        ]
        named = [
            rival.sensor
            for rival in rivals
            if self._is_named(rival.sensor.preset, rival.sensor.edges)
        ]
        longest = max(
            (len(_model(candidate.preset)) for candidate in named), default=0
        )  # of oak-d and oak-d-pro, the longer one
        named = [candidate for candidate in named if len(_model(candidate.preset)) == longest]
        if len({candidate.preset for candidate in named}) == 1:
            return named[0]
        return generic[0] if generic and not named else None

    def edges_naming_presets(self) -> list[tuple[Edge, list[str]]]:
        """Return the edges whose frame, or a mesh on it, names presets, with these.

        The most exact names first.

        It may be a model, or else a family, or else a vendor.
        """
        found: list[tuple[int, Edge, list[str]]] = []
        for rank, naming in enumerate((_model, _family, _vendor)):
            presets: dict[str, list[str]] = {}
            for name in self.library.names:
                presets.setdefault(naming(name), []).append(name)
            for edge in self.edges.values():
                token = max(
                    (self._words_of(edge.child) & presets.keys()) - {""}, key=len, default=""
                )
                if token:
                    found.append((100 * rank - len(token), edge, presets[token]))
        return [(edge, presets) for _, edge, presets in sorted(found, key=itemgetter(0))]

    def other_model(self, sensor: Recognised) -> list[str]:
        """Return the presets named at the frames, if none of them is the sensor's.

        The mesh of a D435i may be that of a D435.
        """
        tokens = frozenset().union(*(self._words_of(edge.child) for edge in sensor.edges))
        named = {name: model for name in self.library.names if (model := _model(name)) in tokens}
        parts = {
            model
            for model in named.values()
            for more in named.values()
            if more.startswith(model) and more != model
        }
        exact = {*named.values()} - parts  # of zedx and zedxone4k, the latter
        own = _model(sensor.preset)
        if not own or any(own.startswith(name) for name in exact):
            return []
        return [name for name, model in named.items() if model in exact]

    def above(self, frame: str) -> Iterator[str]:
        """Yield the frames that a frame is fixed to, the nearest first."""
        known = {frame}
        while frame in self.edges and (frame := self.edges[frame].parent) not in known:
            known.add(frame)
            yield frame

    def below(self, frame: str) -> Iterator[str]:
        """Yield the frames that are fixed to a frame, and to these."""
        waiting, known = [frame], {frame}
        while waiting:
            for edge in self._children.get(waiting.pop(), ()):
                if edge.child not in known:
                    known.add(edge.child)
                    waiting.append(edge.child)
                    yield edge.child

    def _is_named(self, preset: str, edges: Iterable[Edge]) -> bool:
        return any(_model(preset) in self._words_of(edge.child) for edge in edges)

    def _words_of(self, frame: str) -> frozenset[str]:
        """Return the words of a frame's name and of the files on it."""
        if frame not in self._words_at:
            link = self.robot.links.get(frame)
            shapes = (*link.visuals, *link.collisions) if link else ()
            files = [posixpath.basename(shape.mesh.uri) for shape in shapes if shape.mesh]
            self._words_at[frame] = _words(frame, *files)
        return self._words_at[frame]

    def _of_preset(
        self, name: str, preset: PresetSpec, choices: Mapping[str, str]
    ) -> Iterator[_Fit]:
        if not preset.frames:
            return
        pattern = re.escape(fill_name(preset.mount, "\0", preset.words)).replace(
            re.escape("\0"), "(.+?)"
        )
        for child, mount in self.edges.items():
            match = re.fullmatch(pattern, child)
            if match and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", match[1]):
                yield from self._at_mount(name, preset, choices, match[1], mount)
            if self._is_named(name, (mount, *self._children.get(child, ()))):
                yield from self._at_mount(
                    name, preset, choices, _sensor_name(child), mount, has_own_names=True
                )

    def _at_mount(  # noqa: PLR0913 (a preset with what is decided of it, and a place)
        self,
        name: str,
        preset: PresetSpec,
        choices: Mapping[str, str],
        sensor: str,
        mount: Edge,
        *,
        has_own_names: bool = False,
    ) -> Iterator[_Fit]:
        own_mount = fill_name(preset.mount, sensor, preset.words)
        for options in _options(preset):
            every = dict(choices) | options
            wanted = {
                key: self._as_sent(frame)
                for key, frame in preset.frames.items()
                if holds(frame.when, every, self.publisher)
            }
            if self.publisher == DRIVER and not any(frame.driver for frame in wanted.values()):
                continue
            names = {own_mount: mount.child} if has_own_names else {}
            found = self._match_frames(preset, sensor, wanted, names, has_own_names=has_own_names)
            inside = found.values()
            if len(found) < len(wanted) or not any(match.tells for match in inside):
                continue
            changed_options = {
                key: value for key, value in every.items() if value != preset.options[key].default
            }
            body = fill_name(preset.body.frame, sensor, preset.words) if preset.body else ""
            yield _Fit(
                Recognised(
                    sensor,
                    name,
                    mount,
                    inside=tuple(match.edge for match in inside),
                    options=changed_options,
                    own_xyz=frozenset(match.edge.child for match in inside if match.own_xyz),
                    own_rotation=frozenset(
                        match.edge.child for match in inside if match.own_rotation
                    ),
                    body=names.get(body, body),
                    driven=preset.driver is not None,
                    names={there: own for own, there in names.items() if there != own},
                    sent=frozenset(
                        match.edge.child for key, match in found.items() if wanted[key].driver
                    ),
                ),
                len(every) - len(changed_options),
            )

    def _as_sent(self, frame: PresetFrame) -> PresetFrame:
        """Return the frame as its publisher sends it.

        A driver may have another parent or pose for it.
        """
        if self.publisher != DRIVER or frame.by_driver is None:
            return frame
        own = frame.by_driver
        turned = (
            {key: getattr(own, key) for key in ROTATIONS} if rotation_of(own) is not None else {}
        )
        at = {"xyz": own.xyz} if own.xyz is not None else {}
        return frame.model_copy(update={"parent": own.parent, **at, **turned})

    def _match_frames(
        self,
        preset: PresetSpec,
        sensor: str,
        wanted: Mapping[str, PresetFrame],
        names: dict[str, str],
        *,
        has_own_names: bool,
    ) -> dict[str, _FrameMatch]:
        """Return where the robot has the preset's frames.

        ``names`` gets those that they have in the robot.
        """
        found: dict[str, _FrameMatch] = {}
        waiting = dict(wanted)
        while waiting:
            ready = [key for key, match in waiting.items() if match.parent not in waiting]
            for key in ready or list(waiting):
                frame = waiting.pop(key)
                own, parent = (
                    fill_name(key, sensor, preset.words),
                    fill_name(frame.parent, sensor, preset.words),
                )
                edges = [self.edges[own]] if own in self.edges else []
                if has_own_names:
                    edges = self._by_likeness(own, names.get(parent, parent), set(names.values()))
                edges = [edge for edge in edges if edge.parent == names.get(parent, parent)]
                match = next(
                    (match for edge in edges if (match := self._match(preset, edge, key, frame))),
                    None,
                )
                if match is None:
                    return {}
                found[key] = match
                names[own] = match.edge.child
        return found

    def _by_likeness(self, name: str, parent: str, used_frames: set[str]) -> list[Edge]:
        """Return the edges from a parent, those to frames of the most similar names first."""
        edges = [edge for edge in self._children.get(parent, ()) if edge.child not in used_frames]
        return sorted(
            edges, key=lambda edge: -difflib.SequenceMatcher(None, name, edge.child).ratio()
        )

    def _match(
        self, preset: PresetSpec, edge: Edge, pattern: str, frame: PresetFrame
    ) -> _FrameMatch | None:
        """Return the edge as that of a preset's frame, or None where it is another one."""
        rotation = rotation_of(frame, pattern)
        unknown = frame.xyz is None and rotation is None
        nominal = Pose(
            frame.xyz or edge.pose.xyz, rotation or (edge.pose if unknown else Pose()).quat_xyzw
        )
        far, twist = (
            math.dist(nominal.xyz, edge.pose.xyz),
            angle_between(nominal.quat_xyzw, edge.pose.quat_xyzw),
        )
        is_calibrated = self.publisher == DRIVER and frame.nominal
        most, most_rad = (CALIBRATED, CALIBRATED_RAD) if is_calibrated else (NEAR, NEAR_RAD)
        if far > most or twist > most_rad:
            return None
        rotates = rotation is not None and rotation != Pose().quat_xyzw
        tells = (frame.xyz is not None and any(frame.xyz)) or (
            preset.vendor == GENERIC and rotates
        )
        return _FrameMatch(edge, frame.xyz is None or far > EQUAL, unknown or twist > EQUAL, tells)


#: Kinds of sensors, which name no model.
_KINDS = frozenset(get_args(SensorKind))
_SHORTEST = 3


def _naming(text: str, preset: str) -> str:
    """Return the words as one that names a preset, or nothing where they may be about anything."""
    compact = re.sub("[^a-z0-9]", "", text.lower())
    return (
        ""
        if len(compact) < _SHORTEST or compact in _KINDS or preset.startswith(f"{GENERIC}/")
        else compact
    )


def _model(preset: str) -> str:
    return _naming(preset.partition("/")[2], preset)


def _family(preset: str) -> str:
    family, dash, _ = preset.partition("/")[2].partition("-")
    return _naming(family, preset) if dash else ""


def _vendor(preset: str) -> str:
    return _naming(preset.partition("/")[0], preset)


def _choices(preset: PresetSpec) -> Iterator[dict[str, str]]:
    """Yield the values that the preset's choices can have."""
    choices = {
        key: list(option.variants)
        for key, option in preset.options.items()
        if option.type == "choice"
    }
    for values in itertools.islice(itertools.product(*choices.values()), _MOST_CHOICES):
        yield dict(zip(choices, values, strict=True))


def _options(preset: PresetSpec) -> Iterator[dict[str, Any]]:
    """Yield the values of other options that change the frames."""
    used = {option for frame in preset.frames.values() for option in frame.when}
    options: dict[str, list[Any]] = {}
    for key, option in preset.options.items():
        if option.type == "bool":
            options[key] = [False, True] if key in used else [option.default]
        elif option.type == "set":
            options[key] = [*_subsets(option.values)] if key in used else [option.default]
    for values in itertools.islice(itertools.product(*options.values()), 4 * _MOST_CHOICES):
        yield dict(zip(options, values, strict=True))


def _subsets(values: tuple[str, ...]) -> Iterator[list[str]]:
    for count in range(1, len(values) + 1):
        for some in itertools.combinations(values, count):
            yield list(some)
