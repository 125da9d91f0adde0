"""Claims of geometry2's own Python tests about the tf2 packages.

What their tests say of an exception's text is asserted of its begin; more follows here.
"""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import (
    PointStamped,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
    Vector3Stamped,
)
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2, PointField

from tests.support.waiting import until
from tfcompose.tf.tf2 import (
    Buffer,
    BufferCore,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformException,
    TransformListener,
)
from tfcompose.tf.tf2 import messages as tf2_geometry_msgs
from tfcompose.tf.tf2 import messages as tf2_sensor_msgs


def stamped(parent: str, child: str, seconds: float, x: float = 2.0) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, Time(seconds=seconds).to_msg()
    message.transform.translation.x = x
    return message


def core(*times: float, parent: str = "bar", child: str = "foo") -> BufferCore:
    buffer = BufferCore(Duration(seconds=10))
    for seconds in times:
        buffer.set_transform(stamped(parent, child, seconds), "unittest")
    return buffer


# tf2_py


def test_the_core_prints_its_frames() -> None:
    for text in (
        core(0).all_frames_as_yaml(),
        core(0).all_frames_as_string(),
        core(0)._allFramesAsDot(),
    ):
        assert "foo" in text
        assert "bar" in text
    assert (core(0)._frameExists("foo"), core(0)._frameExists("baz")) == (True, False)
    assert sorted(core(0)._getFrameStrings()) == ["bar", "foo"]


def test_set_transform_returns_nothing_and_a_fixed_one_holds_at_any_time() -> None:
    for seconds, expected in ((0.5, 0), (0, 1)):
        buffer = core()
        assert buffer.set_transform(stamped("bar", "foo", 0), "unittest") is None  # type: ignore[func-returns-value]
        assert (
            buffer.can_transform_core(
                target_frame="bar", source_frame="foo", time=Time(seconds=seconds)
            )[0]
            == expected
        )
    assert buffer.set_transform_static(stamped("bar", "foo", 0), "unittest") is None  # type: ignore[func-returns-value]
    assert buffer.can_transform_core("bar", "foo", Time(seconds=0.5)) == (1, "")


def test_the_core_says_whether_and_why_not() -> None:
    assert core(0, 1).can_transform_core("foo", "bar", Time(seconds=0.5)) == (1, "")
    for seconds, why in (
        (2.5, "extrapolation into the future"),
        (0.5, "extrapolation into the past"),
    ):
        possible, reason = core(1, 2).can_transform_core("foo", "bar", Time(seconds=seconds))
        assert not possible
        assert why in reason
    buffer = core(0)
    buffer.set_transform(stamped("foo", "baz", 0), "unittest")
    full: Any = {
        "target_frame": "foo",
        "target_time": Time(),
        "source_frame": "baz",
        "source_time": Time(),
    }
    assert buffer.can_transform_full_core(**full, fixed_frame="bar") == (1, "")
    assert (
        buffer.lookup_transform_full_core(**full, fixed_frame="bar").transform.translation.x == 2.0
    )


def test_the_latest_common_time_is_a_time_of_rclpy() -> None:
    assert core(0, 1, 0.5).get_latest_common_time("bar", "foo") == Time(seconds=1)
    assert core(0, 1).get_latest_common_time("foo", "foo") == Time(seconds=1)
    for frame in ("baz", "/bar"):
        with pytest.raises(TransformException):
            core(0).get_latest_common_time(frame, frame)


def test_clear_forgets_and_a_lookup_gives_back_what_was_set() -> None:
    buffer = core(0)
    assert buffer.lookup_transform_core("bar", "foo", Time()) == stamped("bar", "foo", 0)
    with pytest.raises(LookupException):
        buffer.lookup_transform_core("bar", "baz", Time())
    with pytest.raises(InvalidArgumentException):
        buffer.lookup_transform_core("/bar", "foo", Time())
    buffer.clear()
    assert not buffer.can_transform_core("foo", "bar", Time())[0]


