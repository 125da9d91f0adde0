"""Start of the guard's process, which loads ROS after it handles signals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.tf.process import start

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.foundation.signals import Stop
    from tfcompose.tf.process import OwnProcess


def main(argv: Sequence[str]) -> int:
    """Run the guard with arguments PLAN_FILE PROCESS_NAME, and return the exit code."""
    return start(argv, "guard", _guard)


def _guard(own_process: OwnProcess, stop: Stop) -> None:
    from tfcompose.guard.process import guard  # noqa: PLC0415 (ROS, once signals are handled)

    guard(own_process, stop)
