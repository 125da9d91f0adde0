"""Joint states: their subscribers, publishers and joints.

A moving joint needs states from exactly one publisher. A listener uses every message, so with two
publishers the frames jump between two positions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding, nearest
from tfcompose.foundation.text import list_names
from tfcompose.guard.verdict.publishers import TOGETHER_S, two_publishers_message
from tfcompose.tf.live.state import MovingJoint
from tfcompose.tf.ros.joint_codec import JOINT_STATE_TYPE
from tfcompose.tf.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from tfcompose.model.plan import Plan
    from tfcompose.tf.live.sent_joints import SentJoints
    from tfcompose.tf.live.state import TopicState, TreeState

_NAMED_AT_MOST = 8


def joint_states_unheard(state: TreeState) -> Iterator[Finding]:
    """Joint states arrive, but no node turns them into transforms."""
    missing = _missing(state)
    for topic in _joint_topics(state):
        if (
            not topic.publishers
            or _transformers(state, topic)
            or (_moving_joints(state) and not missing)
        ):
            continue
        message = (
            f"{list_names(topic.publishers)} publishes {topic.name}, and no node that publishes TF"
            " listens to it"
        )
        notes = (
            [Note(f"missing: {list_names([f'{j.parent} → {j.child}' for j in missing])}")]
            if missing
            else []
        )
        advice = (
            "start robot_state_publisher with the robot's description, or let tfcompose up publish"
            " the joints"
        )
        yield finding("TF842", message, None, severity="warning", notes=notes, help=advice)


def no_joint_states(state: TreeState) -> Iterator[Finding]:
    """A robot_state_publisher waits for joint states that no node publishes."""
    missing = _missing(state)
    for topic in _joint_topics(state):
        nodes = _transformers(state, topic)
        if topic.publishers or not nodes or not missing:
            continue
        edges = list_names([f"{joint.parent} → {joint.child}" for joint in missing])
        message = (
            f"{list_names(nodes)} waits for {topic.name}, which no node publishes;"
            f" missing: {edges}"
        )
        yield finding("TF843", message, None, help=_sender_help(state))


def _sender_help(state: TreeState) -> str:
    """Return the expected publisher of joint states: the simulating process, or nodes of ROS."""
    simulating = [
        process
        for process in (state.plan.processes if state.plan else ())
        if process.simulate is not None and process.simulate.kind == "joints"
    ]
    for process in simulating:
        is_there = bool({*process.nodes} & {*state.nodes})
        why = "is there and sends none" if is_there else "does not run"
        return f"{process.name} should publish it, and {why}: tfcompose start {process.name}"
    return (
        "start joint_state_broadcaster or joint_state_publisher; is the topic remapped, or in a"
        " namespace?"
    )


def joint_without_state(state: TreeState) -> Iterator[Finding]:
    """Joint states lack a joint of the robot description."""
    sent = state.joint_names
    if not sent:
        return
    absent = [joint for joint in _missing(state) if not joint.mimic and joint.name not in sent]
    heard = [topic for topic in _joint_topics(state) if _transformers(state, topic)]
    if absent and heard:
        message = (
            f"{list_names([joint.name for joint in absent])}: no state on"
            f" {list_names([topic.name for topic in heard])}"
        )
        notes = [
            Note(f"missing: {list_names([f'{joint.parent} → {joint.child}' for joint in absent])}")
        ]
        advice = (
            f"{list_names([node for topic in heard for node in topic.publishers])} should send"
            " them: is a joint misspelt?"
        )
        yield finding("TF844", message, None, notes=notes, help=advice)


def _missing(state: TreeState) -> list[MovingJoint]:
    """Return the moving joints whose frames no node publishes, with or without frame_prefix."""
    children = {edge.child for edge in state.taken}
    plain = children | {child.rpartition("/")[2] for child in children}
    return [joint for joint in _moving_joints(state) if joint.child not in plain]


def _moving_joints(state: TreeState) -> Sequence[MovingJoint]:
    """Return the moving joints of the robot description; without one, of the plan."""
    if state.moving_joints or state.plan is None:
        return state.moving_joints
    return [
        MovingJoint(edge.joint.name, edge.parent, edge.child, edge.joint.mimic is not None)
        for edge in state.plan.edges
        if edge.joint is not None and edge.kind == "joint"
    ]


def _joint_topics(state: TreeState) -> list[TopicState]:
    """Return the topics named ``joint_states``, without topics of other robots.

    Another robot has its own TF topics in a namespace below this robot's namespace.
    """
    namespace = _namespace(state.topics[0])
    spaces = {
        _namespace(topic.name) for topic in state.topics_of_type(TF_MESSAGE) if topic.publishers
    }
    neighbours = tuple(
        f"{space}/" for space in spaces if space != namespace and space.startswith(f"{namespace}/")
    )
    named = [
        topic
        for topic in state.topics_of_type(JOINT_STATE_TYPE)
        if topic.name.endswith("/joint_states")
    ]
    return [
        topic
        for topic in named
        if topic.name.startswith(f"{namespace}/") and not topic.name.startswith(neighbours)
    ]


def _namespace(topic: str) -> str:
    return topic.rpartition("/")[0]


def _transformers(state: TreeState, topic: TopicState) -> list[str]:
    writers = {publisher.node for publisher in state.publishers if publisher.node}
    return [node for node in topic.readers if node in writers]


# Senders.


def joint_senders(state: TreeState) -> Iterator[Finding]:
    """Two publishers send states of the same joint, or the robot does not have the joint."""
    heard = {topic.name for topic in _joint_topics(state)}
    senders = [sender for sender in state.sent_joints if sender.topic in heard]
    yield from find_sent_twice(senders)
    yield from unknown_joints(senders, known_joints(state))


def known_joints(state: TreeState) -> frozenset[str]:
    """Return the names of the robot's joints, from its description and its plan."""
    described = {joint.name for joint in state.moving_joints}
    return frozenset(described | (planned_joints(state.plan) if state.plan else frozenset()))


