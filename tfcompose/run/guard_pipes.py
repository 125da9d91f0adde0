"""The two pipes between the launcher and the guard: its events, and the launcher's orders."""

from __future__ import annotations

import contextlib
import io
import os
from typing import TYPE_CHECKING

from tfcompose.run.events import EVENTS_FD
from tfcompose.run.orders import JOINS, ORDERS_FD, order_line

if TYPE_CHECKING:
    from tfcompose.run.orders import GuardOrder


class GuardPipes:
    """The launcher's ends; ``theirs`` are the guard's, which are closed here once it has them."""

    def __init__(self, *, joins: bool) -> None:
        read_fd, write_fd = os.pipe()
        orders_fd, self._orders = os.pipe()
        os.set_blocking(self._orders, False)
        self.theirs = (write_fd, orders_fd)
        self.events = io.FileIO(read_fd)
        self.env = {EVENTS_FD: str(write_fd), ORDERS_FD: str(orders_fd)} | ({JOINS: "1"} if joins else {})

    def handed_over(self) -> None:
        """Close the guard's ends."""
        for fd in self.theirs:
            os.close(fd)

    def order(self, order: GuardOrder) -> None:
        """Tell the guard; one that is stuck is told nothing."""
        with contextlib.suppress(OSError):
            os.write(self._orders, order_line(order).encode())

    def close(self) -> None:
        """Close the launcher's end for orders; that for events is closed by whoever reads it."""
        os.close(self._orders)
