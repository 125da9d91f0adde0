"""An own process that has loaded what it needs, and joins ROS only when the launcher says so.

``up`` looks before the start whether somebody publishes an edge already; its publishers load Python and rclpy then.
"""

from __future__ import annotations

import os
from select import select
from typing import TYPE_CHECKING

from tfcompose.ipc import GO, HOLD_FD

if TYPE_CHECKING:
    from tfcompose.ros.stop import Stop

_CHECK_EVERY_S = 0.2


def wait_for_go(stop: Stop) -> None:
    """Wait until the launcher lets this process go on, where it is held; without that word it is to end."""
    if HOLD_FD not in os.environ:
        return
    fd = int(os.environ.pop(HOLD_FD))
    try:
        while not stop.requested:
            if select([fd], [], [], _CHECK_EVERY_S)[0]:
                if os.read(fd, len(GO)) != GO:
                    stop.request()
                return
    finally:
        os.close(fd)
