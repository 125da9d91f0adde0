"""Robots from several files: ``include``, profiles, overlays, and values from the command line.

Mappings are merged. Scalars and lists are replaced. ``null`` in an overlay removes a key, so that
its default applies. Some mappings accept only one of several keys, for example for a rotation or
for the way a process runs. If an overlay sets one of these keys, the others are dropped.
``include: [base.yaml]`` merges the file over the files that it includes. Paths are relative to the
file that contains them.
"""

from __future__ import annotations

import contextlib
import posixpath
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, did_you_mean, finding
from tfcompose.foundation.text import list_names
from tfcompose.spec.language.args import BuildInputs
from tfcompose.spec.language.conditions import holds
from tfcompose.spec.language.expressions import ExpressionError
from tfcompose.spec.language.recognition import load_named
from tfcompose.spec.language.spec import Spec, mappings_at
from tfcompose.spec.language.tool_keys import robot_model
from tfcompose.spec.language.variables import NothingNewError, Variables
from tfcompose.spec.load import DEEPEST, Location, Path, Source, Spans, find_path, load

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.spec.language.robot import RosSpec

    Reader = Callable[[str], str]


_NOTHING = BuildInputs()


def compose(
    source: Source,
    profiles: Sequence[str] = (),
    overlays: Sequence[Source] = (),
    inputs: BuildInputs = _NOTHING,
    read: Reader | None = None,
) -> Source:
    """Return the robot with profiles merged over it, in order, and then the overlays.

    The profiles are those in ``profiles``, preceded by profiles whose condition ``when`` is true
    with the ``inputs`` and the named profiles. An overlay may define further profiles. The result
    has no section ``profiles``. ``read`` returns the text of a file. If ``read`` is given, a
    finding about a missing profile names parts that have it.

    Raises:
        RejectedError: if a profile does not exist.
    """
    for overlay in overlays:
        if "profiles" in overlay.data:
            only = {"profiles": overlay.data["profiles"]}
            source = lay_over(source, replace(overlay, data=only))
    profiles_by_name = source.mapping("profiles")
    wrong = [*_wrong_profiles(source), *_choosing_overlays(source, overlays)]
    missing = [name for name in dict.fromkeys(profiles) if name not in profiles_by_name]
    unusable = [name for name in profiles if not isinstance(profiles_by_name.get(name), dict)]
    if unusable:
        unknown = (_unknown_profile(source, name, read) for name in missing)
        raise RejectedError([*source.findings, *wrong, *unknown])
    base = replace(without(source, "profiles"), findings=(*source.findings, *wrong))
    result = _lay_over_all(base, source, profiles, overlays)
    if any(
        isinstance(profile, dict) and "when" in profile for profile in profiles_by_name.values()
    ):
        holding, refused = _holding(source, result, inputs)
        profiles = [*(name for name in holding if name not in profiles), *profiles]
        result = _lay_over_all(
            replace(base, findings=(*base.findings, *refused)), source, profiles, overlays
        )
    return replace(
        result,
        is_variant=bool(profiles or overlays),
        profiles=tuple(dict.fromkeys(profiles)),
        overlays=tuple(overlay.file for overlay in overlays),
    )


def _lay_over_all(
    base: Source, source: Source, profiles: Sequence[str], overlays: Sequence[Source]
) -> Source:
    for name in profiles:
        base = lay_over(base, without(source.part(("profiles", name)), "when"))
    for overlay in overlays:
        rest = without(overlay, "profiles")
        if rest.data or rest is overlay:
            base = lay_over(base, rest)
    return base


def _holding(
    source: Source, merged: Source, inputs: BuildInputs
) -> tuple[list[str], list[Finding]]:
    """Return the profiles whose conditions are true, and findings about conditions."""
    variables = Variables(merged, inputs)
    names: list[str] = []
    findings = []
    for name, profile in profiles_in(source).items():
        path: Path = ("profiles", name)
        if "when" not in profile:
            continue
        if "args" in profile:
            advice = "a profile that is named with --profile may"
            message = "a profile with a condition cannot change args, which decide it"
            findings.append(
                finding("TF107", message, source.key_span((*path, "args")), help=advice)
            )
            continue
        try:
            if holds(profile["when"], variables):
                names.append(name)
        except NothingNewError:
            continue
        except ExpressionError as error:
            findings.append(
                finding("TF105", str(error), source.span_of((*path, "when")), help=error.advice)
            )
    return names, findings


