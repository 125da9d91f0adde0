"""Stage ``check``: a Robot becomes findings, one rule a function, the rules of a family in one module."""

from tfcompose.check.allow import apply, idle, levelled, unknown_rules
from tfcompose.check.check import RULES, check
from tfcompose.check.edits import with_edits
from tfcompose.check.replaced import with_replaced
from tfcompose.check.rule import Rule

__all__ = [
    "RULES",
    "Rule",
    "apply",
    "check",
    "idle",
    "levelled",
    "unknown_rules",
    "with_edits",
    "with_replaced",
]
