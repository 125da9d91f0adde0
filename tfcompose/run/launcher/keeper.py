"""What ends a run whose launcher was killed: a shell that outlives the launcher by a moment.

It kills the groups that it was told last, those of everything that descends from the launcher, and then whatever
carries the run's id in its environment: processes that left their groups since.
"""

from __future__ import annotations

import contextlib
import signal
import subprocess
from typing import TYPE_CHECKING

from tfcompose.ipc import RUN_ID
from tfcompose.ros.stop import SIGNALS

if TYPE_CHECKING:
    from collections.abc import Iterable

_SCRIPT = """
groups='' last=''
while read -r line; do groups=$line; last=$line; done
for g in $groups; do [ "$g" = end ] || kill -9 -$g; done
[ -n "$1" ] && [ "$last" != end ] || exit 0
for e in /proc/[0-9]*/environ; do
    pid=${e#/proc/}; pid=${pid%/environ}
    [ "$pid" = $$ ] || ! grep -qaF "$1" "$e" || kill -9 "$pid"
done
"""


def _heed_no_signal() -> None:
    """Ignore, from the first moment on, what ends programs; what the shell starts does so too."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


class Keeper:
    """Outlives the launcher by a moment, and kills the groups that it was told last."""

    def __init__(self, run_id: str = "") -> None:
        self._shell = subprocess.Popen(
            ["/bin/sh", "-c", _SCRIPT, "sh", f"{RUN_ID}={run_id}" if run_id else ""],
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            preexec_fn=_heed_no_signal,  # noqa: PLW1509 (the launcher has one thread)
        )
        self._kept = ""

    @property
    def pid(self) -> int:
        """Its process number."""
        return self._shell.pid

    @property
    def returncode(self) -> int | None:
        """How it ended; None while it runs."""
        return self._shell.poll()

    @property
    def ended(self) -> bool:
        """Whether somebody killed it."""
        return self.returncode is not None

    def keep(self, groups: Iterable[int]) -> None:
        """Say which groups there are now."""
        kept = " ".join(map(str, sorted(groups)))
        if self._shell.stdin and kept != self._kept:
            self._kept = kept
            with contextlib.suppress(BrokenPipeError):
                self._shell.stdin.write(f"{kept}\n".encode())

    def close(self) -> None:
        """Let it go; the groups that it was told last are killed."""
        if self._shell.stdin:
            if not self._kept:
                with contextlib.suppress(BrokenPipeError):
                    self._shell.stdin.write(b"end\n")
            self._shell.stdin.close()
        self._shell.wait()
