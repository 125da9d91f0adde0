"""What tf2's BufferCore does (geometry2 for Jazzy), line by line.

What it takes, and what it answers when.
"""

import math
from collections.abc import Sequence
from typing import Any

import pytest

from tfcompose.foundation.geometry import Pose, angle_between, quat_from_rpy
from tfcompose.tf.tf2 import (
    Buffer,
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from tfcompose.tf.tf2.exceptions import Rejection
from tfcompose.tf.tf2.messages import (
    Header,
    Quaternion,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)

S = 1_000_000_000
MS = 1_000_000


def pose_at(x: float) -> Pose:
    return Pose((x, 0.0, 0.0))


def moving(*samples: tuple[str, str, float, float]) -> Buffer:
    """Return a buffer that has taken (parent, child, x, seconds) in order."""
    buffer = Buffer()
    for parent, child, x, seconds in samples:
        buffer.set(parent, child, pose_at(x), round(seconds * S), static=False)
    return buffer


def x_of(buffer: Buffer, target: str, source: str, seconds: float = 0.0) -> float:
    x: float = buffer.lookup(target, source, round(seconds * S))[0].xyz[0]
    return x


@pytest.mark.parametrize(
    ("parent", "child", "numbers", "why"),
    [
        ("a", "a", (0, 0, 0, 0, 0, 0, 1), Rejection.SELF),
        ("/a", "a", (0, 0, 0, 0, 0, 0, 1), Rejection.SELF),
        ("a", "", (0, 0, 0, 0, 0, 0, 1), Rejection.NO_CHILD),
        ("a", "/", (0, 0, 0, 0, 0, 0, 1), Rejection.NO_CHILD),
        ("", "b", (0, 0, 0, 0, 0, 0, 1), Rejection.NO_PARENT),
        ("a", "b", (math.nan, 0, 0, 0, 0, 0, 1), Rejection.NOT_FINITE),
        ("a", "b", (0, 0, math.inf, 0, 0, 0, 1), Rejection.NOT_FINITE),
        ("a", "b", (0, 0, 0, 0, math.nan, 0, 1), Rejection.NOT_FINITE),
        ("a", "b", (0, 0, 0, 0, 0, 0, 0), Rejection.DENORMALISED),
        ("a", "b", (0, 0, 0, 0, 0, 0, math.sqrt(1.0101)), Rejection.DENORMALISED),
        ("a", "b", (0, 0, 0, 0, 0, 0, math.sqrt(0.9899)), Rejection.DENORMALISED),
        ("a", "b", (0, 0, 0, 0, 0, 0, math.sqrt(1.0099)), None),
        ("a", "b", (1e308, 1e308, 1e308, 0, 0, 0, 1), None),
        ("a", "/b", (0, 0, 0, 0, 0, 0, -1), None),
    ],
)
def test_what_is_refused_is_refused_for_tf2s_reason_and_leaves_nothing(
    parent: str, child: str, numbers: Sequence[float], why: Rejection | None
) -> None:
    buffer = Buffer()
    row: Any = (parent, child, 5, 0, *numbers)
    refused = buffer.insert([row], static=False)
    assert refused == ([] if why is None else [(child.removeprefix("/"), why)])
    assert buffer.frames == ({"a", "b"} if why is None else frozenset())


def test_a_quaternion_a_little_off_is_brought_to_length_1() -> None:
    buffer = Buffer()
    assert buffer.set("a", "b", Pose((0, 0, 0), (0, 0, 0.6, 0.803)), S, static=False)
    assert math.hypot(*buffer.lookup("a", "b")[0].quat_xyzw) == pytest.approx(1, abs=1e-15)
    buffer.set("b", "c", pose_at(100), 0, static=True)
    assert math.hypot(*buffer.lookup("a", "c")[0].xyz) == pytest.approx(100, abs=1e-12), (
        "turning does not stretch"
    )


def test_data_older_than_the_cache_is_refused_and_the_rest_is_taken() -> None:
    buffer = moving(("odom", "base", 0.0, 100.0))
    rows: list[Any] = [
        ("odom", "base", 89, 999_999_999, *[0.0] * 6, 1.0),
        ("odom", "arm", 1, 0, *[0.0] * 6, 1.0),
    ]
    assert buffer.insert(rows, static=False) == [("base", Rejection.OLD)]
    assert buffer.set("odom", "base", pose_at(1), 90 * S, static=False), (
        "exactly as old as the cache is not too old"
    )
    assert buffer.frames == {"odom", "base", "arm"}


def test_samples_are_dropped_by_the_newest_before_the_one_that_comes() -> None:
    """tf2 prunes before it inserts, so a gap keeps older data for one more sample."""
    buffer = moving(
        ("odom", "base", 0.0, 1.0), ("odom", "base", 1.0, 2.0), ("odom", "base", 2.0, 50.0)
    )
    assert x_of(buffer, "odom", "base", 1.5) == 0.5
    buffer.set("odom", "base", pose_at(3), 51 * S, static=False)
    with pytest.raises(ExtrapolationException, match=r"past.* 48500 ms"):
        buffer.lookup("odom", "base", round(1.5 * S))


@pytest.mark.parametrize(
    ("seconds", "why"),
    [
        (
            3.0625,
            r"odom → base at 3\.062500000 s .*future.* 62\.5 ms",
        ),
        (0.5, r"odom → base at 0\.500000000 s .*past.* 500 ms"),
    ],
)
def test_outside_the_samples_it_says_which_edge_and_how_many_milliseconds(
    seconds: float, why: str
) -> None:
    buffer = moving(("odom", "base", 1.0, 1.0), ("odom", "base", 3.0, 3.0))
    buffer.set("base", "laser", pose_at(0.1), 0, static=True)
    with pytest.raises(ExtrapolationException, match=why):
        buffer.lookup("odom", "laser", round(seconds * S))
    answer, reason = buffer.can_transform(
        "odom", "laser", round(seconds * S), return_debug_tuple=True
    )
    assert not answer
    assert "odom → base" in reason
    assert [x_of(buffer, "odom", "base", second) for second in (1.0, 2.0, 3.0)] == [1.0, 2.0, 3.0]


def test_one_sample_is_good_at_its_own_time_and_as_the_newest() -> None:
    buffer = moving(("odom", "base", 1.0, 5.0))
    assert x_of(buffer, "odom", "base", 5.0) == x_of(buffer, "odom", "base") == 1.0
    with pytest.raises(ExtrapolationException, match=" 1000 ms"):
        buffer.lookup("odom", "base", 4 * S)


def test_a_fixed_edge_is_good_at_any_time_and_its_newest_value_counts() -> None:
    buffer = Buffer()
    for x in (1.0, 2.0):
        buffer.set("base", "laser", pose_at(x), 7 * S, static=True)
    assert [x_of(buffer, "base", "laser", second) for second in (0.0, 1.0, 1e6)] == [2.0, 2.0, 2.0]
    assert buffer.lookup("base", "laser")[1] == 0
    assert buffer.lookup("base", "laser", 9)[1] == 9


def test_an_edge_loses_its_samples_if_it_becomes_fixed_or_dynamic() -> None:
    buffer = moving(("a", "b", 1.0, 1.0), ("a", "b", 2.0, 2.0))
    buffer.set("a", "b", pose_at(9), 0, static=True)
    assert x_of(buffer, "a", "b", 1.0) == 9.0
    buffer.set("a", "b", pose_at(3), 3 * S, static=False)
    with pytest.raises(ExtrapolationException):
        buffer.lookup("a", "b", 1 * S)
    assert x_of(buffer, "a", "b") == 3.0


def test_a_frame_hangs_where_its_samples_hung_at_that_time() -> None:
    buffer = moving(
        ("table", "cup", 1.0, 1.0), ("table", "cup", 2.0, 2.0), ("hand", "cup", 0.5, 3.0)
    )
    buffer.set("world", "table", pose_at(10), 0, static=True)
    buffer.set("world", "hand", pose_at(20), 0, static=True)
    assert x_of(buffer, "world", "cup") == 20.5
    assert x_of(buffer, "world", "cup", 1.5) == 11.5
    assert x_of(buffer, "world", "cup", 2.5) == 12.0, (
        "between samples of two parents the older holds"
    )
    assert x_of(buffer, "table", "cup", 2.5) == 2.0
    for second in (4.0, 14.0):
        buffer.set("hand", "cup", pose_at(0.5), round(second * S), static=False)
    assert x_of(buffer, "world", "cup", 3.5) == 20.5


def test_an_older_sample_of_another_parent_does_not_move_the_frame() -> None:
    buffer = moving(
        ("odom", "base", 1.0, 2.0), ("map", "base", 2.0, 3.0), ("utm", "base", 3.0, 1.0)
    )
    assert buffer.lookup("map", "base") == (pose_at(2), 3 * S)
    assert {"utm", "odom"} <= buffer.frames
    with pytest.raises(ConnectivityException, match=r"utm\b.*\bbase\b"):
        buffer.lookup("utm", "base")


def test_of_two_equal_stamps_the_last_counts_but_at_the_oldest_the_first() -> None:
    buffer = moving(
        ("a", "b", 1.0, 1.0), ("a", "b", 2.0, 1.0), ("a", "b", 5.0, 2.0), ("a", "b", 6.0, 2.0)
    )
    assert x_of(buffer, "a", "b", 1.0) == 1.0
    assert x_of(buffer, "a", "b", 1.5) == 3.5
    assert x_of(buffer, "a", "b", 2.0) == 6.0


def test_the_newest_common_time_passes_by_fixed_edges_and_time_zero() -> None:
    buffer = moving(
        ("map", "odom", 0.0, 4.0), ("odom", "base", 0.0, 3.0), ("odom", "base", 0.0, 4.5)
    )
    buffer.set("base", "laser", pose_at(0.1), 99 * S, static=True)
    assert buffer.lookup("map", "laser")[1] == 4 * S
    assert buffer.get_latest_common_time("map", "laser").nanoseconds == 4 * S
    assert buffer.get_latest_common_time("base", "laser").nanoseconds == 0
    assert buffer.get_latest_common_time("base", "base").nanoseconds == 4.5 * S
    buffer.set("laser", "mirror", pose_at(0.1), 0, static=False)
    assert buffer.get_latest_common_time("map", "mirror").nanoseconds == 4 * S
    assert buffer.get_latest_common_time("laser", "mirror").nanoseconds == 0
    assert x_of(buffer, "laser", "mirror") == 0.1


@pytest.mark.parametrize("name", ["", "/base"])
def test_a_name_that_tf2_takes_in_no_question_is_an_invalid_argument(name: str) -> None:
    buffer = moving(("odom", "base", 1.0, 1.0))
    for names in ((name, "odom"), ("odom", name)):
        with pytest.raises(InvalidArgumentException):
            buffer.lookup(*names)
    assert not buffer.can_transform(name, "odom", 0)


def test_a_frame_in_itself_needs_no_data() -> None:
    assert Buffer().lookup("x", "x", 7) == (Pose(), 7)
    assert Buffer().lookup("", "") == (Pose(), 0)
    assert moving(("a", "b", 1.0, 5.0)).lookup("b", "b") == (Pose(), 5 * S)
    with pytest.raises(LookupException):
        Buffer().lookup_transform_full("x", 1, "x", 2, "x")


def test_between_two_times_the_fixed_frame_stands_still() -> None:
    buffer = moving(*[("odom", "base", float(second), float(second)) for second in range(1, 6)])
    buffer.set("base", "laser", pose_at(0.5), 0, static=True)
    moved = buffer.lookup_transform_full("base", 5 * S, "laser", 2 * S, "odom")
    assert moved.transform.translation.x == pytest.approx(-2.5), "the robot has gone 3 m since"
    assert (moved.header.stamp.sec, moved.header.frame_id, moved.child_frame_id) == (
        5,
        "base",
        "laser",
    )
    newest = buffer.lookup_transform_full("base", 0, "laser", 2 * S, "odom")
    assert (newest.header.stamp.sec, newest.transform.translation.x) == (5, pytest.approx(-2.5))
    assert buffer.can_transform_full("base", 5 * S, "laser", 2 * S, "odom")
    answer, reason = buffer.can_transform_full(
        "base", 6 * S, "laser", 2 * S, "odom", return_debug_tuple=True
    )
    assert not answer
    assert "extrapolation into the future" in reason


def test_between_two_times_rotations_count_in_the_order_of_the_frames() -> None:
    buffer = Buffer()
    for second, yaw in ((1, 0.7), (2, math.pi / 2)):
        buffer.set(
            "odom",
            "base",
            Pose((2.0, 0.0, 0.0), quat_from_rpy(0, 0, yaw)),
            second * S,
            static=False,
        )
    buffer.set(
        "base", "laser", Pose((1.0, 0.0, 0.0), quat_from_rpy(0, math.pi / 2, 0)), 0, static=True
    )
    transform = buffer.lookup_transform_full("laser", 2 * S, "base", S, "odom").transform
    expected = buffer.lookup("laser", "odom", 2 * S)[0] @ buffer.lookup("odom", "base", S)[0]
    xyz = transform.translation.x, transform.translation.y, transform.translation.z
    assert xyz == pytest.approx(expected.xyz, abs=1e-12)
    rotated = (
        transform.rotation.x,
        transform.rotation.y,
        transform.rotation.z,
        transform.rotation.w,
    )
    assert angle_between(rotated, expected.quat_xyzw) < 1e-12
    reversed_pose = buffer.lookup("odom", "base", S)[0] @ buffer.lookup("laser", "odom", 2 * S)[0]
    assert angle_between(rotated, reversed_pose.quat_xyzw) > 0.5, (
        "in the other order it would be another rotation"
    )


def test_a_sample_that_comes_again_is_not_the_last_of_its_time() -> None:
    """tf2 keeps all samples of a time, and takes none twice."""
    buffer = moving(*(("odom", "base", x, 5.0) for x in (1.0, 2.0, 3.0, 2.0)))
    assert x_of(buffer, "odom", "base") == 3.0
    buffer.set("odom", "base", pose_at(4.0), 7 * S, static=False)
    assert x_of(buffer, "odom", "base", 5.0) == 1.0, "at the oldest time of all the first counts"
    assert x_of(buffer, "odom", "base", 6.0) == 3.5
    buffer.set("map", "base", pose_at(2.0), 7 * S, static=False)
    buffer.set("odom", "base", pose_at(4.0), 7 * S, static=False)
    assert x_of(buffer, "map", "base") == 2.0


def test_samples_that_came_at_an_expired_time_are_forgotten() -> None:
    buffer = moving(
        *(("odom", "base", x, 5.0) for x in (1.0, 2.0, 3.0)),
        *(("odom", "base", 0.0, s) for s in (20, 21)),
    )
    assert not buffer._caches["base"].repeated


def test_clear_forgets_what_moves_and_keeps_what_is_fixed_and_the_names() -> None:
    buffer = moving(("odom", "base", 1.0, 5.0))
    buffer.set("base", "laser", pose_at(0.1), 0, static=True)
    assert x_of(buffer, "odom", "laser") == 1.1
    buffer.clear()
    assert buffer.frames == {"odom", "base", "laser"}
    assert x_of(buffer, "base", "laser") == 0.1
    with pytest.raises(ConnectivityException, match=r"base .*cleared"):
        buffer.lookup("odom", "laser")
    with pytest.raises(ExtrapolationException, match="base "):
        buffer.lookup("odom", "laser", 5 * S)
    assert buffer.set("odom", "base", pose_at(2), 1 * S, static=False), (
        "after a jump back nothing is too old"
    )
    assert x_of(buffer, "odom", "base") == 2.0


def test_in_a_loop_a_parent_is_found_and_the_rest_raises_lookup_exception() -> None:
    buffer = Buffer()
    for parent, child in (("a", "b"), ("b", "c"), ("c", "a"), ("a", "tool")):
        buffer.set(parent, child, pose_at(1), 0, static=True)
    assert x_of(buffer, "a", "c") == 2.0
    for stamp in (0, S):
        with pytest.raises(LookupException, match="b → c → a → b"):
            buffer.lookup("tool", "b", stamp)


def test_a_chain_of_two_thousand_edges_is_no_loop() -> None:
    buffer = Buffer()
    for index in range(2000):
        buffer.set(f"f{index}", f"f{index + 1}", pose_at(1), 0, static=True)
    assert x_of(buffer, "f0", "f2000") == 2000.0


def test_messages_and_times_are_taken_by_what_they_have() -> None:
    class Duration:
        nanoseconds = 2 * S

    buffer = Buffer(cache_time=Duration())
    for sec in (1, 2, 3, 4, 5):
        stamped = TransformStamped(
            Header(Time(sec, 500 * MS), "/odom"),
            "base",
            Transform(Vector3(float(sec)), Quaternion()),
        )
        buffer.set_transform(stamped, "driver")
    buffer.set_transform(TransformStamped(Header(Time(1), "odom"), "base"), "driver")
    assert [each.samples for each in buffer.all_frames() if each.name == "base"] == [3], (
        "2 s are kept, no older one taken"
    )
    buffer.set_transform_static(TransformStamped(Header(Time(), "base"), "laser"), "urdf")
    result = buffer.lookup_transform("odom", "laser", Time(5, 0), timeout=Duration())
    assert (result.header.stamp.sec, result.header.stamp.nanosec, result.header.frame_id) == (
        5,
        0,
        "odom",
    )
    assert (result.transform.translation.x, result.child_frame_id) == (4.5, "laser")
    with pytest.raises(TypeError, match="is not a time"):
        buffer.lookup_transform("odom", "laser", "now")
    with pytest.raises(TypeError, match="is not a time"):
        buffer.lookup_transform("odom", "laser", 1.5)
    with pytest.raises(ValueError, match="cannot be kept"):
        Buffer(-1)


def test_a_time_far_from_the_epoch_keeps_its_nanoseconds() -> None:
    """A double has 53 bits: seconds since 1970 as a float would be off by 240 ns."""
    base = 1_795_244_326_447_640_343
    buffer = Buffer()
    for index in range(2):
        buffer.set("odom", "base", pose_at(float(index)), base + 4 * index, static=False)
    assert [buffer.lookup("odom", "base", base + ns)[0].xyz[0] for ns in range(5)] == [
        0,
        0.25,
        0.5,
        0.75,
        1,
    ]
    stamp = buffer.lookup_transform("odom", "base", 0).header.stamp
    assert (stamp.sec, stamp.nanosec) == (1_795_244_326, 447_640_347)


def test_all_frames_says_what_is_kept_of_each() -> None:
    buffer = moving(("odom", "base", 0.0, 1.0), ("odom", "base", 0.0, 3.0))
    buffer.set("base", "laser", pose_at(0.1), 9 * S, static=True, authority="urdf")
    base, odom, laser = buffer.all_frames()
    assert (base.name, base.parent, base.static, base.samples) == ("base", "odom", False, 2)
    assert (base.oldest_ns, base.newest_ns) == (S, 3 * S)
    assert (odom.name, odom.parent, odom.samples) == ("odom", "", 0)
    assert (laser.authority, laser.static, laser.oldest_ns, laser.newest_ns) == (
        "urdf",
        True,
        0,
        0,
    )
    assert (
        buffer.all_frames_as_string()
        == "Frame base exists with parent odom.\nFrame laser exists with parent base.\n"
    )
    assert "base: \n  parent: 'odom'\n" in buffer.all_frames_as_yaml()
    assert "  rate: 1.000\n" in buffer.all_frames_as_yaml()
    assert "  rate: 10000.000\n" in buffer.all_frames_as_yaml(), (
        "as view_frames shows a fixed edge"
    )
    assert Buffer().all_frames_as_yaml() == "[]"


def test_exceptions_have_tf2s_names_and_hierarchy() -> None:
    for kind in (
        LookupException,
        ConnectivityException,
        ExtrapolationException,
        InvalidArgumentException,
    ):
        assert issubclass(kind, TransformException)
    assert TransformException.__bases__ == (Exception,)
