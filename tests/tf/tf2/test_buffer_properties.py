"""What holds for any tree and any history; pytransform3d and scipy are the oracles for numbers."""

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytransform3d.transform_manager import TransformManager
from pytransform3d.transformations import transform_from_pq
from scipy.spatial.transform import Rotation, Slerp

from tfcompose.foundation.geometry import Pose, Quaternion, angle_between, normalise
from tfcompose.tf.ros.tf_codec import Decoder, SentTransform, encode
from tfcompose.tf.tf2 import Buffer, TransformException

S = 1_000_000_000
TOLERANCE = 1e-9

coordinates = st.floats(-100, 100)
quaternions = (
    st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda q: sum(part * part for part in q) > 0.01)
    .map(normalise)
)
poses = st.builds(Pose, st.tuples(*[coordinates] * 3), quaternions)
stamps = st.integers(20 * S, 29 * S)


@st.composite
def trees(draw: st.DrawFn) -> Buffer:
    """A tree of up to eight frames below f0, some moving, known from 20 s to 29 s."""
    buffer = Buffer()
    for index in range(1, draw(st.integers(2, 8))):
        parent = f"f{draw(st.integers(0, index - 1))}"
        if draw(st.booleans()):
            buffer.set(parent, f"f{index}", draw(poses), 0, static=True)
            continue
        for stamp in {20 * S, 29 * S, *draw(st.lists(stamps, max_size=4))}:
            buffer.set(parent, f"f{index}", draw(poses), stamp, static=False)
    return buffer


def close(a: Pose, b: Pose, *, scale: float = 1000) -> bool:
    off = max(abs(p - q) for p, q in zip(a.xyz, b.xyz, strict=True))
    return off < TOLERANCE * scale and angle_between(a.quat_xyzw, b.quat_xyzw) < 1e-7


def some(data: st.DataObject, buffer: Buffer) -> str:
    return data.draw(st.sampled_from(sorted(buffer.frames)))


@given(trees(), stamps, st.data())
def test_the_way_through_a_third_frame_gives_the_same_pose(
    buffer: Buffer, stamp: int, data: st.DataObject
) -> None:
    a, b, c = (some(data, buffer) for _ in range(3))
    through = buffer.lookup(a, b, stamp)[0] @ buffer.lookup(b, c, stamp)[0]
    assert close(buffer.lookup(a, c, stamp)[0], through)


@given(trees(), stamps, st.data())
def test_the_other_way_round_is_the_inverse(
    buffer: Buffer, stamp: int, data: st.DataObject
) -> None:
    a, b = some(data, buffer), some(data, buffer)
    assert close(buffer.lookup(a, b, stamp)[0], buffer.lookup(b, a, stamp)[0].inverse())


@given(poses, poses, st.integers(1, 9 * S), st.data())
def test_an_interpolated_pose_lies_between_samples_and_near_the_nearer_one(
    first: Pose, last: Pose, length: int, data: st.DataObject
) -> None:
    buffer = Buffer()
    buffer.set("a", "b", first, S, static=False)
    buffer.set("a", "b", last, S + length, static=False)
    since = data.draw(st.integers(0, length))
    pose, _ = buffer.lookup("a", "b", S + since)
    part = since / length
    for p, q, x in zip(first.xyz, last.xyz, pose.xyz, strict=True):
        assert min(p, q) - 1e-9 <= x <= max(p, q) + 1e-9
        assert x == pytest.approx(p + (q - p) * part, abs=1e-9)
    full = angle_between(first.quat_xyzw, last.quat_xyzw)
    assert angle_between(first.quat_xyzw, pose.quat_xyzw) == pytest.approx(full * part, abs=1e-7)
    assert angle_between(pose.quat_xyzw, last.quat_xyzw) == pytest.approx(
        full * (1 - part), abs=1e-7
    )


@given(quaternions, quaternions, st.floats(0, 1))
def test_rotations_between_samples_are_scipys_slerp(
    a: Quaternion, b: Quaternion, part: float
) -> None:
    buffer = Buffer()
    buffer.set("a", "b", Pose((0, 0, 0), a), S, static=False)
    buffer.set("a", "b", Pose((0, 0, 0), b), 2 * S, static=False)
    since = round(part * S)
    if angle_between(a, b) > 3.14:  # there both ways are nearly as short
        return
    expected = Slerp([0, S], Rotation.from_quat([a, b]))(since)
    turned = Rotation.from_quat(buffer.lookup("a", "b", S + since)[0].quat_xyzw)
    assert (turned.inv() * expected).magnitude() < 1e-7


@given(
    st.dictionaries(st.integers(20 * S, 29 * S), poses, min_size=2, max_size=8),
    st.randoms(),
    stamps,
)
def test_the_order_of_arrival_does_not_matter(
    samples: dict[int, Pose], rng: random.Random, stamp: int
) -> None:
    def answer(order: list[tuple[int, Pose]]) -> object:
        buffer = Buffer()
        for when, pose in order:
            assert buffer.set("a", "b", pose, when, static=False)
        try:
            return buffer.lookup("a", "b", stamp), buffer.lookup("a", "b")
        except TransformException as error:
            return str(error)

    mixed = list(samples.items())
    rng.shuffle(mixed)
    assert answer(mixed) == answer(sorted(samples.items()))


