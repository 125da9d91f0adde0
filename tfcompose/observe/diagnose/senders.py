"""What is wrong with who publishes, and how: two of them, settings that no listener accepts, the wrong topic."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.observe.seen import NAMELESS, counted, listed, who
from tfcompose.plan.topics import GLOBAL
from tfcompose.ros.misfits import best_effort_writer, leak, volatile_writer
from tfcompose.ros.tf_codec import TF_MESSAGE
from tfcompose.verdict.offset import Offset, offset_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.observe.census import EdgeSeen
    from tfcompose.observe.seen import Seen

#: A listener keeps the last 100 messages on /tf_static, one of each publisher.
MOST_STATIC = 100
#: A micrometre, a millidegree.
_SAME = Offset(1e-6, 2e-5)
#: One that sends so long after the other began has not only replaced it.
TOGETHER_S = 0.3


def two_writers(seen: Seen) -> Iterator[Finding]:
    """Two publishers send the same edge."""
    same: dict[tuple[str, str], list[EdgeSeen]] = {}
    for edge in seen.taken:
        same.setdefault((edge.strand.parent, edge.strand.child), []).append(edge)
    groups: dict[tuple[bytes | None, ...], list[list[EdgeSeen]]] = {}
    planned = seen.planned
    for (_, child), edges in same.items():
        rivals = [edge for edge in edges if edge.strand.gid is not None and edge.present is not False]
        distinct = {edge.strand.gid for edge in rivals}
        if len({edge.strand.static for edge in rivals}) > 1:
            continue  # it comes on both topics, which is a finding of its own
        if len(distinct) > 1 and child not in planned and _together(rivals):
            groups.setdefault(tuple(sorted(distinct, key=str)), []).append(rivals)
    for found in groups.values():
        rivals = sorted(found[0], key=who)
        names = list(dict.fromkeys(who(edge) for edge in rivals))
        by = f"twice by {names[0]}" if len(names) == 1 else f"by {' and by '.join(names)}"
        more = f" and {counted(len(found) - 1, 'more edge')}" if len(found) > 1 else ""
        message = f"{rivals[0].name}{more} {'are' if more else 'is'} published {by}; {_difference(rivals)}"
        notes = [Note(_where(seen, edge)) for edge in rivals]
        notes += [Note(others[0].name) for others in found[1:8]]
        advice = "end one of them, or switch its TF off" if len(names) > 1 else f"{names[0]} runs twice: end one"
        yield finding("TF822", message, None, severity="warning", notes=notes, help=advice)


def both_topics(seen: Seen) -> Iterator[Finding]:
    """A frame comes on /tf and on /tf_static."""
    kinds: dict[str, dict[bool, EdgeSeen]] = {}
    for edge in seen.taken:
        kinds.setdefault(edge.strand.child, {})[edge.strand.static] = edge
    planned = seen.planned
    for child, found in kinds.items():
        if len(found) == 1 or child in planned:
            continue
        moving, fixed = found[False], found[True]
        message = f"{child} comes on {seen.topics[0]} from {who(moving)} and on {seen.topics[1]} from {who(fixed)}"
        advice = "send it on one of them: tf2 throws the frame's history away each time that it changes"
        yield finding("TF809", message, None, help=advice)


def volatile_static(seen: Seen) -> Iterator[Finding]:
    """Fixed frames are sent so that no listener can receive them."""
    for one in seen.publishers:
        if one.static and not one.latched and one.node and one.type in {"", TF_MESSAGE}:
            owned = [edge.name for edge in seen.plan.edges if edge.node == one.node] if seen.plan else []
            yield volatile_writer(one.node, one.topic or seen.topics[1], owned)


def volatile_reader(seen: Seen) -> Iterator[Finding]:
    """A node listens to fixed frames so that it misses those that were sent before it came."""
    if seen.forgetful and any(one.static for one in seen.publishers):
        listen = "listens" if len(seen.forgetful) == 1 else "listen"
        message = (
            f"{listed(seen.forgetful)} {listen} to {seen.topics[1]} with durability volatile: what was sent before "
        )
        message += "is missed"
        advice = "subscribe with durability transient_local, reliable, depth 100, as tf2_ros's TransformListener does"
        yield finding("TF849", message, None, severity="warning", help=advice)


def best_effort(seen: Seen) -> Iterator[Finding]:
    """Frames are sent best effort, and listeners ask for reliable."""
    for one in seen.publishers:
        if not one.reliable and one.node and one.type in {"", TF_MESSAGE}:
            yield best_effort_writer(one.node, one.topic or seen.topics[one.static])


def other_type(seen: Seen) -> Iterator[Finding]:
    """Something else than transforms is published on a topic of TF."""
    for topic in seen.graph:
        if topic.name in seen.topics and topic.type != TF_MESSAGE and topic.publishers:
            message = f"{listed(topic.publishers)} publishes {topic.type} on {topic.name}, and listeners ask for "
            message += TF_MESSAGE
            yield finding("TF832", message, None, help=f"publish {TF_MESSAGE}, or give the topic another name")


def unreadable(seen: Seen) -> Iterator[Finding]:
    """Bytes come that are no TFMessage."""
    named = {one.gid: one for one in seen.publishers}
    for gid, number in seen.malformed.items():
        one = named.get(gid) if gid is not None else None
        node, topic = (one.node or NAMELESS, one.topic) if one else (NAMELESS, listed(seen.topics))
        message = f"{counted(number, 'message')} on {topic} from {node} cannot be read as {TF_MESSAGE}"
        yield finding("TF832", message, None, help="does it send bytes of its own making, or with another definition?")


def many_static(seen: Seen) -> Iterator[Finding]:
    """So many nodes publish fixed frames that listeners lose some."""
    fixed = [one for one in seen.publishers if one.static]
    if len(fixed) >= MOST_STATIC:
        nodes = sorted({one.node for one in fixed if one.node})
        message = f"{len(fixed)} publishers on {seen.topics[1]}, and a listener keeps the last {MOST_STATIC} messages"
        advice = "let one node publish them: tfcompose sends all fixed edges in one message"
        yield finding("TF309", message, None, severity="error", notes=[Note(listed(nodes))], help=advice)


def isolation_leak(seen: Seen) -> Iterator[Finding]:
    """A node of a robot with TF topics of its own writes the global ones."""
    topics = {topic.name: topic for topic in seen.typed(TF_MESSAGE)}
    own = {node for process in seen.plan.processes for node in process.nodes} if seen.plan else set()
    for name in [name for name in topics if name not in GLOBAL and name.endswith(GLOBAL)]:
        word = "/tf_static" if name.endswith("/tf_static") else "/tf"
        inside = name.removesuffix(word)
        if not topics[name].publishers or (seen.topics not in {GLOBAL, (f"{inside}/tf", f"{inside}/tf_static")}):
            continue
        for node in topics[word].publishers if word in topics else ():
            if node.startswith(f"{inside}/") or (node in own and seen.topics != GLOBAL):
                yield leak(node, word, name)


def _together(edges: Sequence[EdgeSeen]) -> bool:
    """Whether two of them sent in the same stretch of time; what is fixed is sent once and holds on."""
    spans = sorted((e.strand.first_ns, float("inf") if e.strand.static else e.strand.tally.last_ns) for e in edges)
    return any(end - begun > TOGETHER_S * 1e9 for (_, end), (begun, _) in pairwise(spans))


def _difference(edges: Sequence[EdgeSeen]) -> str:
    """Return how far apart the newest poses are."""
    off = offset_of(edges[0].strand.pose, edges[1].strand.pose)
    return f"their newest values are {off.text} apart" if off.beyond(_SAME) else "both with the same value"


def _where(seen: Seen, edge: EdgeSeen) -> str:
    where, rate = seen.where(edge), edge.timing.rate
    how = "once" if edge.strand.static or rate is None else f"at {rate:.3g} Hz"
    return f"{who(edge)} sends it {how}{', and runs ' if where else ''}{where}"
