"""What silences findings: ``# tfcompose: allow TF301 because …`` on a line, and ``rules`` for a whole robot.

The comment is on the line that the finding is about, or alone on the line above. Findings about text and keys cannot be
silenced, since they say that the file was not understood; nor can those that leave nothing to build.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.catalogue import CATALOGUE, can_be_allowed, code_of, codes_and_names
from tfcompose.findings import Allow, Finding, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from tfcompose.findings import Span

    Used = set[tuple[Allow, str]]


def silenced(
    found: Iterable[Finding], rules: Mapping[str, tuple[str, Span]], allows: Sequence[Allow]
) -> tuple[list[Finding], Used]:
    """Return what neither a comment nor an entry of ``rules`` silences, and which comments silenced something.

    ``rules`` holds a severity or ``off`` for codes and names, each with its place; an entry that is neither, or cannot
    be set, is a finding too.
    """
    unknown = _unknown_rules({word: at for word, (_, at) in rules.items()})
    return apply([*_with_severities(found, {word: level for word, (level, _) in rules.items()}), *unknown], allows)


def apply(found: Iterable[Finding], allows: Sequence[Allow]) -> tuple[list[Finding], Used]:
    """Return the findings that are not allowed, and which comments silenced something, with the code."""
    kept: list[Finding] = []
    used: Used = set()
    for one in found:
        allowing = [allow for allow in allows if _covers(allow, one)]
        if allowing and can_be_allowed(one.code):
            used.update((allow, one.code) for allow in allowing)
        else:
            kept.append(one)
    return kept, used


def _with_severities(found: Iterable[Finding], rules: Mapping[str, str]) -> list[Finding]:
    """Return the findings with the severities that the robot's ``rules`` set; those that are ``off`` are left out."""
    levels = {code: level for word, level in rules.items() if (code := code_of(word)) and can_be_allowed(code)}
    result = []
    for one in found:
        match levels.get(one.code):
            case "error" | "warning" as severity:
                result.append(replace(one, severity=severity))
            case None:
                result.append(one)
    return result


def _unknown_rules(rules: Mapping[str, Span]) -> list[Finding]:
    """Return a finding for each entry of ``rules``, with its place, that is no code or cannot be set."""
    found = []
    for word, at in rules.items():
        code = code_of(word)
        if code is None:
            advice = did_you_mean(word, codes_and_names(), "write a code that lint prints, such as TF401")
            found.append(finding("TF017", f"unknown code {word} under rules", at, help=advice))
        elif not can_be_allowed(code):
            found.append(
                finding("TF017", f"{code} {CATALOGUE[code].name} cannot be set under rules", at, help="remove it")
            )
    return found


def _covers(allow: Allow, found: Finding) -> bool:
    at = found.span
    if at is None or at.file != allow.at.file or found.code not in allow.codes:
        return False
    return allow.line <= at.line <= max(allow.line, allow.last)


def unused_allows(allows: Sequence[Allow], used: Used) -> list[Finding]:
    """Return a finding for each comment that allows nothing, cannot allow what it names, or gives no reason."""
    found = []
    for allow in allows:
        if not allow.codes:
            found.append(finding("TF012", "allow without a code", allow.at, help="write allow TF401 because …"))
        for code in allow.codes:
            message = ""
            if code not in CATALOGUE:
                message = f"allow {code}: unknown code"
            elif not can_be_allowed(code):
                message = f"allow {code}: {CATALOGUE[code].name} cannot be allowed"
            elif (allow, code) not in used:
                message = f"unused allow {code}: there is no {CATALOGUE[code].name} here"
            if message:
                advice = did_you_mean(code, CATALOGUE, "remove it") if code not in CATALOGUE else "remove it"
                found.append(finding("TF012", message, allow.at, help=advice))
        if allow.codes and not allow.reason:
            message = f"allow {', '.join(allow.codes)} without a reason"
            found.append(finding("TF013", message, allow.at, help="add because … after it"))
    return found
