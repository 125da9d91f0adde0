"""Stage ``check``: a Robot becomes findings, one rule a file."""

from tfcompose.check.allow import apply, code_of, idle, levelled, unknown_rules
from tfcompose.check.check import RULES, Rule, check

__all__ = ["RULES", "Rule", "apply", "check", "code_of", "idle", "levelled", "unknown_rules"]
