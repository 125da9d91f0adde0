"""What a strict guard holds back, counted by who sent it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection

    from tfcompose.run.guard.senders import Message

#: Of so many senders' edges what was held back is counted.
MOST_COUNTED = 1000
NAMED_AT_MOST = 6


class Held:
    """``counts`` are transforms that were not passed on, by the sender's node, parent and child."""

    def __init__(self) -> None:
        self.counts: dict[tuple[str, str, str], int] = {}
        self._reported: dict[tuple[str, str, str], int] = {}

    def count(self, message: Message, admitted: Collection[tuple[str, str]], who: str) -> None:
        """Count what is not admitted of a message."""
        for parent, child in message.edges:
            key = (who, parent, child)
            if (parent, child) not in admitted and (key in self.counts or len(self.counts) < MOST_COUNTED):
                self.counts[key] = self.counts.get(key, 0) + 1

    def report(self) -> str:
        """Return how much was held back since the last time, and whose it is; empty if nothing was."""
        now = {key: count for key, count in self.counts.items() if count != self._reported.get(key)}
        self._reported.update(now)
        said = [f"{count} × {parent} → {child} from {who}" for (who, parent, child), count in now.items()]
        more = [f"and {len(said) - NAMED_AT_MOST} more"] if len(said) > NAMED_AT_MOST else []
        return ", ".join([*said[:NAMED_AT_MOST], *more])
