"""Recognition of sensors in a URDF by the names and poses of fixed frames.

A preset fits if the robot has its frames at the preset's poses. At least one of these frames,
inside the sensor, must have a position other than 0 that the vendor states. If the frames have
other names than in the preset, the name of a frame or mesh must also contain the model's name. If
several presets fit equally well, the generic preset is used, or the preset whose model is named.
If this does not decide, no preset is used, and a note in the robot file asks for the model. The
same note appears if only a vendor's name is found.
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

#: The largest distances, in m and rad, at which a pose matches a preset's pose. The angle is
#: larger than rounding errors, because URDFs often contain -1.57.
NEAR, NEAR_RAD = 1e-6, 2e-3
#: The largest difference at which the robot file omits the pose, because the preset has it.
EQUAL = 1e-13
#: The largest distances, in m and rad, at which a frame matches a nominal pose, if a driver
#: publishes the frame with the calibration of its device.
CALIBRATED, CALIBRATED_RAD = 0.02, 0.06
#: The vendor of generic presets. They do not identify a vendor, because every camera has optical
#: frames.
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
    """A match of a preset with frames of the robot."""

    sensor: Recognised
    #: The number of options with default values.
    usual: int

    @property
    def quality(self) -> tuple[int, int, int, int]:
        """The numbers of frames, equal names, exact values and defaults, to compare matches."""
        count = len(self.sensor.own_xyz) + len(self.sensor.own_rotation)
        return (len(self.sensor.inside), -len(self.sensor.names), -count, self.usual)


@dataclass(frozen=True, slots=True)
class _FrameMatch:
    """A frame of the robot that matches a frame of a preset."""

    edge: Edge
    #: Whether the position differs from the preset's.
    own_xyz: bool
    #: Whether the rotation differs from the preset's.
    own_rotation: bool
    #: Whether the pose identifies the sensor, because few other sensors have such a pose.
    tells: bool


def recognise(
    robot: Robot, library: Library, publisher: str = TFCOMPOSE
) -> tuple[list[Recognised], dict[str, str]]:
    """Return the sensors, and a note for each undecided mount.

    ``publisher`` is tfcompose or the driver. It decides if the frames of a preset have their
    nominal poses or the poses that the driver publishes.
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
    """Return a name for a sensor from the name of its mount, if this has no name of the preset."""
    return re.sub(r"\W+", "_", _MOUNTS.sub("", mount)).strip("_") or "sensor"


