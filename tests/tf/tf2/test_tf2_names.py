"""Every name of tf2_ros's and tf2_py's buffer exists and behaves as theirs, without ROS."""

import asyncio
import inspect
import pickle
import sys
import threading
from dataclasses import dataclass
from timeit import repeat
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.tf import tf2
from tfcompose.tf.tf2 import (
    Buffer,
    BufferInterface,
    ConvertRegistration,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    NotImplementedException,
    Stamped,
    TransformListener,
    TransformRegistration,
    TypeException,
    convert,
)
from tfcompose.tf.tf2.messages import Header, Time, Vector3

S = 1_000_000_000


@pytest.fixture(autouse=True)
def _without_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have nothing of ROS loaded, whatever ran before in this process."""
    for name in ("rclpy.task", "rclpy.time", "std_msgs.msg", "geometry_msgs.msg"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(tf2.messages, "_makers", {})


# As geometry2 for Jazzy has them; of keyword-only arguments the names, since their order does not
# matter.
METHODS = {
    "set_transform": "transform authority",
    "set_transform_static": "transform authority",
    "time_jump_callback": "time_jump",
    "lookup_transform": "target_frame source_frame time timeout",
    "lookup_transform_core": "target_frame source_frame time",
    "lookup_transform_async": "target_frame source_frame time",
    "lookup_transform_full": (
        "target_frame target_time source_frame source_time fixed_frame timeout"
    ),
    "lookup_transform_full_core": "target_frame target_time source_frame source_time fixed_frame",
    "lookup_transform_full_async": "target_frame target_time source_frame source_time fixed_frame",
    "can_transform": "target_frame source_frame time timeout return_debug_tuple",
    "can_transform_core": "target_frame source_frame time",
    "can_transform_full": (
        "target_frame target_time source_frame source_time fixed_frame timeout return_debug_tuple"
    ),
    "can_transform_full_core": "target_frame target_time source_frame source_time fixed_frame",
    "wait_for_transform_async": "target_frame source_frame time",
    "wait_for_transform_full_async": (
        "target_frame target_time source_frame source_time fixed_frame"
    ),
    "transform": "object_stamped target_frame timeout new_type",
    "transform_full": "object_stamped target_frame target_time fixed_frame timeout new_type",
    "lookupVelocityCore": "tracking_frame observation_frame time averaging_interval",
    "lookupVelocityFullCore": (
        "tracking_frame observation_frame reference_frame reference_point reference_point_frame"
        " time averaging_interval"
    ),
    "get_latest_common_time": "target_frame source_frame",
    "all_frames_as_yaml": "",
    "all_frames_as_string": "",
    "clear": "",
    "_chain": "target_frame target_time source_frame source_time fixed_frame",
    "_frameExists": "frame_id",
    "_getFrameStrings": "",
    "_allFramesAsDot": "time",
}


#: What tf2_py's BufferCore has.
OF_THE_CORE = [
    "set_transform",
    "set_transform_static",
    "lookup_transform_core",
    "lookup_transform_full_core",
    "can_transform_core",
    "can_transform_full_core",
    "lookupVelocityCore",
    "lookupVelocityFullCore",
    "get_latest_common_time",
    "all_frames_as_yaml",
    "all_frames_as_string",
    "clear",
    "_chain",
    "_frameExists",
    "_getFrameStrings",
    "_allFramesAsDot",
]


@pytest.mark.parametrize("name", OF_THE_CORE)
def test_the_core_has_tf2_pys_methods(name: str) -> None:
    assert (
        list(inspect.signature(getattr(tf2.BufferCore(), name)).parameters)
        == METHODS[name].split()
    )


#: What a client of a buffer server has.
OF_THE_CLIENT = ["transform", "transform_full", "lookup_transform", "lookup_transform_full"]
OF_THE_CLIENT += ["can_transform", "can_transform_full"]


@pytest.mark.parametrize("name", OF_THE_CLIENT)
def test_the_client_has_the_buffers_lookups(name: str) -> None:
    named = list(inspect.signature(getattr(tf2.BufferClient, name)).parameters)[1:]
    assert named == [word for word in METHODS[name].split() if word != "return_debug_tuple"]


@pytest.mark.parametrize("name", METHODS)
def test_a_method_takes_tf2s_arguments_in_tf2s_order(name: str) -> None:
    assert list(inspect.signature(getattr(Buffer(), name)).parameters) == METHODS[name].split()


def test_the_buffer_and_the_listener_are_made_as_tf2s_are() -> None:
    assert list(inspect.signature(Buffer).parameters)[:2] == ["cache_time", "node"]
    parameters = inspect.signature(TransformListener).parameters
    assert list(parameters)[:2] == ["buffer", "node"]
    named = {
        name for name, each in parameters.items() if each.kind is inspect.Parameter.KEYWORD_ONLY
    }
    assert named >= {
        "spin_thread",
        "qos",
        "static_qos",
        "tf_topic",
        "tf_static_topic",
        "static_only",
    }


def test_what_is_exported_has_the_names_of_tf2_ros() -> None:
    expected = (
        "Buffer BufferClient BufferCore BufferInterface StaticTransformBroadcaster"
        " TransformBroadcaster TransformListener TransformRegistration ConvertRegistration Stamped"
        " convert"
    )
    expected += (
        " TypeException NotImplementedException TransformException ConnectivityException"
        " LookupException"
    )
    expected += " ExtrapolationException InvalidArgumentException TimeoutException"
    assert set(expected.split()) <= set(tf2.__all__)


def rover() -> Buffer:
    buffer = Buffer()
    for second in (1, 3):
        buffer.set("odom", "base", Pose((float(second), 0.0, 0.0)), second * S, static=False)
    buffer.set("base", "laser", Pose((0.0, 0.0, 0.5)), 0, static=True)
    return buffer


def test_the_core_calls_answer_as_the_others_do() -> None:
    buffer = rover()
    assert buffer.lookup_transform_core("odom", "laser", Time(2)) == buffer.lookup_transform(
        "odom", "laser", Time(2)
    )
    full = "base", Time(1), "laser", Time(3), "odom"
    assert buffer.lookup_transform_full_core(*full).transform.translation.x == 2.0
    assert buffer.can_transform_core("odom", "laser", Time(2)) == (True, "")
    assert buffer.can_transform_full_core(*full) == (True, "")
    possible, why = buffer.can_transform_core("odom", "laser", Time(4))
    assert not possible
    assert "odom → base" in why
    assert not buffer.can_transform_full_core("base", Time(1), "laser", Time(9), "odom")[0]
    assert (buffer._frameExists("laser"), buffer._frameExists("lidar")) == (True, False)
    assert buffer._getFrameStrings() == ["base", "odom", "laser"]
    dot = buffer._allFramesAsDot()
    assert dot.startswith("digraph G {\n")
    assert '"odom" -> "base"[label="' in dot
    assert dot.endswith("}")


def test_a_future_is_done_once_the_transform_is_available() -> None:
    buffer = rover()
    assert (
        buffer.wait_for_transform_async("odom", "laser", Time(2)).result(0).transform.translation.x
        == 2.0
    )
    later = buffer.wait_for_transform_async("odom", "laser", Time(4))
    full = buffer.wait_for_transform_full_async("base", Time(3), "laser", Time(5), "odom")
    buffer.set("map", "odom", Pose(), S, static=False)
    assert not later.done()
    buffer.set("odom", "base", Pose((5.0, 0.0, 0.0)), 5 * S, static=False)
    assert later.result(0).transform.translation.x == 4.0
    assert full.result(0).transform.translation.x == 2.0
    assert not buffer.on_insert, "nothing is waited for any longer"


def test_a_cancelled_future_is_forgotten_and_an_invalid_name_ends_it() -> None:
    buffer = rover()
    assert buffer.wait_for_transform_async("odom", "arm", Time()).cancel()
    assert not buffer.on_insert
    with pytest.raises(InvalidArgumentException, match="cannot start with a '/'"):
        buffer.wait_for_transform_async("/odom", "arm", Time()).result(0)


def test_a_coroutine_waits_and_the_loop_goes_on_meanwhile() -> None:
    buffer = rover()

    async def both() -> tuple[Any, Any]:
        timer = threading.Timer(
            0.1, lambda: buffer.set("odom", "base", Pose((5.0, 0, 0)), 5 * S, static=False)
        )
        timer.start()
        simple = buffer.lookup_transform_async("odom", "laser", Time(4))
        full = buffer.lookup_transform_full_async("base", Time(3), "laser", Time(5), "odom")
        answers = await asyncio.wait_for(asyncio.gather(simple, full), 60)
        timer.join()
        return answers[0], answers[1]

    simple, full = asyncio.run(both())
    assert (simple.transform.translation.x, full.transform.translation.x) == (4.0, 2.0)


def test_many_futures_are_done_by_many_threads_each_once() -> None:
    buffer = rover()
    requested = [
        buffer.wait_for_transform_async("odom", "laser", 3 * S + index) for index in range(1, 201)
    ]
    threads = [
        threading.Thread(
            target=lambda start: [
                buffer.set("odom", "base", Pose(), 3 * S + index, static=False)
                for index in range(start, 201, 4)
            ],
            args=(start,),
        )
        for start in (1, 2, 3, 4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(future.done() and future.exception() is None for future in requested)
    assert not buffer.on_insert


@dataclass
class Reading:
    """A type of somebody's own."""

    header: Header
    range_m: float


