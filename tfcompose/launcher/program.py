"""Command lines of tfcompose's own processes, which import no module from the working directory.

``tfcompose.__main__`` removes the working directory from Python's path before it imports any
module.
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
#: The ``main`` module of each process of tfcompose, by the name in its command line. Any other
#: name is a command.
PROCESSES = {
    "static": "tfcompose.launcher.publishers.static",
    "joints": "tfcompose.launcher.publishers.joints",
    "simulate": "tfcompose.launcher.publishers.simulate",
    "guard": "tfcompose.guard.start",
    "exec": "tfcompose.launcher.exec",
    "rehearse": "tfcompose.launcher.rehearse",
}
#: Modules that several of these processes import after they handle signals.
SHARED_MODULES = (
    "tfcompose.guard.process",
    "tfcompose.launcher.publishers.description",
    "tfcompose.launcher.publishers.simulate",
    "tfcompose.launcher.publishers.static",
)
#: Command line that starts tfcompose from the current installation on this machine.
HERE = (sys.executable, str(Path(__file__).absolute().parents[1] / "__main__.py"))
#: Python code that starts tfcompose if only the Python that has it is known. It searches the
#: working directory last.
ANYWHERE_PARTS = (
    "import os, sys; sys.path.sort(key=['', os.getcwd()].__contains__);",
    " from tfcompose.__main__ import run; sys.exit(run())",
)
ANYWHERE = "".join(ANYWHERE_PARTS)


def is_process(argv: Sequence[str]) -> bool:
    """Return whether a command line starts a process of tfcompose instead of a command.

    ``guard`` is both. As a process it gets a plan and a name as arguments.
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
    """Import the modules that processes share. Do not initialise ROS.

    Raises:
        ImportError: if ROS cannot be imported.
    """
    for module in SHARED_MODULES:
        import_module(module)
    import_module("tfcompose.tf.ros.node").load_types()


def anywhere(python: str) -> list[str]:
    """Return a command line that starts tfcompose on any machine with the given Python."""
    return [python, "-c", ANYWHERE]


def without_current_folder(env: Mapping[str, str]) -> dict[str, str]:
    """Return the environment with a PYTHONPATH that does not contain the working directory.

    An empty entry means the working directory, such as the last entry of ``PYTHONPATH=/opt/lib:``.
    Python imports some modules from PYTHONPATH before it runs any code of tfcompose.
    """
    entries = env.get(PYTHON_PATH, "").split(os.pathsep)
    kept = os.pathsep.join(entry for entry in entries if os.path.normpath(entry) != ".")
    environment = {name: value for name, value in env.items() if name != PYTHON_PATH}
    return environment | {PYTHON_PATH: kept} if kept else environment
