"""The whole way from text to files, on one screen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.check import apply, check, levelled, unknown_rules, with_edits, with_replaced
from tfcompose.findings import Allow, Finding, RejectedError
from tfcompose.load import Source, composed, load, with_includes
from tfcompose.resolve import Disk, Library, Whole, resolve
from tfcompose.validate import validate

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.model import Robot
    from tfcompose.validate import Validated

#: Findings that follow from a pose. In an entry whose pose was refused they say nothing new.
_FROM_A_POSE = frozenset({"TF401", "TF404", "TF405", "TF413", "TF414", "TF621", "TF622"})

#: Findings that something has no use. What a profile or an overlay has no use for, the robot without it may need.
_IDLE = frozenset({"TF504", "TF619", "TF815"})


@dataclass(frozen=True, slots=True)
class Compiled:
    """A robot and everything that was found; ``robot`` is None where the text did not get that far.

    ``allows`` are the comments that let findings stand, ``used`` those that did, with the code. ``sources`` are what
    the robot was made from, overlays laid over it: its own file's, and those of the robot files that are parts.
    """

    robot: Robot | None
    found: tuple[Finding, ...]
    allows: tuple[Allow, ...] = ()
    used: frozenset[tuple[Allow, str]] = frozenset()
    sources: tuple[Source, ...] = ()

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that stand in the way of a build."""
        return tuple(found for found in self.found if found.severity == "error")


def compile_robot(  # noqa: PLR0913 (text, and what is laid over it)
    text: str,
    file: str,
    library: Library,
    profiles: Sequence[str] = (),
    *,
    overlays: Sequence[Source] = (),
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
) -> Compiled:
    """Return the robot that the text describes with profiles and overlays laid over it, and all findings, by place.

    ``read`` gives the text of a file that is included or holds a calibration; without it nothing can be. ``disk`` says
    which files and packages there are; without it no mesh is looked for.
    """
    try:
        source = load(text, file)
        source = with_includes(source, read) if read else source
    except RejectedError as error:
        return Compiled(None, error.findings)
    return compile_source(source, library, profiles, overlays, read, disk)


def compile_source(  # noqa: PLR0913, PLR0917 (as above)
    source: Source,
    library: Library,
    profiles: Sequence[str] = (),
    overlays: Sequence[Source] = (),
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
) -> Compiled:
    """Return what ``compile_robot`` does, from text that has been loaded, with what it includes."""
    try:
        validated = validate(composed(source, profiles, overlays), source.data.get("profiles"))
    except RejectedError as error:
        return Compiled(None, error.findings)
    resolved = resolve(validated, library, read, disk)
    later = [*resolved.found, *_about_parts(check(resolved.robot), resolved.whole)]
    source = validated.source
    plain = not (profiles or overlays)
    found = [*validated.found, *(one for one in later if _stands(one, validated) and (plain or one.code not in _IDLE))]
    rules = validated.spec.rules
    found += unknown_rules({word: source.at_key(("rules", word)) for word in rules})
    found = with_edits(found, source)
    sources = (source, *resolved.whole.sources)
    for one in sources:
        found = with_replaced(found, one)
    kept, used = apply(levelled(_once(found), rules), (*source.allows, *resolved.whole.allows))
    ordered = sorted(kept, key=lambda one: one.sort_key)
    return Compiled(resolved.robot, tuple(ordered), source.allows, frozenset(used), sources)


def _once(found: list[Finding]) -> list[Finding]:
    """Return each finding once; where two differ in their notes only, as of a part that is there twice, with all."""
    first: dict[Finding, Finding] = {}
    for one in found:
        alone = replace(one, notes=()) if one.notes else one
        before = first.setdefault(alone, one)
        notes = dict.fromkeys((*before.notes, *one.notes))
        if len(notes) > len(before.notes):
            first[alone] = replace(before, notes=tuple(notes))
    return list(first.values())


def _about_parts(found: list[Finding], whole: Whole) -> list[Finding]:
    """Return the findings; those about the files of parts with a note that says which part it is.

    Warnings about files that somebody else wrote are left out: who holds the part cannot mend them, and ``lint`` of
    the file says them.
    """
    if not (whole.foreign or whole.own):
        return found
    said = []
    for one in found:
        file = one.span.file if one.span else ""
        notes = whole.foreign.get(file) or whole.own.get(file, [])
        if file not in whole.foreign or one.severity == "error":
            said.append(replace(one, notes=(*one.notes, *notes)))
    return said


def _stands(found: Finding, validated: Validated) -> bool:
    """Whether a later finding is not merely a consequence of an entry that was refused already."""
    if found.code not in _FROM_A_POSE:
        return True
    at = found.span
    spans = (validated.source.exactly_at(entry) for entry in validated.broken)
    return at is None or not any(span and span.holds(at) for span in spans)


def profiles_of(source: Source) -> list[str]:
    """Return the names of the file's profiles."""
    profiles = source.data.get("profiles")
    return [name for name, value in profiles.items() if isinstance(value, dict)] if isinstance(profiles, dict) else []
