"""Templates of ``init``: their files, and the commands to run after them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

FOLDER = Path(__file__).parents[1] / "data" / "templates"
#: Description of each template, and its files besides the robot file.
TEMPLATES = {
    "diffbot": ("a base with two driven wheels, a laser and a depth camera", ()),
    "arm": ("an arm of three joints on a bench, with a camera at its wrist", ()),
    "rover": ("a rover with odometry, SLAM, a lidar, an IMU and two cameras of one kind", ()),
    "fleet": ("two robots from one file on one map", ("cart.yaml",)),
}
SCHEMA = "robot.schema.json"


def template_files(arguments: Namespace, default_name: str, output: Path) -> dict[Path, str]:
    """Return the texts of a template by file, the robot file first.

    The robot's name comes from the command line, or else is ``default_name``.

    Raises:
        SystemExit: after an error message, if the name is invalid.
    """
    template = arguments.template
    name = default_name if arguments.name is None else arguments.name
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        fail(f"{name} is not a robot's name: a letter, then letters, digits and _", UNREADABLE)
    text = (FOLDER / f"{template}.yaml").read_text("utf-8")
    text = text.replace(f"\nrobot: {template}\n", f"\nrobot: {name}\n", 1)
    if arguments.schema:
        text = f"# yaml-language-server: $schema={SCHEMA}\n{text}"
    files = {output: text}
    for file_name in TEMPLATES[template][1]:
        files[output.with_name(file_name)] = (FOLDER / file_name).read_text("utf-8")
    if arguments.schema:
        from tfcompose.cli.schemas import schema_text

        files[output.with_name(SCHEMA)] = schema_text("robot")
    return files


def has_demo(text: str) -> bool:
    """Return whether the template needs its profile demo to start without hardware."""
    return "\nprofiles:" in text


def print_next(commands: Mapping[str, str]) -> None:
    """Print the next commands, each with its purpose."""
    width = max(map(len, commands))
    lines = [f"  {command:<{width}}  # {purpose}" for command, purpose in commands.items()]
    print("next:", *lines, sep="\n")