def planned_joints(plan: Plan) -> frozenset[str]:
    """Return the names of the joints in the plan's edges."""
    return frozenset(edge.joint.name for edge in plan.edges if edge.joint is not None)


def find_sent_twice(senders: Sequence[SentJoints]) -> Iterator[Finding]:
    """Yield findings about joints whose states several publishers send at the same time."""
    shared: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for topic in dict.fromkeys(sender.topic for sender in senders):
        of_topic = [sender for sender in senders if sender.topic == topic and sender.node]
        for joint in sorted({joint for sender in of_topic for joint in sender.joints}):
            some = _together([sender for sender in of_topic if joint in sender.joints])
            if len(some) > 1:
                nodes = tuple(sorted(sender.node for sender in some))
                shared.setdefault((topic, nodes), []).append(joint)
    for (topic, nodes), joints in shared.items():
        named = list_names(joints, _NAMED_AT_MOST)
        message = two_publishers_message(named, nodes, are_many=len(joints) > 1)
        yield finding(
            "TF860",
            f"{message}, on {topic}",
            None,
            help="end all but one of them, or let each send other joints: frames jump between the"
            " positions of the two",
        )


def _together(senders: Sequence[SentJoints]) -> list[SentJoints]:
    """Return the publishers that sent at the same time as another publisher."""
    return [
        sender
        for sender in senders
        if any(
            peer is not sender
            and sender.last_ns >= peer.first_ns + TOGETHER_S * 1e9
            and peer.last_ns >= sender.first_ns + TOGETHER_S * 1e9
            for peer in senders
        )
    ]


def unknown_joints(senders: Sequence[SentJoints], names: Collection[str]) -> Iterator[Finding]:
    """Yield findings about joints that the robot does not have, if its joints are known."""
    for sender in senders if names else ():
        unknown = sorted(sender.joints.difference(names))
        if not unknown or not sender.node:
            continue
        nearest_names = {joint: nearest(joint, list(names)) for joint in unknown}
        near = [
            f"did you mean {name} for {joint}?" for joint, name in nearest_names.items() if name
        ]
        yield finding(
            "TF861",
            f"{sender.node} sends {list_names(unknown, _NAMED_AT_MOST)} on {sender.topic}; the"
            f" robot has no such joint{'s' if len(unknown) > 1 else ''}",
            None,
            help=" ".join(near)
            or "correct the name where the node is configured, or describe the joint",
        )