def lay_over(
    base: Source, overlay: Source, *, is_overlay: bool = True, of: type[Spec] | None = None
) -> Source:
    """Return ``base`` with ``overlay`` merged into it.

    Each key keeps its place and the places of replaced values. With ``is_overlay``, a value that
    changes nothing becomes a finding. ``of`` is the language of both files, by default that of
    robot files.
    """
    if of is None:
        base, overlay = _with_full_args(base), _with_full_args(overlay)
        of = robot_model(base.data.keys() | overlay.data.keys())
    merger = _Merger(base.replaced, overlay.replaced, of, is_overlay=is_overlay)
    if is_overlay and not overlay.data:
        merger.findings.append(_idle("nothing is merged over the robot here", overlay.places))
    data, places = merger.merge((base.data, base.places), (overlay.data, overlay.places), ())
    findings = (*base.findings, *overlay.findings, *merger.findings)
    allows = tuple(dict.fromkeys((*base.allows, *overlay.allows)))
    return replace(
        base,
        data=data,
        places=places,
        findings=findings,
        allows=allows,
        replaced=merger.replaced,
        has_nulls=base.has_nulls or overlay.has_nulls,
    )


def _with_full_args(source: Source) -> Source:
    """Return the source with each argument as a mapping.

    In an overlay, a plain value sets the default of an argument.
    """
    declared = source.data.get("args")
    if not isinstance(declared, dict) or all(
        isinstance(declared_value, dict) or declared_value is None
        for declared_value in declared.values()
    ):
        return source
    location = source.places.inside["args"]
    inside, keys, data = dict(location.inside), dict(location.keys), dict(declared)
    for name, value in declared.items():
        if not isinstance(value, dict) and value is not None:
            data[name] = {"default": value}
            inner = location.inside[name]
            inside[name] = Location(inner.span, {"default": inner}, {"default": inner})
    places = {**source.places.inside, "args": location.with_inside(inside, keys)}
    return replace(
        source,
        data=source.data | {"args": data},
        places=source.places.with_inside(places, source.places.keys),
    )


Replaced = dict[Path, tuple["Span", ...]]
"""Where values stood that others were laid over, the last one first."""

Part = tuple[dict[str, Any], Location]
"""A mapping, and where it and what is in it stands."""


class _Merger:
    """Merges sources, in time proportional to the overlay and the mappings that it reaches.

    Neither source is modified.
    """

    def __init__(
        self, below: Replaced, above: Replaced, of: type[Spec], *, is_overlay: bool
    ) -> None:
        self.is_overlay = is_overlay
        self.of = of
        self.below = below
        self.above = above
        self.replaced = below | above
        self.findings: list[Finding] = []

    def merge(self, base: Part, overlay: Part, path: Path) -> Part:
        """Return ``base`` with ``overlay`` merged over it."""
        data, inside, keys = dict(base[0]), dict(base[1].inside), dict(base[1].keys)
        for choice in self.choices_at(path, overlay[0]):
            for dropped in choice & (data.keys() - overlay[0].keys()):
                new = next(
                    key for key in overlay[0] if key in choice and overlay[0][key] is not None
                )
                self.remember((*path, new), inside[dropped])
                _drop(dropped, data, inside, keys)
        for key, value in overlay[0].items():
            inner, location = (*path, key), overlay[1].inside[key]
            if value is None and not is_for_later(path):
                self.note_removal(key in data, overlay[1].keys[key], inner)
                _drop(key, data, inside, keys)
            elif isinstance(value, dict):
                old = data.get(key)
                if self.is_overlay and not value and isinstance(old, dict):
                    message = (
                        f"{'.'.join(map(str, inner))} is there already, and {{}} changes nothing"
                    )
                    self.findings.append(_idle(message, location, inside[key]))
                if key in data and not isinstance(old, dict):
                    self.remember(inner, inside[key])
                under = (
                    (old, inside[key])
                    if isinstance(old, dict)
                    else ({}, location.with_inside({}, {}))
                )
                data[key], inside[key] = self.merge(under, (value, location), inner)
                keys[key] = overlay[1].keys[key]
            else:
                if key in data:
                    self.note(data[key], inside[key], value, location, inner)
                data[key], inside[key], keys[key] = value, location, overlay[1].keys[key]
        return data, base[1].with_inside(inside, keys)

    def choices_at(self, path: Path, data: dict[str, Any]) -> list[frozenset[str]]:
        """Return the groups of exclusive keys of which the mapping at the path sets a key."""
        return [
            keys
            for kind in mappings_at(self.of, path)
            for keys in getattr(kind, "EXCLUSIVE", ())
            if any(data.get(key) is not None for key in keys)
        ]

    def note_removal(self, was_there: bool, key: Location, path: Path) -> None:  # noqa: FBT001 (the fact itself)
        """Add a finding if the removed key did not exist."""
        if not was_there:
            message = f"{'.'.join(map(str, path))} is removed here, but does not exist"
            self.findings.append(finding("TF010", message, key.span))

    def remember(self, path: Path, old: Location) -> None:
        """Record that the value at the path replaced the old value."""
        self.replaced[path] = (*self.above.get(path, ()), old.span, *self.below.get(path, ()))

    def note(
        self, old: Any, old_place: Location, new: Any, location: Location, path: Path
    ) -> None:
        """Record the replaced value. Add a finding if the new value is equal."""
        self.remember(path, old_place)
        if self.is_overlay and type(old) is type(new) and old == new and path != ("tfcompose",):
            message = f"{'.'.join(map(str, path))} is {_show_value(new)} already"
            self.findings.append(_idle(message, location, old_place))