def moving_at_3_m_s() -> BufferCore:
    buffer = BufferCore()
    for second in range(5):
        message = stamped("PARENT", "THISFRAME", 0, 3.0 * second)
        message.header.stamp = Time(seconds=second)  # tf2_py takes rclpy's, too
        buffer.set_transform(message, "unittest")
    return buffer


def test_a_velocity_around_the_epoch_begins_there() -> None:
    buffer = moving_at_3_m_s()
    query: Any = Time(seconds=0.0), Duration(seconds=4, nanoseconds=1_000_000)
    velocity = buffer.lookupVelocityCore("THISFRAME", "PARENT", *query)
    assert velocity[0] == pytest.approx((3.0, 0.0, 0.0))
    assert velocity == buffer.lookupVelocityFullCore(
        "THISFRAME", "PARENT", "PARENT", (0, 0, 0), "THISFRAME", *query
    )


@pytest.mark.parametrize(
    ("time", "interval"), [(0, 4), (2, 4), (1, 2), (1, 4), (0.5, 3), (0, 9), (4, 8)]
)
def test_a_velocity_over_an_interval_from_the_epoch_or_before_is_correct(
    time: float, interval: float
) -> None:
    """Time 0 is no time for an end of the interval: it would be the newest."""
    buffer, mean = moving_at_3_m_s(), Duration(seconds=interval)
    for velocity in (
        buffer.lookup_velocity("THISFRAME", "PARENT", Time(seconds=time), mean),
        buffer.lookupVelocityCore("THISFRAME", "PARENT", Time(seconds=time), mean),
    ):
        assert velocity.linear == pytest.approx((3.0, 0.0, 0.0))


def test_at_time_0_tf2s_velocity_is_that_of_the_epoch_and_ours_the_newest() -> None:
    buffer = BufferCore()
    for seconds, x in ((0, 0.0), (1, 1.0), (2, 5.0)):
        buffer.set_transform(stamped("a", "b", seconds, x), "unittest")
    assert buffer.lookupVelocityCore("b", "a", Time(), Duration(seconds=1)).linear[
        0
    ] == pytest.approx(1.0)
    assert buffer.lookup_velocity("b", "a", Time(), Duration(seconds=1)).linear[
        0
    ] == pytest.approx(4.0)


def test_the_chain_names_the_children_of_its_edges() -> None:
    buffer = core(1, 3)
    buffer.set_transform_static(stamped("foo", "tool", 0), "unittest")
    buffer.set_transform_static(stamped("bar", "lamp", 0), "unittest")
    first, two = Time(seconds=1), Time(seconds=2)
    assert buffer._chain("bar", first, "tool", first, "bar") == ["tool", "foo"]
    assert buffer._chain("tool", first, "bar", first, "tool") == ["foo", "tool"]
    assert buffer._chain("lamp", two, "tool", first, "bar") == ["tool", "foo", "lamp"]
    assert buffer._chain("tool", first, "tool", first, "tool") == []
    with pytest.raises(LookupException):
        buffer._chain("bar", first, "baz", first, "bar")


# tf2_ros


@pytest.mark.parametrize("cache_time", [None, Duration(seconds=10.0)])
def test_a_buffer_gives_what_was_set(cache_time: Any) -> None:
    buffer, now = Buffer(cache_time=cache_time), rclpy.clock.Clock().now()
    message = stamped("foo", "bar", 0)
    message.header.stamp = now.to_msg()
    assert buffer.set_transform(message, "unittest") is None  # type: ignore[func-returns-value]
    assert buffer.can_transform("foo", "bar", now)
    assert buffer.lookup_transform("foo", "bar", now) == message


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("later", [False, True])
def test_a_coroutine_ends_at_the_step_after_its_transform_came(*, full: bool, later: bool) -> None:
    buffer, now, message = Buffer(), Time(seconds=5), stamped("foo", "bar", 5)
    waits: Any = buffer.lookup_transform_full_async if full else buffer.lookup_transform_async
    coroutine = waits("foo", now, "bar", now, "foo") if full else waits("foo", "bar", now)
    if later:
        coroutine.send(None)
    buffer.set_transform(message, "unittest")
    with pytest.raises(StopIteration) as ended:
        coroutine.send(None)
    assert ended.value.value == message


