"""Stamps and clocks: wrong clock, repeated stamps, back in time, too old, too new.

The guard judges the stamps of each message, with ``StampHistory`` and ``Clocks``. The doctor
judges an observer's counts at the end. Stamps are compared with system time, or with simulated
time from /clock.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import duration, list_names, plural, with_more
from tfcompose.tf.live.arrivals import KEPT_NS
from tfcompose.tf.live.state import who

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tf.live.state import TreeState

REPEATED, BACK, WRONG_CLOCK = "TF823", "TF824", "TF825"

_SECOND_NS = 1_000_000_000
#: A stamp before this date in 2001 is not system time; in nanoseconds.
_NO_DATE_NS = 10**9 * _SECOND_NS
KEPT_S = KEPT_NS / _SECOND_NS
#: A single step back of this size, in seconds, is enough for a finding.
LARGE_STEP_S = 1.0
#: If stamps are ahead by more, in seconds, lookups of the current time return an earlier pose.
#: Nodes that predict poses stay below this.
AHEAD_S = 0.15
#: AMCL and other nodes stamp edges below these frames up to a second ahead, so that lookups of the
#: current time succeed.
LOCALISED_IN, FORWARD_S = ("map", "earth", "world"), 1.1
#: Steps of a simulated clock are smaller, in seconds.
CLOCK_STEP_S = 0.5
#: If a message seems to arrive this many seconds before it was sent, the sender's clock is ahead.
SKEW_S = 0.02
#: A network delays messages by less than this, in seconds. With a larger delay, a clock is behind.
SLOW_S = 0.25
#: At the end: this many wrong stamps, and this fraction of all stamps, are a fault.
FEWEST, PART = 5, 0.3
#: For each message: this many consecutive wrong stamps are a fault, and as many correct stamps end
#: it.
WRONG_IN_A_ROW = 3
#: A fault raises its count by the first number, and each correct message lowers the count by one.
#: At the second number the fault is reported.
REPEAT_COUNTS, REPEATS = 2, 10
STEP_COUNTS, BACK_STEPS = 4, 12
#: The speed of simulated time is measured over this time, in seconds.
SPEED_OVER_S = 2.0
#: If simulated time has not advanced for this time, in seconds, it is paused. It must be shorter
#: than the silence allowed for an edge.
STANDS_S = 0.3


# Findings.


def other_clock(stamp_ns: int, received_ns: int, sim_ns: int | None, *, simulated: bool) -> str:
    """Return how a stamp's clock differs from the expected clock; empty if it does not.

    ``received_ns`` is the system time of the arrival, 0 if unknown. ``sim_ns`` is the newest time
    on /clock, None without one. ``simulated`` selects the expected clock.
    """
    if stamp_ns == 0:
        return "without a stamp"
    near_sim = sim_ns is not None and abs(stamp_ns - sim_ns) <= KEPT_NS
    near_system = bool(received_ns) and abs(stamp_ns - received_ns) <= KEPT_NS
    if simulated and sim_ns is not None:
        if near_sim:
            return ""
        if near_system:
            return f"stamped with the system's time, while /clock says {sim_ns / 1e9:.1f} s"
        return f"stamped {stamp_ns / 1e9:.1f} s, {_off(stamp_ns, sim_ns)} /clock"
    if simulated or near_system or not received_ns:
        return ""
    if near_sim:
        return f"stamped with simulated time ({stamp_ns / 1e9:.1f} s), unlike others"
    if stamp_ns < _NO_DATE_NS:
        since = "simulated time, or the time since a start"
        if _is_since_boot(stamp_ns, received_ns):
            since = "the time since this machine was started"
        return f"stamped {stamp_ns / 1e9:.1f} s, which is {since}"
    name = offset_name((stamp_ns - received_ns) / 1e9)
    return f"stamped {_off(stamp_ns, received_ns)} the system's time{name}"


def _off(stamp_ns: int, reference_ns: int) -> str:
    return (
        f"{duration((reference_ns - stamp_ns) / 1e9)}"
        f" {'behind' if stamp_ns < reference_ns else 'ahead of'}"
    )


#: Offsets from UTC in seconds of the time scales of GNSS receivers and PTP since 2017 (IERS
#: Bulletin C; GPS time is TAI - 19 s).
_SCALES = {37.0: "TAI, which PTP has", 18.0: "the time of GPS"}
#: Tolerances in seconds for such an offset and for full hours.
_NEAR_S, _NEAR_HOUR_S = 0.5, 20.0
_MOST_HOURS = 14


def offset_name(ahead_s: float) -> str:
    """Return the name of the time scale that is ``ahead_s`` seconds ahead of UTC; "" if unknown.

    The text continues a sentence: " (TAI, which PTP has)".
    """
    for offset_s, name in _SCALES.items():
        if abs(ahead_s - offset_s) <= _NEAR_S:
            return f" ({name})"
    hours = round(ahead_s / 3600)
    is_zone = 1 <= abs(hours) <= _MOST_HOURS and abs(ahead_s - hours * 3600) <= _NEAR_HOUR_S
    return " (whole hours: a local time taken for UTC)" if is_zone else ""


def _is_since_boot(stamp_ns: int, received_ns: int) -> bool:
    """Return whether a stamp equals the uptime of this machine. False for a recording."""
    uptime_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    then_ns = received_ns - (time.time_ns() - uptime_ns)
    return 0 < then_ns <= uptime_ns and abs(stamp_ns - then_ns) <= KEPT_NS


def message(code: str, publisher: str, edges: str, detail: str) -> str:
    """Return the message for stamps that repeat, go back, or come from another clock."""
    if code == REPEATED:
        return f"{publisher} sends {edges} with the same stamp again and again: {detail}"
    if code == BACK:
        return f"{publisher} stamps {edges} back in time, {detail}"
    return f"{publisher} sends {edges} {detail}"


def advice(code: str, detail: str) -> str:
    """Return the help for a code about stamps."""
    if code == REPEATED:
        return (
            "tf2 drops all but the first; stamp with the time of the measurement, or send when"
            " there is a new one"
        )
    if code == BACK:
        return (
            "tf2 inserts it before newer ones, or drops it; was a bag or a simulation started"
            " again, or a clock set?"
        )
    if detail == "without a stamp":
        simulated = "a node with use_sim_time stamps 0 while nothing publishes /clock"
        return f"{simulated}; otherwise set header.stamp from the node's clock"
    apart = "no lookup can combine it with other transforms"
    if "simulated" in detail or "/clock" in detail:
        return f"{apart}: use_sim_time must be the same for all nodes, and agree with ros.clock"
    return f"{apart}: is a bag played without --clock, or a machine's clock not in sync?"


# Judgement of each message.


@dataclass(slots=True)
class Clocks:
    """Reference clocks for stamps: system time at the arrival of a message, and /clock."""

    simulated: bool
    #: The newest time on /clock, None before the first.
    sim_ns: int | None = None
    #: Whether a node publishes /clock.
    sent: bool = True
    _moved: float = 0.0
    _since: tuple[float, int] | None = None
    _speed: float = 1.0

    def take(self, sim_ns: int | None, now: float) -> None:
        """Record the newest time on /clock, and its arrival."""
        self._moved = self._moved if sim_ns == self.sim_ns else now
        self.sim_ns = sim_ns
        if sim_ns is None:
            return
        if self._since is None or sim_ns < self._since[1]:
            self._since = (now, sim_ns)
        elif now - self._since[0] >= SPEED_OVER_S:
            self._speed = self._measure_speed(now)
            self._since = (now, sim_ns)

    def stands(self, now: float) -> bool:
        """Return whether simulated time has arrived before and has stopped.

        While it is stopped, nodes send nothing, so no node counts as silent.
        """
        return (
            self.simulated
            and self.sent
            and self.sim_ns is not None
            and now - self._moved > STANDS_S
        )

    def speed(self, now: float) -> float:
        """Return the real-time factor of /clock, at most 1.

        This is the minimum of the current factor and the previous one.
        """
        enough = self._since is not None and now - self._since[0] >= SPEED_OVER_S / 4
        return min(self._speed, self._measure_speed(now)) if enough else self._speed

    def _measure_speed(self, now: float) -> float:
        """Return the real-time factor since the last measurement."""
        begun, begun_ns = self._since or (now, 0)
        return min(1.0, ((self.sim_ns or 0) - begun_ns) / _SECOND_NS / max(now - begun, 1e-9))

    def reference_ns(self, received_ns: int) -> int | None:
        """Return the time that stamps should have, None if unknown."""
        return self.sim_ns if self.simulated else received_ns or None


@dataclass(slots=True)
class StampHistory:
    """The stamps of a publisher's messages with the same edges."""

    last: Sequence[int] = ()
    repeats: int = 0
    back: int = 0
    wrong: int = 0

    def judge(self, stamps_ns: Sequence[int], received_ns: int, clocks: Clocks) -> tuple[str, str]:
        """Process a message's stamps. Return a fault's code and a description of the observation.

        Both are empty if the stamps are correct.
        """
        last, self.last = self.last, stamps_ns
        off = self._clock(stamps_ns, received_ns, clocks)
        step = self._step(stamps_ns, last) if last else ("", "")
        # A repeated stamp also drifts from the clock, so report only the repetition. Report a
        # missing stamp as missing.
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
            large = -least >= LARGE_STEP_S * _SECOND_NS
            self.back = min(self.back + (BACK_STEPS if large else STEP_COUNTS), 2 * BACK_STEPS)
            if self.back >= BACK_STEPS:
                return BACK, f"by {duration(least / 1e9)}"
        return "", ""

    def _clock(self, stamps_ns: Sequence[int], received_ns: int, clocks: Clocks) -> str:
        reference = clocks.reference_ns(received_ns)
        if reference is None:
            return ""
        oldest, newest = min(stamps_ns), max(stamps_ns)
        worst = newest if newest - reference > reference - oldest else oldest
        if abs(worst - reference) <= KEPT_NS:
            self.wrong = 0
            return ""
        self.wrong = min(self.wrong + 1, WRONG_IN_A_ROW)
        if self.wrong < WRONG_IN_A_ROW:
            return ""
        return other_clock(worst, received_ns, clocks.sim_ns, simulated=clocks.simulated)


