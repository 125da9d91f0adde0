"""A listener in a node that is none: what it subscribes to, drops and forgets."""

import sys
import threading
import time
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rclpy.clock import ROSClock
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from rclpy.time import Time

from tests.support import processes
from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.tf2 import Buffer, LookupException, TransformException, TransformListener

S = 1_000_000_000


class StandInNode:
    """Keeps its subscriptions' callbacks and profiles by their topics, and what it logs."""

    def __init__(self) -> None:
        self.callbacks: dict[str, Any] = {}
        self.profiles: dict[str, Any] = {}
        self.logged: list[str] = []
        self.clock: Any = ROSClock()

    def create_subscription(
        self, _: Any, name: str, callback: Any, profile: Any, *, callback_group: Any, raw: bool
    ) -> str:
        assert callback_group
        assert raw
        self.callbacks[name], self.profiles[name] = callback, profile
        return name

    def destroy_subscription(self, name: str) -> None:
        del self.callbacks[name]

    def get_clock(self) -> Any:
        return self.clock

    def get_logger(self) -> Any:
        return SimpleNamespace(warning=self.logged.append)

    def set_time(self, seconds: float) -> None:
        """Set its clock, as /clock does where its parameter use_sim_time is set."""
        self.clock._set_ros_time_is_active(True)  # noqa: FBT003 (rclpy's)
        self.clock.set_ros_time_override(Time(seconds=seconds, clock_type=self.clock.clock_type))


@pytest.fixture
def node() -> StandInNode:
    return StandInNode()


def encoded(x: float, stamp_ns: int, parent: str = "odom", child: str = "base_link") -> bytes:
    return encode([SentTransform(stamp_ns, parent, child, (x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])


def of(node: StandInNode, name: str) -> tuple[str, str, int]:
    profile = node.profiles[name]
    return profile.reliability.name, profile.durability.name, profile.depth


def test_the_subscriptions_are_those_of_tf2_and_end_with_the_listener(node: StandInNode) -> None:
    with TransformListener(Buffer(), node):
        assert of(node, "/tf") == ("RELIABLE", "VOLATILE", 100)
        assert of(node, "/tf_static") == ("RELIABLE", "TRANSIENT_LOCAL", 100)
    assert node.callbacks == {}


def test_profiles_and_depths_are_those_that_were_requested(node: StandInNode) -> None:
    requested = cast("Any", QoSProfile)(depth=7, reliability=2)
    TransformListener(Buffer(), node, qos=requested, static_qos=5)
    assert of(node, "/tf") == ("BEST_EFFORT", "VOLATILE", 7)
    assert of(node, "/tf_static") == ("RELIABLE", "TRANSIENT_LOCAL", 5), "still latched"


def test_a_listener_to_fixed_edges_alone_has_one_subscription(node: StandInNode) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node, static_only=True)
    assert node.callbacks.keys() == {"/tf_static"}
    node.callbacks["/tf_static"](encoded(0.5, 0, "base_link", "laser"))
    stamped = listener.buffer.lookup_transform("base_link", "laser", 0)
    assert stamped.transform.translation.x == 0.5


def test_malformed_messages_and_refused_transforms_are_reported_once(node: StandInNode) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    bad = [
        b"\0\1\0\0\xff\xff\xff\xff",
        encoded(0, S, "base_link", "base_link"),
        encoded(float("nan"), S),
    ]
    for data in (*bad, *bad, encoded(1.0, S)):
        node.callbacks["/tf"](data)
    assert listener.buffer.lookup_transform("odom", "base_link", 0).transform.translation.x == 1.0
    logged = "\n".join(node.logged)
    assert logged.count("no TFMessage") == 1
    assert logged.count("TF_SELF_TRANSFORM: ") == 1
    assert logged.count("TF_NAN_INPUT") == 1


@pytest.mark.parametrize("both", [False, True])
def test_when_the_clock_goes_back_moving_edges_are_forgotten_once(
    node: StandInNode, *, both: bool
) -> None:
    """Programs of tf2_ros name the node to the buffer, to the listener, or to both."""
    node.set_time(100)
    buffer = Buffer(node=node) if both else Buffer()
    listener = TransformListener(buffer, node)
    node.callbacks["/tf"](encoded(1.0, 100 * S))
    node.callbacks["/tf_static"](encoded(0.5, 0, "base_link", "laser"))
    node.set_time(101)
    assert buffer.can_transform("odom", "laser", Time())
    node.set_time(5)
    assert not buffer.can_transform("odom", "laser", Time())
    assert buffer.can_transform("base_link", "laser", Time())
    assert [line.split(":")[0] for line in node.logged] == ["time went back by 96.000 s"]
    node.callbacks["/tf"](encoded(1.0, 5 * S))
    assert buffer.can_transform("odom", "base_link", Time()), "what comes now is not too old"
    listener.close()


def test_a_wait_ends_at_the_transform_or_soon_after_the_timeout() -> None:
    buffer = Buffer()
    timer = threading.Timer(0.2, lambda: buffer.set("odom", "base_link", Pose(), S, static=False))
    begun = time.monotonic()
    timer.start()
    buffer.lookup_transform("odom", "base_link", Time(), timeout=Duration(seconds=60))
    assert 0.2 <= time.monotonic() - begun < 30
    begun = time.monotonic()
    with pytest.raises(LookupException, match='"laser" passed to'):
        buffer.lookup_transform("odom", "laser", Time(), timeout=Duration(seconds=0.3))
    assert 0.25 < time.monotonic() - begun < 30
    timer.join()


def test_rclpy_is_not_started_by_importing_the_classes() -> None:
    code = (
        "import tfcompose.tf.tf2, sys; print([m for m in ('rclpy', 'numpy') if m in sys.modules])"
    )
    assert processes.run([sys.executable, "-c", code], check=True).stdout == "[]\n"
    assert issubclass(LookupException, TransformException)
