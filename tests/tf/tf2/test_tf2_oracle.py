"""The buffer against tf2 itself, where it is installed.

The same random history, the same questions, the same answers.

PyPI has no tf2; with a ROS installation on the path (``tf2_py``) this runs.
"""

import math
import random
from typing import Any

import pytest

from tfcompose.foundation.geometry import Pose, Quaternion, angle_between, normalise
from tfcompose.tf.tf2 import Buffer, TransformException

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
        to, rotated = message.transform.translation, message.transform.rotation
        (to.x, to.y, to.z), (rotated.x, rotated.y, rotated.z, rotated.w) = pose.xyz, pose.quat_xyzw
        if static:
            self.ours.set_transform_static(message, "a")
            self.theirs.set_transform_static(message, "a")
        else:
            self.ours.set_transform(message, "a")
            self.theirs.set_transform(message, "a")

    def compare(self, target: str, source: str, stamp_ns: int) -> None:
        requested = target, source, time.Time(nanoseconds=stamp_ns)
        self._both("lookup_transform_core", requested)
        assert self.ours.can_transform_core(*requested)[0] == bool(
            self.theirs.can_transform_core(*requested)[0]
        )

    def compare_full(
        self, target: str, target_ns: int, source: str, source_ns: int, fixed: str
    ) -> None:
        times = time.Time(nanoseconds=target_ns), time.Time(nanoseconds=source_ns)
        requested = target, times[0], source, times[1], fixed
        self._both("lookup_transform_full_core", requested)
        assert self.ours.can_transform_full_core(*requested)[0] == bool(
            self.theirs.can_transform_full_core(*requested)[0]
        )

    def clear(self) -> None:
        self.ours.clear()
        self.theirs.clear()

    def compare_frames(self) -> None:
        lines = [
            line
            for line in self.theirs.all_frames_as_string().splitlines()
            if "NO_PARENT" not in line
        ]
        assert sorted(self.ours.all_frames_as_string().splitlines()) == sorted(lines)

    def _both(self, name: str, requested: tuple[Any, ...]) -> None:
        try:
            answer = getattr(self.ours, name)(*requested)
        except TransformException as error:
            with pytest.raises(getattr(tf2, type(error).__name__)):
                getattr(self.theirs, name)(*requested)
            return
        same(answer, getattr(self.theirs, name)(*requested))


def same(ours: Any, theirs: Any) -> None:
    assert ours.header.stamp == theirs.header.stamp
    xyz = [
        (m.transform.translation.x, m.transform.translation.y, m.transform.translation.z)
        for m in (ours, theirs)
    ]
    assert xyz[0] == pytest.approx(xyz[1], abs=1e-9)
    rotations: list[Quaternion] = [
        (
            m.transform.rotation.x,
            m.transform.rotation.y,
            m.transform.rotation.z,
            m.transform.rotation.w,
        )
        for m in (ours, theirs)
    ]
    assert angle_between(rotations[0], normalise(rotations[1])) < 1e-6


@pytest.mark.parametrize("seed", range(100))
def test_random_histories_with_new_parents_loops_gaps_and_refusals(seed: int) -> None:
    rng = random.Random(seed)
    frames = [f"f{index}" for index in range(rng.choice([3, 5, 8]))]
    grid_ns = rng.choice([1, S])  # with times that come twice, or hardly any
    pair = Pair()

    def stamp() -> int:
        return rng.randrange(S, 16 * S) // grid_ns * grid_ns if rng.random() < 0.9 else 0

    for _ in range(150):
        parent, child, fixed = (rng.choice(frames) for _ in range(3))
        what = rng.random()
        if what < 0.5:
            x, y, z, w = (rng.gauss(0, 1) for _ in range(4))
            xyz = rng.uniform(-5, 5), rng.uniform(-5, 5), math.nan if rng.random() < 0.02 else 0.0
            static = (frames.index(child) % 3 == 0) is not (rng.random() < 0.02)
            pair.set(
                rng.choice(["", "/"]) + parent,
                child,
                Pose(xyz, normalise((x, y, z, w))),
                stamp(),
                static=static,
            )
        elif what < 0.51:
            pair.clear()
        elif what < 0.9:
            pair.compare(rng.choice([parent, parent, "nobody", "", "/f0"]), child, stamp())
        else:
            pair.compare_full(parent, stamp(), child, stamp(), fixed)
    pair.compare_frames()
