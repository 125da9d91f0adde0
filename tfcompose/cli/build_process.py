"""A build in a separate process.

The launcher's process, which lasts as long as the robot runs, then never contains the compiler.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import traceback
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from tfcompose.cli.terminal import FAILED, INTERRUPTED, UNREADABLE, fail
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.signals import take_interrupt

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable

    from typing_extensions import Self


class BuildProcess:
    """Builds a robot in a child process while this process continues.

    The child prints its findings on the same terminal. The child has its own process group, so
    that it receives a Ctrl-C only once, from this process. An error in the ``with`` block
    interrupts the build and waits for its end.
    """

    def __init__(self, arguments: Namespace) -> None:
        self._pipe, answer = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        mask = signal.pthread_sigmask(
            signal.SIG_BLOCK, [signal.SIGINT]
        )  # Python's handlers after a fork print errors
        self._pid = os.fork()
        if self._pid == 0:
            os._exit(_build(arguments, answer, mask))
        os.close(answer)
        try:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        except KeyboardInterrupt:
            self._interrupt()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._pid:
            self._interrupt()

    def _interrupt(self) -> None:
        # A Ctrl-C can come when the child was waited for, and before that is known here.
        with contextlib.suppress(ProcessLookupError, ChildProcessError):
            os.kill(self._pid, signal.SIGINT)
            self._exit_code()

    def wait_until_built(self) -> tuple[Path, list[Finding]]:
        """Wait for the build to end; return its plan file and the warnings it printed.

        Raises:
            SystemExit: if the build failed; with its exit code. The build has printed the reason.
            OSError: if an OSError ended the build.
        """
        with open(self._pipe, "rb", closefd=False) as pipe:
            answer = pipe.read()
        code = self._exit_code()
        if code < 0:
            fail(f"the build was killed by {signal.Signals(-code).name}")
        if code == 0:
            file, _, findings_json = answer.partition(b"\0")
            return Path(os.fsdecode(file)), msgspec.json.decode(findings_json, type=list[Finding])
        if answer:
            raise OSError(int(answer), os.strerror(int(answer)))
        raise SystemExit(code)

    def _exit_code(self) -> int:
        code = os.waitstatus_to_exitcode(os.waitpid(self._pid, 0)[1])
        self._pid = 0
        os.close(self._pipe)
        return code


def _build(arguments: Namespace, answer: int, mask: Iterable[int]) -> int:
    """Build and return the exit code.

    The function writes the plan's path and the findings to ``answer``, or the number of an
    OSError. ``mask`` is the signal mask from before the fork.
    """
    code = FAILED
    try:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.setpgid(0, 0)
        for number in (
            signal.SIGTTOU,
            signal.SIGTTIN,
        ):  # a terminal may stop background groups that read or write
            signal.signal(number, signal.SIG_IGN)
        from tfcompose.cli.plans import PLAN
        from tfcompose.cli.writing import build

        folder, _, findings = build(arguments)
        with open(answer, "wb", closefd=False) as pipe:
            pipe.write(os.fsencode(folder / PLAN) + b"\0" + msgspec.json.encode(findings))
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else UNREADABLE
    except OSError as error:
        os.write(answer, str(error.errno).encode())
    except KeyboardInterrupt:
        code = INTERRUPTED
    except BaseException:  # noqa: BLE001 (nobody further out says what it was)
        if take_interrupt():
            code = INTERRUPTED
        else:
            traceback.print_exc()
    with contextlib.suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    return code
