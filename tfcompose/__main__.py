"""``python -m tfcompose`` is the same program as the ``tfcompose`` command."""

import sys

from tfcompose.cli import main

sys.exit(main())
