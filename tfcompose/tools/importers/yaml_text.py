"""Expressions and arguments of a robot file among texts that may hold anything."""

from __future__ import annotations

import re
from typing import Any

from tfcompose.foundation.yaml_text import Bare, entry


class Expression(str):
    """An expression, which is computed: ``${…}`` in the written file."""

    __slots__ = ()


def without_expressions(
    sections: dict[str, dict[str, Any]],
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Return sections without accidental expressions, and the variable they need."""
    lines = (
        entry("vars", {"dollar": "$"}) if any("${" in value for value in _texts(sections)) else []
    )
    return _escaped(sections), lines


#: What stands for an argument of the robot file among texts that may hold anything: its name, and
#: its value.
_ARGUMENT = re.compile("\x04([^\x05]*)\x05([^\x06]*)\x06")


def argument(name: str, value: str) -> str:
    """Return what stands for an argument that has this value.

    ``${args.name}`` in the written file.
    """
    return f"\x04{name}\x05{value}\x06"


def arguments_in(value: Any) -> set[str]:
    """Return the names of the arguments in data."""
    return {found[1] for one in _texts(value) for found in _ARGUMENT.finditer(one)}


def with_values(value: str) -> str:
    """Return a text with the values of its arguments."""
    return _ARGUMENT.sub(r"\2", value)


def _texts(value: Any) -> list[str]:
    """Return the texts in which expressions are looked for: in a key none is."""
    if isinstance(value, dict):
        return [one for item in value.values() for one in _texts(item)]
    if isinstance(value, (list, tuple)):
        return [one for item in value for one in _texts(item)]
    return [value] if isinstance(value, str) and not isinstance(value, Expression) else []


def _escaped(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _escaped(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_escaped(item) for item in value]
    if not isinstance(value, str):
        return value
    if isinstance(value, Expression):
        return f"${{{value}}}"
    text = _ARGUMENT.sub(lambda found: f"${{args.{found[1]}}}", value.replace("${", "${dollar}{"))
    return Bare(f'"{text}"') if text != value and isinstance(value, Bare) else type(value)(text)
