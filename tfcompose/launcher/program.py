"""Command lines of tfcompose's own processes, which import no module from the current folder.

``tfcompose.__main__`` removes that folder from Python's path before it imports anything.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

PYTHON_PATH = "PYTHONPATH"
#: The processes of tfcompose's own, by the kind that plans and supervisors name, with the module
#: whose ``main`` each runs. Everything else is a command.
PROCESSES = {
    "static": "tfcompose.launcher.publishers.static",
    "joints": "tfcompose.launcher.publishers.joints",
    "simulate": "tfcompose.launcher.publishers.simulate",
    "guard": "tfcompose.guard.start",
    "exec": "tfcompose.launcher.exec",
    "rehearse": "tfcompose.launcher.rehearse",
}
#: Modules that more than one of the programs imports once it handles signals.
SHARED_MODULES = (
    "tfcompose.guard.process",
    "tfcompose.launcher.publishers.description",
    "tfcompose.launcher.publishers.simulate",
    "tfcompose.launcher.publishers.static",
)
#: Command that starts the program on this machine with the current installation.
HERE = (sys.executable, str(Path(__file__).absolute().parents[1] / "__main__.py"))
#: The code that starts the program where only a Python that has tfcompose is known: it looks for
#: it in the current folder last.
ANYWHERE_PARTS = (
    "import os, sys; sys.path.sort(key=['', os.getcwd()].__contains__);",
    " from tfcompose.__main__ import run; sys.exit(run())",
)
ANYWHERE = "".join(ANYWHERE_PARTS)


def is_process(argv: Sequence[str]) -> bool:
    """Return whether a command line starts one of tfcompose's own processes, not a command.

    ``guard`` is both: as a process it is given a plan and its name.
    """
    kind, *first = [*argv, "-", "-", "-"][:3]
    if kind == "guard" and any(text.startswith("-") or ":=" in text for text in first):
        return False
    return kind in PROCESSES


def run_process() -> int:
    """Run the process that the command line names, and return its exit code."""
    code: int = import_module(PROCESSES[sys.argv[1]]).main(sys.argv[2:])
    return code


def load_shared() -> None:
    """Import the processes' shared modules, and initialise nothing of ROS.

    Raises:
        ImportError: if ROS cannot be imported.
    """
    for module in SHARED_MODULES:
        import_module(module)
    import_module("tfcompose.tf.ros.node").load_types()


def anywhere(python: str) -> list[str]:
    """Return the arguments that start the program on any machine, with that Python."""
    return [python, "-c", ANYWHERE]


def without_current_folder(env: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with a PYTHONPATH that does not include the current folder.

    An empty entry includes it, such as the last one of ``PYTHONPATH=/opt/lib:``. Python imports
    some modules before it runs any of our code.
    """
    entries = env.get(PYTHON_PATH, "").split(os.pathsep)
    kept = os.pathsep.join(entry for entry in entries if os.path.normpath(entry) != ".")
    others = {name: value for name, value in env.items() if name != PYTHON_PATH}
    return others | {PYTHON_PATH: kept} if kept else others
