"""Whether moving joints get from their sensors into the tree: joint states, and who makes transforms of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.observe.seen import listed
from tfcompose.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.observe.seen import Movable, Seen, Topic

JOINT_STATE = "sensor_msgs/msg/JointState"


def joint_states_unheard(seen: Seen) -> Iterator[Finding]:
    """Joint states come, and nobody makes transforms of them."""
    missing = _missing(seen)
    for topic in _joint_topics(seen):
        if not topic.publishers or _transformers(seen, topic) or (seen.movable and not missing):
            continue
        message = f"{listed(topic.publishers)} publishes {topic.name}, and no node that publishes TF listens to it"
        notes = [Note(f"missing: {listed([f'{j.parent} → {j.child}' for j in missing])}")] if missing else []
        advice = "start robot_state_publisher with the robot's description, or let tfcompose up publish the joints"
        yield finding("TF842", message, None, severity="warning", notes=notes, help=advice)


def no_joint_states(seen: Seen) -> Iterator[Finding]:
    """A robot state publisher waits for joint states that nobody sends."""
    missing = _missing(seen)
    for topic in _joint_topics(seen):
        nodes = _transformers(seen, topic)
        if topic.publishers or not nodes or not missing:
            continue
        edges = listed([f"{joint.parent} → {joint.child}" for joint in missing])
        message = f"{listed(nodes)} waits for {topic.name}, which nobody publishes; missing: {edges}"
        advice = "start joint_state_broadcaster or joint_state_publisher; is the topic remapped, or in a namespace?"
        yield finding("TF843", message, None, help=advice)


def joint_without_state(seen: Seen) -> Iterator[Finding]:
    """Joint states come, and a joint of the description is not in them."""
    if not seen.joint_names:
        return
    absent = [joint for joint in _missing(seen) if not joint.mimic and joint.name not in seen.joint_names]
    heard = [topic for topic in _joint_topics(seen) if _transformers(seen, topic)]
    if absent and heard:
        message = f"{listed([joint.name for joint in absent])}: no state on {listed([topic.name for topic in heard])}"
        notes = [Note(f"missing: {listed([f'{joint.parent} → {joint.child}' for joint in absent])}")]
        advice = (
            f"{listed([node for topic in heard for node in topic.publishers])} should send them: is a joint misspelt?"
        )
        yield finding("TF844", message, None, notes=notes, help=advice)


def _missing(seen: Seen) -> list[Movable]:
    """Return the moving joints whose frames nobody publishes; a frame_prefix may stand before them."""
    children = {edge.strand.child for edge in seen.taken}
    plain = children | {child.rpartition("/")[2] for child in children}
    return [joint for joint in seen.movable if joint.child not in plain]


def _joint_topics(seen: Seen) -> list[Topic]:
    """Return the topics of joint states that are meant: those named ``joint_states``, but for robots beside this one.

    A robot beside has TF topics of its own, in a namespace below this one's.
    """
    own = _namespace(seen.topics[0])
    spaces = {_namespace(topic.name) for topic in seen.typed(TF_MESSAGE) if topic.publishers}
    beside = tuple(f"{space}/" for space in spaces if space != own and space.startswith(f"{own}/"))
    named = [topic for topic in seen.typed(JOINT_STATE) if topic.name.endswith("/joint_states")]
    return [topic for topic in named if topic.name.startswith(f"{own}/") and not topic.name.startswith(beside)]


def _namespace(topic: str) -> str:
    return topic.rpartition("/")[0]


def _transformers(seen: Seen, topic: Topic) -> list[str]:
    writers = {one.node for one in seen.publishers if one.node}
    return [node for node in topic.readers if node in writers]
