"""Checks whether a tree serves its consumers: scans, points, images and joint states.

A message with a frame and a stamp requires the pose of the frame at that time. A moving joint
requires its joint state.
"""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.text import duration, list_names
from tfcompose.foundation.tree import way_up
from tfcompose.guard.verdict.stamps import (
    SLOW_S,
    by_publisher,
    least_delay_s,
    names_of,
    other_clock,
)
from tfcompose.tf.live.arrivals import KEPT_NS
from tfcompose.tf.live.state import who

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tf.live.state import StampedData, TreeState


KEPT_S = KEPT_NS / 1e9
#: If stamps are older on arrival, in seconds, lookups at the current time or for new data fail for
#: that time. Costmaps wait for 0.3 s.
LATE_S = 0.3
#: Listeners rarely wait longer for a transform, in seconds.
LACK_S = 0.3
#: If stamps are ahead by more, in seconds, the clock or the driver is wrong.
AHEAD_S = 0.05
#: If stamps are farther off, in seconds, they come from another clock.
HOUR_S = 3600.0
FEWEST = 3


def data_frame_unknown(state: TreeState) -> Iterator[Finding]:
    """Sensor data arrive with a frame that is not in the tree."""
    frames = {frame for edge in state.taken for frame in (edge.parent, edge.child)}
    for each in state.stamped:
        if each.frame in frames or not frames:
            continue
        who_sends = list_names(each.nodes) or "somebody"
        if not each.frame:
            message = f"{each.topic} from {who_sends} has no frame_id, so its position is unknown"
            yield finding("TF840", message, None, help="set the driver's frame_id")
            continue
        message = (
            f"{each.topic} from {who_sends} is in the frame {each.frame}, which no node publishes"
        )
        plain = each.frame.removeprefix("/")
        otherwise = (
            "set the driver's frame_id to a frame of the tree, or publish the edge that leads to"
            f" {each.frame}"
        )
        advice = did_you_mean(each.frame, frames, otherwise)
        prefixed = sorted(
            name for name in frames if name.rpartition("/")[2] == plain.rpartition("/")[2]
        )
        if prefixed:
            advice = (
                f"is it meant to be {list_names(prefixed)}? A frame_prefix is on one side only"
            )
        if plain in frames:
            message = (
                f"{each.topic} from {who_sends} is in the frame {each.frame}: tf2 refuses names"
                " that begin with /"
            )
            advice = f"set the driver's frame_id to {plain}"
        yield finding("TF840", message, None, help=advice)


def data_beyond_tf(state: TreeState) -> Iterator[Finding]:
    """Stamps of data and of the tree do not overlap, so every lookup extrapolates."""
    simulated = state.simulated
    for each in state.stamped:
        sender = list_names(each.nodes) or "somebody"
        for lack_s, age_s, edge in _latest_above(state, each):
            fault = _off_clock(state, each, edge, age_s, simulated=simulated)
            if fault:
                message = (
                    f"{each.topic} from {sender} {fault}: no lookup can combine it with"
                    f" {edge.name}"
                )
                yield finding("TF841", message, None, help=_clock_help(each, age_s))
            elif lack_s > LACK_S:
                message = (
                    f"{each.topic} from {sender} is stamped {duration(lack_s)} after the newest"
                    f" {edge.name}"
                )
                message += f" from {who(edge)}"
                yield finding(
                    "TF841",
                    f"{message}: extrapolation into the future",
                    None,
                    help=_ahead_help(each, age_s),
                )
            elif -lack_s > KEPT_S:
                message = (
                    f"{each.topic} from {sender} is stamped {duration(lack_s)} before {edge.name},"
                    " and tf2 keeps 10 s"
                )
                advice = (
                    "stamp with the time of the measurement, by the same clock; or give listeners"
                    " a longer cache_time"
                )
                yield finding(
                    "TF841", f"{message}: extrapolation into the past", None, help=advice
                )


