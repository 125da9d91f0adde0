"""Injection of faults into a started robot."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Protocol

from tfcompose.foundation.text import list_names
from tfcompose.launcher.child import kill_group
from tfcompose.launcher.control import RequestRefusedError, ask
from tfcompose.launcher.runtime_dir import RuntimeDirError, runtime_dir_of
from tfcompose.model.messages import RobotStatus, StatusRequest
from tfcompose.tools.treetest.faults import topics_of
from tfcompose.tools.treetest.injections import split_pair
from tfcompose.tools.treetest.processes import end_process, own_command
from tfcompose.tools.treetest.relayed_plan import relayed_processes

if TYPE_CHECKING:
    from typing_extensions import Self

    from tfcompose.model.plan import Plan
    from tfcompose.tools.treetest.case import Case
    from tfcompose.tools.treetest.injections import InjectionSpec, PublishSpec
    from tfcompose.tools.treetest.setup import LiveSetup

#: Time for an injection to begin once it is due, and for its process to end, in seconds.
BEGIN_S, END_S = 30.0, 10.0
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)


class InjectionError(Exception):
    """Raised when a fault cannot be injected; the message is one sentence for the user."""


class LiveFault(Protocol):
    """A fault, prepared and ended with its ``with`` block."""

    #: What it does, for the user.
    text: str
    has_begun: bool

    def __enter__(self) -> Self:
        """Prepare it."""

    def __exit__(self, *_: object) -> None:
        """End it."""

    def begin(self) -> None:
        """Begin, and update ``has_begun``; later calls only update that.

        Raises:
            InjectionError: if that is not possible.
        """


class Injections:
    """The injections of a case: prepared, begun when due, and ended with the ``with`` block."""

    def __init__(self, case: Case, setup: LiveSetup) -> None:
        self._faults = [
            (each.at or 0.0, _fault_of(number, each, case.plan, setup))
            for number, each in enumerate(case.spec.inject)
        ]
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            for _, fault in self._faults:
                stack.enter_context(fault)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def begin_due(self, since_complete_s: float) -> bool:
        """Begin the injections that are due; return whether all have begun.

        Raises:
            InjectionError: if one does not.
        """
        for at_s, fault in self._faults:
            if since_complete_s >= at_s:
                fault.begin()
            if since_complete_s > at_s + BEGIN_S and not fault.has_begun:
                raise InjectionError(f"{fault.text} did not begin")
        return all(fault.has_begun for _, fault in self._faults)


def _fault_of(number: int, injection: InjectionSpec, plan: Plan, setup: LiveSetup) -> LiveFault:
    if injection.publish is not None:
        return PublisherProcess(injection.publish, plan)
    if injection.kill is not None:
        return ProcessSignal(injection.kill, signal.SIGKILL, plan)
    if injection.stop is not None:
        return ProcessSignal(injection.stop, signal.SIGSTOP, plan)
    return RelayedFault(number, injection, plan, setup)


class RelayedFault:
    """A fault in messages, injected by the relays of processes."""

    def __init__(
        self, number: int, injection: InjectionSpec, plan: Plan, setup: LiveSetup
    ) -> None:
        processes = relayed_processes(injection, plan)
        self.text = f"{injection.kind} in the messages of {list_names(processes)}"
        self.has_begun = False
        self._begin = setup.begin_file(number)
        self._begun = [setup.begun_file(number, process) for process in processes]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for file in (self._begin, *self._begun):
            file.unlink(missing_ok=True)

    def begin(self) -> None:
        """Ask the relays to begin, and update ``has_begun``."""
        self._begin.touch()
        self.has_begun = all(file.exists() for file in self._begun)


class ProcessSignal:
    """A signal to a process of the robot, and all that it started."""

    def __init__(self, process: str, number: signal.Signals, plan: Plan) -> None:
        self.text = f"{number.name} to {process}"
        self.has_begun = False
        self._process = process
        self._number = number
        self._plan = plan
        self._pid: int | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pid is not None:
            kill_group(self._pid, signal.SIGCONT)  # what is stopped ends with no other signal

    def begin(self) -> None:
        """Send the signal, once.

        Raises:
            InjectionError: if the process does not run.
        """
        if self.has_begun:
            return
        try:
            status = ask(runtime_dir_of(self._plan, os.environ), StatusRequest(), RobotStatus)
        except (OSError, RequestRefusedError, RuntimeDirError) as error:
            raise InjectionError(f"{self.text} was not sent: {error}") from None
        pids = {each.name: each.pid for each in status.processes}
        self._pid = pids.get(self._process)
        if self._pid is None:
            raise InjectionError(f"{self.text} was not sent: {self._process} does not run")
        kill_group(self._pid, self._number)
        self.has_begun = True


class PublisherProcess:
    """A process that publishes an edge; it is loaded at once, and waits for ``begin``."""

    def __init__(self, spec: PublishSpec, plan: Plan) -> None:
        parent, child = split_pair(spec.edge)
        node = f"/{spec.as_.lstrip('/')}"
        self.text = f"publisher {node}"
        self.has_begun = False
        self._is_requested = False
        self._request = {
            "node": node,
            "topic": topics_of(plan, child)[0],
            "parent": parent,
            "child": child,
            "xyz": spec.xyz,
            "quat_xyzw": spec.rotation or _NO_ROTATION,
            "rate": spec.rate,
        }

    def __enter__(self) -> Self:
        command = [*own_command("tfcompose.tools.treetest.publisher"), json.dumps(self._request)]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        self._input, self._output = self._process.stdin, self._process.stdout
        return self

    def __exit__(self, *_: object) -> None:
        end_process(self._process, signal.SIGTERM, END_S)
        for stream in (self._input, self._output):
            if stream:
                with suppress(BrokenPipeError):
                    stream.close()

    def begin(self) -> None:
        """Let it publish, once, and update ``has_begun``.

        Raises:
            InjectionError: if it has ended.
        """
        if self._process.poll() is not None:
            raise InjectionError(f"{self.text} ended with exit code {self._process.returncode}")
        if not self._is_requested and self._input:
            self._is_requested = True
            self._input.write(b"\n")
            self._input.flush()
        if not self.has_begun and self._output:
            os.set_blocking(self._output.fileno(), False)
            self.has_begun = bool(self._output.read())
