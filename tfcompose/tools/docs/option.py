"""Option ``--html`` of ``help``: write the documentation as a site."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.foundation.reading import exists

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

#: The file that lists the files of a site, one in each line. A later ``--html`` replaces only
#: these files.
MANIFEST = "manifest.txt"


def arguments(parser: ArgumentParser) -> None:
    """Add the option."""
    parser.add_argument(
        "--html",
        metavar="DIR",
        help="write the whole documentation to DIR, as a site that needs no server",
    )


def run(command: str, arguments: Namespace) -> int | None:
    """Write the site; return exit code 2 if that fails, None without ``--html``."""
    del command
    if arguments.html is None:
        return None
    if arguments.word is not None:
        fail(f"--html writes all pages: leave out {arguments.word}", UNREADABLE)
    try:
        from tfcompose.tools.docs.site import build_site
    except ModuleNotFoundError as error:
        fail(f"--html needs the package {error.name}: pip install 'tfcompose[docs]'", UNREADABLE)
    from tfcompose.cli.tool_commands import report_problems
    from tfcompose.cli.writing import write_all
    from tfcompose.model.files import File

    report_problems()
    folder = Path(arguments.html)
    files = build_site()
    paths = [*(file.path for file in files), MANIFEST]
    try:
        earlier = _files_of_earlier_site(folder)
        for path in paths:
            if path not in earlier and exists(folder / path):
                fail(
                    f"{folder / path} is there, and help did not write it: choose another folder",
                    UNREADABLE,
                )
        manifest = File(MANIFEST, "".join(f"{path}\n" for path in sorted(paths)))
        write_all(folder, [*files, manifest], earlier=earlier)
    except OSError as error:
        where = f": {error.filename}" if error.filename else ""
        fail(f"nothing was written to {folder}: {error.strerror}{where}", UNREADABLE)
    print(f"wrote {folder / 'index.html'} and {len(files) - 1} more files")
    return 0


def _files_of_earlier_site(folder: Path) -> list[str]:
    """Return the files that an earlier ``help --html`` wrote to the folder.

    Raises:
        OSError: if the list of these files cannot be read.
    """
    manifest = folder / MANIFEST
    try:
        paths = manifest.read_text("utf-8").splitlines()
    except FileNotFoundError:
        return []
    except UnicodeDecodeError:
        return []
    return [path for path in paths if _is_of_a_site(path)]


def _is_of_a_site(path: str) -> bool:
    """Return whether a line of a manifest is a file inside the site's folder."""
    parts = path.split("/")
    return ".." not in parts and not path.startswith("/") and path.endswith(_SUFFIXES)


_SUFFIXES = (".css", ".html", ".js", ".svg", ".txt")
