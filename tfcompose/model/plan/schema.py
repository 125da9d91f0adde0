"""The JSON Schema of ``plan.json``, generated from the classes that read a plan.

``schemas/plan.schema.json`` contains it. If it is outdated, a test fails; ``tfcompose schema
plan`` prints the new schema.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import fields, is_dataclass
from typing import Any

import msgspec

from tfcompose.model import plan

#: A field in the source of its class, after the ``#:`` lines that describe it.
_DESCRIBED = re.compile(r"^((?: {4}#: .*\n)+) {4}(\w+):", re.MULTILINE)


def field_comments(kind: type) -> dict[str, str]:
    """Return the ``#:`` comments of a class's fields, by field."""
    comments = _DESCRIBED.findall(inspect.getsource(kind))
    return {field: " ".join(text.replace("#: ", "").split()) for text, field in comments}


def plan_schema() -> dict[str, Any]:
    """Return the schema, draft 2020-12.

    Unknown keys are allowed, because a later version may add keys.
    """
    schema = msgspec.json.schema(plan.Plan)
    classes: dict[str, dict[str, Any]] = schema["$defs"]
    for name, described in classes.items():
        described["description"] = inspect.cleandoc(described.get("description", ""))
        kind = getattr(plan, name, None)
        if not isinstance(kind, type) or not is_dataclass(kind):
            continue
        for key, comment in field_comments(kind).items():
            described["properties"][key]["description"] = comment
        for field in fields(kind):
            described["properties"][field.name] |= field.metadata
    classes["Plan"]["required"].insert(0, "version")
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "tfcompose plan"}
    return head | schema
