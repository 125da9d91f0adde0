"""Stage ``check``: a Robot becomes findings, one rule a file."""

from tfcompose.check.check import RULES, Rule, check

__all__ = ["RULES", "Rule", "check"]
