"""Common start of tfcompose's processes: arguments, signals, plan, readiness and output.

Publishers and the guard are such processes: ``tfcompose KIND PLAN_FILE PROCESS_NAME``. This module
imports no ROS.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from select import select
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.signals import Stop
from tfcompose.model.plan.file import read_plan
from tfcompose.model.variables import GO, HOLD_FD, JOINS, MEMORY_FD, ORDERS_FD
from tfcompose.tf.ros.environment import RosError, child_environment, missing_ros
from tfcompose.tf.ros.network import FirstNetwork

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tfcompose.model.plan import Clock, Plan, PlanEdge, PlanProcess

_ARGUMENTS = 2
_CHECK_EVERY_S = 0.2


@dataclass(frozen=True, slots=True)
class OwnProcess:
    """A process of the plan, as this program runs it."""

    plan: Plan
    process: PlanProcess
    file: Path
    #: The arguments after ``--ros-args`` on its command line.
    extra_ros_args: tuple[str, ...]

    @property
    def node_name(self) -> str:
        """The last part of the node's full name."""
        return self._full_name.rpartition("/")[2]

    @property
    def namespace(self) -> str:
        """The node's namespace: empty, or with a leading slash."""
        return self._full_name.rpartition("/")[0]

    @property
    def ros_args(self) -> list[str]:
        """The ROS arguments of the node.

        Arguments from the command line come first, then the plan's remappings.
        """
        return [
            *self.extra_ros_args,
            *(
                argument
                for old, new in self.process.remap.items()
                for argument in ("-r", f"{old}:={new}")
            ),
        ]

    @property
    def edges(self) -> tuple[PlanEdge, ...]:
        """The edges that it publishes."""
        return self.plan.edges_of(self.process.name)

    @property
    def is_of_several_computers(self) -> bool:
        """Whether any process of the robot names a computer."""
        return any(process.host for process in self.plan.processes)

    def reread(self, file: str) -> OwnProcess:
        """Return the same process of the plan in another file.

        Raises:
            RejectedError: with a TF902 finding, if there is no such plan or process.
        """
        arguments = [file, self.process.name, "--ros-args", *self.extra_ros_args]
        return read_own(arguments, self.process.kind)

    @property
    def description(self) -> Path:
        """The file with the ``robot_description``, next to the plan."""
        return self.file.parent / (self.process.description or self.plan.description)

    @property
    def _full_name(self) -> str:
        return self.process.nodes[0] if self.process.nodes else self.process.name


def say(line: str) -> None:
    """Write a line of output immediately."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def start(argv: Sequence[str], kind: str, role: Callable[[OwnProcess, Stop], None]) -> int:
    """Run the process that ``argv`` names until a signal arrives, and return the exit code.

    ``argv`` is PLAN_FILE PROCESS_NAME, optionally followed by ``--ros-args …``. ``role`` is the
    body of the process. It imports ROS only when called, because that takes a third of a second.
    By then signals are handled, so an interrupted process ends without a traceback. It calls
    ``wait_for_go`` before its first message. If a robot uses several computers and the process
    started without a network, it leaves ROS as soon as there is a network, and starts again in the
    same process.

    Returns:
        0 if a signal ended it, 1 if ROS is missing or unusable, 2 if the arguments or the plan are
        invalid.
    """
    with Stop() as stop:
        try:
            process = read_own(argv, kind)
        except RejectedError as error:
            return _fail(error, 2)
        missing = missing_ros()
        if missing:
            return _fail(missing, 1)
        os.environ.update(child_environment(os.environ, process.plan.ros, is_built_in=True))
        if stop.requested:
            return 0
        network = FirstNetwork(stop)
        try:
            with network if process.is_of_several_computers else contextlib.nullcontext():
                role(process, stop)
        except RosError as error:
            return _fail(error, 1)
    if network.came:
        say("this computer has a network now: joining ROS again")
        os.environ[JOINS] = "1"
        os.environ.pop(MEMORY_FD, None)
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])  # noqa: S606 (what it began as)
    return 0


def read_own(argv: Sequence[str], kind: str) -> OwnProcess:
    """Return the process that ``argv`` names, which must be of this kind, with its plan.

    Raises:
        RejectedError: with a TF902 finding, if there is no such plan or process.
    """
    arguments = list(argv)
    end = arguments.index("--ros-args") if "--ros-args" in arguments else len(arguments)
    if end != _ARGUMENTS:
        raise _unfit(f"usage: tfcompose {kind} PLAN_FILE PROCESS_NAME [--ros-args …]", "")
    file, name = arguments[:end]
    try:
        plan = read_plan(Path(file).read_text(encoding="utf-8"), file)
    except (OSError, UnicodeDecodeError) as error:
        raise _unfit(f"cannot read the plan: {error}", file) from None
    try:
        process = plan.process(name)
    except KeyError:
        raise _unfit(f"the plan has no process {name}", file) from None
    if process.kind != kind:
        raise _unfit(f"process {name} is of kind {process.kind}, not {kind}", file)
    if kind == "simulate" and process.simulate is None:
        raise _unfit(f"process {name} does not say what to simulate", file)
    ros_args = tuple(arguments[end + 1 :])
    return OwnProcess(_with_clock(plan, ros_args), process, Path(file), ros_args)


def _with_clock(plan: Plan, ros_args: Sequence[str]) -> Plan:
    """Return the plan with the clock that ``-p use_sim_time:=…`` sets, if present."""
    values = [
        value.lower()
        for flag, rule in pairwise(ros_args)
        for name, _, value in [rule.partition(":=")]
        if flag in {"-p", "--param"} and name == "use_sim_time"
    ]
    if not values or values[-1] not in {"true", "false"}:
        return plan
    clock: Clock = "sim" if values[-1] == "true" else "wall"
    return replace(plan, ros=replace(plan.ros, clock=clock))


def _unfit(message: str, file: str) -> RejectedError:
    return RejectedError([finding("TF902", message, Span(file) if file else None)])


def wait_for_go(stop: Stop) -> bool:
    """Wait, if the launcher holds this process, until the launcher releases it.

    Return False if the process should end instead. Before the start, ``up`` checks whether an edge
    is already published. Meanwhile its publishers join ROS, so that listeners have discovered them
    when the launcher releases them. A process that starts again is still held.
    """
    if HOLD_FD not in os.environ:
        return not stop.requested
    fd = int(os.environ[HOLD_FD])
    while not stop.requested:
        if select([fd], [], [], _CHECK_EVERY_S)[0]:
            if os.read(fd, len(GO)) != GO:
                stop.request()
            del os.environ[HOLD_FD]
            os.close(fd)
            break
    return not stop.requested


def take_orders_fd() -> list[int]:
    """Return the descriptor of the launcher's orders; empty without a launcher."""
    return [int(os.environ.pop(ORDERS_FD))] if ORDERS_FD in os.environ else []


def ready() -> None:
    """Tell systemd that this process is ready, as sd_notify(3) does.

    Without systemd, do nothing.
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if address[:1] not in {"/", "@"}:
        return
    name = f"\0{address[1:]}" if address[0] == "@" else address  # @ marks an abstract socket
    with (
        contextlib.suppress(OSError),
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as to_manager,
    ):
        to_manager.sendto(b"READY=1", name)


def _fail(what: object, code: int) -> int:
    sys.stderr.write(f"{what}\n")
    return code