@pytest.mark.ros
def test_what_broadcasters_send_a_listener_in_the_same_node_hears(node: Any) -> None:
    buffer = Buffer()
    moving, fixed = TransformBroadcaster(node), StaticTransformBroadcaster(node)
    listener = TransformListener(buffer=buffer, node=node, spin_thread=False)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def heard(parent: str, child: str) -> bool:
        executor.spin_once(timeout_sec=0.05)
        return bool(buffer.can_transform(parent, child, Time()))

    for seconds in (0.3, 0.2):
        moving.sendTransform(stamped("foo", "bar", seconds))
    moving.sendTransform([stamped("foo", "arm", 1), stamped("arm", "hand", 1)])
    assert until(lambda: heard("foo", "bar") and heard("foo", "hand"))
    assert until(
        lambda: heard("bar", "foo") and buffer.can_transform("foo", "bar", Time(seconds=0.2))
    )
    assert buffer.lookup_transform("foo", "bar", time=Time(seconds=0.3).to_msg()) == stamped(
        "foo", "bar", 0.3
    )
    for seconds in (0.1, 0.4):
        with pytest.raises(ExtrapolationException):
            buffer.lookup_transform("foo", "bar", Time(seconds=seconds).to_msg())

    fixed.sendTransform(stamped("foo", "lamp", 1.1))
    fixed.sendTransform(item for item in [stamped("foo", "sign", 1.1)])
    assert until(lambda: heard("lamp", "sign"))
    result = buffer.lookup_transform("foo", "lamp", Time(seconds=1.5).to_msg())
    assert (result.header.stamp, result.transform) == (
        Time(seconds=1.5).to_msg(),
        stamped("foo", "lamp", 0).transform,
    )
    listener.close()
    executor.shutdown()


