"""Run all rules over a robot, silence findings, and add notes about replaced values.

If a rule crashes, ``check`` reports a finding and runs the other rules. The comment ``# tfcompose:
allow TF301 because …`` silences a finding on the comment's line. A comment on a line of its own
silences findings on the next line. The section ``rules`` sets a severity, or ``off``, for the
entire robot. Some findings cannot be silenced: findings about text and keys, because the file was
not understood, and findings that leave nothing to build.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.check import (
    bodies,
    joints,
    names,
    optical,
    ownership,
    placement,
    poses,
    prefixes,
    processes,
    sensors,
    stock,
    tree,
    wheels,
)
from tfcompose.compiler.check.rule import Rule
from tfcompose.foundation.catalogue import (
    CATALOGUE,
    absent_code,
    can_be_allowed,
    code_of,
    similar_words,
)
from tfcompose.foundation.findings import Allow, Finding, Note, Span, did_you_mean, finding
from tfcompose.foundation.tool import load
from tfcompose.spec.language.tool_keys import keys_in

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from tfcompose.model.robot import Robot
    from tfcompose.spec.load import Path, Source

    Used = set[tuple[Allow, str]]


#: Codes of findings about a single value. The finding's span is the span of that value.
_OF_VALUES = frozenset({"TF410", "TF411", "TF412", "TF704", "TF705", "TF707"})


def by_code(rules: Iterable[Rule]) -> dict[str, Rule]:
    """Return the rules by code, sorted by code.

    Raises:
        ValueError: if two rules have the same code.
    """
    table: dict[str, Rule] = {}
    for rule in sorted(rules, key=lambda rule: rule.code):
        if table.setdefault(rule.code, rule) is not rule:
            raise ValueError(f"two rules have the code {rule.code}")
    return table


_FAMILIES = (
    tree,
    ownership,
    stock,
    prefixes,
    poses,
    optical,
    names,
    sensors,
    placement,
    bodies,
    joints,
    wheels,
    processes,
)
RULES = by_code(
    value for family in _FAMILIES for value in vars(family).values() if isinstance(value, Rule)
)


def check(robot: Robot, rules: Iterable[Rule] = RULES.values()) -> list[Finding]:
    """Return the findings of all rules, in no particular order.

    Three kinds of findings are left out: findings that only follow from a rejected value; unused
    entries of a variant, a robot with profiles or overlays merged; and warnings about parts from a
    URDF, because ``lint`` reports them when it reads that URDF.
    """
    findings: list[Finding] = []
    for rule in rules:
        if rule.idle and robot.is_variant:
            continue
        try:
            findings += [
                _of_part(entry, robot)
                for entry in rule.find(robot)
                if not _is_left_out(entry, rule, robot)
            ]
        except Exception as error:  # noqa: BLE001 (a rule's fault must not hide the others' findings)
            name = CATALOGUE[rule.code].name
            message = f"rule {rule.code} {name} crashed: {type(error).__name__}: {error}"
            findings.append(
                finding(
                    "TF903",
                    message,
                    Span(robot.file),
                    help="this is a bug in tfcompose: please report it",
                )
            )
    return _at_shared_values(findings)


def _at_shared_values(findings: list[Finding]) -> list[Finding]:
    """Merge findings about a value that several entries share through a YAML anchor.

    The notes of the merged finding name the other entries.
    """
    by_place: dict[tuple[str, Span], list[Finding]] = {}
    single = []
    for entry in findings:
        if entry.span is not None and entry.code in _OF_VALUES:
            by_place.setdefault((entry.code, entry.span), []).append(entry)
        else:
            single.append(entry)
    shared = [
        replace(first, notes=(*first.notes, *(Note(repeat.message) for repeat in repeats)))
        for first, *repeats in by_place.values()
    ]
    return [*single, *shared]


def rules_of_tools(robot: Robot) -> tuple[list[Rule], list[Finding]]:
    """Return rules of tools whose sections the file has, and findings for load failures."""
    rules: list[Rule] = []
    findings = []
    for key in keys_in(robot.sections):
        try:
            module = vars(load(key.rules)) if key.rules else {}
        except Exception as error:  # noqa: BLE001 (a foreign package may raise anything)
            message = f"the rules of {key.name} cannot be loaded: {type(error).__name__}: {error}"
            advice = f"update or uninstall the package that provides {key.rules}"
            span = robot.sections[key.name].span_of()
            findings.append(finding("TF921", message, span, help=advice))
            continue
        rules += [value for value in module.values() if isinstance(value, Rule)]
    return rules, findings


def _is_left_out(finding: Finding, rule: Rule, robot: Robot) -> bool:
    span = finding.span
    if span is None:
        return False
    if rule.follows == "pose" and any(entry.holds(span) for entry in robot.refused):
        return True
    return (
        finding.severity == "warning"
        and span.file in robot.foreign
        and span.file in robot.part_notes
    )


def _of_part(finding: Finding, robot: Robot) -> Finding:
    """Return the finding with a note for each part that uses the finding's file."""
    notes = robot.part_notes.get(finding.span.file, ()) if finding.span else ()
    return replace(finding, notes=(*finding.notes, *notes)) if notes else finding