def _idle(message: str, location: Location, old: Location | None = None) -> Finding:
    notes = [Note("here", old.span)] if old else []
    return finding("TF014", message, location.span, notes=notes, help="remove it")


def is_for_later(path: Path) -> bool:
    """Return whether the value at the path belongs to a profile or a variant of a preset.

    Such a value is merged only later.
    """
    return path[:1] == ("profiles",) or (path[:1] == ("options",) and path[2:3] == ("variants",))


def _drop(key: str, *tables: dict[Any, Any]) -> None:
    for table in tables:
        table.pop(key, None)


def _show_value(value: Any) -> str:
    return "that list" if isinstance(value, list) else str(value)


#: Settings that all processes of a plan share. A part cannot have its own.
_SHARED_SETTINGS = ("clock", "domain_id", "discovery", "rmw", "distro", "router")


def as_part(  # noqa: PLR0913, PLR0917 (two files, and what the one says of the other)
    part: Source,
    holder: Spans,
    path: Path,
    ros: RosSpec,
    settings: dict[str, Any],
    variables: dict[str, Any],
) -> tuple[Source, list[Finding]]:
    """Return a robot file as a part, and a finding for each setting that a part cannot have.

    ``path`` leads to the part in its ``holder``. The function merges three things over the part:
    the holder's ROS settings ``ros``, the part's own ``settings``, and the ``variables`` from the
    holder.
    """
    key = holder.key_span(path)
    part_settings = part.mapping("ros")
    findings = []
    for name in _SHARED_SETTINGS:
        setting = getattr(ros, name)
        if name in part_settings and part_settings[name] != setting:
            message = (
                f"the part {path[-1]} has {name} {part_settings[name]}, but the robot that"
                f" includes it has {setting}"
            )
            notes = [Note("set here", part.span_of(("ros", name)))]
            advice = f"ros: {{{name}: {part_settings[name]}}} here, or leave it out there"
            findings.append(finding("TF312", message, key, notes=notes, help=advice))
    frames = _frame_names(part)
    settings = {
        **settings,
        "shared_frames": [name for name in ros.shared_frames if name in frames],
        **{
            name: getattr(ros, name) for name in _SHARED_SETTINGS if getattr(ros, name) is not None
        },
    }
    here = Location(key)
    inside = {"ros": Location(key, dict.fromkeys(settings, here), dict.fromkeys(settings, here))}
    data: dict[str, Any] = {"ros": settings}
    if variables:
        data["vars"] = dict(variables)
        inside["vars"] = holder.places.nearest((*path, "vars"))
    places = Location(key, inside, dict.fromkeys(data, here))
    over = Source(holder.file, places, data, has_nulls=False)
    return lay_over(part, over, is_overlay=False), findings