def _words(*texts: str) -> frozenset[str]:
    """Return the words in some names, and each word joined to its neighbours.

    For ``VLP-16_base``, one of them is ``vlp16``.
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
        """Yield every match of a preset with frames of the robot."""
        for name in self.library.names:
            try:
                plain = self.library.get(name)
                for choices in _choices(plain):
                    yield from self._of_preset(name, self.library.get(name, choices), choices)
            except RejectedError:
                continue  # lint reports the error in the preset

    def choose(self, rivals: list[_Fit]) -> Recognised | None:
        """Choose among equally good matches by names of models.

        If names do not decide, return a generic preset's match, or None.
        """
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
        )  # if both oak-d and oak-d-pro are named, the longer name
        named = [candidate for candidate in named if len(_model(candidate.preset)) == longest]
        if len({candidate.preset for candidate in named}) == 1:
            return named[0]
        return generic[0] if generic and not named else None

    def edges_naming_presets(self) -> list[tuple[Edge, list[str]]]:
        """Return the edges whose frame or mesh has a preset's name, with the names of the presets.

        The most exact names come first. A name is a model or, if there is none, a family or a
        vendor.
        """
        matches: list[tuple[int, Edge, list[str]]] = []
        for rank, naming in enumerate((_model, _family, _vendor)):
            presets: dict[str, list[str]] = {}
            for name in self.library.names:
                presets.setdefault(naming(name), []).append(name)
            for edge in self.edges.values():
                token = max(
                    (self._words_of(edge.child) & presets.keys()) - {""}, key=len, default=""
                )
                if token:
                    matches.append((100 * rank - len(token), edge, presets[token]))
        return [(edge, presets) for _, edge, presets in sorted(matches, key=itemgetter(0))]

    def other_model(self, sensor: Recognised) -> list[str]:
        """Return the presets that names of frames and meshes contain, if the sensor's is not one.

        A D435i may have the mesh of a D435.
        """
        tokens = frozenset().union(*(self._words_of(edge.child) for edge in sensor.edges))
        named = {name: model for name in self.library.names if (model := _model(name)) in tokens}
        parts = {
            model
            for model in named.values()
            for more in named.values()
            if more.startswith(model) and more != model
        }
        exact = {*named.values()} - parts  # if both zedx and zedxone4k are named, the latter
        model_of_sensor = _model(sensor.preset)
        if not model_of_sensor or any(model_of_sensor.startswith(name) for name in exact):
            return []
        return [name for name, model in named.items() if model in exact]

    def above(self, frame: str) -> Iterator[str]:
        """Yield the frames above a frame that are fixed to it, the nearest first."""
        frames = {frame}
        while frame in self.edges and (frame := self.edges[frame].parent) not in frames:
            frames.add(frame)
            yield frame

    def below(self, frame: str) -> Iterator[str]:
        """Yield all frames below a frame that are fixed to it."""
        waiting, visited = [frame], {frame}
        while waiting:
            for edge in self._children.get(waiting.pop(), ()):
                if edge.child not in visited:
                    visited.add(edge.child)
                    waiting.append(edge.child)
                    yield edge.child

    def _is_named(self, preset: str, edges: Iterable[Edge]) -> bool:
        return any(_model(preset) in self._words_of(edge.child) for edge in edges)

    def _words_of(self, frame: str) -> frozenset[str]:
        """Return the words in the name of a frame and in the names of its meshes."""
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
            preset_frames = {
                key: self._as_sent(frame)
                for key, frame in preset.frames.items()
                if holds(frame.when, every, self.publisher)
            }
            if self.publisher == DRIVER and not any(
                frame.driver for frame in preset_frames.values()
            ):
                continue
            names = {own_mount: mount.child} if has_own_names else {}
            matches = self._match_frames(
                preset, sensor, preset_frames, names, has_own_names=has_own_names
            )
            inside = matches.values()
            if len(matches) < len(preset_frames) or not any(match.tells for match in inside):
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
                    names={
                        preset_name: name
                        for name, preset_name in names.items()
                        if preset_name != name
                    },
                    sent=frozenset(
                        match.edge.child
                        for key, match in matches.items()
                        if preset_frames[key].driver
                    ),
                ),
                len(every) - len(changed_options),
            )

    def _as_sent(self, frame: PresetFrame) -> PresetFrame:
        """Return a preset's frame with the parent and the pose that its publisher sends.

        A driver may send another parent or pose.
        """
        if self.publisher != DRIVER or frame.by_driver is None:
            return frame
        by_driver = frame.by_driver
        turned = (
            {key: getattr(by_driver, key) for key in ROTATIONS}
            if rotation_of(by_driver) is not None
            else {}
        )
        position = {"xyz": by_driver.xyz} if by_driver.xyz is not None else {}
        return frame.model_copy(update={"parent": by_driver.parent, **position, **turned})

    def _match_frames(
        self,
        preset: PresetSpec,
        sensor: str,
        preset_frames: Mapping[str, PresetFrame],
        names: dict[str, str],
        *,
        has_own_names: bool,
    ) -> dict[str, _FrameMatch]:
        """Return the robot's frames that match the preset's frames.

        The names of these frames in the robot are added to ``names``.
        """
        matches: dict[str, _FrameMatch] = {}
        waiting = dict(preset_frames)
        while waiting:
            ready = [key for key, match in waiting.items() if match.parent not in waiting]
            for key in ready or list(waiting):
                frame = waiting.pop(key)
                name, parent = (
                    fill_name(key, sensor, preset.words),
                    fill_name(frame.parent, sensor, preset.words),
                )
                edges = [self.edges[name]] if name in self.edges else []
                if has_own_names:
                    edges = self._by_likeness(name, names.get(parent, parent), set(names.values()))
                edges = [edge for edge in edges if edge.parent == names.get(parent, parent)]
                match = next(
                    (match for edge in edges if (match := self._match(preset, edge, key, frame))),
                    None,
                )
                if match is None:
                    return {}
                matches[key] = match
                names[name] = match.edge.child
        return matches

    def _by_likeness(self, name: str, parent: str, used_frames: set[str]) -> list[Edge]:
        """Return the edges from a parent; frames with the most similar names come first."""
        edges = [edge for edge in self._children.get(parent, ()) if edge.child not in used_frames]
        return sorted(
            edges, key=lambda edge: -difflib.SequenceMatcher(None, name, edge.child).ratio()
        )

    def _match(
        self, preset: PresetSpec, edge: Edge, pattern: str, frame: PresetFrame
    ) -> _FrameMatch | None:
        """Return the match of an edge with a preset's frame, or None if they do not match."""
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


#: Kinds of sensors. Such a word in a name does not identify a model.
_KINDS = frozenset(get_args(SensorKind))
_SHORTEST = 3


def _naming(text: str, preset: str) -> str:
    """Return the text as a single word that can identify a preset; empty if it is too general."""
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
    """Yield each combination of values of the preset's choices."""
    choices = {
        key: list(option.variants)
        for key, option in preset.options.items()
        if option.type == "choice"
    }
    for values in itertools.islice(itertools.product(*choices.values()), _MOST_CHOICES):
        yield dict(zip(choices, values, strict=True))


def _options(preset: PresetSpec) -> Iterator[dict[str, Any]]:
    """Yield each combination of values of other options that change the frames."""
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
