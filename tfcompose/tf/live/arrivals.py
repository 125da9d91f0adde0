"""Statistics of arrivals: rate, jitter and delay over recent time, in bounded memory.

Times are integer nanoseconds; results are in seconds and hertz.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

#: tf2 buffers keep 10 s. A stamp that is farther off cannot be looked up together with others.
KEPT_NS = 10_000_000_000
#: A gap that is longer than the window and than this many usual gaps is a pause. Rates are
#: measured from the end of a pause.
PAUSE = 10.0


@dataclass(slots=True)
class _Sums:
    """Sums over gaps between arrivals and over delays, for means and deviations."""

    begun_ns: int = 0
    gaps: int = 0
    gaps_ns: int = 0
    squares: float = 0.0  # of gaps, in s²
    longest_ns: int = 0
    longest_ended_ns: int = 0
    delays: int = 0
    delays_ns: int = 0
    least_ns: int = 0
    most_ns: int = 0

    def gap(self, gap_ns: int, at_ns: int) -> None:
        self.gaps += 1
        self.gaps_ns += gap_ns
        gap_s = gap_ns * 1e-9
        self.squares += gap_s * gap_s
        if gap_ns >= self.longest_ns:
            self.longest_ns, self.longest_ended_ns = gap_ns, at_ns

    def delay(self, delay_ns: int) -> None:
        if self.delays == 0:
            self.least_ns = self.most_ns = delay_ns
        elif delay_ns < self.least_ns:
            self.least_ns = delay_ns
        elif delay_ns > self.most_ns:
            self.most_ns = delay_ns
        self.delays += 1
        self.delays_ns += delay_ns

    def plus(self, other: _Sums) -> _Sums:
        """Return the combined sums."""
        longest = max(self, other, key=lambda each: (each.longest_ns, each.longest_ended_ns))
        spans = [(each.least_ns, each.most_ns) for each in (self, other) if each.delays]
        return _Sums(
            self.begun_ns,
            self.gaps + other.gaps,
            self.gaps_ns + other.gaps_ns,
            self.squares + other.squares,
            longest.longest_ns,
            longest.longest_ended_ns,
            self.delays + other.delays,
            self.delays_ns + other.delays_ns,
            min((low for low, _ in spans), default=0),
            max((high for _, high in spans), default=0),
        )


@dataclass(frozen=True, slots=True)
class Timing:
    """Measured timing. A value is None if there are too few arrivals."""

    #: Arrivals per second. It decreases while no message arrives.
    rate: float | None = None
    #: Standard deviation of the time between two arrivals.
    jitter_s: float | None = None
    #: Longest time between two arrivals.
    longest_gap_s: float | None = None
    #: Time since the end of the longest gap.
    since_gap_s: float | None = None
    #: Mean of arrival minus stamp, negative if stamps are ahead of the receiver's clock.
    delay_s: float | None = None
    #: Minimum of arrival minus stamp.
    least_delay_s: float | None = None
    #: Maximum of arrival minus stamp.
    most_delay_s: float | None = None


@dataclass(slots=True)
class Arrivals:
    """Counts arrivals over a sliding window.

    A pause longer than the window counts as the longest gap for one window, and does not affect
    the other values.
    """

    #: The window covers one to two of these periods; 0 for all arrivals.
    window_ns: int = 0
    #: Arrivals in this initial period are only counted, because a new subscriber receives all
    #: latched messages at once.
    settle_ns: int = 0
    count: int = 0
    last_ns: int = 0
    _now: _Sums = field(default_factory=_Sums)
    _before: _Sums = field(default_factory=_Sums)
    _pause_ns: int = 0
    _resumed_ns: int = 0

    def note_arrival(self, at_ns: int, delay_ns: int | None) -> None:
        """Record an arrival, and the age of its stamp if known."""
        self.count += 1
        if self.count == 1:
            self._now.begun_ns = at_ns
        elif at_ns - self._now.begun_ns < self.settle_ns:
            self.last_ns = at_ns
            return
        else:
            self.settle_ns = 0
            self._take_gap(max(0, at_ns - self.last_ns), at_ns)
        self.last_ns = at_ns
        if delay_ns is not None and not self.settle_ns:
            self._now.delay(delay_ns)

    def _take_gap(self, gap_ns: int, at_ns: int) -> None:
        if self.window_ns and at_ns - self._now.begun_ns > self.window_ns:
            if self._is_pause(gap_ns):
                self._before, self._now = _Sums(), _Sums(at_ns)
                self._pause_ns, self._resumed_ns = gap_ns, at_ns
                return
            self._before, self._now = self._now, _Sums(at_ns)
        self._now.gap(gap_ns, at_ns)

    def _is_pause(self, gap_ns: int) -> bool:
        sums = self._before.plus(self._now)
        is_unusual = gap_ns * sums.gaps > PAUSE * sums.gaps_ns
        return gap_ns > self.window_ns and is_unusual

    def note_resumption(self, at_ns: int) -> None:
        """Record an arrival after a pause that does not count as a gap."""
        if self.count:
            self.count += 1
            self.last_ns = at_ns
        else:
            self.note_arrival(at_ns, None)

    def timing(self, now_ns: int) -> Timing:
        """Return the timing until ``now_ns``, on the clock of the arrivals."""
        sums = self._before.plus(self._now)
        delays: tuple[float | None, float | None, float | None] = (None, None, None)
        if sums.delays:
            delays = (
                sums.delays_ns / sums.delays * 1e-9,
                sums.least_ns * 1e-9,
                sums.most_ns * 1e-9,
            )
        longest_ns, ended_ns = sums.longest_ns, sums.longest_ended_ns
        if self._pause_ns and now_ns - self._resumed_ns <= self.window_ns:
            longest_ns, ended_ns = self._pause_ns, self._resumed_ns
        longest: tuple[float | None, float | None] = (None, None)
        if ended_ns:
            longest = (longest_ns * 1e-9, (now_ns - ended_ns) * 1e-9)
        if not sums.gaps:
            return Timing(None, None, *longest, *delays)
        mean_s = sums.gaps_ns / sums.gaps * 1e-9
        open_gap_ns = max(0, now_ns - self.last_ns - sums.longest_ns)
        total_s = (sums.gaps_ns + open_gap_ns) * 1e-9
        return Timing(
            sums.gaps / total_s if total_s > 0 else None,
            sqrt(max(0.0, sums.squares / sums.gaps - mean_s * mean_s)) if sums.gaps > 1 else None,
            *longest,
            *delays,
        )

    def steady_rate(self, least_ns: int) -> float | None:
        """Return the rate in Hz without the longest gap, which may be an exception.

        None while the gaps add up to less than ``least_ns``.
        """
        sums = self._before.plus(self._now)
        rest_ns = sums.gaps_ns - sums.longest_ns
        if sums.gaps < 2 or sums.gaps_ns < least_ns or rest_ns <= 0:  # noqa: PLR2004 (one besides the longest)
            return None
        return (sums.gaps - 1) / (rest_ns * 1e-9)