def _frame_names(source: Source) -> set[str]:
    """Return every frame name that the file uses."""
    names: set[str] = set()
    for section in ("frames", "links", "joints", "sensors"):
        for name, entry in source.mapping(section).items():
            names.add(name)
            if isinstance(entry, dict):
                names.update(
                    entry[key] for key in ("parent", "child") if isinstance(entry.get(key), str)
                )
    return names


def extended_preset(preset: Source) -> str | None:
    """Return the name of the preset that a preset's file extends, or None."""
    base = preset.data.get("extends")
    return base if isinstance(base, str) else None


def profiles_in(source: Source) -> dict[str, dict[str, Any]]:
    """Return the file's profiles by name, without profiles that are not mappings."""
    profiles = source.mapping("profiles")
    return {name: value for name, value in profiles.items() if isinstance(value, dict)}


def without(source: Source, key: str) -> Source:
    """Return the source without the section."""
    if key not in source.data:
        return source
    location = source.places
    inside = {step: below for step, below in location.inside.items() if step != key}
    keys = {name: below for name, below in location.keys.items() if name != key}
    data = {name: value for name, value in source.data.items() if name != key}
    return replace(source, data=data, places=location.with_inside(inside, keys))


def _wrong_profiles(source: Source) -> list[Finding]:
    """Return a finding for each profile that is not a mapping or contains profiles itself."""
    profiles = source.data.get("profiles", {})
    if not isinstance(profiles, dict):
        advice = "for example profiles: {demo: {…}}"
        return [
            finding(
                "TF103", "profiles is not a mapping", source.span_of(("profiles",)), help=advice
            )
        ]
    findings = []
    for name, profile in profiles.items():
        if not isinstance(profile, dict):
            message, span = (
                f"the profile {name} is not a mapping",
                source.key_span(("profiles", name)),
            )
            findings.append(
                finding("TF103", message, span, help=f"for example {name}: {{sensors: {{…}}}}")
            )
        elif "profiles" in profile:
            message, span = (
                f"the profile {name} holds profiles",
                source.key_span(("profiles", name, "profiles")),
            )
            findings.append(
                finding(
                    "TF101",
                    message,
                    span,
                    help="combine profiles instead: --profile a --profile b",
                )
            )
    return findings


def _choosing_overlays(source: Source, overlays: Sequence[Source]) -> Iterator[Finding]:
    """Yield a finding for each profile or overlay with the section ``overlays``.

    The robot's overlay is chosen before profiles and overlays are merged.
    """
    parts = [
        (f"the profile {name}", source.part(("profiles", name))) for name in profiles_in(source)
    ]
    for what, part in [*parts, *(("an overlay", overlay) for overlay in overlays)]:
        if "overlays" in part.data:
            message, span = f"{what} cannot choose overlays", part.key_span(("overlays",))
            yield finding("TF023", message, span, help="write it in the robot file")


def _unknown_profile(source: Source, name: str, read: Reader | None) -> Finding:
    profiles = list(source.mapping("profiles"))
    otherwise = f"profiles: {', '.join(profiles)}" if profiles else "the file has no profiles"
    advice = did_you_mean(name, profiles, otherwise)
    if parts := _parts_with_profile(source, name, read) if read else []:
        entries = list_names((f"{part}: {{profiles: [{name}]}}" for part in parts), 3)
        advice = (
            f"{'a part has' if len(parts) == 1 else 'parts have'} it: write"
            f" profiles: {{{name}: {{parts: {{{entries}}}}}}}"
        )
    span = source.key_span(("profiles",))
    return finding("TF009", f"unknown profile {name}", span, help=advice)


def _parts_with_profile(source: Source, profile: str, read: Reader) -> list[str]:
    """Return the parts whose robot files have the profile."""
    parts = []
    for part, inside in source.mapping("parts").items():
        spec = inside.get("spec") if isinstance(inside, dict) else None
        if not isinstance(spec, str):
            continue
        file = find_path(spec, source.span_of(("parts", part, "spec")))
        with contextlib.suppress(RejectedError):
            if profile in with_includes(load_named(read(file), file), read).mapping("profiles"):
                parts.append(part)
    return parts


