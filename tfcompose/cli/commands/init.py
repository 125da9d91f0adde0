"""Write a first robot file.

Write a small, commented robot file, and print the next commands. The file has no findings and can
be started at once. Existing files are not overwritten.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

FOLDER = Path(__file__).parents[2] / "data" / "templates"
#: By template: what it is, and the files that it is made of besides the first.
TEMPLATES = {
    "diffbot": ("a base with two driven wheels, a laser and a depth camera", ()),
    "arm": ("an arm of three joints on a bench, with a camera at its wrist", ()),
    "rover": ("a rover with odometry, SLAM, a lidar, an IMU and two cameras of one kind", ()),
    "fleet": ("two robots from one file on one map", ("cart.yaml",)),
}
SCHEMA = "robot.schema.json"


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "template", nargs="?", choices=tuple(TEMPLATES), default="diffbot", help="default: diffbot"
    )
    parser.add_argument("--name", metavar="NAME", help="the robot's name; default: the template's")
    parser.add_argument(
        "-o", "--output", metavar="FILE", default=DEFAULT_FILE, help=f"default: {DEFAULT_FILE}"
    )
    parser.add_argument(
        "--schema",
        action="store_true",
        help=f"also write {SCHEMA}, for completion and checks in editors",
    )
    parser.add_argument("--list", action="store_true", help="list the templates and exit")


def run(arguments: Namespace) -> int:
    """Write the files; exit code 0, 2 if one of them exists or cannot be written."""
    if arguments.list:
        width = max(map(len, TEMPLATES))
        print(*(f"{name:<{width}}  {about}" for name, (about, _) in TEMPLATES.items()), sep="\n")
        return 0
    if arguments.name is not None and not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", arguments.name):
        fail(
            f"{arguments.name} is not a robot's name: a letter, then letters, digits and _",
            UNREADABLE,
        )
    output = Path(arguments.output)
    files = _files(
        arguments.template,
        arguments.name or arguments.template,
        output,
        with_schema=arguments.schema,
    )
    from tfcompose.foundation.reading import exists

    there = [str(path) for path in files if exists(path) or path.is_symlink()]
    if there:
        fail(f"nothing was written: {', '.join(there)} exists; -o FILE names another", UNREADABLE)
    for path, text in files.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("x", encoding="utf-8", newline="\n") as stream:
                stream.write(text)
        except OSError as error:
            fail(f"{path} cannot be written: {error.strerror}", UNREADABLE)
    print(f"wrote {', '.join(map(str, files))}")
    print("next:", *(f"  {line}" for line in _next(output, files[output])), sep="\n")
    return 0


def _files(template: str, name: str, output: Path, *, with_schema: bool) -> dict[Path, str]:
    """Return the texts by file, the robot file first."""
    text = (FOLDER / f"{template}.yaml").read_text("utf-8")
    text = text.replace(f"\nrobot: {template}\n", f"\nrobot: {name}\n", 1)
    if with_schema:
        text = f"# yaml-language-server: $schema={SCHEMA}\n{text}"
    files = {output: text}
    for other in TEMPLATES[template][1]:
        files[output.with_name(other)] = (FOLDER / other).read_text("utf-8")
    if with_schema:
        from tfcompose.cli.schemas import schema_text

        files[output.with_name(SCHEMA)] = schema_text("robot")
    return files


def _next(output: Path, text: str) -> list[str]:
    """Return the next three commands with their purposes."""
    file = "" if str(output) == DEFAULT_FILE else f" {output}"
    profile = " -p demo" if "\nprofiles:" in text else ""
    commands = {
        f"tfcompose tree{file}": "the frames, and who publishes each edge",
        f"tfcompose lint{file}": "everything that is wrong with it",
        f"tfcompose up{file}{profile}": "start it, without hardware; Ctrl-C ends it",
    }
    width = max(map(len, commands))
    return [f"{command:<{width}}  # {what}" for command, what in commands.items()]
