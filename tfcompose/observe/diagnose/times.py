"""What is wrong with stamps and rates: lookups that fail with extrapolation, and frames that jump."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.observe.diagnose.data import keeps_data_waiting
from tfcompose.observe.seen import counted, listed, who
from tfcompose.verdict.clock import WRONG_BY_NS, other_clock, seconds

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen

_SECOND_NS = 1_000_000_000
KEPT_S = WRONG_BY_NS / _SECOND_NS
#: Stamps that are older on arrival make lookups of "now", and of new data, fail for so long; costmaps wait 0.3 s.
LATE_S = 0.3
#: Stamps that are ahead by more make lookups of "now" give a pose of before; nodes that predict do so by less.
AHEAD_S = 0.15
#: AMCL and others date what hangs on these frames forward by up to a second, so that lookups of "now" do not fail.
LOCALISED_IN, FORWARD_S = ("map", "earth", "world"), 1.1
#: A simulated clock takes smaller steps.
CLOCK_STEP_S = 0.5
#: A message that seems to arrive so long before it was sent comes from a clock that is ahead.
SKEW_S = 0.02
#: A network is not that slow; a clock may be that late.
SLOW_S = 0.25
#: So many stamps, and this part of all, are no accident.
FEWEST, PART = 5, 0.3
#: A single step back by so much is enough.
LARGE_STEP_S = 1.0


def stamp_repeated(seen: Seen) -> Iterator[Finding]:
    """A publisher sends an edge with the same stamp again and again."""

    def repeats(edge: EdgeSeen) -> bool:
        return _repeats(edge) and edge.strand.stamp_ns > 0 and not _stands_with_the_clock(seen, edge)

    for edges in _by_publisher(seen, repeats):
        strand = edges[0].strand
        at = strand.stamp_ns / 1e9
        message = f"{who(edges[0])} sends {_names(edges)} with the same stamp again and again: {at:.3f} s"
        notes = [Note(f"{strand.stamps_repeated} of {strand.tally.count} messages; tf2 drops all but the first")]
        advice = "stamp with the time of the measurement, or send when there is a new one"
        yield finding("TF823", message, None, severity="warning", notes=notes, help=advice)


def stamp_went_back(seen: Seen) -> Iterator[Finding]:
    """A publisher's stamps go back in time."""
    for edges in _by_publisher(seen, _went_back):
        strand = edges[0].strand
        now_s = _behind_newest_s(edges[0])
        by = f", the newest is {seconds(now_s)} before an earlier one" if now_s > 0 else ""
        times = counted(strand.stamps_back, "time")
        message = f"{who(edges[0])} stamps {_names(edges)} back in time, {times} in {strand.tally.count}{by}"
        advice = (
            "tf2 sorts it in behind newer ones, or drops it; does a bag or a simulation start again, was a clock set?"
        )
        yield finding("TF824", message, None, severity="warning", help=advice)


def wrong_clock(seen: Seen) -> Iterator[Finding]:
    """Stamps are of another clock than the others': simulated and system time mixed, or no stamp at all."""
    simulated = seen.simulated
    for edges in _by_publisher(seen, lambda edge: bool(_clock_said(seen, edge, simulated=simulated))):
        said = _clock_said(seen, edges[0], simulated=simulated)
        message = f"{who(edges[0])} stamps {_names(edges)} {said}"
        where = seen.where(edges[0])
        yield finding("TF825", message, None, notes=[Note(f"it runs {where}")] if where else [], help=_clock_help(said))


def host_clock_off(seen: Seen) -> Iterator[Finding]:
    """The clock of another machine is not this one's."""
    machines: dict[tuple[bool, str], tuple[float, list[str]]] = {}
    for one in seen.publishers:
        skew = seen.skews_s.get(one.gid)
        if skew is None or -SLOW_S < skew < SKEW_S or not one.node:
            continue
        known = machines.setdefault((skew > 0, one.where), (skew, []))[1]
        if one.node not in known:
            known.append(one.node)
    for (ahead, where), (skew, nodes) in machines.items():
        there = f" {where}" if where else ""
        if ahead:
            message = f"the clock of {listed(nodes)}{there} is {seconds(skew)} ahead of this machine's"
        else:
            message = f"what {listed(nodes)}{there} sends arrives {seconds(skew)} after it was sent"
        advice = "bring the machines' clocks together (chrony, or timedatectl set-ntp true); stamps differ by as much"
        advice += "" if ahead else ", or the network is that slow"
        yield finding("TF834", message, None, help=advice)


def late_stamps(seen: Seen) -> Iterator[Finding]:
    """An edge's stamps are old when they come: lookups of new data extrapolate into the future."""
    told = keeps_data_waiting(seen)

    def late_s(edge: EdgeSeen) -> float:
        under_way_s = -seen.skews_s.get(edge.strand.gid or b"", 0.0)
        return _least_s(edge) - (under_way_s if under_way_s >= SLOW_S else 0.0)  # that part is a finding of its own

    def is_late(edge: EdgeSeen) -> bool:
        return LATE_S <= late_s(edge) <= KEPT_S and (edge.strand.parent, edge.strand.child) not in told

    for edges in _by_publisher(seen, is_late):
        late = seconds(late_s(edges[0]))
        message = f"{_names(edges)} from {who(edges[0])} is stamped {late} ago when it comes"
        notes = [Note(f"a lookup of now, or of data that is newer, is extrapolation into the future by {late}")]
        advice = "stamp with the time of the measurement and send at once; is the node overloaded, or its clock behind?"
        yield finding("TF833", message, None, severity="warning", notes=notes, help=advice)


