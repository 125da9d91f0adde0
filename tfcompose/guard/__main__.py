"""Starts the guard: ``python -m tfcompose.guard PLAN_FILE PROCESS_NAME``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.tf.process import start

if TYPE_CHECKING:
    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.process import Own


def _guard(own: Own, stop: Stop) -> None:
    from tfcompose.guard.process import guard  # noqa: PLC0415 (ROS, once signals are handled)

    guard(own, stop)


if __name__ == "__main__":
    sys.exit(start(sys.argv[1:], "guard", _guard))