# Judgement at the end.


def find_repeated_stamps(state: TreeState) -> Iterator[Finding]:
    """A publisher sends an edge repeatedly with the same stamp."""

    def repeats(edge: EdgeState) -> bool:
        return (
            _repeats(edge) and edge.stream.stamp_ns > 0 and not _stands_with_the_clock(state, edge)
        )

    for edges in by_publisher(state, repeats):
        stream = edges[0].stream
        detail = f"{stream.stamp_ns / 1e9:.3f} s"
        notes = [Note(f"{stream.stamps_repeated} of {stream.arrivals.count} messages")]
        yield _stamp_finding(REPEATED, edges, detail, notes)


def stamp_went_back(state: TreeState) -> Iterator[Finding]:
    """A publisher's stamps go back in time."""
    for edges in by_publisher(state, _went_back):
        stream = edges[0].stream
        now_s = _behind_newest_s(edges[0])
        by = f", the newest is {duration(now_s)} before an earlier one" if now_s > 0 else ""
        detail = f"{plural(stream.stamps_back, 'time')} in {stream.arrivals.count}{by}"
        yield _stamp_finding(BACK, edges, detail)


def wrong_clock(state: TreeState) -> Iterator[Finding]:
    """Stamps of some edges come from another clock than stamps of other edges.

    Simulated and system time are mixed, or stamps are missing.
    """
    simulated = state.simulated
    for edges in by_publisher(
        state, lambda edge: bool(_off_clock(state, edge, simulated=simulated))
    ):
        where = state.where(edges[0])
        notes = [Note(f"it runs {where}")] if where else []
        yield _stamp_finding(
            WRONG_CLOCK, edges, _off_clock(state, edges[0], simulated=simulated), notes
        )


