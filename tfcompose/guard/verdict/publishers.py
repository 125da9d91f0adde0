"""Publishers: unusable QoS, wrong topics or types, duplicates, and wrong poses."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.geometry import Offset, Pose, normalise, offset_of
from tfcompose.foundation.text import list_names, plural, with_more
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.live.state import NAMELESS, who
from tfcompose.tf.ros.environment import PROFILE_VARIABLES
from tfcompose.tf.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import PlanEdge
    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tf.live.state import TreeState

#: A listener keeps the last 100 messages on /tf_static. With more publishers, messages are lost.
MOST_STATIC = 100
LISTED_AT_MOST = 12
#: Two poses within this distance count as equal.
SAME_POSE = Offset(1e-3, math.radians(0.1))
#: One micrometre and about one millidegree.
_SAME = Offset(1e-6, 2e-5)
#: If both publishers send for longer than this, in seconds, the second one is not just a
#: replacement.
TOGETHER_S = 0.3


# Findings.


def two_publishers_message(edges: str, publishers: Sequence[str], *, are_many: bool) -> str:
    """Return the message for edges with two publishers. A single name means two instances."""
    names = list(dict.fromkeys(publishers))
    by = f"twice by {names[0]}" if len(names) == 1 else f"by {' and by '.join(names)}"
    return f"{edges} {'are' if are_many else 'is'} published {by}"


def topics_message(
    edges: str, topics: Sequence[tuple[str, str]], declared: str = "", *, are_many: bool = False
) -> str:
    """Return the message for edges on the wrong topic or on both topics.

    ``topics`` has each topic with its publisher. ``declared`` is the topic in the plan; empty
    without a plan.
    """
    on = " and ".join(f"on {' by '.join(filter(None, pair))}" for pair in topics)
    return (
        f"{edges} {'are' if are_many else 'is'} published"
        f" {on}{', declared for ' if declared else ''}{declared}"
    )


def flood(node: str, where: str, transforms: int, hertz: float | None) -> Finding:
    """Return the finding for a publisher of more undeclared edges than the guard judges.

    Its messages have up to ``transforms`` transforms. ``hertz`` is their rate, None if unknown.
    """
    rate = f" at {hertz:.3g} Hz" if hertz else ""
    message = (
        f"{node} sends {transforms:,} frames{rate}, more than the guard checks: now it"
        " checks only the declared edges of this node"
    )
    notes = [Note(f"{node} runs {where}")] if where else []
    return finding(
        "TF853",
        message,
        None,
        notes=notes,
        help=f"end {node}, or let it use the same frames again",
    )


def find_floods(state: TreeState) -> Iterator[Finding]:
    """A node publishes more edges than the observer keeps."""
    named = {publisher.gid: publisher for publisher in state.publishers}
    for gid, number in state.beyond.items():
        sender = named.get(gid) if gid is not None else None
        node = sender.node if sender and sender.node else NAMELESS
        message = (
            f"{node} publishes more edges than are kept: {plural(number, 'transform')} of further"
            " ones came"
        )
        notes = [Note(f"{node} runs {sender.where}")] if sender and sender.where else []
        yield finding(
            "TF853",
            message,
            None,
            notes=notes,
            help=f"end {node}, or let it use the same frames again",
        )


def unfenced_finding(
    node: str, process: str, topic: str, profile: str, *, remapped: bool
) -> Finding:
    """Return the finding for a process of a strict plan that bypasses the filter.

    ``profile`` is the profile file with which it started instead of the plan's; empty without one.
    """
    message = (
        f"{node} of {process} publishes {topic} without passing the strict guard: every"
        " listener receives it"
    )
    if remapped:
        advice = (
            "let it take ROS arguments: start it as {package, executable}, or add --ros-args to"
            " its command; "
        )
        advice += 'a script passes them on with "$@"'
        return finding("TF852", message, None, help=advice)
    variable = PROFILE_VARIABLES[0]
    starter = "a script or program that starts it"
    if profile:
        how = f"with {variable}={profile}, which {starter} sets"
    else:
        how = f"without {variable}, which {starter} unsets"
    notes = [Note(f"it runs {how}")]
    if profile:
        advice = (
            f"take {variable} out of the script, and name the file in the robot file, so that the"
            " partition is added "
        )
        advice += f"to it: processes: {{{process}: {{env: {{{variable}: {profile}}}}}}}"
    else:
        advice = f"let the script keep {variable}, which sets the partition"
    advice += '; or, with a script that passes "$@" on, guard: {fence: remap}'
    return finding("TF852", message, None, notes=notes, help=advice)


def unmarked_finding(node: str, topic: str, where: str, *, remapped: bool) -> Finding:
    """Return the finding for a process of a strict plan's run whose environment was cleared.

    ``where`` describes the process, which bypasses the filter. ``remapped``: remappings isolate
    the other processes.
    """
    message = (
        f"{node} publishes {topic} without passing the strict guard: every listener receives it"
    )
    notes = [Note(f"it runs {where}, and what started it cleared its environment")]
    advice = "start it without env -i, and with sudo -E where it needs sudo: "
    advice += (
        'a script passes its ROS arguments on with "$@"'
        if remapped
        else f"{PROFILE_VARIABLES[0]} names the fence"
    )
    return finding("TF852", message, None, notes=notes, help=advice)


def best_effort_publisher(node: str, topic: str) -> Finding:
    """Return the finding for a best-effort publisher, which no TF listener accepts."""
    message = (
        f"{node} publishes {topic} best effort, so no listener receives it: all ask for reliable"
    )
    return finding("TF826", message, None, help="publish it reliable")


def leak(node: str, topic: str, own_type: str) -> Finding:
    """Return the finding for a node of an isolated robot that publishes a global TF topic."""
    message = f"{node} publishes the global {topic}, but its robot's TF is on {own_type}"
    advice = (
        f"start it with the remapping {topic}:={own_type}, as tfcompose does with the processes"
        " that it starts"
    )
    return finding("TF827", message, None, help=advice)


def replaced_latched_finding(node: str, sent_before: int, missing: Sequence[str]) -> Finding:
    """Return the finding for a publisher whose last latched message lacks these edges."""
    lost, named = plural(sent_before, "message"), list_names(missing, LISTED_AT_MOST)
    message = (
        f"{node} sent {lost} on /tf_static before the guard received it, and none since contains"
        f" {named}"
    )
    advice = "send all fixed edges in each message: a latched topic keeps only the last one"
    return finding("TF850", message, None, severity="warning", help=advice)


def volatile_publisher(node: str, topic: str, owned: Sequence[str]) -> Finding:
    """Return the finding for a publisher of fixed edges that no TF listener accepts.

    ``owned`` are its edges.
    """
    notes = [Note(f"it owns {list_names(owned, LISTED_AT_MOST)}")] if owned else []
    message = f"{node} publishes {topic} with durability volatile, so no listener receives it"
    return finding(
        "TF806",
        message,
        None,
        notes=notes,
        help="publish it with durability transient_local, reliable",
    )


# At the end.


def two_publishers(state: TreeState) -> Iterator[Finding]:
    """Two publishers send the same edge."""
    same: dict[tuple[str, str], list[EdgeState]] = {}
    for edge in state.taken:
        same.setdefault((edge.parent, edge.child), []).append(edge)
    groups: dict[tuple[bytes | None, ...], list[list[EdgeState]]] = {}
    planned = state.planned
    for (_, child), edges in same.items():
        rivals = [
            edge for edge in edges if edge.stream.gid is not None and edge.present is not False
        ]
        distinct = {edge.stream.gid for edge in rivals}
        if len({edge.stream.static for edge in rivals}) > 1:
            continue  # it arrives on both topics, which another finding reports
        if len(distinct) > 1 and child not in planned and _together(rivals):
            groups.setdefault(tuple(sorted(distinct, key=str)), []).append(rivals)
    for states in groups.values():
        rivals = sorted(states[0], key=who)
        names = list(dict.fromkeys(who(edge) for edge in rivals))
        named = with_more(rivals[0].name, len(states) - 1)
        message = (
            two_publishers_message(named, names, are_many=len(states) > 1)
            + f"; {_difference(rivals)}"
        )
        notes = [Note(_where(state, edge)) for edge in rivals]
        notes += [Note(edge_states[0].name) for edge_states in states[1:8]]
        advice = (
            "stop one of them, or disable its TF output"
            if len(names) > 1
            else f"{names[0]} runs twice: stop one"
        )
        yield finding("TF822", message, None, severity="warning", notes=notes, help=advice)


def both_topics(state: TreeState) -> Iterator[Finding]:
    """A frame arrives on /tf and on /tf_static."""
    kinds: dict[str, dict[bool, EdgeState]] = {}
    for edge in state.taken:
        kinds.setdefault(edge.child, {})[edge.stream.static] = edge
    planned = state.planned
    for child, kinds_of_child in kinds.items():
        if len(kinds_of_child) == 1 or child in planned:
            continue
        moving, fixed = kinds_of_child[False], kinds_of_child[True]
        message = topics_message(
            child, [(state.topics[0], who(moving)), (state.topics[1], who(fixed))]
        )
        advice = "send it on one of them: tf2 discards the frame's history whenever it changes"
        yield finding("TF809", message, None, help=advice)


def volatile_static(state: TreeState) -> Iterator[Finding]:
    """Fixed frames are published with a QoS that no listener receives."""
    for publisher in state.publishers:
        if (
            publisher.static
            and not publisher.latched
            and publisher.node
            and publisher.type in {"", TF_MESSAGE}
        ):
            owned = (
                [edge.name for edge in state.plan.edges if edge.node == publisher.node]
                if state.plan
                else []
            )
            yield volatile_publisher(publisher.node, publisher.topic or state.topics[1], owned)


def volatile_reader(state: TreeState) -> Iterator[Finding]:
    """A node's subscription misses fixed frames that were sent before it was created."""
    if state.volatile_readers and any(publisher.static for publisher in state.publishers):
        listen = "listens" if len(state.volatile_readers) == 1 else "listen"
        message = (
            f"{list_names(state.volatile_readers)} {listen} to {state.topics[1]} with durability"
            " volatile: "
        )
        message += "earlier messages are missed"
        advice = (
            "subscribe with durability transient_local, reliable, depth 100, as tf2_ros's"
            " TransformListener does"
        )
        yield finding("TF849", message, None, severity="warning", help=advice)


