"""Diagnosis of a tree: functions from its state to findings, in order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.foundation.text import plural
from tfcompose.guard.verdict import (
    consumers,
    joints,
    publishers,
    rates,
    setup,
    stamps,
    tree,
    verify,
)
from tfcompose.tf.live.state import who
from tfcompose.tf.ros.tf_codec import TF_MESSAGE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.tf.live.state import TreeState


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Findings of the doctor, and a summary of its observation."""

    findings: list[Finding]
    #: Number of observed edges.
    edges: int
    #: Number of publishing nodes.
    nodes: int
    #: Duration of the observation in seconds.
    seconds: float
    #: Root frames of the trees.
    roots: tuple[str, ...] = ()
    #: Topics with TF that the doctor did not observe.
    elsewhere: tuple[str, ...] = ()
    #: A sentence about the traffic on each topic.
    costs: tuple[str, ...] = ()


#: The checks in order: is there TF, who sends it, what is its shape, and are its times correct.
DIAGNOSES: tuple[Callable[[TreeState], Iterator[Finding]], ...] = (
    setup.settings_contradict,
    setup.no_tf,
    setup.other_settings,
    publishers.volatile_static,
    publishers.best_effort,
    publishers.volatile_reader,
    publishers.other_type,
    publishers.unreadable,
    publishers.isolation_leak,
    publishers.many_static,
    tree.self_transform,
    tree.drops,
    tree.slash_in_front,
    tree.loop,
    tree.second_parent,
    tree.two_trees,
    publishers.find_floods,
    publishers.two_publishers,
    publishers.both_topics,
    verify.differs_from_plan,
    stamps.clock_missing,
    stamps.two_clocks,
    stamps.wrong_clock,
    stamps.host_clock_off,
    stamps.stamps_ahead,
    consumers.late_stamps,
    stamps.find_repeated_stamps,
    stamps.stamp_went_back,
    rates.fell_silent,
    rates.find_fixed_left,
    rates.low_rate,
    rates.gap,
    consumers.data_frame_unknown,
    consumers.data_beyond_tf,
    joints.joint_states_unheard,
    joints.no_joint_states,
    joints.joint_without_state,
    joints.joint_senders,
)


def diagnose(state: TreeState) -> list[Finding]:
    """Return all findings: errors first, then in the order of the checks."""
    findings = [finding for diagnosis in DIAGNOSES for finding in diagnosis(state)]
    return sorted(dict.fromkeys(findings), key=lambda finding: finding.severity)


def examine(states: Sequence[TreeState]) -> Diagnosis:
    """Judge all states of an observation, one for each pair of topics."""
    findings = list(dict.fromkeys(finding for state in states for finding in diagnose(state)))
    edges = {(edge.parent, edge.child) for state in states for edge in state.taken}
    names = {name for state in states for edge in state.taken for name in edge.nodes}
    roots = tuple(dict.fromkeys(root for state in states for root in tree.trees_of(state)))
    topics = {topic for state in states for topic in state.topics}
    with_tf = [
        topic.name
        for state in states[:1]
        for topic in state.topics_of_type(TF_MESSAGE)
        if topic.publishers
    ]
    elsewhere = tuple(name for name in with_tf if name not in topics and "/_" not in name)
    seconds = states[0].seconds if states else 0.0
    return Diagnosis(
        sorted(findings, key=lambda finding: finding.severity),
        len(edges),
        len(names),
        seconds=seconds,
        roots=roots,
        elsewhere=elsewhere,
        costs=tuple(filter(None, map(cost, states))),
    )


#: A node that sends this many edges or more in separate messages could send fewer messages.
_SINGLE_FROM = 3


def cost(state: TreeState) -> str:
    """Return a sentence about traffic on the topic of moving edges; empty without messages.

    Each message goes to each listener, so a node should send its edges in a single message.
    """
    messages = sum(count.messages for count in state.sent.values())
    if not messages or not state.seconds:
        return ""
    name = state.topics[0]
    readers = next((topic.readers for topic in state.graph if topic.name == name), ())
    transforms = sum(count.transforms for count in state.sent.values())
    text = (
        f"{name} carries {messages / state.seconds:.0f} messages a second with"
        f" {transforms / state.seconds:.0f} transforms to {plural(len(readers), 'listener')}"
    )
    single = []
    for gid, count in state.sent.items():
        edges = [edge for edge in state.moving if edge.stream.gid == gid]
        if count.messages == count.transforms and len(edges) >= _SINGLE_FROM:
            hertz = count.messages / state.seconds
            single.append(
                f"{who(edges[0])} sends its {len(edges)} edges one by one ({hertz:.0f}/s)"
            )
    return "; ".join([text, *single])
