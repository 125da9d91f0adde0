"""The language as JSON Schema (draft 2020-12), generated from the models.

Editors and check-jsonschema read the schemas.
"""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING, Any

from pydantic.json_schema import GenerateJsonSchema

from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.tool import installed_tools, load
from tfcompose.foundation.units import EXPRESSION
from tfcompose.spec.language.node_preset import NodePresetSpec
from tfcompose.spec.language.preset import PresetSpec
from tfcompose.spec.language.spec import describe_key, examples_of, fields_of, walk
from tfcompose.spec.language.tool_keys import full_robot_model
from tfcompose.spec.language.values import COMPUTED
from tfcompose.spec.load.scalars import plain

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from pydantic.fields import FieldInfo

    from tfcompose.spec.language.preset import PresetOption
    from tfcompose.spec.language.spec import Spec

#: Languages of the core other than the language of robot files.
_MODELS: dict[str, type[Spec]] = {"preset": PresetSpec, "node": NodePresetSpec}


def model_of(language: str) -> type[Spec]:
    """Return the model of ``robot``, ``preset``, ``node`` or a tool's language."""
    if language == "robot":
        return full_robot_model()
    model: type[Spec] = _MODELS.get(language) or load(
        installed_tools().languages()[language].model
    )
    return model


def json_schema(
    language: str, presets: Mapping[str, PresetSpec], nodes: Iterable[str]
) -> dict[str, Any]:
    """Return the schema of ``robot``, of an ``overlay`` of a robot, or of another language.

    The schema of a robot contains the names and options of ``presets``, and the names of
    ``nodes``, which are presets of nodes.
    """
    is_robot = language in {"robot", "overlay"}
    root = model_of("robot" if is_robot else language)
    definition = _with_named_types(
        root.model_json_schema(schema_generator=_Generator), {model for _, model in walk(root)}
    )
    if not is_robot:
        definition = _without_expressions(definition)
    definitions = definition.pop("$defs", {})
    for _, kind in walk(root):
        schema = definition if kind is root else definitions[kind.__name__]
        for name, field in fields_of(kind).items():
            form = schema["properties"][name]
            form.pop("to", None)  # JSON Schema cannot express which processes a key applies to
            form |= {"description": describe_key(field), "examples": _examples(field, form)}
        if kind is not root:
            schema["title"] = kind.__name__.removesuffix("Spec")
        _exclude(schema, getattr(kind, "EXCLUSIVE", ()), definitions)
    if language == "preset":
        _overlaid(definition, definitions)
    if is_robot:
        definition["patternProperties"] = {
            "^x-": {"description": "your own anchors, which tfcompose does not read"}
        }
        _add_codes(definition["properties"]["rules"], definitions)
        _add_presets(definition, definitions, presets)
        for kind in ("NamedNode", "NodeSpec"):
            definitions[kind]["properties"]["preset"] |= {
                "anyOf": [{"enum": sorted(nodes)}, _COMPUTED]
            }
        _add_profiles(
            definition, definitions, place="#/$defs/Robot" if language == "overlay" else "#"
        )
    if language == "overlay":
        definitions["Robot"], profile = definition, definitions["Profile"]
        properties = {
            name: schema for name, schema in profile["properties"].items() if name != "when"
        }
        definition = profile | {
            "properties": properties | {"profiles": definition["properties"]["profiles"]}
        }
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"tfcompose {language}, version 1",
    }
    return head | definition | {"$defs": dict(sorted(definitions.items()))}


def _with_named_types(schema: dict[str, Any], mappings: Collection[Any]) -> dict[str, Any]:
    """Return the schema with the definitions of types other than mappings inlined.

    Editors ignore keys next to ``$ref``.
    """
    names = {kind.__name__ for kind in mappings}
    types = {
        f"#/$defs/{name}": definition
        for name, definition in schema["$defs"].items()
        if name not in names
    }

    def inline(value: Any) -> Any:
        if isinstance(value, list):
            return [inline(item) for item in value]
        if not isinstance(value, dict):
            return value
        inlined = {key: inline(item) for key, item in value.items()}
        if value.get("$ref") not in types:
            return inlined
        return dict(sorted((inline(types[inlined.pop("$ref")]) | inlined).items()))

    inside = {name: definition for name, definition in schema["$defs"].items() if name in names}
    made: dict[str, Any] = inline(schema | {"$defs": inside})
    return made