def _stamp_finding(
    code: str, edges: Sequence[EdgeState], detail: str, notes: Sequence[Note] = ()
) -> Finding:
    sentence = message(code, who(edges[0]), names_of(edges), detail)
    severity = "error" if code == WRONG_CLOCK else "warning"
    return finding(code, sentence, None, severity=severity, notes=notes, help=advice(code, detail))  # type: ignore[arg-type]


def host_clock_off(state: TreeState) -> Iterator[Finding]:
    """The clock of another machine differs from this machine's clock."""
    machines: dict[tuple[bool, str], tuple[float, list[str]]] = {}
    for publisher in state.publishers:
        skew = state.skews_s.get(publisher.gid)
        if skew is None or -SLOW_S < skew < SKEW_S or not publisher.node:
            continue
        states = machines.setdefault((skew > 0, publisher.where), (skew, []))[1]
        if publisher.node not in states:
            states.append(publisher.node)
    for (ahead, where), (skew, nodes) in machines.items():
        location = f" {where}" if where else ""
        if ahead:
            message = (
                f"the clock of {list_names(nodes)}{location} is {duration(skew)} ahead of this"
                f" machine's{offset_name(skew)}"
            )
        else:
            late = f"{duration(skew)} after they were sent"
            message = f"messages of {list_names(nodes)}{location} arrive {late}"
        advice = (
            "bring the machines' clocks together (chrony, or timedatectl set-ntp true); stamps"
            " differ by as much"
        )
        advice += "" if ahead else ", or the network is that slow"
        yield finding("TF834", message, None, help=advice)


