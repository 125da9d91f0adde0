"""JSON Schemas of all files that users write, and of plan.json."""

from __future__ import annotations

import json

from tfcompose.foundation.tool import installed_tools

#: The languages of the core.
LANGUAGES = ("robot", "overlay", "preset", "node", "plan")


def languages() -> tuple[str, ...]:
    """Return the languages of the core and of all installed tools."""
    return (*LANGUAGES, *installed_tools().languages())


#: Languages without a reference of keys for users, and the reason.
WITHOUT_REFERENCE = {
    "overlay": "an overlay has the keys of a robot file",
    "plan": "build writes plan.json",
}


def languages_with_reference() -> list[str]:
    """Return the languages whose keys have a reference for users."""
    return [language for language in languages() if language not in WITHOUT_REFERENCE]


def schema_text(language: str) -> str:
    """Return the JSON Schema, as in the files under ``schemas/``."""
    return json.dumps(_schema(language), indent=2, ensure_ascii=False) + "\n"


def _schema(language: str) -> dict[str, object]:
    if language == "plan":
        from tfcompose.model.plan.schema import plan_schema

        return plan_schema()
    from tfcompose.cli.compiling import library
    from tfcompose.compiler.resolve.presets import node_preset_names
    from tfcompose.spec.language.json_schema import json_schema

    presets_of_product = library()
    presets = {name: presets_of_product.get(name) for name in presets_of_product.names}
    return json_schema(language, presets, node_preset_names())