def _without_expressions(schema: Any) -> Any:
    """Return the schema without ``${…}``, because only robot files compute expressions."""
    if isinstance(schema, list):
        return [_without_expressions(item) for item in schema if item not in _EXPRESSIONS]
    if not isinstance(schema, dict):
        return schema
    made = {key: _without_expressions(item) for key, item in schema.items()}
    if isinstance(made.get("pattern"), str):
        made["pattern"] = made["pattern"].removeprefix(f"{EXPRESSION}|")
    if len(made.get("anyOf", ())) == 1:
        made |= made.pop("anyOf")[0]
    return made


_EXPRESSIONS = ({"type": "string", "pattern": EXPRESSION}, COMPUTED)


class _Generator(GenerateJsonSchema):
    """Omits everything that is useless in an editor.

    This includes titles, empty defaults, and null for optional keys.
    """

    def get_title_from_name(self, name: str) -> str:
        """Return no title, because the key is sufficient."""
        del name
        return ""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Return False, because no key has a title."""
        del schema
        return False

    def model_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema of a model with its docstring."""
        made = super().model_schema(schema)
        made.pop("title", None)
        return {"description": inspect.getdoc(schema["cls"]), **made}

    def dataclass_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema of a dataclass with its docstring."""
        made = super().dataclass_schema(schema)
        made.pop("title", None)
        return {"description": inspect.getdoc(schema["cls"]), **made}

    def nullable_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema without null, because only an overlay uses null, to remove a key."""
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema with its default if that is a plain value."""
        made = super().default_schema(schema)
        if made.get("default") in (None, [], {}, "") or isinstance(made.get("default"), dict):
            made.pop("default", None)
        return made

    def literal_schema(self, schema: Any) -> dict[str, Any]:
        """Return only the choices."""
        return {"enum": list(schema["expected"])}

    def tagged_union_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema of alternatives that differ in their value, not in a key."""
        made = super().tagged_union_schema(schema)
        return {"anyOf": made["oneOf"]} if "oneOf" in made else made

    def tuple_schema(self, schema: Any) -> dict[str, Any]:
        """Return the schema of a list. Editors support ``items``, but not ``prefixItems``."""
        made = super().tuple_schema(schema)
        items = made.pop("prefixItems", None)
        return made | {"items": items[0]} if items else made


def _examples(field: FieldInfo, form: dict[str, Any]) -> list[Any]:
    """Return the examples that an editor can insert.

    If a key has several forms, mappings are omitted, because editors show them as a single word.
    """
    examples = examples_of(field)
    return (
        [example for example in examples if not isinstance(example, dict)]
        if "anyOf" in form
        else examples
    )


def _exclude(
    schema: dict[str, Any], groups: Iterable[frozenset[str]], definitions: dict[str, Any]
) -> None:
    """Allow a mapping only one key of each group."""
    for keys in map(sorted, groups):
        name = f"OneOf_{'_'.join(keys)}"
        definitions[name] = {
            "allOf": [
                {
                    "if": {"required": [key]},
                    "then": {
                        "properties": {excluded: False for excluded in keys if excluded != key}
                    },
                }
                for key in keys
            ]
        }
        schema.setdefault("allOf", []).append({"$ref": f"#/$defs/{name}"})


def _overlaid(definition: dict[str, Any], definitions: dict[str, Any]) -> None:
    """Allow an overlay to omit required keys, and to remove keys with null."""
    definition["required"] = ["preset"]
    for model in (
        definition,
        *(definition for definition in definitions.values() if "properties" in definition),
    ):
        if model is not definition:
            model.pop("required", None)
        for name, schema in model["properties"].items():
            if name != "preset":
                model["properties"][name] = _removable(schema)


def _removable(schema: dict[str, Any]) -> dict[str, Any]:
    """Return the schema with null as an alternative, also for the entries of a mapping."""
    about = {key: schema[key] for key in ("description", "examples", "default") if key in schema}
    form = {key: value for key, value in schema.items() if key not in about}
    if isinstance(form.get("additionalProperties"), dict) and form["additionalProperties"]:
        form["additionalProperties"] = {"anyOf": [form["additionalProperties"], {"type": "null"}]}
    return about | ({"anyOf": [form, {"type": "null"}]} if form else {})


def _add_codes(rules: dict[str, Any], definitions: dict[str, Any]) -> None:
    """Add the codes of findings whose severity can be set to ``rules``."""
    definitions["RuleSetting"] = rules.pop("additionalProperties")
    setting = {"$ref": "#/$defs/RuleSetting"}
    codes = [code for code in CATALOGUE.values() if code.can_be_allowed]
    rules["properties"] = {
        code.code: setting | {"description": code.name.replace("_", " ")} for code in codes
    }
    rules["additionalProperties"] = False


