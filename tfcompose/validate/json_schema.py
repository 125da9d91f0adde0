"""The language as JSON Schema (draft 2020-12), made from the same description that the validator reads."""

from __future__ import annotations

import inspect
from typing import Any

from tfcompose.validate.claims import NodePresetSpec
from tfcompose.validate.preset import PresetSpec
from tfcompose.validate.schema import Model, Type
from tfcompose.validate.spec import RobotSpec

LANGUAGES: dict[str, type[Model]] = {"robot": RobotSpec, "preset": PresetSpec, "node": NodePresetSpec}


def json_schema(language: str) -> dict[str, Any]:
    """Return the schema of ``robot``, ``preset`` or ``node``, which is a preset of a node that publishes TF."""
    root = LANGUAGES[language]
    definitions: dict[str, Any] = {}
    _plain(root, definitions)
    own: dict[str, Any] = definitions.pop(root.__name__)
    if language == "preset":
        _laid_over(own, definitions)
    if language == "robot":
        own["patternProperties"] = {"^x-": {"description": "your own anchors; tfcompose does not read it"}}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": f"tfcompose {language}, version 1"}
    return head | own | {"$defs": dict(sorted(definitions.items()))}


def _laid_over(own: dict[str, Any], definitions: dict[str, Any]) -> None:
    """Let a file that is laid over another one leave out what that one says, and remove it with null."""
    own["required"] = ["preset"]
    for model in (own, *definitions.values()):
        if model is not own:
            model.pop("required", None)
        model["properties"] = {
            name: schema if name == "preset" else _removable(schema) for name, schema in model["properties"].items()
        }


def _removable(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of what may be null instead, and so may what is in it."""
    told = {key: schema[key] for key in ("description", "examples", "default") if key in schema}
    form = {key: value for key, value in schema.items() if key not in told}
    if form.get("additionalProperties"):
        form["additionalProperties"] = {"anyOf": [form["additionalProperties"], {"type": "null"}]}
    return told | ({"anyOf": [form, {"type": "null"}]} if form else {})


def _plain(described: Any, definitions: dict[str, Any]) -> Any:
    """Return the description as plain data, with each model among the definitions."""
    if isinstance(described, Type):
        return _plain(described.schema, definitions)
    if isinstance(described, type) and issubclass(described, Model):
        name = described.__name__
        if name not in definitions:
            definitions[name] = {}
            definitions[name] = _model(described, definitions)
        return {"$ref": f"#/$defs/{name}"}
    if isinstance(described, dict):
        return {key: _plain(value, definitions) for key, value in described.items()}
    if isinstance(described, list):
        return [_plain(item, definitions) for item in described]
    return described


def _model(cls: type[Model], definitions: dict[str, Any]) -> dict[str, Any]:
    properties: dict[str, Any] = {}
    for name, key in cls.KEYS.items():
        schema = _plain(key.type, definitions)
        shown = {"description": key.about} if key.about else {}
        examples = {"examples": list(key.examples)} if key.examples else {}
        default = {"default": _written(key.default)} if not key.required and _said(key.default) else {}
        properties[name] = schema | shown | examples | default
    required = [name for name, key in cls.KEYS.items() if key.required]
    schema = {"type": "object", "description": inspect.getdoc(cls), "properties": properties}
    return schema | {"additionalProperties": False} | ({"required": required} if required else {})


def _said(default: Any) -> bool:
    return default is not None and default not in ((), {}) and not isinstance(default, Model)


def _written(default: Any) -> Any:
    return list(default) if isinstance(default, tuple) else default
