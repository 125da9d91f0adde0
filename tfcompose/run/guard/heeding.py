"""The guard's end of the launcher's orders."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from tfcompose.ipc import GUARD_ORDERS, ORDERS_FD, Absent, Gate, Present

if TYPE_CHECKING:
    from tfcompose.run.guard.gatekeeper import Gates
    from tfcompose.run.guard.judge import Judge


class Orders:
    """What the launcher tells the guard, as it comes."""

    def __init__(self, judges: list[Judge], gates: Gates) -> None:
        self._judges = judges
        self._gates = gates
        self._fd = int(os.environ[ORDERS_FD]) if ORDERS_FD in os.environ else None
        self._rest = b""
        if self._fd is not None:
            os.set_blocking(self._fd, False)

    def take(self) -> None:
        """Follow the orders that have come, and look at the gates."""
        for line in self._lines():
            match GUARD_ORDERS.read(line):
                case Absent(process):
                    for judge in self._judges:
                        judge.absent(process)
                    self._gates.forget(process)
                case Present(process):
                    for judge in self._judges:
                        judge.live.present(process)
                case Gate() as gate:
                    self._gates.add(gate)
        self._gates.look()

    def _lines(self) -> list[str]:
        try:
            data = os.read(self._fd, 64 * 1024) if self._fd is not None else b""
        except BlockingIOError:
            return []
        *lines, self._rest = (self._rest + data).split(b"\n")
        return [line.decode() for line in lines]
