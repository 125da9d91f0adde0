"""How tfcompose's own processes begin: signals, the plan, ROS, and then what they are for.

Exit codes: 0 ended by a signal, 1 ROS is missing or not usable, 2 the arguments or the plan are not.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.findings import RejectedError
from tfcompose.ros.environment import RosError, child_environment, missing_ros
from tfcompose.ros.stop import Stop
from tfcompose.run.hold import wait_for_go
from tfcompose.run.own import read_own

if TYPE_CHECKING:
    from collections.abc import Sequence

#: What each kind of process does: a function, and its module, which imports ROS and is loaded when signals are handled.
ROLES = {
    "static": ("tfcompose.run.publishing.static_role", "static"),
    "joints": ("tfcompose.run.publishing.joint_role", "joints"),
    "simulate": ("tfcompose.run.publishing.simulate_role", "simulate"),
    "guard": ("tfcompose.guard.process", "guard"),
}


def start(argv: Sequence[str], kind: str) -> int:
    """Run the process that ``argv`` names until a signal comes, and return the exit code.

    ``argv`` is PLAN_FILE PROCESS_NAME, and may end with ``--ros-args …``. Signals are handled before ROS is imported,
    which takes a third of a second: whoever is interrupted then ends without a traceback too.
    """
    with Stop() as stop:
        try:
            own = read_own(argv, kind)
        except RejectedError as error:
            return _fail(error, 2)
        missing = missing_ros()
        if missing:
            return _fail(missing, 1)
        os.environ.update(child_environment(os.environ, own.plan.ros, own=True))
        if stop.requested:
            return 0
        try:
            module, name = ROLES[kind]
            role = getattr(import_module(module), name)
            wait_for_go(stop)
            if not stop.requested:
                role(own, stop)
        except RosError as error:
            return _fail(error, 1)
    return 0


def _fail(what: object, code: int) -> int:
    sys.stderr.write(f"{what}\n")
    return code
