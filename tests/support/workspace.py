"""A colcon workspace: packages that are built, tested and sourced as on a robot."""

from __future__ import annotations

import os
import shlex
import shutil
from typing import TYPE_CHECKING

from tests.support import processes
from tests.support.house import ROOT

if TYPE_CHECKING:
    import subprocess
    from pathlib import Path

#: Building or testing one package on a busy machine.
COLCON_TIMEOUT_S = 240
_WITHOUT_BYTECODE = "PYTHONDONTWRITEBYTECODE"
_FILES = ("package.xml", "colcon.pkg", "setup.py", "pyproject.toml", "README.md", "LICENSE")
_FOLDERS = ("tfcompose", "robots", "schemas", "tests")
_IGNORED = shutil.ignore_patterns("__pycache__")


class Workspace:
    """A folder with ``src``, whose packages colcon builds into ``install``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.source = folder / "src"
        self.source.mkdir(parents=True)

    def add_repository(self) -> Path:
        """Copy what colcon builds this repository from; return its folder."""
        target = self.source / "tfcompose"
        target.mkdir()
        for name in _FILES:
            shutil.copy2(ROOT / name, target)
        for name in _FOLDERS:
            shutil.copytree(ROOT / name, target / name, ignore=_IGNORED)
        return target

    def colcon(self, *arguments: str, sourced: bool = False) -> subprocess.CompletedProcess[str]:
        """Run colcon, with the workspace sourced where packages need others of it."""
        return self.run(f"colcon {shlex.join(arguments)}", sourced=sourced)

    def run(self, script: str, *, sourced: bool = True) -> subprocess.CompletedProcess[str]:
        """Run a script of bash, after ``source install/setup.bash``."""
        setup = shlex.quote(str(self.folder / "install" / "setup.bash"))
        command = ["bash", "-c", f". {setup}; {script}" if sourced else script]
        # setuptools warns where it may not compile what it installs.
        env = {key: value for key, value in os.environ.items() if key != _WITHOUT_BYTECODE}
        return processes.run(command, cwd=self.folder, env=env, timeout_s=COLCON_TIMEOUT_S)
