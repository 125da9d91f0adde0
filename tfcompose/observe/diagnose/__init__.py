"""The doctor's diagnoses: each a small function from what was seen to findings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.observe.diagnose import data, expected, joints, rates, senders, surroundings, times, tree

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.findings import Finding
    from tfcompose.observe.seen import Seen

#: In the order in which one looks: is there anything, who sends it, what is its shape, and its time.
DIAGNOSES: tuple[Callable[[Seen], Iterator[Finding]], ...] = (
    surroundings.settings_contradict,
    surroundings.no_tf,
    surroundings.other_settings,
    senders.volatile_static,
    senders.best_effort,
    senders.volatile_reader,
    senders.other_type,
    senders.unreadable,
    senders.isolation_leak,
    senders.many_static,
    tree.self_transform,
    tree.drops,
    tree.slash_in_front,
    tree.loop,
    tree.second_parent,
    tree.two_trees,
    senders.two_writers,
    senders.both_topics,
    expected.differs_from_plan,
    times.clock_missing,
    times.two_clocks,
    times.wrong_clock,
    times.host_clock_off,
    times.stamps_ahead,
    times.late_stamps,
    times.stamp_repeated,
    times.stamp_went_back,
    rates.fell_silent,
    rates.fixed_left,
    rates.low_rate,
    rates.gap,
    data.data_frame_unknown,
    data.data_beyond_tf,
    joints.joint_states_unheard,
    joints.no_joint_states,
    joints.joint_without_state,
)


def diagnose(seen: Seen) -> list[Finding]:
    """Return everything that is wrong, errors first, else in the order in which one looks."""
    found = [one for diagnosis in DIAGNOSES for one in diagnosis(seen)]
    return sorted(dict.fromkeys(found), key=lambda one: one.severity)
