"""``tfcompose schema``: the JSON Schema of the language.

Print the JSON Schema that editors and CI use: of robot files, of presets of sensors and nodes, or of plan.json.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from tfcompose.plan.schema import plan_schema
from tfcompose.validate.json_schema import json_schema

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

LANGUAGES = ("robot", "preset", "node", "plan")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("language", nargs="?", choices=LANGUAGES, default="robot", help="default: robot")


def run(arguments: Namespace) -> int:
    """Print the schema."""
    sys.stdout.write(schema_text(arguments.language))
    return 0


def schema_text(language: str) -> str:
    """Return the schema as the files under ``schemas/`` hold it."""
    schema = plan_schema() if language == "plan" else json_schema(language)
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
