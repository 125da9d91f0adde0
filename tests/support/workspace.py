"""A colcon workspace: packages that are built, tested and sourced as on a robot."""

from __future__ import annotations

import os
import shlex
from typing import TYPE_CHECKING

from tests.support import processes
from tests.support.house import ROOT

if TYPE_CHECKING:
    import subprocess
    from pathlib import Path

#: Building or testing one package on a busy machine.
COLCON_TIMEOUT_S = 240
_WITHOUT_BYTECODE = "PYTHONDONTWRITEBYTECODE"


class Workspace:
    """A folder with ``src``, whose packages colcon builds into ``install``."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.source = folder / "src"
        self.source.mkdir(parents=True)

    def add_repository(self) -> Path:
        """Copy the files of this repository that Git knows or would add; return their folder."""
        target = self.source / "tfcompose"
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        names = processes.run(command, cwd=ROOT, check=True).stdout.split("\0")
        for name in filter(None, names):
            file = target / name
            file.parent.mkdir(parents=True, exist_ok=True)
            if (ROOT / name).is_file():
                file.write_bytes((ROOT / name).read_bytes())
                file.chmod((ROOT / name).stat().st_mode)
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
