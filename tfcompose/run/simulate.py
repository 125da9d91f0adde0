"""The process that stands in for an owner: ``python -m tfcompose.run.simulate PLAN_FILE PROCESS_NAME``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from tfcompose.run.begin import start

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(argv: Sequence[str]) -> int:
    """Run it until a signal comes and return the exit code; ``begin.start`` says which."""
    return start(argv, "simulate")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
