"""Whether the tree serves the data that come with a frame and a stamp: scans, points, camera images."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.observe.seen import listed, who
from tfcompose.tree import way_up
from tfcompose.verdict.clock import WRONG_BY_NS, other_clock, seconds

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen, Stamped

#: tf2's buffers keep 10 s.
KEPT_S = 10.0
#: Who waits for a transform rarely waits longer.
LACK_S = 0.3
#: A clock, or a driver, that is ahead by more.
AHEAD_S = 0.05
#: A clock that is farther off is another clock.
HOUR_S = 3600.0
FEWEST = 3


def data_frame_unknown(seen: Seen) -> Iterator[Finding]:
    """Data come in a frame that is not in the tree."""
    frames = {frame for edge in seen.taken for frame in (edge.strand.parent, edge.strand.child)}
    for each in seen.stamped:
        if each.frame in frames or not frames:
            continue
        who_sends = listed(each.nodes) or "somebody"
        if not each.frame:
            message = f"{each.topic} from {who_sends} has no frame_id, so nobody can say where it was measured"
            yield finding("TF840", message, None, help="set the driver's frame_id")
            continue
        message = f"{each.topic} from {who_sends} is in the frame {each.frame}, which nobody publishes"
        plain = each.frame.removeprefix("/")
        otherwise = f"set the driver's frame_id to a frame of the tree, or publish the edge that leads to {each.frame}"
        advice = did_you_mean(each.frame, frames, otherwise)
        prefixed = sorted(name for name in frames if name.rpartition("/")[2] == plain.rpartition("/")[2])
        if prefixed:
            advice = f"is it meant to be {listed(prefixed)}? A frame_prefix is on one side only"
        if plain in frames:
            message = f"{each.topic} from {who_sends} is in the frame {each.frame}: tf2 refuses names that begin with /"
            advice = f"set the driver's frame_id to {plain}"
        yield finding("TF840", message, None, help=advice)


def data_beyond_tf(seen: Seen) -> Iterator[Finding]:
    """The stamps of data and of the tree do not meet: every lookup for them extrapolates."""
    simulated = seen.simulated
    for each in seen.stamped:
        sender = listed(each.nodes) or "somebody"
        for lack_s, age_s, edge in _latest_above(seen, each):
            said = _clock_said(seen, each, edge, age_s, simulated=simulated)
            if said:
                message = f"{each.topic} from {sender} {said}: no lookup brings it together with {edge.name}"
                yield finding("TF841", message, None, help=_clock_help(each, age_s))
            elif lack_s > LACK_S:
                message = f"{each.topic} from {sender} is stamped {seconds(lack_s)} after the newest {edge.name}"
                message += f" from {who(edge)}"
                yield finding("TF841", f"{message}: extrapolation into the future", None, help=_ahead_help(each, age_s))
            elif -lack_s > KEPT_S:
                message = (
                    f"{each.topic} from {sender} is stamped {seconds(lack_s)} before {edge.name}, and tf2 keeps 10 s"
                )
                advice = (
                    "stamp with the time of the measurement, by the same clock; or give listeners a longer cache_time"
                )
                yield finding("TF841", f"{message}: extrapolation into the past", None, help=advice)


def _latest_above(seen: Seen, each: Stamped) -> list[tuple[float, float, EdgeSeen]]:
    """Return of the edge above the data that is behind the others: how far it is behind the data, and their age."""
    if len(each.delays_s) < FEWEST:
        return []
    age_s = median(each.delays_s)
    ways = [(_delay_s(edge) - age_s, age_s, edge) for edge in _moving_above(seen, each.frame)]
    return sorted(ways, key=lambda way: -way[0])[:1]


def keeps_data_waiting(seen: Seen) -> set[tuple[str, str]]:
    """Return the edges, parent and child, whose stamps are behind data that need them: they are told with the data."""
    found = [way for each in seen.stamped for way in _latest_above(seen, each)]
    return {(edge.strand.parent, edge.strand.child) for lack_s, _, edge in found if lack_s > LACK_S}


def _clock_said(seen: Seen, each: Stamped, edge: EdgeSeen, age_s: float, *, simulated: bool) -> str:
    """Return how data are of another clock than an edge; nothing where they are only late or ahead."""
    if each.stamp_ns is None or KEPT_S < abs(age_s) < HOUR_S:
        return ""
    apart_ns = each.stamp_ns - edge.strand.stamp_ns - (each.received_ns - edge.strand.tally.last_ns)
    if abs(apart_ns) <= WRONG_BY_NS:
        return ""  # a recording that is played without its clock, perhaps
    if each.stamp_ns == 0:
        return "has no stamp"
    said = other_clock(each.stamp_ns, each.received_ns, seen.clock_ns, simulated=simulated)
    return f"is stamped {said}" if said else ""


def _clock_help(each: Stamped, age_s: float) -> str:
    if each.stamp_ns == 0:
        return "set header.stamp in the driver; a node with use_sim_time stamps 0 while there is no /clock"
    if age_s < -AHEAD_S:
        return _ahead_help(each, age_s)
    return "set use_sim_time alike for all nodes, and let the driver stamp with ROS time, not with its device's"


def _ahead_help(each: Stamped, age_s: float) -> str:
    if age_s < -AHEAD_S:
        return (
            f"the clock behind {each.topic} is {seconds(age_s)} ahead: sync it, or let the driver stamp with ROS time"
        )
    advice = "the edge is late: stamp it with the time of the measurement and send at once"
    return f"{advice}; listeners may wait, with a timeout"


def _delay_s(edge: EdgeSeen) -> float:
    return edge.timing.delay_s or 0.0


def _moving_above(seen: Seen, frame: str) -> list[EdgeSeen]:
    """Return the moving edges from a frame up to its root, of each frame the one that came last."""
    newest: dict[str, EdgeSeen] = {}
    for edge in seen.taken:
        known = newest.get(edge.strand.child)
        if known is None or known.age_s > edge.age_s:
            newest[edge.strand.child] = edge
    parents = {child: edge.strand.parent for child, edge in newest.items()}
    way = [newest[child] for child in way_up(frame, parents.get) if child in newest]
    return [edge for edge in way if not edge.strand.static]
