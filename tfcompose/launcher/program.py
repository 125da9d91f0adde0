"""Command lines of tfcompose's own processes, which take no module from the current folder.

``tfcompose.__main__`` takes that folder off Python's path before it imports anything.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

PYTHON_PATH = "PYTHONPATH"
#: What starts the program on this machine, with the installation that runs now.
HERE = (sys.executable, str(Path(__file__).absolute().parents[1] / "__main__.py"))
#: The code that starts the program where only a Python that has tfcompose is known: it looks for
#: it in the current folder last.
ANYWHERE_PARTS = (
    "import os, sys; sys.path.sort(key=['', os.getcwd()].__contains__);",
    " from tfcompose.__main__ import run; sys.exit(run())",
)
ANYWHERE = "".join(ANYWHERE_PARTS)


def anywhere(python: str) -> list[str]:
    """Return the words that start the program on any machine, with that Python."""
    return [python, "-c", ANYWHERE]


def without_current_folder(env: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with a PYTHONPATH that does not mean the current folder.

    An empty entry means it, such as the one that ``PYTHONPATH=/opt/lib:`` ends with. Python reads
    some modules before any code of ours runs.
    """
    entries = env.get(PYTHON_PATH, "").split(os.pathsep)
    kept = os.pathsep.join(entry for entry in entries if os.path.normpath(entry) != ".")
    others = {name: value for name, value in env.items() if name != PYTHON_PATH}
    return others | {PYTHON_PATH: kept} if kept else others
