"""The buffer against tf2 itself, where it is installed: the same random history, the same questions, the same answers.

PyPI has no tf2; with a ROS installation on the path (``tf2_py``) this runs.
"""

from __future__ import annotations

import random
from typing import Any

import pytest

from tfcompose.observe import Buffer, TransformException
from tfcompose.pose import Pose, Quaternion, angle_between, normalised

tf2 = pytest.importorskip("tf2_py")
messages = pytest.importorskip("geometry_msgs.msg")
time = pytest.importorskip("rclpy.time")

S = 1_000_000_000


class Pair:
    """Our buffer and tf2's, told and asked the same."""

    def __init__(self) -> None:
        self.ours, self.theirs = Buffer(), tf2.BufferCore()

    def set(self, parent: str, child: str, pose: Pose, stamp_ns: int, *, static: bool) -> None:
        message = messages.TransformStamped()
        message.header.frame_id, message.child_frame_id = parent, child
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, S)
        to, turn = message.transform.translation, message.transform.rotation
        (to.x, to.y, to.z), (turn.x, turn.y, turn.z, turn.w) = pose.xyz, pose.quat_xyzw
        if static:
            self.ours.set_transform_static(message, "a")
            self.theirs.set_transform_static(message, "a")
        else:
            self.ours.set_transform(message, "a")
            self.theirs.set_transform(message, "a")

    def compare(self, target: str, source: str, stamp_ns: int) -> None:
        asked = target, source, time.Time(nanoseconds=stamp_ns)
        try:
            found = self.ours.lookup_transform(*asked)
        except TransformException as error:
            with pytest.raises(getattr(tf2, type(error).__name__)):
                self.theirs.lookup_transform_core(*asked)
            return
        same(found, self.theirs.lookup_transform_core(*asked))


def same(ours: Any, theirs: Any) -> None:
    assert ours.header.stamp == theirs.header.stamp
    xyz = [(m.transform.translation.x, m.transform.translation.y, m.transform.translation.z) for m in (ours, theirs)]
    assert xyz[0] == pytest.approx(xyz[1], abs=1e-9)
    turns: list[Quaternion] = [
        (m.transform.rotation.x, m.transform.rotation.y, m.transform.rotation.z, m.transform.rotation.w)
        for m in (ours, theirs)
    ]
    assert angle_between(turns[0], normalised(turns[1])) < 1e-6


@pytest.mark.parametrize("seed", range(50))
def test_random_histories_with_new_parents_loops_and_gaps(seed: int) -> None:
    rng = random.Random(seed)
    frames = [f"f{index}" for index in range(rng.choice([3, 5, 8]))]
    pair = Pair()
    for _ in range(100):
        parent, child = rng.choice(frames), rng.choice(frames)
        x, y, z, w = (rng.gauss(0, 1) for _ in range(4))
        pose = Pose((rng.uniform(-5, 5), rng.uniform(-5, 5), 0.0), normalised((x, y, z, w)))
        if rng.random() < 0.5:
            pair.set(parent, child, pose, rng.randrange(S, 16 * S), static=frames.index(child) % 3 == 0)
        else:
            pair.compare(parent, child, rng.choice([0, rng.randrange(S, 16 * S)]))
