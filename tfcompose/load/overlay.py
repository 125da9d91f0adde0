"""Overlays: a base robot with profiles laid over it.

Mappings merge; scalars and lists replace; ``null`` in an overlay removes the key, and its default returns. Where a
mapping holds one choice out of several keys (how a process runs, how a rotation is written), setting one in an overlay
drops the others.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, Note, RejectedError, did_you_mean, finding
from tfcompose.load.source import Path, Source

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ROTATIONS = frozenset({"rpy", "quat_xyzw", "axis_angle", "matrix", "look"})
RUNNING = frozenset({"run", "simulate", "external"})
COMMANDS = (
    *(frozenset({"argv", key}) for key in ("package", "executable", "args", "launch")),
    *(frozenset({"launch", key}) for key in ("package", "executable")),
)
READY = frozenset({"edges", "topic", "service", "lifecycle", "log", "exit", "time"})
SHAPES = frozenset({"box", "cylinder", "sphere", "capsule", "mesh"})
MASSES = frozenset({"mass", "density"})
SIMULATIONS = frozenset({"circle", "fixed", "joints"})

_POSES: tuple[tuple[str, ...], ...] = (
    ("frames", "*"),
    ("links", "*"),
    ("links", "*", "visual"),
    ("links", "*", "collision"),
    ("links", "*", "inertial"),
    ("joints", "*"),
    ("sensors", "*"),
    ("sensors", "*", "frames", "*"),
    ("processes", "*", "simulate", "fixed"),
)
_PROCESSES: tuple[tuple[str, ...], ...] = (("processes", "*"), ("sensors", "*", "driver"))

#: Where a mapping stands (``*`` is any name), and the keys of which it can hold one.
CHOICES: tuple[tuple[tuple[str, ...], frozenset[str]], ...] = (
    *((place, ROTATIONS) for place in _POSES),
    *(((*place, "run"), choice) for place in _PROCESSES for choice in COMMANDS),
    *((place, RUNNING) for place in _PROCESSES),
    *(((*place, "ready"), READY) for place in _PROCESSES),
    *((("processes", "*"), frozenset({"nodes", key})) for key in ("node", "lifecycle")),
    (("processes", "*", "simulate"), SIMULATIONS),
    (("links", "*", "visual"), SHAPES),
    (("links", "*", "collision"), SHAPES),
    (("links", "*", "inertial"), MASSES),
)


def composed(source: Source, profiles: Sequence[str] = (), overlays: Sequence[Source] = ()) -> Source:
    """Return the robot with its named profiles laid over it, in order, then the overlays; without ``profiles``.

    An overlay may bring profiles of its own.

    Raises:
        RejectedError: if a profile is not there.
    """
    for overlay in overlays:
        if "profiles" in overlay.data:
            source = lay_over(source, _only(overlay, "profiles"))
    known = source.data.get("profiles")
    known = known if isinstance(known, dict) else {}
    wrong = _wrong_profiles(source)
    missing = [name for name in dict.fromkeys(profiles) if name not in known]
    unusable = [name for name in profiles if not isinstance(known.get(name), dict)]
    if unusable:
        unknown = (_unknown_profile(source, name, list(known)) for name in missing)
        raise RejectedError([*source.found, *wrong, *unknown])
    result = replace(without(source, "profiles"), found=(*source.found, *wrong))
    for name in profiles:
        result = lay_over(result, source.part(("profiles", name)))
    for overlay in overlays:
        result = lay_over(result, without(overlay, "profiles"))
    return _without_nulls(result)


def lay_over(base: Source, overlay: Source, *, is_overlay: bool = True) -> Source:
    """Return ``base`` with ``overlay`` merged into it; each key remembers where it is from, and what it replaced.

    With ``is_overlay`` a value that changes nothing is a finding.
    """
    merger = _Merger(base, is_overlay=is_overlay)
    merger.merge(merger.data, overlay.data, overlay, ())
    found = (*base.found, *overlay.found, *merger.found)
    allows = tuple(dict.fromkeys((*base.allows, *overlay.allows)))
    return Source(base.file, merger.data, merger.values, merger.keys, found, allows, merger.replaced)


class _Merger:
    """Merges in time proportional to the overlay and to what it drops, not to the whole base."""

    def __init__(self, base: Source, *, is_overlay: bool) -> None:
        self.is_overlay = is_overlay
        self.data = _copy(base.data)
        self.values = dict(base.values)
        self.keys = dict(base.keys)
        self.replaced = dict(base.replaced)
        self.found: list[Diagnostic] = []

    def merge(self, target: dict[str, Any], data: dict[str, Any], overlay: Source, path: Path) -> None:
        for choice in _choices_at(path, data):
            for dropped in sorted(choice & (set(target) - set(data))):
                self.forget((*path, dropped), target.pop(dropped))
        for key, value in data.items():
            at = (*path, key)
            if value is None and path[:1] != ("profiles",):  # in a profile it is for later
                self.remove(target, key, overlay, at)
            elif isinstance(value, dict):
                if not isinstance(target.get(key), dict):
                    self.forget(at, target.get(key))
                    target[key] = {}
                    self.values[at] = overlay.at(at)
                self.keys[at] = overlay.at_key(at)
                self.merge(target[key], value, overlay, at)
            else:
                if key in target:
                    self.note(target[key], value, overlay, at)
                self.forget(at, target.get(key))
                target[key] = _copy(value)
                self.remember(at, value, overlay)

    def remove(self, target: dict[str, Any], key: str, overlay: Source, path: Path) -> None:
        if key not in target:
            message = f"{'.'.join(map(str, path))} is removed here, but nothing is there"
            self.found.append(finding("TF010", message, overlay.at_key(path), severity="warning"))
        self.forget(path, target.pop(key, None))

    def note(self, old: Any, new: Any, overlay: Source, path: Path) -> None:
        """Remember what is replaced, and say so if that changes nothing."""
        if path in self.values:
            self.replaced[path] = self.values[path]
        if self.is_overlay and type(old) is type(new) and old == new:
            message = f"{'.'.join(map(str, path))} is {_shown(new)} already"
            notes = [Note("here", self.values[path])] if path in self.values else []
            span = overlay.at(path)
            self.found.append(finding("TF014", message, span, notes=notes, help="remove it", severity="warning"))

    def forget(self, path: Path, value: Any) -> None:
        for below in _paths(value, path):
            self.values.pop(below, None)
            self.keys.pop(below, None)

    def remember(self, path: Path, value: Any, overlay: Source) -> None:
        for below in _paths(value, path):
            for table, theirs in ((self.values, overlay.values), (self.keys, overlay.keys)):
                if below in theirs:
                    table[below] = theirs[below]


def _paths(value: Any, path: Path) -> Iterator[Path]:
    """Yield the paths of a value and of everything in it."""
    yield path
    steps = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for step, item in steps:
        yield from _paths(item, (*path, step))


def _choices_at(path: Path, data: dict[str, Any]) -> list[frozenset[str]]:
    return [
        keys
        for pattern, keys in CHOICES
        if len(pattern) == len(path)
        and all(want in {"*", step} for want, step in zip(pattern, path, strict=True))
        and any(data.get(key) is not None for key in keys)
    ]


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copy(item) for key, item in value.items()}
    return [_copy(item) for item in value] if isinstance(value, list) else value


def _shown(value: Any) -> str:
    return "that list" if isinstance(value, list) else str(value)


def _only(source: Source, key: str) -> Source:
    return replace(source, data={key: source.data[key]})


def without(source: Source, key: str) -> Source:
    """Return the source without one of its sections."""
    if key not in source.data and (key,) not in source.values:
        return source
    data = {name: value for name, value in source.data.items() if name != key}
    values = {path: span for path, span in source.values.items() if path[:1] != (key,)}
    keys = {path: span for path, span in source.keys.items() if path[:1] != (key,)}
    return replace(source, data=data, values=values, keys=keys)


def _without_nulls(source: Source) -> Source:
    """Report what is null after all overlays: a key without a value says nothing."""
    found: list[Diagnostic] = []

    def clean(value: Any, path: Path) -> Any:
        if isinstance(value, list):
            for index in [index for index, item in enumerate(value) if item is None]:
                advice = "give a value, or remove the item"
                found.append(
                    finding("TF006", "an item of the list has no value", source.at((*path, index)), help=advice)
                )
            return [clean(item, (*path, index)) for index, item in enumerate(value) if item is not None]
        if not isinstance(value, dict):
            return value
        for key in [key for key, item in value.items() if item is None]:
            message = f"{key} has no value"
            found.append(
                finding("TF006", message, source.at_key((*path, key)), help=f"write {key}: {{}}, or remove it")
            )
        return {key: clean(item, (*path, key)) for key, item in value.items() if item is not None}

    data = clean(source.data, ())
    return replace(source, data=data, found=(*source.found, *found))


def _wrong_profiles(source: Source) -> list[Diagnostic]:
    """Return a finding for each profile that is no mapping, or that holds profiles itself."""
    profiles = source.data.get("profiles", {})
    if not isinstance(profiles, dict):
        advice = "for example profiles: {demo: {…}}"
        return [finding("TF103", "profiles is no mapping", source.at(("profiles",)), help=advice)]
    found = []
    for name, profile in profiles.items():
        if not isinstance(profile, dict):
            message, span = f"the profile {name} is no mapping", source.at_key(("profiles", name))
            found.append(finding("TF103", message, span, help=f"for example {name}: {{sensors: {{…}}}}"))
        elif "profiles" in profile:
            message, span = f"the profile {name} holds profiles", source.at_key(("profiles", name, "profiles"))
            found.append(finding("TF101", message, span, help="profiles stand side by side: --profile a --profile b"))
    return found


def _unknown_profile(source: Source, name: str, known: list[str]) -> Diagnostic:
    there = f"there is {', '.join(known)}" if known else "the file has no profiles"
    span = source.at_key(("profiles",))
    return finding("TF009", f"no profile {name}", span, help=did_you_mean(name, known, there))