@dataclass
class PointStamped:
    header: Header
    point: Vector3


def moved_reading(reading: Reading, transform: Any) -> Reading:
    return Reading(transform.header, reading.range_m + transform.transform.translation.x)


def test_registered_types_of_users_are_transformed_and_converted() -> None:
    buffer = rover()
    with pytest.raises(TypeException, match=r"Reading\b.*\bPointStamped"):
        buffer.transform(Reading(Header(Time(2), "base"), 1.0), "odom")
    TransformRegistration().add(Reading, moved_reading)
    try:
        assert buffer.registration.get(Reading) is moved_reading
        moved = buffer.transform(Reading(Header(Time(2), "base"), 1.0), "odom")
        assert (moved.range_m, moved.header.frame_id) == (3.0, "odom")
        full = buffer.transform_full(
            Reading(Header(Time(3), "base"), 1.0), "base", Time(1), "odom"
        )
        assert full.range_m == 3.0
        with pytest.raises(TypeException, match="Reading"):
            buffer.transform(Reading(Header(Time(2), "base"), 1.0), "odom", new_type=PointStamped)
        registry = ConvertRegistration()
        registry.add_to_msg(
            Reading, lambda reading: PointStamped(reading.header, Vector3(reading.range_m))
        )
        point = buffer.transform(
            Reading(Header(Time(2), "base"), 1.0), "odom", new_type=PointStamped
        )
        assert (type(point), point.point.x, point.header.frame_id) == (PointStamped, 3.0, "odom")
        registry.add_convert((PointStamped, float), lambda point: point.point.x)
        assert (
            buffer.transform(
                PointStamped(Header(Time(2), "base"), Vector3()), "odom", new_type=float
            )
            == 2.0
        )
    finally:
        TransformRegistration._moves.clear()
        ConvertRegistration._to_msg.clear()
        ConvertRegistration._direct.clear()
    assert convert(point, PointStamped) == point
    assert convert(point, PointStamped) is not point
    with pytest.raises(TypeException, match=r"PointStamped .*Vector3Stamped"):
        convert(point, type("Vector3Stamped", (), {}))
    assert Stamped(point, Time(7), "map").header == Header(Time(7), "map")


