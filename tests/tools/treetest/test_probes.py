"""Measurements of a case, against a probe that looks up after every message."""

from math import nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.foundation.geometry import Offset, Pose
from tfcompose.model.plan import PlanJoint
from tfcompose.tf.tf2.pose_buffer import PoseBuffer
from tfcompose.tools.treetest.joints import JointProbe
from tfcompose.tools.treetest.replay import Arrival, PoseProbe, ProbedTree, Timeline

FRAMES = "abcd"
#: Parent, child, position, whether it is fixed, and the time since the message before.
Message = tuple[str, str, int, bool, int]
messages = st.lists(
    st.tuples(
        st.sampled_from(FRAMES),
        st.sampled_from(FRAMES),
        st.integers(0, 3),
        st.booleans(),
        st.integers(0, 2),
    ).filter(lambda each: each[0] != each[1]),
    max_size=30,
)


class EagerProbe(PoseProbe):
    """Looks up after every message."""

    def _is_affected(self, arrival: Arrival) -> bool:
        del arrival
        return True


def replay(sent: list[Message], *probes: PoseProbe) -> PoseBuffer:
    tree = ProbedTree(Timeline())
    tree.probes += probes
    now_s = 1
    for parent, child, x, static, later_s in sent:
        now_s += later_s
        row = (parent, child, now_s, 0, float(x), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        tree.take([row], static=static, gid=None, received_ns=now_s * 10**9)
    return tree.buffer


def pose_probe(kind: type[PoseProbe]) -> PoseProbe:
    return kind("a", "d", (1.0, 0.0, 0.0), None, Offset(0.5, 0.1))


def outcome(probe: PoseProbe) -> tuple[Pose | None, float | None, float]:
    return probe.worst, probe.beyond_s, probe.elapsed_s


def test_a_joint_moves_past_transforms_that_tf2_rejects() -> None:
    joint = PlanJoint("joint", "prismatic", (1.0, 0.0, 0.0))
    probe = JointProbe("a", "b", joint, Pose(), Offset(0.1, 0.1))
    tree = ProbedTree(Timeline())
    tree.probes.append(probe)
    for now_s, y, w in [(1, nan, 1.0), (2, 0.0, nan), (3, 0.0, 1.0), (4, 2.0, 1.0)]:
        row = ("a", "/b", now_s, 0, 0.0, y, 0.0, 0.0, 0.0, 0.0, w)
        tree.take([row], static=False, gid=None, received_ns=now_s * 10**9)
    assert (probe.offset.xyz_m, probe.elapsed_s) == (2.0, 3.0)


@given(messages)
def test_a_pose_is_judged_as_if_every_message_affected_it(sent: list[Message]) -> None:
    cheap, eager = pose_probe(PoseProbe), pose_probe(EagerProbe)
    replay(sent, cheap, eager)
    assert outcome(cheap) == outcome(eager)
    assert (cheap.failure == eager.failure) or cheap.worst


def test_only_messages_that_affect_a_pose_cost_a_lookup(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    count = 0
    lookup = PoseBuffer.lookup

    def counted(buffer: PoseBuffer, target: str, source: str) -> tuple[Pose, int]:
        nonlocal count
        count += 1
        return lookup(buffer, target, source)

    monkeypatch.setattr(PoseBuffer, "lookup", counted)
    missing: list[Message] = [("a", "b", 1, False, 1)] * 50
    fixed: list[Message] = [("a", "d", 1, True, 0)] * 3
    replay([*missing, *fixed, *missing], pose_probe(PoseProbe))
    assert count == 2
    chain: list[Message] = [("b", "d", 1, True, 0), *missing]
    replay([*chain, *[("a", "c", 1, False, 1)] * 50], pose_probe(PoseProbe))
    assert count == 2 + 1 + 50 + 1
