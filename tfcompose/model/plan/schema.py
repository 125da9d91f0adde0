"""The JSON Schema of ``plan.json``, made from the classes that a plan is read by.

``schemas/plan.schema.json`` holds it; a test says when it must be made anew, by ``tfcompose schema
plan``.
"""

from __future__ import annotations

import inspect
from dataclasses import fields, is_dataclass
from typing import Any

import msgspec

from tfcompose.model import plan


def plan_schema() -> dict[str, Any]:
    """Return the schema, draft 2020-12.

    Keys that it does not name are allowed: a later plan may have more.
    """
    schema = msgspec.json.schema(plan.Plan)
    classes: dict[str, dict[str, Any]] = schema["$defs"]
    for name, described in classes.items():
        described["description"] = inspect.cleandoc(described.get("description", ""))
        kind = getattr(plan, name, None)
        for field in fields(kind) if is_dataclass(kind) else ():
            described["properties"][field.name] |= field.metadata
    classes["Plan"]["required"].insert(0, "version")
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "tfcompose plan"}
    return head | schema
