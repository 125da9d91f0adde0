"""The runtime directory of a robot: a private folder with a lock, a control socket and the plan.

A robot is identified by its name and its ROS domain. If it runs on several hosts, the host is part
of the name of each share. The folder is in XDG_RUNTIME_DIR, otherwise in ``/run/user/UID``,
otherwise in ``tfcompose-UID`` below the folder for temporary files. Logs outlive the run. They are
in ROS's log folder (ROS_LOG_DIR, otherwise ROS_HOME/log, otherwise ~/.ros/log), in
``tfcompose/ROBOT@DOMAIN``.
"""

from __future__ import annotations

import errno
import fcntl
import os
import pwd
import stat
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan

#: systemd creates a folder here for each logged-in user. Services and cron jobs lack the variable
#: XDG_RUNTIME_DIR, but have the folder.
USERS = Path("/run/user")
#: logind's folders with a file for each logged-in user, and for each user whose folder stays after
#: a logout.
LOGGED_IN, LINGERING = Path("/run/systemd/users"), Path("/var/lib/systemd/linger")
#: Prefix of the folder with a copy of the plan.
_PLAN = "plan-"
#: Name of the link to the folder of the plan that runs.
_RUNNING = "running"


class RuntimeDirError(Exception):
    """There is no safe folder for a run; the message is a sentence for the user."""


@dataclass(frozen=True, slots=True)
class Holder:
    """The launcher that runs a robot.

    Its pid, its start in seconds since 1970, and the run's id.
    """

    pid: int
    since: float
    run: str


@dataclass(frozen=True, slots=True)
class RuntimeDir:
    """The folder of a robot in a domain."""

    #: ROBOT@DOMAIN, or ROBOT.HOST@DOMAIN.
    name: str
    folder: Path
    logs: Path

    @property
    def robot(self) -> str:
        """The robot's name, without host and domain."""
        return self.share.partition(".")[0]

    @property
    def share(self) -> str:
        """The robot's name with the host of the share, without the domain."""
        return self.name.rpartition("@")[0]

    @property
    def domain(self) -> str:
        """The ROS domain."""
        return self.name.rpartition("@")[2]

    @property
    def socket(self) -> Path:
        """The path of the control socket."""
        return self.folder / "control"

    def plan_folder(self, digest: str) -> Path:
        """Return the folder for a copy of a plan and its files.

        Because a run uses the copy, builds do not affect it.
        """
        return self.folder / f"{_PLAN}{digest}"

    def plan_folders(self) -> list[Path]:
        """Return the folders of existing copies of plans."""
        return list(self.folder.glob(f"{_PLAN}*"))

    def link_plan(self, folder: Path) -> None:
        """Make the folder known as that of the plan that runs.

        Other copies of plans are there too: of requests that the launcher has refused, or has not
        answered yet.
        """
        new = self.folder / f".running.{os.getpid()}"
        new.unlink(missing_ok=True)
        new.symlink_to(folder)
        new.replace(self.folder / _RUNNING)

    def linked_plan(self) -> Path:
        """Return the folder of the plan that runs.

        Raises:
            OSError: if no plan runs.
        """
        return (self.folder / _RUNNING).readlink()

    def holder(self) -> Holder | None:
        """Return the launcher that currently runs the robot, or None."""
        try:
            descriptor = os.open(self.folder / "lock", os.O_RDWR | os.O_NOFOLLOW)
        except OSError:
            return None
        try:
            return _read_holder(descriptor) if _is_held(descriptor) else None
        finally:
            os.close(descriptor)


class Lock:
    """A file lock that permits only one run of a robot at a time.

    It is held until this process ends, in whatever way. Children do not inherit it.
    """

    def __init__(self, directory: RuntimeDir) -> None:
        """Take the lock.

        Raises:
            BlockingIOError: if another process holds the lock.
        """
        directory.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self.fd = _open_lock(directory)
        self.run = f"{directory.name}:{os.urandom(6).hex()}"
        self.sign()

    def sign(self) -> None:
        """Record this process as the holder of the lock, with the current time."""
        self._holder = Holder(os.getpid(), time.time(), self.run)
        self._write_holder()

    def renew(self, directory: RuntimeDir) -> None:
        """Take the lock of another directory instead, for the same run.

        Raises:
            OSError: if the lock file cannot be created.
            BlockingIOError: if another process holds the lock.
        """
        before, self.fd = self.fd, _open_lock(directory)
        os.close(before)
        self._write_holder()

    def close(self) -> None:
        """Release the lock."""
        os.close(self.fd)

    def _write_holder(self) -> None:
        os.ftruncate(self.fd, 0)
        os.pwrite(self.fd, msgspec.json.encode(self._holder), 0)


