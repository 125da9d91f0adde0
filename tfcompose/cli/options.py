"""Arguments that several commands have."""

from __future__ import annotations

from argparse import ArgumentTypeError
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argparse import ArgumentParser

DEFAULT_FILE = "robot.yaml"


def add_file(parser: ArgumentParser) -> None:
    """Add FILE."""
    parser.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE", help="default: robot.yaml")


def add_profiles(parser: ArgumentParser, text: str) -> None:
    """Add --profile, repeatable."""
    parser.add_argument(
        "-p", "--profile", action="append", default=[], metavar="NAME", dest="profiles", help=f"{text}; repeatable"
    )


def positive(text: str) -> float:
    """Read a positive number.

    Raises:
        ArgumentTypeError: if it is none.
    """
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e9:  # noqa: PLR2004 (in seconds thirty years)
        raise ArgumentTypeError(f"{text} is not a positive number")
    return value
