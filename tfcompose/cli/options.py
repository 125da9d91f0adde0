"""Arguments that several commands have."""

from __future__ import annotations

import re
from argparse import ArgumentTypeError
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from argparse import ArgumentParser

DEFAULT_FILE = "robot.yaml"
TF_TOPICS = ("tf", "tf_static")


def add_file(parser: ArgumentParser) -> None:
    """Add FILE."""
    parser.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE", help="default: robot.yaml")


def add_variant(parser: ArgumentParser, text: str = "lay this profile over the file") -> None:
    """Add what is laid over a robot file: --profile, then --overlay, then --set; each repeatable."""
    parser.add_argument(
        "-p", "--profile", action="append", default=[], metavar="NAME", dest="profiles", help=f"{text}; repeatable"
    )
    parser.add_argument(
        "-f", "--overlay", action="append", default=[], metavar="FILE", dest="overlays",
        help="lay this file over it, after the profiles; repeatable",
    )  # fmt: skip
    parser.add_argument(
        "--set", action="append", default=[], metavar="PATH=VALUE", dest="settings",
        help="set one value, last of all: sensors.camera.tf=driver; repeatable",
    )  # fmt: skip


def namespace(text: str) -> str:
    """Read a namespace as ROS has it, and return it without slashes around; empty for the global one.

    Raises:
        ArgumentTypeError: if no topic can be below it.
    """
    name = text.strip("/")
    if name in TF_TOPICS or name.endswith(tuple(f"/{topic}" for topic in TF_TOPICS)):
        raise ArgumentTypeError(f"{text} is a topic; the namespace is what stands before it")
    if name and not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*", name):
        raise ArgumentTypeError(f"{text} is no namespace, such as robot1: letters, digits and _, with / between")
    return name


def positive(text: str) -> float:
    """Read a positive number.

    Raises:
        ArgumentTypeError: if it is none.
    """
    value = _number(text)
    if value is None or value == 0:
        raise ArgumentTypeError(f"{text} is not a positive number below a billion")
    return value


def counted(text: str) -> int:
    """Read a whole number of 0 or more.

    Raises:
        ArgumentTypeError: if it is none.
    """
    if not text.isascii() or not text.isdigit() or len(text) > 9:  # noqa: PLR2004 (a billion lines)
        raise ArgumentTypeError(f"{text} is not a whole number of 0 or more")
    return int(text)


def not_negative(text: str) -> float:
    """Read a number that is 0 or more.

    Raises:
        ArgumentTypeError: if it is none.
    """
    value = _number(text)
    if value is None:
        raise ArgumentTypeError(f"{text} is not a number of 0 or more, below a billion")
    return value


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0 <= value < 1e9 else None  # noqa: PLR2004 (in seconds thirty years)
