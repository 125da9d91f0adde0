"""Overlays: a base robot with profiles laid over it.

Mappings merge; scalars and lists replace; ``null`` in an overlay removes the key, and its default returns. Where a
mapping holds one choice out of several keys (how a process runs, how a rotation is written), setting one in an overlay
drops the others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, RejectedError, did_you_mean, finding
from tfcompose.load.source import Path, Source

if TYPE_CHECKING:
    from collections.abc import Sequence

ROTATIONS = frozenset({"rpy", "quat_xyzw", "axis_angle", "matrix", "look"})
RUNNING = frozenset({"run", "simulate", "external"})
SHAPES = frozenset({"box", "cylinder", "sphere", "mesh"})
SIMULATIONS = frozenset({"circle", "fixed", "joints"})

#: Where a mapping stands (``*`` is any name), and the keys of which it can hold one.
CHOICES: tuple[tuple[tuple[str, ...], frozenset[str]], ...] = (
    (("frames", "*"), ROTATIONS),
    (("links", "*"), ROTATIONS),
    (("joints", "*"), ROTATIONS),
    (("sensors", "*"), ROTATIONS),
    (("processes", "*"), RUNNING),
    (("processes", "*", "simulate"), SIMULATIONS),
    (("links", "*", "visual"), SHAPES),
    (("links", "*", "collision"), SHAPES),
)


def with_profiles(source: Source, profiles: Sequence[str]) -> Source:
    """Return the robot with its named profiles laid over it, in order, and without the section ``profiles``.

    Raises:
        RejectedError: if a profile is not there.
    """
    known = source.data.get("profiles")
    known = known if isinstance(known, dict) else {}
    missing = [name for name in profiles if not isinstance(known.get(name), dict)]
    if missing:
        raise RejectedError([*source.found, *(_unknown_profile(source, name, list(known)) for name in missing)])
    result = _without(source, "profiles")
    for name in profiles:
        result = lay_over(result, source.part(("profiles", name)))
    return _without_nulls(result)


def lay_over(base: Source, overlay: Source) -> Source:
    """Return ``base`` with ``overlay`` merged into it; each key remembers where it is from."""
    merger = _Merger(base)
    merger.merge(merger.data, overlay.data, overlay, ())
    return Source(base.file, merger.data, merger.values, merger.keys, (*base.found, *merger.found))


class _Merger:
    def __init__(self, base: Source) -> None:
        self.data = _copy(base.data)
        self.values = dict(base.values)
        self.keys = dict(base.keys)
        self.found: list[Diagnostic] = []

    def merge(self, target: dict[str, Any], data: dict[str, Any], overlay: Source, path: Path) -> None:
        for choice in _choices_at(path, data):
            for dropped in sorted(choice & (set(target) - set(data))):
                self.forget((*path, dropped))
                del target[dropped]
        for key, value in data.items():
            at = (*path, key)
            if value is None:
                if key not in target:
                    message = f"{'.'.join(map(str, at))} is removed here, but nothing is there"
                    span = overlay.at_key(at)
                    self.found.append(finding("TF010", message, span, severity="warning"))
                target.pop(key, None)
                self.forget(at)
            elif isinstance(value, dict) and isinstance(target.get(key), dict):
                self.keys[at] = overlay.at_key(at)
                self.merge(target[key], value, overlay, at)
            else:
                self.forget(at)
                target[key] = _copy(value)
                self.remember(overlay, at)

    def forget(self, path: Path) -> None:
        for table in (self.values, self.keys):
            for below in [known for known in table if known[: len(path)] == path]:
                del table[below]

    def remember(self, overlay: Source, path: Path) -> None:
        for table, theirs in ((self.values, overlay.values), (self.keys, overlay.keys)):
            table.update({known: span for known, span in theirs.items() if known[: len(path)] == path})


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


def _without(source: Source, key: str) -> Source:
    data = {name: value for name, value in source.data.items() if name != key}
    values = {path: span for path, span in source.values.items() if path[:1] != (key,)}
    keys = {path: span for path, span in source.keys.items() if path[:1] != (key,)}
    return Source(source.file, data, values, keys, source.found)


def _without_nulls(source: Source) -> Source:
    """Report what is null after all overlays: a key without a value says nothing."""
    found: list[Diagnostic] = []

    def clean(value: Any, path: Path) -> Any:
        if isinstance(value, list):
            items = [clean(item, (*path, index)) for index, item in enumerate(value)]
            return [item for item in items if item is not None]
        if not isinstance(value, dict):
            return value
        for key in [key for key, item in value.items() if item is None]:
            message = f"{key} has no value"
            found.append(
                finding("TF006", message, source.at_key((*path, key)), help=f"write {key}: {{}}, or remove it")
            )
        return {key: clean(item, (*path, key)) for key, item in value.items() if item is not None}

    data = clean(source.data, ())
    return Source(source.file, data, source.values, source.keys, (*source.found, *found))


def _unknown_profile(source: Source, name: str, known: list[str]) -> Diagnostic:
    there = f"there is {', '.join(known)}" if known else "the file has no profiles"
    span = source.at_key(("profiles",))
    return finding("TF009", f"no profile {name}", span, help=did_you_mean(name, known, there))
