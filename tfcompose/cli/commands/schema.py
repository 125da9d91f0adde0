"""Print the language as JSON Schema, or as a reference.

Print a JSON Schema for editors and CI: for robot files, overlays, presets of sensors or nodes,
plan.json, or a file of a tool, such as fleet.yaml. With --reference, print every key as Markdown
instead.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.cli.schemas import WITHOUT_REFERENCE, languages, schema_text
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "language", nargs="?", choices=languages(), default="robot", help="default: robot"
    )
    parser.add_argument(
        "--reference",
        action="store_true",
        help="every key with its type, unit, default and example",
    )


def run(arguments: Namespace) -> int:
    """Print the schema or the reference."""
    if not arguments.reference:
        sys.stdout.write(schema_text(arguments.language))
        return 0
    if arguments.language in WITHOUT_REFERENCE:
        fail(f"there is no reference: {WITHOUT_REFERENCE[arguments.language]}", UNREADABLE)
    from tfcompose.spec.language.reference import reference

    sys.stdout.write(reference(arguments.language))
    return 0
