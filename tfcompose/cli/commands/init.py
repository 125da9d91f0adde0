"""Write a first robot file.

Write a small, commented robot file, and print the next commands. The file has no findings and can
be started at once. Existing files are not overwritten.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.templates import SCHEMA, TEMPLATES, has_demo, print_next, template_files
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "template", nargs="?", choices=tuple(TEMPLATES), default="diffbot", help="default: diffbot"
    )
    parser.add_argument("--name", metavar="NAME", help="the robot's name; default: the template's")
    parser.add_argument("-o", "--output", metavar="FILE", help=f"default: {DEFAULT_FILE}")
    parser.add_argument(
        "--schema",
        action="store_true",
        help=f"also write {SCHEMA}, for completion and checks in editors",
    )
    parser.add_argument("--list", action="store_true", help="list the templates and exit")


def run(arguments: Namespace) -> int:
    """Write the files. Return 0, or 2 if a file exists or cannot be written."""
    if arguments.list:
        width = max(map(len, TEMPLATES))
        print(*(f"{name:<{width}}  {about}" for name, (about, _) in TEMPLATES.items()), sep="\n")
        return 0
    output = Path(arguments.output or DEFAULT_FILE)
    files = template_files(arguments, arguments.template, output)
    from tfcompose.foundation.reading import exists

    existing = [str(path) for path in files if exists(path) or path.is_symlink()]
    if existing:
        fail(
            f"nothing was written: {', '.join(existing)} exists; -o FILE names another", UNREADABLE
        )
    _create(files)
    print(f"wrote {', '.join(map(str, files))}")
    file = "" if str(output) == DEFAULT_FILE else f" {output}"
    profile = " -p demo" if has_demo(files[output]) else ""
    print_next(
        {
            f"tfcompose tree{file}": "the frames, and who publishes each edge",
            f"tfcompose lint{file}": "everything that is wrong with it",
            f"tfcompose up{file}{profile}": "start it, without hardware; Ctrl-C ends it",
        }
    )
    return 0


def _create(files: Mapping[Path, str]) -> None:
    """Create all files. If a file cannot be written, or after an interrupt, create none.

    Raises:
        SystemExit: after an error message that names the file that cannot be written.
    """
    created: list[Path] = []
    try:
        for path, text in files.items():
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                with path.open("x", encoding="utf-8", newline="\n") as stream:
                    created.append(path)
                    stream.write(text)
            except OSError as error:
                fail(f"{path} cannot be written: {error.strerror}", UNREADABLE)
    except BaseException:
        for path in created:
            path.unlink(missing_ok=True)
        raise