def stamps_ahead(seen: Seen) -> Iterator[Finding]:
    """An edge's stamps are ahead of time."""

    def ahead(edge: EdgeSeen) -> bool:
        most = edge.timing.most_delay_s
        skewed = seen.skews_s.get(edge.strand.gid or b"", 0.0) >= SKEW_S
        localised = edge.strand.parent.rpartition("/")[2] in LOCALISED_IN
        least = FORWARD_S if localised else AHEAD_S
        return most is not None and -KEPT_S <= most <= -least and not skewed

    for edges in _by_publisher(seen, ahead):
        ahead_s = -(edges[0].timing.delay_s or 0.0)
        message = f"{who(edges[0])} stamps {_names(edges)} {seconds(ahead_s)} ahead of time"
        advice = "lookups of now get a pose from before; is its clock ahead, or its time offset too large?"
        yield finding("TF835", message, None, severity="warning", help=advice)


def clock_missing(seen: Seen) -> Iterator[Finding]:
    """Nodes wait for simulated time, and it does not come."""
    for topic in seen.graph:
        if topic.name != "/clock" or not (topic.readers or (seen.plan and seen.plan.ros.clock == "sim")):
            continue
        users = f"{listed(topic.readers)} {'use' if len(topic.readers) > 1 else 'uses'} simulated time"
        users = users if topic.readers else "the plan's clock is sim"
        if not topic.publishers:
            message = f"{users}, and nobody publishes /clock"
            advice = "start the simulator, play the bag with --clock, or set use_sim_time: false"
            yield finding("TF836", message, None, help=advice)
        elif not seen.clock_moves:
            stands = "has sent nothing" if seen.clock_ns is None else f"stands at {seen.clock_ns / 1e9:.3f} s"
            message = f"{users}, and /clock from {listed(topic.publishers)} {stands}"
            yield finding("TF836", message, None, help="is the simulator paused, or the bag at its end?")


def two_clocks(seen: Seen) -> Iterator[Finding]:
    """Two nodes publish the time."""
    for topic in seen.graph:
        if topic.name == "/clock" and len(topic.publishers) > 1:
            message = f"/clock is published by {' and by '.join(sorted(topic.publishers))}: time jumps to and fro"
            yield finding(
                "TF837", message, None, help="end one: a second simulator, or a bag played with --clock beside it"
            )


def _by_publisher(seen: Seen, is_so: Callable[[EdgeSeen], bool]) -> Iterator[list[EdgeSeen]]:
    """Give the moving edges of which something is so, those of one publisher together."""
    found: dict[object, list[EdgeSeen]] = {}
    for edge in seen.moving:
        if is_so(edge):
            found.setdefault(edge.strand.gid or edge.nodes, []).append(edge)
    yield from found.values()


def _names(edges: list[EdgeSeen]) -> str:
    more = f" and {counted(len(edges) - 1, 'more edge')}" if len(edges) > 1 else ""
    return f"{edges[0].name}{more}"


def _many(edge: EdgeSeen, number: int) -> bool:
    return number >= FEWEST and number >= PART * edge.strand.tally.count


def _repeats(edge: EdgeSeen) -> bool:
    return _many(edge, edge.strand.stamps_repeated)


def _stands_with_the_clock(seen: Seen, edge: EdgeSeen) -> bool:
    """Whether its stamps are those of a /clock that stands, which is a finding of its own."""
    return (
        seen.clock_ns is not None
        and not seen.clock_moves
        and abs(edge.strand.stamp_ns - seen.clock_ns) <= CLOCK_STEP_S * _SECOND_NS
    )


def _went_back(edge: EdgeSeen) -> bool:
    return _many(edge, edge.strand.stamps_back) or (
        edge.strand.stamps_back > 0 and _behind_newest_s(edge) >= LARGE_STEP_S
    )


def _behind_newest_s(edge: EdgeSeen) -> float:
    return (edge.strand.newest_ns - edge.strand.stamp_ns) / 1e9


def _least_s(edge: EdgeSeen) -> float:
    """Return the least age of a stamp when it came; a repeated stamp only grows old."""
    least = edge.timing.least_delay_s
    return 0.0 if least is None or _repeats(edge) else least


def _clock_said(seen: Seen, edge: EdgeSeen, *, simulated: bool) -> str:
    """Return how the stamps are not of the clock that the others have, or nothing."""
    strand = edge.strand
    if strand.stamp_ns and _many(edge, strand.stamps_repeated):
        return ""  # it is off at last, which follows
    return other_clock(strand.stamp_ns, strand.tally.last_ns, seen.clock_ns, simulated=simulated)


def _clock_help(said: str) -> str:
    if said == "without a stamp":
        return "a node with use_sim_time stamps 0 while there is no /clock; else set header.stamp from the node's clock"
    if "simulated" in said or "/clock" in said:
        return "no lookup brings it together with the rest: set use_sim_time alike for all nodes"
    return (
        "no lookup brings it together with the rest: is a bag played without --clock, or a machine's clock not in sync?"
    )
