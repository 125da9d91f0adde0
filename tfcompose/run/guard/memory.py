"""What a guard leaves to the one that follows it, should it die: by the launcher, which does not look into it.

``events.MEMORY_FD`` names the environment variable that holds the descriptor of a file with the memory: one JSON
object, by the TF topics that a judge watches.
"""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from tfcompose.ipc import MEMORY_FD, Remember

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tfcompose.ipc import GuardEvent
    from tfcompose.run.guard.judge import Judge
    from tfcompose.run.guard.relay import Relay
    from tfcompose.run.guard.switches import Switches

#: A longer part is not handed on: the launcher takes no longer lines; characters.
LONGEST = 900_000
#: The part of the memory that no topics have.
_SWITCHES, _ANSWERED = "switches", "answered"


def recalled(env: Mapping[str, str]) -> dict[str, Any]:
    """Return what the guard before this one left, by topics; nothing where there was none."""
    if MEMORY_FD not in env:
        return {}
    with os.fdopen(int(env[MEMORY_FD]), "rb") as file:
        left: dict[str, Any] = json.loads(file.read())
    by_topics: dict[str, Any] = {}
    for key, value in left.items():
        topics, _, part = key.rpartition(" ")
        by_topics.setdefault(topics, {})[part] = value
    return by_topics


class Memory:
    """Hands on what a judge knows, and a relay latches, part by part, whenever a part has changed."""

    def __init__(self, topics: str, judge: Judge, relay: Relay | None, emit: Callable[[GuardEvent], None]) -> None:
        self._topics = topics
        self._judge = judge
        self._relay = relay
        self._emit = emit
        self._mark: object = None
        self._left: dict[str, Any] = {}

    def look(self) -> None:
        """Hand on what has changed."""
        mark = (self._judge.mark, self._relay and self._relay.changes)
        if mark == self._mark:
            return
        self._mark = mark
        known = self._judge.memory() | (self._relay.memory() if self._relay else {})
        gone = dict.fromkeys(self._left.keys() - known.keys())
        for part, value in (known | gone).items():
            if self._left.get(part) != value and len(json.dumps(value)) < LONGEST:
                self._emit(Remember({f"{self._topics} {part}": value}))
        self._left = known


class SwitchMemory:
    """Hands on which nodes have answered what their switches are, so that nobody is told twice."""

    def __init__(self, switches: Switches, emit: Callable[[GuardEvent], None], left: Mapping[str, Any]) -> None:
        self._switches = switches
        self._emit = emit
        self._left = left.get(_SWITCHES, {}).get(_ANSWERED, [])
        switches.recall(self._left)

    def look(self) -> None:
        """Hand on what has changed."""
        answered = self._switches.answered
        if answered != self._left:
            self._left = answered
            self._emit(Remember({f"{_SWITCHES} {_ANSWERED}": answered}))
