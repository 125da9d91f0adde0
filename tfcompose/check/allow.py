"""``# tfcompose: allow TF301 because …``: findings that a person has looked at and lets stand.

The comment stands on the line that the finding is about, or alone on the line above. Findings about text and keys (TF0
and TF1) cannot be allowed, since they say that the file was not understood; nor can those without whose end there is no
robot to build.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.catalogue import CATALOGUE, can_be_allowed, code_of, codes_and_names
from tfcompose.findings import Allow, Finding, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from tfcompose.findings import Span


def apply(found: Iterable[Finding], allows: Sequence[Allow]) -> tuple[list[Finding], set[tuple[Allow, str]]]:
    """Return the findings that are not allowed, and which comments let something stand, by code."""
    kept: list[Finding] = []
    used: set[tuple[Allow, str]] = set()
    for one in found:
        allowing = [allow for allow in allows if _covers(allow, one)]
        if allowing and can_be_allowed(one.code):
            used.update((allow, one.code) for allow in allowing)
        else:
            kept.append(one)
    return kept, used


def levelled(found: Iterable[Finding], rules: Mapping[str, str]) -> list[Finding]:
    """Return the findings with the severities that the robot's ``rules`` set; those that are ``off`` are left out."""
    levels = {code_of(word): level for word, level in rules.items()}
    result = []
    for one in found:
        level = levels.get(one.code) if can_be_allowed(one.code) else None
        if level in {"error", "warning"}:
            result.append(replace(one, severity="error" if level == "error" else "warning"))
        elif level != "off":
            result.append(one)
    return result


def unknown_rules(rules: Mapping[str, Span]) -> list[Finding]:
    """Return a finding for each entry of ``rules``, with its place, that is no code or cannot be set."""
    found = []
    for word, at in rules.items():
        code = code_of(word)
        if code is None:
            advice = did_you_mean(word, codes_and_names(), "lint prints codes: TF401")
            found.append(finding("TF017", f"rules: there is no code {word}", at, help=advice))
        elif not can_be_allowed(code):
            found.append(finding("TF017", f"rules: {code} {CATALOGUE[code].name} cannot be set", at, help="remove it"))
    return found


def _covers(allow: Allow, found: Finding) -> bool:
    at = found.span
    if at is None or at.file != allow.at.file or found.code not in allow.codes:
        return False
    return allow.line <= at.line <= max(allow.line, allow.last)


def idle(allows: Sequence[Allow], used: set[tuple[Allow, str]]) -> list[Finding]:
    """Return a finding for each comment that allows nothing, cannot allow what it names, or does not say why."""
    found = []
    for allow in allows:
        if not allow.codes:
            found.append(finding("TF012", "allow names no code", allow.at, help="allow TF401 because …"))
        for code in allow.codes:
            message = ""
            if code not in CATALOGUE:
                message = f"allow {code}: there is no such code"
            elif not can_be_allowed(code):
                message = f"allow {code}: {CATALOGUE[code].name} cannot be allowed"
            elif (allow, code) not in used:
                message = f"allow {code}: there is no {CATALOGUE[code].name} here"
            if message:
                advice = did_you_mean(code, CATALOGUE, "remove it") if code not in CATALOGUE else "remove it"
                found.append(finding("TF012", message, allow.at, help=advice))
        if allow.codes and not allow.reason:
            message = f"allow {', '.join(allow.codes)} does not say why"
            found.append(finding("TF013", message, allow.at, help="add: because …"))
    return found
