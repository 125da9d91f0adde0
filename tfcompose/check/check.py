"""Every rule over one robot. A rule that crashes is a finding, and the others go on."""

from __future__ import annotations

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
    """Return what the rules find, in no particular order."""
    found: list[Finding] = []
    for rule in rules:
        try:
            found += list(rule.find(robot))
        except Exception as error:  # noqa: BLE001 (a rule's fault must not hide the others' findings)
            message = f"the rule {rule.code.code} {rule.code.name} crashed: {type(error).__name__}: {error}"
            found.append(finding("TF903", message, Span(robot.file), help="this is a fault of tfcompose: report it"))
    return found
