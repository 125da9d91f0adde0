"""Observed edges as a table, or as JSON."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

from tfcompose.cli.tables import Table
from tfcompose.cli.terminal import printable
from tfcompose.compiler.render.text import YELLOW
from tfcompose.foundation.text import list_names, plural

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.tf.live.chain import FrameChain
    from tfcompose.tf.live.edges import EdgeState, TreeObserver

#: If stamp and current time differ by more, in seconds, they come from different clocks.
_CLOCKS_AGREE_S = 1e6
HEADS = ("edge", "publisher", "kind", "rate", "jitter", "gap", "age", "delay", "")
#: On a narrow terminal, the table omits kind, jitter, gap, delay and age. The row of a fixed edge
#: has no numbers, which shows its kind.
TABLE = Table(
    right=frozenset(range(3, 8)),
    spare=(2, 4, 5, 7, 6),
    least={8: 16, 1: 16, 0: 24},
    colour=lambda column, _: YELLOW if HEADS[column] == "" else "",
)


def lines_of(
    edges: Sequence[EdgeState],
    observer: TreeObserver,
    now_ns: int,
    width: int | None = None,
    *,
    coloured: bool = False,
) -> list[str]:
    """Return a summary line and a table of edges and publishers that fits the width."""
    contested = _several(edges)
    rows = [HEADS, *(_row(state, contested) for state in edges)]
    table = TABLE.lines(rows, width, coloured=coloured) if edges else []
    return [_summary(edges, observer, now_ns), *table]


def _several(edges: Sequence[EdgeState]) -> set[str]:
    """Return the children with several publishers or several parents."""
    counts = Counter(state.stream.child for state in edges if state.present is not False)
    return {child for child, number in counts.items() if number > 1}


def _summary(edges: Sequence[EdgeState], observer: TreeObserver, now_ns: int) -> str:
    seconds = max(0, now_ns - observer.begun_ns) / 1e9 if observer.begun_ns else 0.0
    names = {(state.stream.parent, state.stream.child) for state in edges}
    parts = [
        plural(len(names), "edge"),
        f"{plural(observer.messages, 'message')} in {seconds:.1f} s",
    ]
    senders = {state.publisher for state in edges if state.publisher}
    if senders:
        parts.insert(1, plural(len(senders), "publisher"))
    bad = sum(observer.malformed.values())
    parts += [f"{bad} unreadable"] if bad else []
    parts += ["delays are from stamp to recording"] if observer.end_ns else []
    parts += [not_kept(observer)] if observer.beyond else []
    return ", ".join(parts)


def not_kept(observer: TreeObserver) -> str:
    """Return the number and the publishers of transforms beyond the memory limits, as text."""
    nodes = {
        node for gid in observer.beyond for node in observer.publishers.nodes(gid, static=False)
    }
    by = f" from {printable(list_names(sorted(nodes)))}" if nodes else ""
    return f"{plural(sum(observer.beyond.values()), 'transform')} of further edges{by} not kept"


def _row(state: EdgeState, contested: set[str]) -> tuple[str, ...]:
    stream, timing = state.stream, state.timing
    remarks = []
    if stream.rejected is not None:
        some = (
            f"{stream.rejections} of {stream.arrivals.count} "
            if stream.rejections < stream.arrivals.count
            else ""
        )
        remarks.append(f"{some}refused: {stream.rejected.text}")
    if stream.child in contested and state.present is not False:
        remarks.append("not the only one")
    if state.present is False:
        remarks.append("publisher left")
    if stream.stamps_back and not stream.static:
        remarks.append(f"{stream.stamps_back}× back in time")
    name, who = printable(state.name), printable(state.publisher) or "–"
    if stream.static:
        return (name, who, "static", "", "", "", "", "", ", ".join(remarks))
    return (
        name,
        who,
        "dynamic",
        f"{timing.rate:.1f} Hz" if timing.rate is not None else "–",
        duration(timing.jitter_s),
        duration(timing.longest_gap_s),
        duration(state.data_age_s),
        duration(timing.delay_s),
        ", ".join(remarks),
    )


def duration(seconds: float | None) -> str:
    """Return a duration in milliseconds or seconds with significant digits only."""
    if seconds is None:
        return "–"
    if abs(seconds) > _CLOCKS_AGREE_S:
        return "other clock"
    return f"{seconds * 1e3:.1f} ms" if abs(seconds) < 1 else f"{seconds:.2f} s"


def chain_line(chain: FrameChain | str, a: str, b: str) -> str:
    """Return the number of edges between two frames and the age of the newest pose.

    If there is no chain, return the reason.
    """
    ends = f"{printable(a)} → {printable(b)}"
    if isinstance(chain, str):
        return f"{ends}: {printable(chain)}"
    parts = [plural(len(chain.newest), "edge")]
    if delay := chain.delay:
        times = f"{duration(delay.mean_s)} on average, {duration(delay.most_s)} at most"
        parts.append(f"net delay {times}; the slowest is {printable(delay.edge.name)}")
    else:
        parts.append("all fixed")
    return f"{ends}: {', '.join(parts)}"


def objects_of(
    edges: Sequence[EdgeState],
    observer: TreeObserver,
    now_ns: int,
    chain: FrameChain | str | None = None,
) -> str:
    """Return a line of JSON with counts and a list of edges.

    Times are in seconds, stamps in nanoseconds.
    """
    data: dict[str, Any] = {
        "time_ns": now_ns,
        "messages": observer.messages,
        "delay_until": "recording" if observer.end_ns else "arrival",
        "malformed": sum(observer.malformed.values()),
        "edges": [object_of(state) for state in edges],
    }
    if isinstance(chain, str):
        data["chain"], data["reason"] = None, chain
    elif chain is not None:
        delay = chain.delay
        data["chain"] = list(chain.frames)
        data["net_delay_s"] = delay and delay.mean_s
        data["most_net_delay_s"] = delay and delay.most_s
        data["most_behind"] = delay and [delay.edge.parent, delay.edge.child]
    return json.dumps(data, ensure_ascii=False) + "\n"


def object_of(state: EdgeState) -> dict[str, Any]:
    """Return an edge as JSON data. Unknown values are null."""
    stream, timing = state.stream, state.timing
    return {
        "parent": stream.parent,
        "child": stream.child,
        "kind": "static" if stream.static else "dynamic",
        "publisher": state.nodes[0] if len(state.nodes) == 1 else None,
        "publishers": list(state.nodes),
        "present": state.present,
        "count": stream.arrivals.count,
        "rate": timing.rate,
        "jitter_s": timing.jitter_s,
        "longest_gap_s": timing.longest_gap_s,
        "age_s": state.age_s,
        "data_age_s": state.data_age_s,
        "delay_s": timing.delay_s,
        "least_delay_s": timing.least_delay_s,
        "most_delay_s": timing.most_delay_s,
        "stamp_ns": stream.stamp_ns,
        "stamps_back": stream.stamps_back,
        "stamps_repeated": stream.stamps_repeated,
        "refused": stream.rejected.value if stream.rejected else None,
        "refusals": stream.rejections,
    }