MOST_FILES = 50


def with_includes(source: Source, read: Reader) -> Source:
    """Return the source merged over the files that it includes, recursively.

    ``read`` returns the text of a file.

    Raises:
        RejectedError: if a file cannot be read or is not YAML, if files include each other, or if
            there are too many files.
    """
    return _Includer(read).include(source, (source.file,))


class _Includer:
    def __init__(self, read: Reader) -> None:
        self.read = read
        self.files = 0

    def include(self, source: Source, chain: tuple[str, ...]) -> Source:
        if "include" not in source.data:
            return source
        base: Source | None = None
        for index, name in self._names(source):
            span = source.span_of(
                ("include", index) if isinstance(source.data["include"], list) else ("include",)
            )
            file = posixpath.normpath(posixpath.join(posixpath.dirname(source.file), name))
            self.files += 1
            if file in chain or self.files > MOST_FILES:
                circle = " → ".join([*chain, file])
                message = (
                    f"files include each other: {circle}"
                    if file in chain
                    else f"more than {MOST_FILES} files"
                )
                raise RejectedError(
                    [*source.findings, finding("TF015", message, span, help="remove one include")]
                )
            included = self.include(self._load(file, span, source), (*chain, file))
            base = lay_over(base, included, is_overlay=False) if base else included
        without_include = without(source, "include")
        if base is None:
            return without_include
        merged = lay_over(base, without_include, is_overlay=False)
        return replace(merged, file=source.file)

    def _names(self, source: Source) -> list[tuple[int, str]]:
        included = source.data["include"]
        names = included if isinstance(included, list) else [included]
        wrong = [
            index for index, name in enumerate(names) if not isinstance(name, str) or not name
        ]
        if wrong:
            advice = "for example include: [base.yaml]"
            refusal = finding(
                "TF103",
                "include takes the names of files",
                source.span_of(("include",)),
                help=advice,
            )
            raise RejectedError([*source.findings, refusal])
        return list(enumerate(names))

    def _load(self, file: str, span: Span, source: Source) -> Source:
        try:
            return load_named(self.read(file), file)
        except RejectedError as error:
            raise RejectedError(
                [*source.findings, *(_with_include(finding, span) for finding in error.findings)]
            ) from None


def _with_include(finding: Finding, span: Span) -> Finding:
    """Return the finding about an included file, with a note about the place that includes it."""
    return replace(finding, notes=(*finding.notes, Note("included here", span)))


#: Prefix of a setting's name in lists of overlays.
SETTING = "--set "


def setting_name(setting: str) -> str:
    """Return the file name in the spans of a ``--set`` setting."""
    return f"{SETTING}{setting}"


def set_value(setting: str) -> Source:
    """Return the overlay for ``PATH=VALUE``.

    The value is YAML, as in ``sensors.camera.xyz=[0.2, 0, 10 cm]``.

    Raises:
        RejectedError: if there is no ``=``, the value is not YAML, or the key is read before
            overlays are merged.
    """
    span = Span(setting_name(setting))
    path_text, sign, value_text = setting.partition("=")
    path: Path = tuple(path_text.strip().split("."))
    if not sign or not all(path):
        message = f"--set takes PATH=VALUE, not {setting!r}"
        raise RejectedError(
            [finding("TF016", message, span, help="for example sensors.camera.tf=driver")]
        )
    if len(path) > DEEPEST:
        message = f"--set names a key in {len(path)} levels; a robot has no more than {DEEPEST}"
        raise RejectedError([finding("TF016", message, Span("--set"))])
    if path[0] == "include":
        message = "--set cannot include files: it is merged over them"
        raise RejectedError([finding("TF016", message, span, help="--overlay FILE")])
    read = load(f"value: {value_text.strip() or 'null'}", span.file)
    data: Any = read.data["value"]
    below = read.places.inside["value"]
    full = Location(Span(span.file, 1, 1, below.span.end_line, below.span.end_column))
    location = full.with_inside(below.inside, below.keys)
    for step in reversed(path):
        data, location = {step: data}, full.with_inside({step: location}, {str(step): full})
    return Source(span.file, location, data, findings=read.findings)
