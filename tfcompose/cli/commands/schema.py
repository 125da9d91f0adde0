"""``tfcompose schema``: the language as JSON Schema, or as a reference for people.

Print the JSON Schema that editors and CI use: of robot files, of presets of sensors and nodes, or of plan.json. With
--reference print every key of the language as Markdown instead.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from tfcompose.cli.shelves import library
from tfcompose.language.json_schema import json_schema
from tfcompose.language.reference import reference
from tfcompose.plan.schema import plan_schema
from tfcompose.resolve.presets import node_preset_names

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

LANGUAGES = ("robot", "preset", "node", "plan")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("language", nargs="?", choices=LANGUAGES, default="robot", help="default: robot")
    parser.add_argument("--reference", action="store_true", help="every key with its type, unit, default and example")


def run(arguments: Namespace) -> int:
    """Print the schema or the reference."""
    if not arguments.reference:
        sys.stdout.write(schema_text(arguments.language))
        return 0
    if arguments.language == "plan":
        sys.stderr.write("tfcompose schema: plan.json is written by build, and has a schema only\n")
        return 2
    sys.stdout.write(reference(arguments.language))
    return 0


def schema_text(language: str) -> str:
    """Return the schema as the files under ``schemas/`` hold it."""
    return json.dumps(_schema(language), indent=2, ensure_ascii=False) + "\n"


def _schema(language: str) -> dict[str, object]:
    if language == "plan":
        return plan_schema()
    known = library()
    presets = {name: known.get(name) for name in known.names}
    return json_schema(language, presets, node_preset_names())