def stamps_ahead(state: TreeState) -> Iterator[Finding]:
    """An edge's stamps are in the future."""

    def ahead(edge: EdgeState) -> bool:
        most = edge.timing.most_delay_s
        skewed = state.skews_s.get(edge.stream.gid or b"", 0.0) >= SKEW_S
        localised = edge.parent.rpartition("/")[2] in LOCALISED_IN
        least = FORWARD_S if localised else AHEAD_S
        return most is not None and -KEPT_S <= most <= -least and not skewed

    for edges in by_publisher(state, ahead):
        ahead_s = -(edges[0].timing.delay_s or 0.0)
        message = f"{who(edges[0])} stamps {names_of(edges)} {duration(ahead_s)} ahead of time"
        advice = (
            "lookups at the current time get an older pose; is its clock ahead, or its time offset"
            " too large?"
        )
        yield finding("TF835", message, None, severity="warning", help=advice)


def clock_missing(state: TreeState) -> Iterator[Finding]:
    """Nodes wait for simulated time, and none arrives."""
    for topic in state.graph:
        if topic.name != "/clock" or not (
            topic.readers or (state.plan and state.plan.ros.clock == "sim")
        ):
            continue
        verb = "use" if len(topic.readers) > 1 else "uses"
        users = f"{list_names(topic.readers)} {verb} simulated time"
        users = users if topic.readers else "the plan's clock is sim"
        if not topic.publishers:
            message = f"{users}, but no node publishes /clock"
            advice = "start the simulator, play the bag with --clock, or set use_sim_time: false"
            yield finding("TF836", message, None, help=advice)
        elif not state.clock_moves:
            stuck = (
                "has sent nothing"
                if state.clock_ns is None
                else f"is stuck at {state.clock_ns / 1e9:.3f} s"
            )
            message = f"{users}, and /clock from {list_names(topic.publishers)} {stuck}"
            yield finding(
                "TF836", message, None, help="is the simulator paused, or the bag at its end?"
            )


def two_clocks(state: TreeState) -> Iterator[Finding]:
    """Two nodes publish /clock."""
    for topic in state.graph:
        if topic.name == "/clock" and len(topic.publishers) > 1:
            message = (
                f"/clock is published by {' and by '.join(sorted(topic.publishers))}: time jumps"
                " back and forth"
            )
            yield finding(
                "TF837",
                message,
                None,
                help="end one: a second simulator, or a bag that is played with --clock",
            )


def by_publisher(
    state: TreeState, is_so: Callable[[EdgeState], bool]
) -> Iterator[list[EdgeState]]:
    """Yield the moving edges for which ``is_so`` returns True, grouped by publisher."""
    states: dict[object, list[EdgeState]] = {}
    for edge in state.moving:
        if is_so(edge):
            states.setdefault(edge.stream.gid or edge.nodes, []).append(edge)
    yield from states.values()


def names_of(edges: Sequence[EdgeState]) -> str:
    """Return the first edge's name, and the number of further edges."""
    return with_more(edges[0].name, len(edges) - 1)


def _many(edge: EdgeState, number: int) -> bool:
    return number >= FEWEST and number >= PART * edge.stream.arrivals.count


def _repeats(edge: EdgeState) -> bool:
    return _many(edge, edge.stream.stamps_repeated)


def _stands_with_the_clock(state: TreeState, edge: EdgeState) -> bool:
    """Return whether an edge repeats stamps because /clock does not advance.

    Another finding reports a /clock that does not advance.
    """
    return (
        state.clock_ns is not None
        and not state.clock_moves
        and abs(edge.stream.stamp_ns - state.clock_ns) <= CLOCK_STEP_S * _SECOND_NS
    )


def _went_back(edge: EdgeState) -> bool:
    return _many(edge, edge.stream.stamps_back) or (
        edge.stream.stamps_back > 0 and _behind_newest_s(edge) >= LARGE_STEP_S
    )


def _behind_newest_s(edge: EdgeState) -> float:
    return (edge.stream.newest_ns - edge.stream.stamp_ns) / 1e9


def least_delay_s(edge: EdgeState) -> float:
    """Return the minimum age of a stamp on arrival, in seconds.

    Repeated stamps return 0, because a repeated stamp only grows older.
    """
    least = edge.timing.least_delay_s
    return 0.0 if least is None or _repeats(edge) else least


def _off_clock(state: TreeState, edge: EdgeState, *, simulated: bool) -> str:
    """Return how the stamps differ from the expected clock; empty if they do not."""
    stream = edge.stream
    if stream.stamp_ns and _many(edge, stream.stamps_repeated):
        return ""  # a repeated stamp finally differs from any clock
    return other_clock(
        stream.stamp_ns, stream.arrivals.last_ns, state.clock_ns, simulated=simulated
    )