def best_effort(state: TreeState) -> Iterator[Finding]:
    """Frames are published best-effort, but listeners require reliable."""
    for publisher in state.publishers:
        if not publisher.reliable and publisher.node and publisher.type in {"", TF_MESSAGE}:
            yield best_effort_publisher(
                publisher.node, publisher.topic or state.topics[publisher.static]
            )


def other_type(state: TreeState) -> Iterator[Finding]:
    """A topic of TF has messages of another type."""
    for topic in state.graph:
        if topic.name in state.topics and topic.type != TF_MESSAGE and topic.publishers:
            message = (
                f"{list_names(topic.publishers)} publishes {topic.type} on {topic.name}, and"
                " listeners ask for "
            )
            message += TF_MESSAGE
            yield finding(
                "TF832",
                message,
                None,
                help=f"publish {TF_MESSAGE}, or give the topic another name",
            )


def unreadable(state: TreeState) -> Iterator[Finding]:
    """Messages arrive that cannot be decoded as a TFMessage."""
    named = {publisher.gid: publisher for publisher in state.publishers}
    for gid, number in state.malformed.items():
        sender = named.get(gid) if gid is not None else None
        node, topic = (
            (sender.node or NAMELESS, sender.topic)
            if sender
            else (NAMELESS, list_names(state.topics))
        )
        message = (
            f"{plural(number, 'message')} on {topic} from {node} cannot be read as {TF_MESSAGE}"
        )
        yield finding(
            "TF832",
            message,
            None,
            help="does it build messages by hand, or use another definition of the type?",
        )


