"""The JSON Schema of ``plan.json``, made from the classes that a plan is read by.

``schemas/plan.schema.json`` holds it; a test says when it must be made anew, by ``tfcompose schema
plan``.
"""

from __future__ import annotations

import inspect
import types
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from tfcompose.model.plan import Plan
from tfcompose.model.plan.codec import Rule, fields_of, is_record

_TYPES: dict[Any, dict[str, Any]] = {
    str: {"type": "string"},
    float: {"type": "number"},
    int: {"type": "integer"},
    bool: {"type": "boolean"},
    type(None): {"type": "null"},
    Any: {},
}


def plan_schema() -> dict[str, Any]:
    """Return the schema, draft 2020-12.

    Keys that it does not name are allowed: a later plan may have more.
    """
    made: dict[str, dict[str, Any]] = {}
    schema = _object(Plan, made)
    return (
        {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "tfcompose plan"}
        | schema
        | {"$defs": dict(sorted(made.items()))}
    )


def _object(cls: Any, made: dict[str, dict[str, Any]]) -> dict[str, Any]:
    properties: dict[str, dict[str, Any]] = {}
    required = []
    for field in fields_of(cls):
        if field.flat:
            inner = _object(
                get_args(field.kind)[0] if get_origin(field.kind) is Annotated else field.kind,
                made,
            )
            properties |= inner["properties"]
            required += inner["required"]
        else:
            about = {"description": field.description} if field.description else {}
            properties[field.name] = about | _of(field.kind, made)
            required += [] if field.omitted else [field.name]
    description = inspect.cleandoc(cls.__doc__ or "")
    return {
        "type": "object",
        "description": description,
        "properties": properties,
        "required": required,
    }


def _of(kind: Any, made: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the schema of a type; a class is put into ``made`` and referred to."""
    if kind in _TYPES:
        return _TYPES[kind]
    if is_record(kind):
        if kind.__name__ not in made:
            made[kind.__name__] = {}
            made[kind.__name__] = _object(kind, made)
        return {"$ref": f"#/$defs/{kind.__name__}"}
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Literal:
        return {"enum": list(inner)} if inner[1:] else {"const": inner[0]}
    if origin is Annotated:
        schema = _of(inner[0], made)
        return schema | {
            key: value
            for rule in inner[1:]
            if isinstance(rule, Rule)
            for key, value in rule.schema.items()
        }
    if origin in (Union, types.UnionType):
        return {"anyOf": [_of(one, made) for one in inner]}
    if origin is dict:
        return {"type": "object", "additionalProperties": _of(inner[1], made)}
    if origin is tuple and inner[-1] is Ellipsis:
        return {"type": "array", "items": _of(inner[0], made)}
    if origin is tuple and len(set(inner)) == 1:
        return {
            "type": "array",
            "items": _of(inner[0], made),
            "minItems": len(inner),
            "maxItems": len(inner),
        }
    raise TypeError(f"a plan holds no {kind}")  # a field of a new kind must be described here