def test_a_buffer_of_ones_own_moves_objects_with_its_own_lookup() -> None:
    class Fixed(BufferInterface):
        def lookup_transform(
            self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0
        ) -> Any:
            return rover().lookup_transform(target_frame, source_frame, time, timeout)

    moved = Fixed().transform(PointStamped(Header(Time(2), "base"), Vector3()), "odom")
    assert moved.point.x == 2.0
    with pytest.raises(NotImplementedException):
        BufferInterface().lookup_transform("odom", "base", Time())
    with pytest.raises(NotImplementedException):
        Fixed().can_transform("odom", "base", Time())


def circling(radius: float, rate: float, seconds: float = 9.0, step_ns: int = 1_000_000) -> Buffer:
    """A base that goes round odom's origin, to the left of where it looks."""
    buffer = Buffer()
    for stamp_ns in range(S, round((1 + seconds) * S), step_ns):
        angle = rate * stamp_ns / 1e9
        pose = Pose(
            (radius * np.cos(angle), radius * np.sin(angle), 0.0),
            quat_from_rpy(0, 0, angle + np.pi / 2),
        )
        buffer.set("odom", "base", pose, stamp_ns, static=False)
    buffer.set("map", "odom", Pose((5.0, 0, 0), quat_from_rpy(0, 0, 1.0)), 0, static=True)
    buffer.set("base", "laser", Pose((0.5, 0, 0), quat_from_rpy(0, 0, 2.0)), 0, static=True)
    return buffer


