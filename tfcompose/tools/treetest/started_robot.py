"""Robots that a Python test starts, asks and ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from tfcompose.cli.runs import plan_of_run
from tfcompose.foundation.geometry import Pose
from tfcompose.foundation.text import list_names
from tfcompose.launcher.control import RequestRefusedError, ask
from tfcompose.launcher.program import HERE
from tfcompose.launcher.runtime_dir import runtime_dirs
from tfcompose.model.messages import RobotStatus, StatusRequest
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.ros.domains import DOMAINS, reserve_domain
from tfcompose.tf.ros.environment import DOMAIN, RANGE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from typing_extensions import Self

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.runtime_dir import RuntimeDir

#: How often a condition is checked, in seconds.
_CHECK_EVERY_S = 0.05
#: Time for ``up`` to end a robot, in seconds; it kills what does not end sooner.
_END_S = 40.0
#: Variables that lead discovery beyond this machine, whatever its range.
_REACHING_OUT = ("ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER", "ROS_LOCALHOST_ONLY")
#: Size of a pipe, in bytes.
_PIPE = 64 * 1024
#: Maximum number of printed lines in an error.
_LINES = 20


class RobotError(Exception):
    """Raised when a robot does not do what a test waits for."""


@contextmanager
def enter_domain(folder: Path) -> Iterator[int]:
    """Reserve a ROS domain, and let this process and its children be in it during the block.

    Runs and logs of robots are below the new folder. Discovery stays on this machine.

    Raises:
        RosError: if all domains are in use.
    """
    first = os.getpid() % len(DOMAINS)
    before = dict(os.environ)
    with reserve_domain([*DOMAINS[first:], *DOMAINS[:first]]) as domain:
        for name in ("run", "log"):
            (folder / name).mkdir(mode=0o700, parents=True)
        for name in _REACHING_OUT:
            os.environ.pop(name, None)
        os.environ[DOMAIN] = str(domain)
        os.environ[RANGE] = "LOCALHOST"
        os.environ["XDG_RUNTIME_DIR"] = str(folder / "run")
        os.environ["ROS_LOG_DIR"] = str(folder / "log")
        try:
            yield domain
        finally:
            os.environ.clear()
            os.environ.update(before)


class RobotStarter:
    """Starts robots, and ends them with the ``with`` block.

    Args:
        root: the folder to which names of robot files are relative.
        scratch: a folder for built files and logs.
    """

    def __init__(self, root: Path, scratch: Path) -> None:
        self._root = root
        self._scratch = scratch
        self._robots: list[RobotUnderTest] = []

    def __enter__(self) -> Self:
        """Begin; nothing is started yet."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the robots."""
        for robot in self._robots:
            robot.down()

    def up(self, file: str | Path, *, profile: str | Sequence[str] = ()) -> RobotUnderTest:
        """Start a robot, and return it while it starts.

        Args:
            file: the robot file.
            profile: one or more of its profiles.
        """
        profiles = [profile] if isinstance(profile, str) else profile
        number = len(self._robots)
        folder = self._scratch / f"robot{number}"
        folder.mkdir()
        options = ["--no-live", "--settle", "0", "--output", str(folder / "build")]
        options += [f"--profile={name}" for name in profiles]
        # Its file may set others.
        options += [f"--set=ros.domain_id={os.environ[DOMAIN]}", "--set=ros.discovery=localhost"]
        robot = RobotUnderTest(["up", str(self._root / file), *options], folder)
        self._robots.append(robot)
        return robot


class RobotUnderTest:
    """A robot under ``tfcompose up``. It also ends if this process does.

    Args:
        argv: the command that starts it, without the program.
        folder: for its log and its events.
    """

    def __init__(self, argv: Sequence[str], folder: Path) -> None:
        self._log = folder / "up.log"
        events = folder / "events"
        os.mkfifo(events, 0o600)
        # The robot stops when the reader of its events is gone.
        self._events = os.open(events, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [*HERE, *argv, "--events", str(events)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def wait_complete(self, timeout_s: float = 60.0) -> Self:
        """Wait until every edge is live, and return the robot.

        Raises:
            RobotError: if it ends before, or if that takes longer.
        """
        end = time.monotonic() + timeout_s
        while True:
            status = self._status()
            if status is not None and status.complete:
                return self
            if time.monotonic() > end:
                reason = "its launcher does not answer yet"
                if status is not None:
                    reason = f"{list_names(status.missing, _LINES)} did not come"
                raise RobotError(f"not complete after {timeout_s:g} s: {reason}")
            time.sleep(_CHECK_EVERY_S)

    def lookup(self, target: str, source: str, *, timeout_s: float = 5.0) -> Pose:
        """Return the newest pose of frame ``source`` in frame ``target``, in metres.

        Raises:
            RobotError: if there is none within the timeout.
        """
        options = ["--once", "--timeout", str(timeout_s), "--format", "json"]
        options += [f"--namespace={self._namespace_of(source)}"]
        done = subprocess.run(
            [*HERE, "echo", target, source, *options],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise RobotError(done.stderr.strip())
        data = json.loads(done.stdout)
        return Pose(tuple(data["xyz"]), tuple(data["quat_xyzw"]))

    def _namespace_of(self, frame: str) -> str:
        """Return the namespace of the topics with this frame; empty: the global ones."""
        runtime_dir = self._runtime_dir()
        plan = plan_of_run(runtime_dir) if runtime_dir else None
        for topics, part in parts_of(plan).items() if plan else ():
            if any(frame in {edge.parent, edge.child} for edge in part.edges):
                return topics[0].rpartition("/")[0]
        return ""

    @property
    def findings(self) -> list[Finding]:
        """The guard's current findings, worst first.

        Raises:
            RobotError: if the robot has ended.
        """
        status = self._status()
        return list(status.findings) if status else []

    def down(self) -> int:
        """End the robot, if it runs, and return the exit code of ``up``."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            code = self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        if self._events >= 0:
            os.close(self._events)
            self._events = -1
        return code

    def _status(self) -> RobotStatus | None:
        """Return the launcher's status; None: it does not answer yet.

        Raises:
            RobotError: if the robot has ended.
        """
        code = self._process.poll()
        if code is not None:
            lines = self._log.read_text("utf-8", errors="replace").splitlines()[-_LINES:]
            raise RobotError("\n".join([f"the robot ended with exit code {code}:", *lines]))
        with suppress(BlockingIOError):
            os.read(self._events, _PIPE)  # or up would keep them
        runtime_dir = self._runtime_dir()
        if runtime_dir is not None:
            with suppress(OSError, RequestRefusedError):
                return ask(runtime_dir, StatusRequest(), RobotStatus)
        return None

    def _runtime_dir(self) -> RuntimeDir | None:
        """Return the runtime directory; None: the launcher has none yet."""
        for runtime_dir in runtime_dirs(os.environ):
            holder = runtime_dir.holder()
            if holder is not None and holder.pid == self._process.pid:
                return runtime_dir
        return None