def many_static(state: TreeState) -> Iterator[Finding]:
    """Too many nodes publish fixed frames, so listeners lose some."""
    fixed = [publisher for publisher in state.publishers if publisher.static]
    if len(fixed) >= MOST_STATIC:
        nodes = sorted({publisher.node for publisher in fixed if publisher.node})
        message = (
            f"{len(fixed)} publishers on {state.topics[1]}, and a listener keeps the last"
            f" {MOST_STATIC} messages"
        )
        advice = "let one node publish them: tfcompose sends all fixed edges in one message"
        yield finding(
            "TF309", message, None, severity="error", notes=[Note(list_names(nodes))], help=advice
        )


def isolation_leak(state: TreeState) -> Iterator[Finding]:
    """A node of a robot with separate TF topics publishes on the global topics."""
    topics = {topic.name: topic for topic in state.topics_of_type(TF_MESSAGE)}
    nodes = (
        {node for process in state.plan.processes for node in process.nodes}
        if state.plan
        else set()
    )
    for name in [name for name in topics if name not in GLOBAL and name.endswith(GLOBAL)]:
        root = "/tf_static" if name.endswith("/tf_static") else "/tf"
        inside = name.removesuffix(root)
        if not topics[name].publishers or (
            state.topics not in {GLOBAL, (f"{inside}/tf", f"{inside}/tf_static")}
        ):
            continue
        for node in topics[root].publishers if root in topics else ():
            if node.startswith(f"{inside}/") or (node in nodes and state.topics != GLOBAL):
                yield leak(node, root, name)


