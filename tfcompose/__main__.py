"""``python -m tfcompose`` is the same program as the ``tfcompose`` command."""

import sys

from tfcompose.cli import main

_code = main()
# Python remembers that Ctrl-C ended an exec of text, as `dataclass` makes them, and run with -m it
# would at last end by the signal although main() handled it. The next exec lets it forget.
exec("")  # noqa: S102
sys.exit(_code)
