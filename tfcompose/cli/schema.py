"""``tfcompose schema``: the JSON Schema of the language.

Print the JSON Schema that editors and CI use.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from tfcompose.validate.json_schema import json_schema

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "language", nargs="?", choices=("robot", "preset", "node"), default="robot", help="default: robot"
    )


def run(arguments: Namespace) -> int:
    """Print the schema."""
    sys.stdout.write(schema_text(arguments.language))
    return 0


def schema_text(language: str) -> str:
    """Return the schema as the files under ``schemas/`` hold it."""
    return json.dumps(json_schema(language), indent=2, ensure_ascii=False) + "\n"
