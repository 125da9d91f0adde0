"""Files of a run in its runtime directory, restored after something removes them.

The files are the lock, the control socket, the folder with the plan, and a link to it. The folder
``/run/user/UID`` vanishes when the user's last session ends, unless the user lingers. Cleaning
programs may remove other folders. Without the files, a restarting process finds no plan, and
``ps`` and ``down`` find no robot. So the launcher keeps the content of the files. If it may not
create the folder again, it writes the files to the folder for temporary files until it may.
Commands also search there.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from typing import TYPE_CHECKING

from tfcompose.launcher.control import listen
from tfcompose.launcher.runtime_dir import make_private, substitute_of

if TYPE_CHECKING:
    from pathlib import Path
    from socket import socket

    from tfcompose.launcher.runtime_dir import Lock, RuntimeDir


class RunFiles:
    """The files of the run whose lock this process holds.

    ``listener`` is the control socket; the code that uses it closes it. ``plan_file`` is the plan.
    The content of the plan's folder is kept if the folder is in the runtime directory.
    """

    def __init__(self, runtime_dir: RuntimeDir, lock: Lock, plan_file: Path) -> None:
        self._home = self._runtime_dir = runtime_dir
        self._lock = lock
        self._kept: dict[str, bytes] = {}
        self.listener = self._listen(runtime_dir)
        self.keep(plan_file)

    @property
    def run_id(self) -> str:
        """The id of the run."""
        return self._lock.run

    @property
    def folder(self) -> Path:
        """The current folder of the files."""
        return self._runtime_dir.folder

    def keep(self, plan_file: Path) -> None:
        """Keep the files of this plan from now on."""
        self.plan_file = plan_file
        self._runtime_dir.link_plan(plan_file.parent)
        folder, self._kept = plan_file.parent, {}
        if folder.is_relative_to(self._runtime_dir.folder):
            self._kept = {
                str(file.relative_to(folder)): file.read_bytes()
                for file in folder.rglob("*")
                if file.is_file()
            }

    def restore(self) -> bool:
        """Restore missing files, and return whether any file was missing.

        Afterwards ``listener`` and ``plan_file`` are new.

        Raises:
            OSError: if no folder for the files can be created.
        """
        if self._runtime_dir is not self._home and self._home.folder.parent.parent.is_dir():
            before = self._runtime_dir
            with contextlib.suppress(OSError):
                self._put(self._home)
                shutil.rmtree(before.folder, ignore_errors=True)
                return True
        if self._are_there():
            return False
        try:
            self._put(self._home)
        except OSError:
            self._put(substitute_of(self._home))
        return True

    def _are_there(self) -> bool:
        folder = self.plan_file.parent
        try:
            return (
                _identity(self._runtime_dir.folder / "lock") == _identity(self._lock.fd)
                and _identity(self._runtime_dir.socket) == self._socket
                and all((folder / name).is_file() for name in self._kept)
                and self._runtime_dir.linked_plan() == folder
            )
        except OSError:
            return False

    def _put(self, runtime_dir: RuntimeDir) -> None:
        make_private(runtime_dir.folder)
        if not _is_same(runtime_dir.folder / "lock", self._lock.fd):
            self._lock.renew(runtime_dir)
        if self._runtime_dir is not runtime_dir or not self._has_socket(runtime_dir):
            self.listener = self._listen(runtime_dir)
        if self._kept:
            folder = runtime_dir.folder / self.plan_file.parent.relative_to(
                self._runtime_dir.folder
            )
            for name, data in self._kept.items():
                _write(folder / name, data)
            self.plan_file = folder / self.plan_file.name
        runtime_dir.link_plan(self.plan_file.parent)
        self._runtime_dir = runtime_dir

    def _listen(self, runtime_dir: RuntimeDir) -> socket:
        listener = listen(runtime_dir)
        self._socket = _identity(runtime_dir.socket)
        return listener

    def _has_socket(self, runtime_dir: RuntimeDir) -> bool:
        try:
            return _identity(runtime_dir.socket) == self._socket
        except OSError:
            return False


def _identity(file: Path | int) -> tuple[int, int]:
    """Return values that distinguish a file from a later file at the same path."""
    status = os.fstat(file) if isinstance(file, int) else file.lstat()
    return status.st_dev, status.st_ino


def _is_same(file: Path, descriptor: int) -> bool:
    try:
        return _identity(file) == _identity(descriptor)
    except OSError:
        return False


def _write(file: Path, data: bytes) -> None:
    """Write a missing file atomically, so that a concurrent reader never reads part of it."""
    if file.is_file():
        return
    make_private(file.parent)
    new = file.with_name(f".{file.name}.{os.getpid()}")
    new.write_bytes(data)
    new.replace(file)
