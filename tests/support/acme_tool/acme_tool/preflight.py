"""What keeps a beeper from beeping on the machine that starts it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.plan import Plan


def muted(plan: Plan) -> Iterator[Finding]:
    """Yield a finding where the environment mutes all beepers."""
    if os.environ.get("ACME_MUTED"):
        frame = plan.sections["acme"]["frame"]
        message = f"{frame} is muted by ACME_MUTED"
        yield finding("ACME103", message, None, help="unset ACME_MUTED")
