"""Stamps, judged for each publisher: the wrong clock, the same one again, and back in time.

A stamp is compared with the plan's clock: the system's, or simulated time as it comes on /clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.verdict.clock import WRONG_BY_NS, other_clock
from tfcompose.verdict.offence import BACK, REPEATED, WRONG_CLOCK

if TYPE_CHECKING:
    from collections.abc import Sequence

_SECOND_NS = 1_000_000_000
#: So many in a row are no accident; so many that are right end it.
WRONG_IN_A_ROW = 3
#: Each fault counts up by so many, each right message down by one; at so many the fault is reported.
REPEAT_COUNTS, REPEATS = 2, 10
STEP_COUNTS, BACK_STEPS = 4, 12
#: How fast simulated time goes by is measured over so long.
SPEED_OVER_S = 2.0
#: Simulated time that has not moved for so long stands: the simulator is paused. Less than an edge may be quiet.
STANDS_S = 0.3
#: One step back by so much is enough.
LARGE_STEP_NS = _SECOND_NS


@dataclass(slots=True)
class Clocks:
    """What time it is: the system's time when a message came, and the newest on /clock (None: nothing came yet).

    ``sent`` says whether anybody is there who could send it.
    """

    simulated: bool
    sim_ns: int | None = None
    sent: bool = True
    _moved: float = 0.0
    _since: tuple[float, int] | None = None
    _speed: float = 1.0

    def take(self, sim_ns: int | None, now: float) -> None:
        """Take the newest time on /clock, and when that was."""
        self._moved = self._moved if sim_ns == self.sim_ns else now
        self.sim_ns = sim_ns
        if sim_ns is None:
            return
        if self._since is None or sim_ns < self._since[1]:
            self._since = (now, sim_ns)
        elif now - self._since[0] >= SPEED_OVER_S:
            self._speed = self._passed(now)
            self._since = (now, sim_ns)

    def stands(self, now: float) -> bool:
        """Return whether time came and does not go on: nobody sends anything then, and nobody is silent."""
        return self.simulated and self.sent and self.sim_ns is not None and now - self._moved > STANDS_S

    def speed(self, now: float) -> float:
        """Return how many seconds go by on /clock in a second, 1 at most: the least of what is, and was a while ago."""
        enough = self._since is not None and now - self._since[0] >= SPEED_OVER_S / 4
        return min(self._speed, self._passed(now)) if enough else self._speed

    def _passed(self, now: float) -> float:
        """Return the speed since the last time that it was measured."""
        begun, begun_ns = self._since or (now, 0)
        return min(1.0, ((self.sim_ns or 0) - begun_ns) / _SECOND_NS / max(now - begun, 1e-9))

    def reference_ns(self, received_ns: int) -> int | None:
        """Return the time that stamps should have, or None if that is not known."""
        return self.sim_ns if self.simulated else received_ns or None


@dataclass(slots=True)
class Stamps:
    """The stamps of one publisher's messages with the same edges."""

    last: Sequence[int] = ()
    repeats: int = 0
    back: int = 0
    wrong: int = 0

    def judge(self, stamps_ns: Sequence[int], received_ns: int, clocks: Clocks) -> tuple[str, str]:
        """Take a message's stamps and return the fault's code and what was seen; empty where all is well."""
        last, self.last = self.last, stamps_ns
        off = self._clock(stamps_ns, received_ns, clocks)
        step = self._step(stamps_ns, last) if last else ("", "")
        # Who repeats a stamp for long is off at last, and that follows from it; who has none is said to have none.
        if off and (step[0] != REPEATED or not stamps_ns[0]):
            return WRONG_CLOCK, off
        return step

    def _step(self, stamps_ns: Sequence[int], last: Sequence[int]) -> tuple[str, str]:
        steps = [new - old for new, old in zip(stamps_ns, last, strict=False)]
        least = min(steps)
        if least > 0:
            self.repeats, self.back = max(0, self.repeats - 1), max(0, self.back - 1)
        elif least == 0:
            self.repeats = min(self.repeats + REPEAT_COUNTS, 2 * REPEATS)
            if self.repeats >= REPEATS:
                return REPEATED, f"{stamps_ns[steps.index(0)] / 1e9:.3f} s"
        else:
            self.back = min(self.back + (BACK_STEPS if -least >= LARGE_STEP_NS else STEP_COUNTS), 2 * BACK_STEPS)
            if self.back >= BACK_STEPS:
                return BACK, f"{-least / 1e9:.3g} s"
        return "", ""

    def _clock(self, stamps_ns: Sequence[int], received_ns: int, clocks: Clocks) -> str:
        reference = clocks.reference_ns(received_ns)
        if reference is None:
            return ""
        oldest, newest = min(stamps_ns), max(stamps_ns)
        worst = newest if newest - reference > reference - oldest else oldest
        if abs(worst - reference) <= WRONG_BY_NS:
            self.wrong = 0
            return ""
        self.wrong = min(self.wrong + 1, WRONG_IN_A_ROW)
        if self.wrong < WRONG_IN_A_ROW:
            return ""
        return other_clock(worst, received_ns, clocks.sim_ns, simulated=clocks.simulated)