def silence(
    findings: Iterable[Finding], rules: Mapping[str, tuple[str, Span]], allows: Sequence[Allow]
) -> tuple[list[Finding], Used]:
    """Return the findings that nothing silences, and the comments that silenced a finding.

    A comment or an entry of ``rules`` silences a finding. ``rules`` maps a code or a name to a
    severity or ``off`` and to the span of the entry. An entry with an unknown code or name, or for
    a code whose severity is fixed, becomes a finding.
    """
    unknown = _unknown_rules({name: span for name, (_, span) in rules.items()})
    return apply(
        [
            *_with_severities(findings, {name: level for name, (level, _) in rules.items()}),
            *unknown,
        ],
        allows,
    )


def apply(findings: Iterable[Finding], allows: Sequence[Allow]) -> tuple[list[Finding], Used]:
    """Return the findings that no comment allows, and each effective comment with its code."""
    kept: list[Finding] = []
    used: Used = set()
    for entry in findings:
        allowing = [allow for allow in allows if _covers(allow, entry)]
        if allowing and can_be_allowed(entry.code):
            used.update((allow, entry.code) for allow in allowing)
        else:
            kept.append(entry)
    return kept, used


def _with_severities(findings: Iterable[Finding], rules: Mapping[str, str]) -> list[Finding]:
    """Return the findings with the severities that the robot's ``rules`` set.

    Findings whose severity is ``off`` are left out.
    """
    levels = {
        code: level
        for name, level in rules.items()
        if (code := code_of(name)) and can_be_allowed(code)
    }
    result = []
    for entry in findings:
        match levels.get(entry.code):
            case "error" | "warning" as severity:
                result.append(replace(entry, severity=severity))
            case None | "":  # the entry sets only a limit
                result.append(entry)
    return result


def _unknown_rules(rules: Mapping[str, Span]) -> list[Finding]:
    """Return a finding for each entry of ``rules`` that is unknown or cannot be set."""
    findings = []
    for name, span in rules.items():
        code = code_of(name)
        if code is None:
            advice = absent_code(name) or did_you_mean(
                name, similar_words(name), "write a code that lint prints, such as TF401"
            )
            findings.append(
                finding("TF017", f"unknown code {name} under rules", span, help=advice)
            )
        elif not can_be_allowed(code):
            findings.append(
                finding(
                    "TF017",
                    f"{code} {CATALOGUE[code].name} cannot be set under rules",
                    span,
                    help="remove it",
                )
            )
    return findings


def _covers(allow: Allow, finding: Finding) -> bool:
    span = finding.span
    if span is None or span.file != allow.span.file or finding.code not in allow.codes:
        return False
    return allow.line <= span.line <= max(allow.line, allow.last)


def unused_allows(allows: Sequence[Allow], used: Used) -> list[Finding]:
    """Return a finding for each comment without effect, without a reason, or not permitted."""
    findings = []
    for allow in allows:
        if not allow.codes:
            findings.append(
                finding(
                    "TF012", "allow without a code", allow.span, help="write allow TF401 because …"
                )
            )
        for code in allow.codes:
            message = ""
            if code not in CATALOGUE:
                message = f"allow {code}: unknown code"
            elif not can_be_allowed(code):
                message = f"allow {code}: {CATALOGUE[code].name} cannot be allowed"
            elif (allow, code) not in used:
                message = f"unused allow {code}: there is no {CATALOGUE[code].name} here"
            if message:
                advice = "remove it"
                if code not in CATALOGUE:
                    advice = absent_code(code) or did_you_mean(code, CATALOGUE, advice)
                findings.append(finding("TF012", message, allow.span, help=advice))
        if allow.codes and not allow.reason:
            message = f"allow {', '.join(allow.codes)} without a reason"
            findings.append(finding("TF013", message, allow.span, help="add because … after it"))
    return findings


_OF_AN_ENTRY = 2  # length of an entry's path: section and name


def add_replaced_notes(findings: Iterable[Finding], sources: Iterable[Source]) -> list[Finding]:
    """Add notes about values that an overlay replaced to the findings about their new values."""
    overlaid = [source for source in sources if source.replaced]
    if not overlaid:
        return list(findings)
    return [replace(finding, notes=_with_notes(finding, overlaid)) for finding in findings]


def _with_notes(finding: Finding, sources: Iterable[Source]) -> tuple[Note, ...]:
    notes = finding.notes
    for source in sources:
        notes = (*notes, *_notes(finding, {note.span for note in notes}, source))
    return notes


def _notes(finding: Finding, spans: set[Span | None], source: Source) -> list[Note]:
    """Return notes about the replaced value at the finding's span.

    If no value there was replaced, return the notes about the complete entry.
    """
    exact, around = [], []
    for path, (old, *_) in source.replaced.items():
        now = source.exact_span(path)
        if now is None or finding.span is None or old in spans:
            continue
        if now.holds(finding.span) or finding.span == source.key_span(path):
            exact.append(Note("it replaces this value", old))
        elif len(path) > _OF_AN_ENTRY and finding.span in _places_of_entry(
            path[:_OF_AN_ENTRY], source
        ):
            name = ".".join(map(str, path[_OF_AN_ENTRY:]))
            around.append(Note(f"{name} at {now} replaces this value", old))
    return exact or around


def _places_of_entry(entry: Path, source: Source) -> set[Span]:
    """Return the spans that a finding about a complete entry can have: its key and its parent."""
    return {source.key_span(entry), source.span_of((*entry, "parent"))}