def test_the_velocity_of_what_goes_in_a_circle_is_that_of_the_book() -> None:
    buffer = circling(2.0, 0.5, seconds=3.0)
    at_ns, mean_ns = 2 * S, 10_000_000
    angle = 0.5 * 2.0
    linear, angular = buffer.lookup_velocity("base", "odom", at_ns, mean_ns)
    assert linear == pytest.approx((-np.sin(angle), np.cos(angle), 0.0), abs=1e-5)
    assert angular == pytest.approx((0.0, 0.0, 0.5), abs=1e-9)
    own_axes = buffer.lookup_velocity("base", "odom", at_ns, mean_ns, "base")
    assert own_axes.linear == pytest.approx((1.0, 0.0, 0.0), abs=1e-5), "it drives forward"
    other_axes = buffer.lookup_velocity("base", "odom", at_ns, mean_ns, "map")
    assert other_axes.linear == pytest.approx(
        tuple(Rotation.from_euler("z", 1.0).apply(linear)), abs=1e-9
    )
    ahead = buffer.lookupVelocityFullCore(
        "base", "odom", "base", (0.5, 0.0, 0.0), "base", at_ns, mean_ns
    )
    assert ahead.linear == pytest.approx((1.0, 0.25, 0.0), abs=1e-5)
    assert buffer.lookupVelocityFullCore(
        "base", "odom", "base", (0, 0, 0), "laser", at_ns, mean_ns
    ).linear == (pytest.approx(ahead.linear)), "a point is a point, whatever frame it is given in"
    laser = buffer.lookup_velocity("laser", "odom", at_ns, mean_ns, "base")
    assert laser.linear == pytest.approx((1.0, 0.25, 0.0), abs=1e-5)
    back = buffer.lookup_velocity("odom", "base", at_ns, mean_ns, "odom")
    assert back.angular == pytest.approx((0.0, 0.0, -0.5), abs=1e-9)


def test_the_velocity_of_a_rotating_point_is_the_cross_product() -> None:
    omega, drift, arm = (
        np.array([0.3, -0.7, 0.4]),
        np.array([0.5, 0.2, -0.1]),
        np.array([0.3, -0.2, 0.5]),
    )
    buffer = Buffer()
    for stamp_ns in range(S, 2 * S + 1, 10_000_000):
        seconds = stamp_ns / 1e9
        x, y, z, w = Rotation.from_rotvec(omega * seconds).as_quat().tolist()
        place = (drift * seconds).tolist()
        buffer.set(
            "odom",
            "base",
            Pose((place[0], place[1], place[2]), (x, y, z, w)),
            stamp_ns,
            static=False,
        )
    linear, angular = buffer.lookup_velocity(
        "base", "odom", 1_500_000_000, 10_000_000, "odom", arm.tolist(), "base"
    )
    assert angular == pytest.approx(tuple(omega), abs=1e-6)
    moved = drift + np.cross(omega, Rotation.from_rotvec(1.5 * omega).apply(arm))
    assert linear == pytest.approx(tuple(moved), abs=1e-6)


