"""Every rule over one robot. A rule that crashes is a finding, and the others go on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.check import bodies, joints, names, ownership, poses, processes, sensors, tree
from tfcompose.check.rule import Rule
from tfcompose.findings import Finding, Span, finding

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.model import Robot


def by_code(rules: Iterable[Rule]) -> dict[str, Rule]:
    """Return the rules by code, in the order of codes.

    Raises:
        ValueError: if two have one code.
    """
    table: dict[str, Rule] = {}
    for rule in sorted(rules, key=lambda rule: rule.code.code):
        if table.setdefault(rule.code.code, rule) is not rule:
            raise ValueError(f"two rules have the code {rule.code.code}")
    return table


_FAMILIES = (tree, ownership, poses, names, sensors, bodies, joints, processes)
RULES = by_code(value for family in _FAMILIES for value in vars(family).values() if isinstance(value, Rule))


def check(robot: Robot, rules: Iterable[Rule] = RULES.values()) -> list[Finding]:
    """Return what the rules find, in no particular order.

    Left out is what merely follows from a value that was refused already, what only this variant of the robot has no
    use for, and warnings about parts that somebody else wrote: ``lint`` of their files reports them.
    """
    found: list[Finding] = []
    for rule in rules:
        if rule.idle and robot.is_variant:
            continue
        try:
            found += [_of_part(one, robot) for one in rule.find(robot) if not _is_left_out(one, rule, robot)]
        except Exception as error:  # noqa: BLE001 (a rule's fault must not hide the others' findings)
            message = f"rule {rule.code.code} {rule.code.name} crashed: {type(error).__name__}: {error}"
            found.append(
                finding("TF903", message, Span(robot.file), help="this is a bug in tfcompose: please report it")
            )
    return found


def _is_left_out(found: Finding, rule: Rule, robot: Robot) -> bool:
    at = found.span
    if at is None:
        return False
    if rule.follows == "pose" and any(entry.holds(at) for entry in robot.refused):
        return True
    return found.severity == "warning" and at.file in robot.foreign and at.file in robot.part_notes


def _of_part(found: Finding, robot: Robot) -> Finding:
    """Return the finding, with a note for each part whose file it is about."""
    notes = robot.part_notes.get(found.span.file, ()) if found.span else ()
    return replace(found, notes=(*found.notes, *notes)) if notes else found
