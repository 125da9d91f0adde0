"""What there is to say about each code: for a rule its docstring, for the others the text here.

A page's first line says what is wrong; what follows says why it matters and what to do.
"""

from __future__ import annotations

import inspect

from tfcompose.check.check import RULES
from tfcompose.check.pages import robot, running, text, tool

PAGES = text.PAGES | robot.PAGES | running.PAGES | tool.PAGES


def page(code: str) -> str:
    """Return the page of a code.

    Raises:
        KeyError: if there is no such code.
    """
    for rule in RULES:
        if rule.code == code:
            return inspect.getdoc(rule.check) or ""
    return PAGES[code]


def rule_table() -> str:
    """Return the rules as a table in Markdown: code, name, severity, and the first line of the page."""
    rows = ["| code | name | severity | what is wrong |", "|---|---|---|---|"]
    for rule in sorted(RULES, key=lambda rule: rule.code):
        first = page(rule.code).partition("\n")[0]
        rows.append(f"| {rule.code} | {rule.name} | {rule.severity} | {first} |")
    return "\n".join(rows) + "\n"
