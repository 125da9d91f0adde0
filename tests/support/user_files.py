"""A user's files, named like modules of Python: each ends the process that imports it."""

import sys
from functools import cache
from pathlib import Path

from tests.support import processes

#: Packages from elsewhere that processes import.
_PACKAGES = ("numpy", "rclpy", "xacro", "yaml", "zenoh")
#: What ``pathlib`` tries to import on other systems.
_ELSEWHERE = ("nt", "winreg")
#: The entry behind the colon is empty: it means the current folder.
PYTHON_PATH = "/no/such/folder:"


def write_namesakes(folder: Path, *, loaded_first: bool = True) -> None:
    """Write a file named like each module; ``loaded_first``: also like the earliest ones."""
    names = {name for name in sys.stdlib_module_names if not name.startswith("_")}
    for name in (names | {*_PACKAGES}) - (set() if loaded_first else _loaded_first()):
        (folder / f"{name}.py").write_text(f"raise SystemExit('the user\\'s {name}.py ran')\n")


@cache
def _loaded_first() -> frozenset[str]:
    """Return what Python loads before it runs a program, or a module with ``-m``.

    An empty entry of PYTHONPATH has these come from the current folder, whatever the program does.
    """
    command = [sys.executable, "-c", "import runpy, sys; print(*sys.modules)"]
    names = processes.run(command, check=True).stdout.split()
    return frozenset({name.partition(".")[0] for name in names} | {*_ELSEWHERE})
