"""Stage ``check``: a Robot becomes findings, one rule a function, the rules of a family in one module."""

from tfcompose.check.check import RULES, apply, check, silenced, unused_allows, with_replaced
from tfcompose.check.rule import Rule

__all__ = ["RULES", "Rule", "apply", "check", "silenced", "unused_allows", "with_replaced"]
