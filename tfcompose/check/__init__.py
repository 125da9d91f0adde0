"""Stage ``check``: a Robot becomes findings, one rule a file."""

from tfcompose.check.allow import apply, idle
from tfcompose.check.check import RULES, Rule, check

__all__ = ["RULES", "Rule", "apply", "check", "idle"]
