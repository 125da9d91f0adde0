"""The JSON Schema of ``plan.json``, made from the classes that hold a plan and what ``file`` writes of them."""

from __future__ import annotations

import inspect
import types
from dataclasses import fields, is_dataclass
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from tfcompose.geometry import Pose
from tfcompose.plan import VERSION, Plan

_NUMBER = {"type": "number"}
_TEXT = {"type": "string"}
_TYPES: dict[Any, dict[str, Any]] = {
    str: _TEXT,
    float: _NUMBER,
    int: {"type": "integer"},
    bool: {"type": "boolean"},
    Any: {},
}
_EDGE = {
    "type": "object",
    "properties": {"parent": _TEXT, "child": _TEXT},
    "required": ["parent", "child"],
}

#: Fields that are written otherwise than they are held, by class and field.
_WRITTEN: dict[tuple[str, str], dict[str, Any]] = {
    ("Plan", "version"): {"const": VERSION},
    ("PlanEdge", "source"): {
        "type": "object",
        "description": "where the edge stands in the robot file",
        "properties": {"file": _TEXT, "line": {"type": "integer"}},
        "required": ["file", "line"],
    },
    ("GuardPolicy", "allow"): {"type": "array", "items": _EDGE},
}
#: Fields that are left out where there is nothing to say.
_LEFT_OUT = {
    "GuardPolicy": {"fence"},
    "Plan": {"host"},
    "PlanEdge": {"joint", "switched"},
    "PlanProcess": {"simulate", "description", "drives", "switches", "namespace"},
}


def plan_schema() -> dict[str, Any]:
    """Return the schema, draft 2020-12. Keys that it does not name are allowed: a later plan may have more."""
    made: dict[str, dict[str, Any]] = {}
    schema = _object(Plan, made)
    return (
        {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "tfcompose plan"}
        | schema
        | {"$defs": dict(sorted(made.items()))}
    )


def _object(cls: type, made: dict[str, dict[str, Any]]) -> dict[str, Any]:
    name, hints = cls.__name__, get_type_hints(cls)
    properties: dict[str, dict[str, Any]] = {}
    for one in fields(cls):
        if hints[one.name] is Pose:
            properties["xyz"], properties["quat_xyzw"] = _list(_NUMBER, 3), _list(_NUMBER, 4)
        else:
            properties[one.name] = _WRITTEN.get((name, one.name)) or _of(hints[one.name], made)
    return {
        "type": "object",
        "description": inspect.cleandoc(cls.__doc__ or ""),
        "properties": properties,
        "required": [key for key in properties if key not in _LEFT_OUT.get(name, ())],
    }


def _of(kind: Any, made: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return the schema of a type; a class is put into ``made`` and referred to."""
    if kind in _TYPES:
        return _TYPES[kind]
    if is_dataclass(kind) and isinstance(kind, type):
        if kind.__name__ not in made:
            made[kind.__name__] = {}
            made[kind.__name__] = _object(kind, made)
        return {"$ref": f"#/$defs/{kind.__name__}"}
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Literal:
        return {"enum": list(inner)}
    if origin in (Union, types.UnionType):
        return {"anyOf": [{"type": "null"} if one is type(None) else _of(one, made) for one in inner]}
    if origin is dict:
        return {"type": "object", "additionalProperties": _of(inner[1], made)}
    if origin is tuple and inner[-1] is Ellipsis:
        return {"type": "array", "items": _of(inner[0], made)}
    if origin is tuple:
        return _list(_of(inner[0], made), len(inner))
    raise TypeError(f"a plan holds no {kind}")  # a field of a new kind must be described here


def _list(items: dict[str, Any], count: int) -> dict[str, Any]:
    return {"type": "array", "items": items, "minItems": count, "maxItems": count}
