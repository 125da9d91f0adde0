"""Stage ``check``: a Robot becomes findings, one rule a file."""

from tfcompose.check.allow import apply, code_of, idle, levelled, unknown_rules
from tfcompose.check.check import RULES, Rule, check
from tfcompose.check.edits import with_edits
from tfcompose.check.replaced import with_replaced

__all__ = [
    "RULES",
    "Rule",
    "apply",
    "check",
    "code_of",
    "idle",
    "levelled",
    "unknown_rules",
    "with_edits",
    "with_replaced",
]