def _together(edges: Sequence[EdgeState]) -> bool:
    """Return whether two publishers sent in overlapping periods. Fixed edges stay valid."""
    spans = []
    for edge in edges:
        stream = edge.stream
        spans.append((stream.first_ns, math.inf if stream.static else stream.arrivals.last_ns))
    spans.sort()
    return any(end - begun > TOGETHER_S * 1e9 for (_, end), (begun, _) in pairwise(spans))


def _difference(edges: Sequence[EdgeState]) -> str:
    """Return the distance between the newest poses, as text."""
    off = offset_of(edges[0].stream.pose, edges[1].stream.pose)
    return (
        f"their newest values are {off.text} apart"
        if off.beyond(_SAME)
        else "both with the same value"
    )


def _where(state: TreeState, edge: EdgeState) -> str:
    where, rate = state.where(edge), edge.timing.rate
    how = "once" if edge.stream.static or rate is None else f"at {rate:.3g} Hz"
    return f"{who(edge)} sends it {how}{', and runs ' if where else ''}{where}"


def show_pose(pose: Pose) -> str:
    """Return the pose on a single line: metres, and fixed-axis angles in degrees."""
    xyz = " ".join(f"{round(value, 5) + 0.0:g}" for value in pose.xyz)
    angles = Pose(pose.xyz, normalise(pose.quat_xyzw)).rpy
    rpy = " ".join(f"{round(math.degrees(angle), 3) + 0.0:g}" for angle in angles)
    return f"xyz {xyz} m, rpy {rpy} deg"


def compare(expected: Pose, observed: Pose) -> str:
    """Return both poses as text."""
    return f"seen {show_pose(observed)}; expected {show_pose(expected)}"


def pose_differs(
    off: Sequence[tuple[PlanEdge, str, Pose]], publisher: str, span: Span | None = None
) -> Finding:
    """Return the finding for edges whose pose differs from the plan.

    ``off`` has each edge with the sent parent and pose. ``publisher`` is empty if unknown.
    ``span`` is the first edge's place in the robot file.
    """
    (first, parent, deviation), *further = [
        (edge, parent, _deviation(edge, pose)) for edge, parent, pose in off
    ]
    by = f" from {publisher}" if publisher else ""
    more = f", and of {plural(len(further), 'more frame')} too" if further else ""
    message = f"the pose of {first.child} in {parent}{by} is off by {deviation[0]}{more}"
    notes = [
        Note(f"{edge.child} in {above} by {far}: {poses}")
        for edge, above, (far, poses) in further[:LISTED_AT_MOST]
    ]
    notes += (
        [] if span else [Note(f"{first.name} is declared in {first.source[0]}:{first.source[1]}")]
    )
    advice = (
        "if the file changed after the start, run tfcompose up again: it restarts the processes"
        " that differ; otherwise correct the wrong one"
    )
    return finding("TF846", f"{message}: {deviation[1]}", span, notes=notes, help=advice)


def _deviation(edge: PlanEdge, pose: Pose) -> tuple[str, str]:
    """Return how far a pose is from the nearest expected one, and both poses, as texts."""
    expected = edge.nearest_pose(pose)
    return offset_of(expected, pose).text, compare(expected, pose)
