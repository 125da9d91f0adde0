"""Between the launcher and the guard: pipes for its events and the launcher's orders, and what it must remember."""

from __future__ import annotations

import contextlib
import io
import json
import os
from typing import TYPE_CHECKING, Any

from tfcompose.ipc import EVENTS_FD, GUARD_ORDERS, JOINS, MEMORY_FD, ORDERS_FD

if TYPE_CHECKING:
    from tfcompose.ipc import GuardOrder


class GuardPipes:
    """The launcher's ends; ``theirs`` are the guard's, which are closed here once it has them."""

    def __init__(self, *, joins: bool, memory: dict[str, Any]) -> None:
        read_fd, write_fd = os.pipe()
        orders_fd, self._orders = os.pipe()
        os.set_blocking(self._orders, False)
        self.theirs: tuple[int, ...] = (write_fd, orders_fd)
        self.events = io.FileIO(read_fd)
        self.env = {EVENTS_FD: str(write_fd), ORDERS_FD: str(orders_fd)} | ({JOINS: "1"} if joins else {})

        if memory:
            memory_fd = os.memfd_create("tfcompose-guard-memory")
            with open(memory_fd, "wb", closefd=False) as file:
                file.write(json.dumps(memory).encode())
            os.lseek(memory_fd, 0, os.SEEK_SET)
            self.theirs += (memory_fd,)
            self.env[MEMORY_FD] = str(memory_fd)

    def handed_over(self) -> None:
        """Close the guard's ends."""
        for fd in self.theirs:
            os.close(fd)

    def order(self, order: GuardOrder) -> None:
        """Tell the guard; one that is stuck is told nothing."""
        with contextlib.suppress(OSError):
            os.write(self._orders, GUARD_ORDERS.line(order).encode())

    def close(self) -> None:
        """Close the launcher's end for orders; that for events is closed by whoever reads it."""
        os.close(self._orders)