def late_stamps(state: TreeState) -> Iterator[Finding]:
    """Stamps of an edge are old on arrival, so lookups for new data extrapolate to the future."""
    waiting = keeps_data_waiting(state)

    def late_s(edge: EdgeState) -> float:
        under_way_s = -state.skews_s.get(edge.stream.gid or b"", 0.0)
        return least_delay_s(edge) - (
            under_way_s if under_way_s >= SLOW_S else 0.0
        )  # another finding reports that part

    def is_late(edge: EdgeState) -> bool:
        return LATE_S <= late_s(edge) <= KEPT_S and (edge.parent, edge.child) not in waiting

    for edges in by_publisher(state, is_late):
        late = duration(late_s(edges[0]))
        message = f"{names_of(edges)} from {who(edges[0])} arrives {late} after its stamp"
        notes = [
            Note(
                f"lookups at the current time, or of newer data, extrapolate {late} into the"
                " future"
            )
        ]
        advice = (
            "stamp with the time of the measurement and send at once; is the node overloaded, or"
            " its clock behind?"
        )
        yield finding("TF833", message, None, severity="warning", notes=notes, help=advice)


def _latest_above(state: TreeState, each: StampedData) -> list[tuple[float, float, EdgeState]]:
    """Return the moving edge above the data whose stamps lag most: none or one.

    It comes with its lag behind the data and the age of the data, in seconds.
    """
    if len(each.delays_s) < FEWEST:
        return []
    age_s = median(each.delays_s)
    ways = [(_delay_s(edge) - age_s, age_s, edge) for edge in _moving_above(state, each.frame)]
    return sorted(ways, key=lambda way: -way[0])[:1]


def keeps_data_waiting(state: TreeState) -> set[tuple[str, str]]:
    """Return the edges (parent, child) whose stamps lag behind data that require them.

    These edges are reported together with the data.
    """
    delays = [way for each in state.stamped for way in _latest_above(state, each)]
    return {(edge.parent, edge.child) for lack_s, _, edge in delays if lack_s > LACK_S}


def _off_clock(
    state: TreeState, each: StampedData, edge: EdgeState, age_s: float, *, simulated: bool
) -> str:
    """Return how the data's clock differs from an edge's clock; "" if only late or ahead."""
    if each.stamp_ns is None or KEPT_S < abs(age_s) < HOUR_S:
        return ""
    apart_ns = (
        each.stamp_ns - edge.stream.stamp_ns - (each.received_ns - edge.stream.arrivals.last_ns)
    )
    if abs(apart_ns) <= KEPT_NS:
        return ""  # possibly a recording played without its clock
    if each.stamp_ns == 0:
        return "has no stamp"
    fault = other_clock(each.stamp_ns, each.received_ns, state.clock_ns, simulated=simulated)
    return f"is {fault}" if fault else ""


def _clock_help(each: StampedData, age_s: float) -> str:
    if each.stamp_ns == 0:
        return (
            "set header.stamp in the driver; a node with use_sim_time stamps 0 while there is no"
            " /clock"
        )
    if age_s < -AHEAD_S:
        return _ahead_help(each, age_s)
    return (
        "set use_sim_time alike for all nodes, and let the driver stamp with ROS time, not with"
        " its device's"
    )


def _ahead_help(each: StampedData, age_s: float) -> str:
    if age_s < -AHEAD_S:
        return (
            f"the clock behind {each.topic} is {duration(age_s)} ahead: sync it, or let the driver"
            " stamp with ROS time"
        )
    advice = "the edge is late: stamp it with the time of the measurement and send at once"
    return f"{advice}; or let listeners wait, with a timeout"


def _delay_s(edge: EdgeState) -> float:
    return edge.timing.delay_s or 0.0


def _moving_above(state: TreeState, frame: str) -> list[EdgeState]:
    """Return the moving edges between a frame and its root, the newest edge of each frame."""
    newest: dict[str, EdgeState] = {}
    for edge in state.taken:
        stamp = newest.get(edge.child)
        if stamp is None or stamp.age_s > edge.age_s:
            newest[edge.child] = edge
    parents = {child: edge.parent for child, edge in newest.items()}
    way = [newest[child] for child in way_up(frame, parents.get) if child in newest]
    return [edge for edge in way if not edge.stream.static]
