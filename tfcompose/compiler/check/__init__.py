"""Rules over a ``Robot``: each rule is a function that yields the findings of one code.

A module holds the rules of one family. The catalogue explains the codes. ``check`` runs the rules
and applies the comments that allow findings.
"""

from tfcompose.compiler.check.check import (
    RULES,
    add_replaced_notes,
    apply,
    check,
    rules_of_tools,
    silence,
    unused_allows,
)
from tfcompose.compiler.check.rule import Rule

__all__ = [
    "RULES",
    "Rule",
    "add_replaced_notes",
    "apply",
    "check",
    "rules_of_tools",
    "silence",
    "unused_allows",
]