def test_tools_print_how_long_and_how_new_what_is_kept_is() -> None:
    buffer = rover()
    buffer.set("odom", "base", Pose(), 4 * S, static=False, authority="ekf")
    yaml = buffer.all_frames_as_yaml()
    for line in (
        "most_recent_transform: 4.000000",
        "oldest_transform: 1.000000",
        "buffer_length: 3.000",
        "rate: 1.000",
    ):
        assert f"  {line}\n" in yaml
    assert "  broadcaster: 'ekf'\n" in yaml
    dot = buffer._allFramesAsDot()
    for part in (
        "Average rate: 1.000 Hz",
        "Most recent transform: 4.000000",
        "Buffer length: 3.000 sec",
        "Broadcaster: ekf",
    ):
        assert part in dot


def test_a_velocity_is_a_mean_around_the_time_and_up_to_the_newest_one() -> None:
    buffer = Buffer()
    for second, x in ((1, 0.0), (2, 1.0), (3, 3.0), (4, 3.0)):
        buffer.set("odom", "base", Pose((x, 0.0, 0.0)), second * S, static=False)
    assert buffer.lookupVelocityCore("base", "odom", 2 * S, S).linear == (1.5, 0.0, 0.0)
    assert buffer.lookup_velocity("base", "odom", 0, 2 * S).linear == (1.0, 0.0, 0.0)
    assert buffer.lookup_velocity("base", "odom", 4 * S, S).linear == (
        0.0,
        0.0,
        0.0,
    ), "as far as samples go"
    with pytest.raises(ExtrapolationException):
        buffer.lookup_velocity("base", "odom", S, S)
    with pytest.raises(LookupException):
        buffer.lookup_velocity("bas", "odom", S, S)
    with pytest.raises(ValueError, match="mean"):
        buffer.lookup_velocity("base", "odom", S, 0)
    buffer.set("base", "laser", Pose(), 0, static=True)
    assert buffer.lookup_velocity("laser", "base", 0, S) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_half_a_rotation_within_the_interval_goes_the_short_way() -> None:
    buffer = Buffer()
    for second, yaw in ((1, 3.0), (2, -3.0)):
        buffer.set(
            "odom", "base", Pose((0, 0, 0), quat_from_rpy(0, 0, yaw)), second * S, static=False
        )
    _, angular = buffer.lookup_velocity("base", "odom", 0, S)
    assert angular == pytest.approx((0, 0, 2 * np.pi - 6.0))


def test_waiting_for_an_absent_frame_costs_little_in_a_tree_of_thousands() -> None:
    """The nearest name is looked for when somebody reads the message, and not at every attempt."""
    buffer = Buffer()
    for index in range(2000):
        buffer.set("base", f"link_{index}_frame", Pose(), 0, static=True)

    def attempt() -> None:
        with pytest.raises(LookupException):
            buffer.lookup_transform("base", "link_7_fram", 0)

    def read() -> None:
        assert (
            "link_7_frame?"
            in buffer.can_transform("base", "link_7_fram", 0, return_debug_tuple=True)[1]
        )

    assert 20 * min(repeat(attempt, number=10, repeat=3)) < min(repeat(read, number=10, repeat=3))
    with pytest.raises(LookupException) as raised:
        buffer.lookup("base", "link_7_fram")
    error = pickle.loads(pickle.dumps(raised.value))  # noqa: S301 (our own)
    assert (str(error), repr(error)) == (
        str(raised.value),
        f"LookupException({str(raised.value)!r})",
    )
    assert "link_7_frame?" in str(error)
