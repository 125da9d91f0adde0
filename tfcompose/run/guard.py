"""The process that watches the live tree: ``python -m tfcompose.run.guard PLAN_FILE PROCESS_NAME``.

What it finds goes to the launcher as lines of JSON on the descriptor that ``TFCOMPOSE_EVENTS_FD`` names, and to its
own output where there is no launcher. ``TFCOMPOSE_SETTLE_S`` is how long it looks before the others are started.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.run.begin import start

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(argv: Sequence[str]) -> int:
    """Run it until a signal comes and return the exit code; ``begin.start`` says which."""
    return start(argv, "guard")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