def _add_profiles(definition: dict[str, Any], definitions: dict[str, Any], place: str) -> None:
    """Allow profiles to contain all keys of a robot file except ``profiles``, all optional.

    All these keys can also be removed with null. This includes nested mappings, but not mappings
    in lists, because a profile replaces a complete list. ``place`` points to the schema
    ``definition`` of the robot.
    """
    mappings = {
        f"#/$defs/{name}": schema for name, schema in definitions.items() if "properties" in schema
    }
    for pointer, schema in mappings.items():
        definitions[f"{pointer.rpartition('/')[2]}Overlay"] = _overlay(pointer, schema, mappings)
    robot = {
        key: definition[key]
        for key in ("type", "properties", "additionalProperties", "patternProperties")
    }
    robot["properties"] = {
        name: schema for name, schema in definition["properties"].items() if name != "profiles"
    }
    definitions["Profile"] = {"description": "What is merged over the robot."} | _overlay(
        place, robot, mappings
    )
    when = definitions["FrameSpec"]["properties"]["when"]
    about = (
        "merged also where this holds, without --profile; it is decided by the file with the other"
        " profiles"
    )
    definitions["Profile"]["properties"]["when"] = when | {"description": about}
    definition["properties"]["profiles"]["additionalProperties"] = {"$ref": "#/$defs/Profile"}


def _overlay(place: str, schema: dict[str, Any], mappings: Collection[str]) -> dict[str, Any]:
    """Return the schema of a mapping that is merged over the mapping at ``place``."""

    def merge(value: Any) -> Any:
        if isinstance(value, list):
            return [merge(item) for item in value]
        if not isinstance(value, dict):
            return value
        if value.get("$ref") in mappings:
            return value | {"$ref": f"{value['$ref']}Overlay"}
        result = {}
        for key, item in value.items():
            result[key] = item if key in {"items", "default", "examples"} else merge(item)
        return result

    def optional(name: str, value: dict[str, Any]) -> dict[str, Any]:
        again = merge(value)
        form = {"$ref": f"{place}/properties/{name}"} if again == value else again
        return _removable({"description": value["description"]} | form)

    made = {key: value for key, value in schema.items() if key != "required"}
    return made | {
        "properties": {name: optional(name, value) for name, value in schema["properties"].items()}
    }


#: A name that contains an expression.
_COMPUTED = {"pattern": r"\$\{"}


def _add_presets(
    definition: dict[str, Any], definitions: dict[str, Any], presets: Mapping[str, PresetSpec]
) -> None:
    """Add the names of presets to ``preset``, and the options of the chosen preset to ``options``.

    An unknown name can only be a user's preset, from ``preset_path`` or an included file with that
    key.
    """
    sensor = definitions["SensorSpec"]
    sensor["properties"]["preset"] |= {
        "anyOf": [{"enum": sorted(presets)}, {"pattern": "^[^/]+/[^/]+$"}, _COMPUTED]
    }
    by_options: dict[str, list[str]] = {}
    schemas: dict[str, dict[str, Any]] = {}
    for name, preset in sorted(presets.items()):
        options = {key: _option(option) for key, option in preset.options.items()}
        by_options.setdefault(repr(options), []).append(name)
        schemas[repr(options)] = options
    sensor["allOf"].append({"$ref": "#/$defs/SensorOptions"})
    definitions["SensorOptions"] = {
        "allOf": [
            {
                "if": {"properties": {"preset": {"enum": names}}, "required": ["preset"]},
                "then": {
                    "properties": {
                        "options": {"properties": schemas[key], "additionalProperties": False}
                    }
                },
            }
            for key, names in by_options.items()
        ]
    }
    vendors = sorted({re.escape(name.partition("/")[0]) for name in presets})
    schema = {
        "anyOf": [
            {"enum": sorted(presets)},
            {"pattern": f"^(?!({'|'.join(vendors)})/)"},
            _COMPUTED,
        ]
    }
    definition["if"] = {"anyOf": [{"required": ["preset_path"]}, {"required": ["include"]}]}
    definition["else"] = {
        "properties": {"sensors": {"additionalProperties": {"properties": {"preset": schema}}}},
    }


def _option(option: PresetOption) -> dict[str, Any]:
    """Return the schema of an option of a preset."""
    forms: dict[str, dict[str, Any]] = {
        "bool": {"type": "boolean"},
        "text": {"type": "string"},
        "choice": {"enum": list(dict.fromkeys([*option.variants, *map(plain, option.variants)]))},
        "set": {"type": "array", "items": {"enum": list(option.values)}},
    }
    schema: dict[str, Any] = {"anyOf": [forms[option.type], COMPUTED]}
    if option.about:
        schema["description"] = option.about
    if option.default is not None:
        schema["default"] = option.default
    return schema
