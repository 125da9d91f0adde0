"""What is seen against a plan: who publishes an edge, below which parent, with which pose, how often."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.observe.differences import differences
from tfcompose.observe.telling import grouped, told
from tfcompose.verdict.offence import SELF

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Finding
    from tfcompose.observe.seen import Seen


def differs_from_plan(seen: Seen) -> Iterator[Finding]:
    """What comes is not what the plan says."""
    if seen.plan is None or not (seen.edges or seen.publishers):
        return  # nobody publishes at all, which is said
    found = [one for one in differences(seen, seen.plan) if one.code != SELF]  # told of every edge, planned or not
    for group in grouped(found):
        yield told(group, seen, seen.plan)