@pytest.mark.ros
def test_a_late_listener_gets_all_fixed_transforms_and_the_first_per_frame(
    node: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    """As in tf2_ros's Python; C++ takes the last."""
    fixed = StaticTransformBroadcaster(node)
    fixed.sendTransform(stamped("base", "laser", 0, 1.0))
    fixed.sendTransform([stamped("base", "camera", 0, 2.0), stamped("base", "laser", 5, 1.0)])
    assert "laser" not in capfd.readouterr().err, (
        "the same again, with another stamp, is no second value"
    )
    fixed.sendTransform(stamped("base", "laser", 0, 9.0))
    assert "base → laser stays" in capfd.readouterr().err
    buffer = Buffer()
    with TransformListener(buffer):
        assert until(lambda: bool(buffer.can_transform("camera", "laser", Time())))
    assert buffer.lookup_transform("base", "laser", Time()).transform.translation.x == 1.0
    assert buffer.lookup_transform("base", "camera", Time()).transform.translation.x == 2.0


@pytest.mark.ros
@pytest.mark.parametrize("kind", [TransformBroadcaster, StaticTransformBroadcaster])
def test_a_broadcasters_depth_is_the_callers_and_the_rest_is_tf2s(node: Any, kind: Any) -> None:
    kind(node, 7)
    topic = "/tf_static" if kind is StaticTransformBroadcaster else "/tf"
    assert until(lambda: len(node.get_publishers_info_by_topic(topic)) == 1)
    info = node.get_publishers_info_by_topic(topic)[0]
    assert info.topic_type == "tf2_msgs/msg/TFMessage"
    assert info.qos_profile.durability.name == (
        "TRANSIENT_LOCAL" if "static" in topic else "VOLATILE"
    )
    assert info.qos_profile.reliability.name == "RELIABLE"


# tf2_geometry_msgs


def half_way_round() -> Buffer:
    buffer, message = Buffer(), stamped("a", "b", 2, 1.0)
    message.transform.rotation = Quaternion(w=0.0, x=1.0, y=0.0, z=0.0)
    buffer.set_transform(message, "unittest")
    return buffer


def headed(message: Any) -> Any:
    message.header.stamp, message.header.frame_id = Time(seconds=2).to_msg(), "a"
    return message


def test_points_and_poses_are_taken_to_another_frame() -> None:
    buffer = half_way_round()
    stamped = buffer.lookup_transform("a", "b", Time(seconds=2).to_msg(), Duration(seconds=2))
    assert (stamped.transform.translation.x, stamped.transform.rotation.x) == (1, 1)
    point = headed(PointStamped())
    point.point.x, point.point.y, point.point.z = 1.0, 2.0, 3.0
    moved = buffer.transform(point, "b", new_type=PointStamped).point
    assert (moved.x, moved.y, moved.z) == (0, -2, -3)
    pose = headed(PoseStamped())
    pose.pose.position = point.point
    pose.pose.orientation = Quaternion(w=0.0, x=1.0, y=0.0, z=0.0)
    position = buffer.transform(pose, "b").pose.position
    assert (position.x, position.y, position.z) == (0, -2, -3)


def test_a_covariance_is_turned_and_a_vector_is_not_moved() -> None:
    half = TransformStamped()
    half.transform.translation = Vector3(x=1.0, y=2.0, z=3.0)
    half.transform.rotation = Quaternion(w=0.0, x=1.0, y=0.0, z=0.0)
    pose = headed(PoseWithCovarianceStamped())
    pose.pose.covariance = np.tile(np.arange(1.0, 7.0), 6)
    pose.pose.pose.position.x, pose.pose.pose.position.y, pose.pose.pose.position.z = 1.0, 2.0, 3.0
    pose.pose.pose.orientation = half.transform.rotation
    moved = tf2_geometry_msgs.do_transform_pose_with_covariance_stamped(pose, half)
    position, rotation = moved.pose.pose.position, moved.pose.pose.orientation
    assert (
        position.x,
        position.y,
        position.z,
        rotation.x,
        rotation.y,
        rotation.z,
        rotation.w,
    ) == (
        2,
        0,
        0,
        0,
        0,
        0,
        1,
    )
    signs = np.array([1, -1, -1, 1, -1, -1])
    assert (
        moved.pose.covariance.reshape(6, 6).tolist()
        == (np.outer(signs, signs) * np.arange(1.0, 7.0)).tolist()
    )

    vector = Vector3Stamped(vector=Vector3(x=1.0))
    for rotation, x in ((Quaternion(), 1), (Quaternion(w=0.0, y=1.0), -1)):
        half.transform.rotation = rotation
        assert tf2_geometry_msgs.do_transform_vector3(vector, half).vector == Vector3(x=float(x))


def test_a_stamp_may_be_rclpys_time_wherever_it_stands() -> None:
    buffer, point = half_way_round(), headed(PointStamped())
    point.header.stamp = Time(seconds=2)
    moved = buffer.transform(point, "b")
    assert (moved.point.x, moved.header.stamp) == (-1.0, Time(seconds=2))
    message = stamped("a", "b", 0)
    message.header.stamp = Time(seconds=2)
    assert (
        tf2_geometry_msgs.do_transform_point(headed(PointStamped()), message).header.stamp
        == Time(seconds=2).to_msg()
    )


def test_a_quaternion_of_zeros_in_a_transform_is_no_rotation() -> None:
    message = stamped("a", "b", 0)
    message.transform.rotation = Quaternion(w=0.0)
    assert tf2_geometry_msgs.do_transform_point(headed(PointStamped()), message).point.x == 2.0


# tf2_sensor_msgs

POINTS = np.array([[1, 2, 0], [10, 20, 30]], np.float32)


def cloud(points: Any, names: str) -> PointCloud2:
    fields = [
        PointField(name=name, offset=4 * i, datatype=7, count=1) for i, name in enumerate(names)
    ]
    made = PointCloud2(
        height=1, width=len(points), fields=fields, point_step=4 * len(names), is_dense=True
    )
    made.row_step, made.data = made.point_step * made.width, points.astype(np.float32).tobytes()
    made.header.frame_id = "test"
    return made


def points_of(message: PointCloud2) -> Any:
    return np.frombuffer(message.data, np.float32).reshape(message.width, -1)


def test_points_are_moved_by_a_transform_alone() -> None:
    up_and_round = Transform(translation=Vector3(z=100.0), rotation=Quaternion(x=1.0, w=0.0))
    expected = [[1, -2, 100], [10, -20, 70]]
    assert np.allclose(tf2_sensor_msgs.transform_points(POINTS, up_and_round), expected)
    assert np.allclose(
        tf2_sensor_msgs.transform_points(POINTS, TransformStamped(transform=up_and_round)),
        expected,
    )
    assert np.allclose(
        points_of(tf2_sensor_msgs.do_transform_cloud(cloud(POINTS, "xyz"), up_and_round)), expected
    )


def test_a_cloud_is_moved_by_the_buffer_and_its_other_fields_stay() -> None:
    buffer, message = Buffer(), TransformStamped(child_frame_id="base_footprint")
    message.header.frame_id, message.transform.translation.z = "test", 100.0
    buffer.set_transform_static(message, "unittest")
    extended = cloud(np.hstack([POINTS, [[9], [9]]]), "xyza")
    before = bytes(extended.data)
    moved = buffer.transform(extended, "base_footprint")
    assert moved.header.frame_id == "base_footprint"
    assert np.allclose(points_of(moved), np.hstack([POINTS - (0, 0, 100), [[9], [9]]]))
    assert bytes(extended.data) == before


@pytest.mark.parametrize(
    ("target", "source", "second", "text"),
    [
        ("odom", "lasr", 1, '"lasr" passed to lookupTransform argument source_frame does not'),
        ("lasr", "odom", 1, '"lasr" passed to lookupTransform argument target_frame does not'),
        (
            "",
            "base",
            1,
            'Invalid argument "" passed to lookupTransform argument target_frame - in',
        ),
        ("odom", "/base", 1, 'Invalid argument "/base" passed to lookupTransform argument source'),
        ("odom", "table", 2, "Could not find a connection between 'odom' and 'table' because"),
        ("a", "loop", 1, "The tf tree is invalid because it contains a loop"),
        (
            "odom",
            "base",
            4,
            "Lookup would require extrapolation into the future.  Requested time 4.000000 but ",
        ),
        (
            "odom",
            "base",
            1,
            "Lookup would require extrapolation into the past.  Requested time 1.000000 but the",
        ),
        (
            "world",
            "table",
            1,
            "Lookup would require extrapolation at time 1.000000, but only time 2.000000 is in",
        ),
    ],
)
def test_an_exception_begins_with_the_words_of_tf2(
    target: str, source: str, second: int, text: str
) -> None:
    buffer = BufferCore()
    for parent, child, seconds in (
        ("odom", "base", (2, 3)),
        ("world", "table", (2,)),
        ("b", "loop", (1, 2)),
        ("loop", "b", (1, 2)),
        ("c", "a", (1, 2)),
    ):
        for sample_s in seconds:
            sample = TransformStamped(child_frame_id=child)
            sample.header.frame_id = parent
            sample.header.stamp.sec = sample_s
            sample.transform.rotation.w = 1.0
            buffer.set_transform(sample, "test")
    with pytest.raises(TransformException) as caught:
        buffer.lookup_transform_core(target, source, Time(seconds=second))
    assert str(caught.value).startswith(text)
    assert caught.value.detail
    assert buffer.can_transform_core(target, source, Time(seconds=second)) == (
        False,
        str(caught.value),
    )


@pytest.mark.parametrize(
    "program",
    [
        "import rclpy; from tfcompose.tf.tf2 import BufferCore; rclpy.time.Time()",
        "from tfcompose.tf.tf2 import BufferCore; import rclpy; BufferCore(); rclpy.time.Time()",
        "import rclpy; from tfcompose.tf.tf2 import Buffer; rclpy.duration.Duration(seconds=1)",
    ],
)
def test_rclpy_alone_has_its_times_as_with_tf2_ros(program: str) -> None:
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
