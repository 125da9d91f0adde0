"""How tfcompose's own processes leave ROS: in order, and not for ever.

Fast DDS 2.14 can wait for itself when several processes leave at once (one time in a hundred, seen on Jazzy): the
participant that goes waits, at full load, for a listener that handles a publisher's going, and that listener waits for
the participant.
"""

from __future__ import annotations

import faulthandler
import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.ros.node import open_node, remappings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rclpy.node import Node

    from tfcompose.run.own import Own

#: Leaving takes some milliseconds.
LEAVE_S = 1.5


@contextmanager
def node_of(own: Own) -> Iterator[Node]:
    """Give the process its node; after the block, the process ends with code 1 if ROS does not let it go in time.

    A thread of Python's could not end it, because ROS keeps the interpreter's lock while it leaves; faulthandler's can.
    """
    args = [*remappings(own.process.remap), *own.ros_args]
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        with open_node(own.node_name, own.namespace, args=args) as node:
            try:
                yield node
            finally:
                faulthandler.dump_traceback_later(LEAVE_S, exit=True, file=nowhere)
        faulthandler.cancel_dump_traceback_later()
