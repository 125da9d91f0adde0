"""The history of edges that come together, in the seconds in which the guard looked.

A guard that was kept from looking knows nothing of the time between, and blames nobody for it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tfcompose.plan import PlanEdge

#: A rate is judged over this time, or so many periods.
WINDOW_S = 2.0
WINDOW_PERIODS = 8.0
#: What is kept of the arrivals before the window: a rate needs two gaps, the longer of which may be a hiccup.
FEWEST_ARRIVALS = 4
#: Of the time between two looks only so much counts; the guard looks ten times a second.
LOOK_COUNTS_S = 0.25
#: After so long without a look messages are lost, and come when the writer's next heartbeat does: 3 s in Fast DDS.
STALLED_S = 1.0
CATCH_UP_S = 3.5


@dataclass(slots=True)
class Watched:
    """The seconds in which the guard looked, as a clock that stands while it is kept from looking."""

    _seconds: float = 0.0
    _looked: float | None = None
    _catching_up_until: float = 0.0

    def at(self, now: float) -> float:
        """Return the seconds until ``now``."""
        if self._looked is None or now < self._catching_up_until:
            return self._seconds
        return self._seconds + min(max(now - self._looked, 0.0), LOOK_COUNTS_S)

    def begins_late(self, until: float) -> None:
        """Take what is missing until then as not found yet."""
        self._catching_up_until = until

    def is_behind(self, now: float) -> bool:
        """Return whether what comes now may have waited: the guard was kept from looking, or still catches up."""
        stalled = self._looked is not None and now - self._looked > STALLED_S
        return stalled or now < self._catching_up_until

    def look(self, now: float) -> float:
        """Note that the guard looks now, and return the seconds until then."""
        if self._looked is not None and now - self._looked > STALLED_S:
            self._catching_up_until = now + CATCH_UP_S
        self._seconds, self._looked = self.at(now), now
        return self._seconds


@dataclass(slots=True)
class Track:
    """What is known of planned edges that come together: of one owner, kind and rate.

    ``arrivals`` and ``heard`` are watched seconds, ``last`` is monotonic; ``delay_s`` is the age of the last stamp when
    it came, ``silent_after`` how long the edges may be quiet, in seconds, or None if they say no rate.
    """

    edges: tuple[PlanEdge, ...]
    silent_after: float | None = field(init=False)
    _window: float = field(init=False)
    delay_s: float | None = None
    live: bool = False
    last: float = 0.0
    heard: float = 0.0
    silent: bool = False
    silent_since: float = 0.0
    steady: bool = False
    slow: bool = False
    arrivals: deque[float] = field(default_factory=deque)

    @property
    def edge(self) -> PlanEdge:
        """One of them."""
        return self.edges[0]

    def __post_init__(self) -> None:
        rate = self.edge.rate
        self._window = max(WINDOW_S, WINDOW_PERIODS / (rate or WINDOW_PERIODS))
        self.silent_after = self.edge.silent_after_s

    def arrived(self, seen: float, now: float) -> None:
        """Note an arrival. An edge that was silent is steady again with two arrivals close enough to each other."""
        after = self.silent_after
        self.steady = after is not None and self.live and seen - self.heard <= after
        self.last, self.heard = now, seen
        if after is not None:
            self.arrivals.append(seen)
            self._forget(seen)

    def rate(self, seen: float) -> float | None:
        """Return the rate over the window in hertz, without its longest gap; None while there is too little to say."""
        self._forget(seen)
        times = self.arrivals
        if len(times) < 3 or times[-1] - times[0] < self._window / 2:  # noqa: PLR2004 (two gaps need three arrivals)
            return None
        longest = max(b - a for a, b in pairwise(times))
        rest = times[-1] - times[0] - longest
        return (len(times) - 2) / rest if rest > 0 else None

    def _forget(self, seen: float) -> None:
        while len(self.arrivals) > FEWEST_ARRIVALS and seen - self.arrivals[0] > self._window:
            self.arrivals.popleft()