def _open_lock(directory: RuntimeDir) -> int:
    """Return the descriptor of the lock file, after this process has taken the lock."""
    descriptor = os.open(directory.folder / "lock", os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
    try:
        _take(descriptor)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def _is_held(descriptor: int) -> bool:
    """Return whether a launcher runs the robot.

    The check takes a shared lock for a moment. Other checks can share it.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    fcntl.flock(descriptor, fcntl.LOCK_UN)
    return False


def _take(descriptor: int) -> None:
    """Take the lock, after waiting for processes that only check it.

    Raises:
        BlockingIOError: if another process holds the lock.
    """
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if _is_held(descriptor):
                raise
            time.sleep(0.001)
        else:
            return


def _read_holder(descriptor: int) -> Holder | None:
    for _ in range(500):  # the holder is written shortly after the lock is taken
        try:
            return msgspec.json.decode(os.pread(descriptor, 4096, 0), type=Holder)
        except (msgspec.DecodeError, UnicodeDecodeError):
            time.sleep(0.01)
    return Holder(0, 0.0, "")


def runtime_dir_of(plan: Plan, env: Mapping[str, str]) -> RuntimeDir:
    """Return the runtime directory of the plan's robot in its ROS domain.

    Create the parent folder if needed.

    Raises:
        RuntimeDirError: if there is no folder that only this user can access.
    """
    domain = str(plan.ros.domain_id) if plan.ros.domain_id is not None else domain_of(env)
    share = f"{plan.robot}.{plan.host}" if plan.host else plan.robot
    return _dir(f"{share}@{domain}".replace("/", "_"), _runtime_folder(env), env)


def domain_of(env: Mapping[str, str]) -> str:
    """Return the ROS domain that the environment sets."""
    return (env.get("ROS_DOMAIN_ID") or "0").strip()


def runtime_dirs(env: Mapping[str, str]) -> list[RuntimeDir]:
    """Return all existing runtime directories of runs, sorted by name.

    Raises:
        RuntimeDirError: if there is no folder that only this user can access.
    """
    base = _runtime_folder(env)
    return [
        _dir(folder.name, base, env)
        for folder in sorted(base.iterdir())
        if (folder / "lock").is_file()
    ]


def log_folder(env: Mapping[str, str]) -> Path:
    """Return ROS's log folder."""
    if env.get("ROS_LOG_DIR"):
        return Path(env["ROS_LOG_DIR"])
    return Path(env.get("ROS_HOME") or Path(env.get("HOME") or "~").expanduser() / ".ros") / "log"


def _dir(name: str, base: Path, env: Mapping[str, str]) -> RuntimeDir:
    return RuntimeDir(name, base / name, log_folder(env) / "tfcompose" / name)


def _runtime_folder(env: Mapping[str, str]) -> Path:
    base = env.get("XDG_RUNTIME_DIR") or str(USERS / str(os.getuid()))
    if base.startswith("/") and _is_ours(Path(base)):
        folder = Path(base) / "tfcompose"
    else:
        folder = _temporary_folder()
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise RuntimeDirError(f"{folder} cannot be created: {error.strerror}") from None
    if not _is_ours(folder):
        raise RuntimeDirError(
            f"{folder} is not a folder that only this user can open; set XDG_RUNTIME_DIR to one"
        )
    return folder


def _temporary_folder() -> Path:
    """Return the folder of runs for a user without a runtime directory."""
    return Path(tempfile.gettempdir()) / f"tfcompose-{os.getuid()}"


def substitute_of(directory: RuntimeDir) -> RuntimeDir:
    """Return the robot's directory to use while the user's runtime folder is missing.

    Raises:
        OSError: if the folder is not private to this user.
    """
    folder = _temporary_folder()
    make_private(folder)
    if not _is_ours(folder):
        raise PermissionError(errno.EPERM, "another user can open it", str(folder))
    return replace(directory, folder=folder / directory.name)


def make_private(folder: Path) -> None:
    """Create a folder and its parents, accessible only to this user.

    The system's folders for users are not created.

    Raises:
        OSError: if the folder cannot be created.
    """
    for missing in reversed(
        [parent for parent in (folder, *folder.parents) if not parent.exists()]
    ):
        if missing.parent == USERS:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(missing))
        missing.mkdir(mode=0o700, exist_ok=True)


def goes_with_logout(directory: RuntimeDir) -> bool:
    """Return whether logind removes the directory when the user's last session ends."""
    number = str(os.getuid())
    return (
        directory.folder.is_relative_to(USERS / number)
        and (LOGGED_IN / number).exists()
        and not (LINGERING / user_name()).exists()
    )


def user_name() -> str:
    """Return this user's name, or the user id without a name."""
    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return str(os.getuid())


def _is_ours(folder: Path) -> bool:
    try:
        status = folder.lstat()
    except OSError:
        return False
    return (
        stat.S_ISDIR(status.st_mode)
        and status.st_uid == os.getuid()
        and not status.st_mode & 0o077
    )