@given(trees(), st.lists(stamps, max_size=12), st.data())
@settings(max_examples=60)
def test_a_trajectory_is_row_by_row_what_lookup_returns(
    buffer: Buffer, times: list[int], data: st.DataObject
) -> None:
    a, b = some(data, buffer), some(data, buffer)
    trajectory = buffer.lookup_many(a, b, times)
    assert (trajectory.xyz.shape, trajectory.quat_xyzw.shape) == ((len(times), 3), (len(times), 4))
    for row, stamp in enumerate(times):
        expected, _ = buffer.lookup(a, b, stamp)
        assert trajectory.xyz[row] == pytest.approx(expected.xyz, abs=1e-7)
        assert abs(trajectory.quat_xyzw[row] @ expected.quat_xyzw) == pytest.approx(1, abs=1e-12)
        assert trajectory.quat_xyzw[row, 3] >= 0


@pytest.mark.parametrize("seed", range(20))
def test_random_trees_agree_with_pytransform3d(seed: int) -> None:
    rng = random.Random(seed)
    buffer, manager, frames = Buffer(), TransformManager(), ["f0"]
    for index in range(1, 30):
        parent, child = rng.choice(frames), f"f{index}"
        x, y, z, w = normalise(
            (rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))
        )
        xyz = (rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(-3, 3))
        buffer.set(parent, child, Pose(xyz, (x, y, z, w)), S, static=rng.random() < 0.5)
        manager.add_transform(child, parent, transform_from_pq([*xyz, w, x, y, z]))
        frames.append(child)
    for _ in range(30):
        a, b = rng.choice(frames), rng.choice(frames)
        expected = manager.get_transform(b, a)
        pose, _ = buffer.lookup(a, b, S)
        assert np.allclose(expected[:3, 3], pose.xyz, atol=1e-9)
        assert np.allclose(
            expected[:3, :3], Rotation.from_quat(pose.quat_xyzw).as_matrix(), atol=1e-9
        )
        assert np.allclose(expected, buffer.lookup_many(a, b, [S]).matrices()[0], atol=1e-9)


OPERATIONS = st.lists(
    st.tuples(st.integers(0, 4), st.integers(0, 4), st.booleans(), st.integers(1, 30 * S), poses),
    max_size=40,
)


@given(OPERATIONS, st.data())
def test_what_is_remembered_of_chains_changes_no_answer(
    operations: list[tuple[int, int, bool, int, Pose]], data: st.DataObject
) -> None:
    """Loops, new parents and kinds, all at once.

    A buffer that was asked in between answers as one that was not.
    """
    requested, fresh = Buffer(), Buffer()
    questions = st.tuples(st.integers(0, 4), st.integers(0, 4), st.integers(0, 30 * S))
    for parent, child, static, stamp, pose in operations:
        for buffer in (requested, fresh):
            buffer.set(f"f{parent}", f"f{child}", pose, stamp, static=static)
        for a in range(5):
            requested.can_transform(f"f{a}", f"f{(a + 2) % 5}", 0)
    for a, b, stamp in data.draw(st.lists(questions, max_size=6)):
        assert _answer(requested, f"f{a}", f"f{b}", stamp) == _answer(
            fresh, f"f{a}", f"f{b}", stamp
        )


def _answer(buffer: Buffer, a: str, b: str, stamp: int) -> object:
    try:
        return buffer.lookup(a, b, stamp)
    except TransformException as error:
        return type(error), str(error)


@given(st.data())
@settings(max_examples=200)
def test_whatever_bytes_come_the_buffer_goes_on_answering(data: st.DataObject) -> None:
    """Broken messages are an error and change nothing.

    Messages with broken content are taken or refused.
    """
    buffer, decoder = Buffer(), Decoder()
    sound = encode([SentTransform(S, "odom", "base", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))] * 3)
    for _ in range(6):
        damaged = bytearray(sound)
        for _ in range(data.draw(st.integers(0, 5))):
            damaged[data.draw(st.integers(0, len(sound) - 1))] = data.draw(st.integers(0, 255))
        try:
            rows = decoder.rows(bytes(damaged[: data.draw(st.integers(0, len(sound)))]))
        except ValueError:
            continue
        buffer.insert(rows, static=data.draw(st.booleans()))
    for frame in ("a", "b"):
        buffer.set("root", frame, Pose((1.0, 0.0, 0.0)), S, static=True)
    assert buffer.lookup("a", "b")[0] == Pose()
    for info in buffer.all_frames():
        buffer.can_transform("root", info.name, 0)
    assert len(buffer.all_frames_as_yaml()) < 100_000
