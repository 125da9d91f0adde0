"""Programs written for tf2_ros run with this package's classes.

The listener takes what tf2's would.
"""

import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.time import Time

from tests.support import processes
from tests.support.waiting import none_but, until
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import PlanEdge, PlanProcess, Simulation
from tfcompose.tf.ros.graph import writers
from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.tf2 import Buffer, LookupException, TransformException, TransformListener

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("domain")]

PROGRAMS = Path(__file__).parent / "programs"
#: What is changed of a program for tf2, and nothing else.
IMPORTS = {
    "from tf2_ros import": "from tfcompose.tf.tf2 import",
    "from tf2_ros.static_transform_broadcaster import": "from tfcompose.tf.tf2 import",
    "from tf2_sensor_msgs import": "from tfcompose.tf.tf2.messages import",
    "import tf_transformations$": (
        "from tfcompose.tf.tf2 import transformations as tf_transformations"
    ),
    "import tf2_ros$": "from tfcompose.tf import tf2 as tf2_ros",
    "import tf2_py as tf2$": "from tfcompose.tf import tf2",
    "import tf2_geometry_msgs$": "from tfcompose.tf.tf2 import messages as tf2_geometry_msgs",
}
S = 1_000_000_000
UNIT = (0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def rover(
    write: Callable[..., Path], start: Callable[..., Any], edge: Callable[..., PlanEdge]
) -> None:
    """A base that stands at x = 2 in odom, with a laser 0.3 m above it."""
    edges = [
        edge("odom base_link", "drive"),
        edge("base_link laser_link", pose=Pose((0.0, 0.0, 0.3))),
    ]
    drive = PlanProcess(
        "drive", "simulate", simulate=Simulation("fixed", 50.0, pose=Pose((2.0, 0.0, 0.0)))
    )
    plan = write(edges, PlanProcess("static", "static"), drive)
    for module, name in (("static", "static"), ("simulate", "drive")):
        start(module, plan, name).until_says("edge")


@pytest.fixture
def changed(tmp_path: Path) -> Callable[[str], Path]:
    """Return a program with nothing but its imports of tf2_ros changed."""

    def change(name: str) -> Path:
        text = (PROGRAMS / f"{name}.py").read_text("utf-8")
        for tf2s, ours in IMPORTS.items():
            text = re.sub(f"^{tf2s}", ours, text, flags=re.MULTILINE)
        assert not re.search(r"^(import|from) tf(2|_)", text, re.MULTILINE)
        file = tmp_path / f"{name}.py"
        file.write_text(text, "utf-8")
        return file

    return change


@pytest.fixture
def program(changed: Callable[[str], Path]) -> Callable[..., str]:
    """Run a changed program to its end; return its output."""

    def run(name: str, *arguments: str) -> str:
        done = processes.run([sys.executable, changed(name), *arguments])
        assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture
def running(changed: Callable[[str], Path]) -> Callable[..., None]:
    """Start a changed program that spins until the test's end."""

    def run(name: str, *arguments: str) -> None:
        processes.start([sys.executable, changed(name), *arguments], stderr=subprocess.DEVNULL)

    return run


@pytest.mark.usefixtures("rover")
def test_a_listener_program_runs_after_changing_its_imports(program: Callable[..., str]) -> None:
    """Its wait for the next sample is in a timer callback, which blocks the executor."""
    output = [
        line for line in program("listener").splitlines() if not line.startswith("not yet: ")
    ]
    assert output[0] == "laser_link in base_link: (0.000, 0.000, 0.300) base_link laser_link"
    assert output[-3:] == [
        "point in odom: (4.000, 0.000, 0.300)",
        "point in base_link: (2.000, 0.000, 0.300)",
        "end",
    ]


@pytest.mark.usefixtures("rover")
def test_a_program_awaits_transforms_in_its_callbacks(program: Callable[..., str]) -> None:
    """One of its waits is for a time that has not come yet.

    The module keeps the name that the program gives it.
    """
    output = program("awaiting").splitlines()
    assert sorted(output[:-1]) == [
        "LookupException",
        "now laser_link is at 2.000",
        "then laser_link is at 2.000 in odom",
    ]
    assert output[-1] == "end"


@pytest.mark.usefixtures("rover")
@pytest.mark.parametrize("arguments", [(), ("--thread",)])
def test_a_program_moves_clouds_at_their_own_time(
    program: Callable[..., str], arguments: tuple[str, ...]
) -> None:
    output = [
        line
        for line in program("cloud", *arguments).splitlines()
        if not line.startswith("not yet: ")
    ]
    assert output == ["cloud in odom: 2.000 keep", "same time: True", "end"]


def test_programs_that_send_transforms_serve_those_that_use_them(
    running: Callable[..., None], program: Callable[..., str]
) -> None:
    running("mounts")
    running("circle")
    assert program("camera_in_base").splitlines() == [
        "at (0.100, 0.000, 0.200) turned (0.131, 0.991)",
        "end",
    ]
    with TransformListener(buffer := Buffer()):
        assert until(lambda: bool(buffer.can_transform("odom", "laser_link", Time())))
        found = buffer.lookup_transform("odom", "laser_link", Time()).transform.translation
    assert (found.x**2 + found.y**2, found.z) == pytest.approx((1.0, 0.3))


def test_a_program_that_sends_a_cameras_frames_serves_one_that_moves_its_clouds(
    running: Callable[..., None], program: Callable[..., str]
) -> None:
    running("camera", "--ros-args", "-p", "camera_pitch:=1.5707963267948966")
    assert program("points").splitlines() == [
        "[0.1, 0.0, -1.8] True",
        "end",
    ], "2 m ahead of a camera that looks down"


@pytest.fixture
def executor(node: Any) -> Iterator[Callable[[float], None]]:
    """Spin the node's executor for some seconds."""
    spinner = SingleThreadedExecutor(context=node.context)
    spinner.add_node(node)
    yield lambda seconds: spinner.spin_once(timeout_sec=seconds)
    spinner.shutdown()


def one(x: float, stamp_ns: int, parent: str = "odom", child: str = "base_link") -> bytes:
    return encode([SentTransform(stamp_ns, parent, child, (x, 0.0, 0.0), UNIT)])


def test_a_node_that_is_handed_over_is_fed_by_its_executor(
    node: Any, executor: Callable[[float], None]
) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    with open_node("talks", "/test") as other:
        moving, fixed = TFPublisher(other, static=False), TFPublisher(other, static=True)
        assert until(lambda: moving.publisher.get_subscription_count() == 1)
        fixed.publish(one(0.5, 0, "base_link", "laser"))
        moving.publish(one(1.0, 5 * S))

        def both() -> bool:
            executor(0.05)
            return bool(buffer.can_transform("odom", "laser", Time()))

        assert until(both)
    found = buffer.lookup_transform("odom", "laser", Time())
    assert type(found).__module__.startswith("geometry_msgs")
    assert (found.transform.translation.x, found.header.stamp.sec) == (1.5, 5)
    listener.close()
    listener.close()


def test_the_subscriptions_are_those_of_tf2(node: Any) -> None:
    listener = TransformListener(Buffer(), node)
    profiles = {
        name: node.get_subscriptions_info_by_topic(name)[0].qos_profile
        for name in ("/tf", "/tf_static")
    }
    listener.close()
    assert {profile.reliability.name for profile in profiles.values()} == {"RELIABLE"}
    assert profiles["/tf"].durability.name == "VOLATILE"
    assert profiles["/tf_static"].durability.name == "TRANSIENT_LOCAL"


def test_a_listener_without_a_node_hears_a_namespace_from_its_own_thread() -> None:
    before = threading.enumerate()
    buffer = Buffer()
    with open_node("talks", "") as other, TransformListener(buffer, namespace="robot1"):
        publisher = TFPublisher(other, static=True, topic="/robot1/tf_static")
        publisher.publish(one(0.5, 0))
        assert (
            buffer.lookup_transform("odom", "base_link", 0, timeout=60 * S).transform.translation.x
            == 0.5
        )
        assert [writer.node for writer in writers(other, "/robot1/tf_static")] == ["/talks"]
    assert none_but(before), "the listener's thread has ended"


def test_a_wait_ends_when_the_transform_comes_or_when_the_time_is_over_and_not_much_later() -> (
    None
):
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


def test_malformed_messages_and_refused_transforms_are_reported_once(
    node: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    bad = [b"\0\1\0\0\xff\xff\xff\xff", one(0, S, "base_link", "base_link"), one(float("nan"), S)]
    with open_node("talks", "/test") as other:
        publisher = TFPublisher(other, static=False)
        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        for data in (*bad, *bad, one(1.0, S)):
            publisher.publish(data)
        assert (
            buffer.lookup_transform("odom", "base_link", 0, timeout=60 * S).transform.translation.x
            == 1.0
        )
    listener.close()
    output = capfd.readouterr().err
    assert output.count("no TFMessage") == 1
    assert output.count("TF_SELF_TRANSFORM: ") == 1
    assert output.count("TF_NAN_INPUT") == 1


def test_when_the_clock_goes_back_moving_edges_are_forgotten(node: Any) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    clock = node.get_clock()
    clock._set_ros_time_is_active(True)  # noqa: FBT003 (rclpy's)
    clock.set_ros_time_override(Time(seconds=100, clock_type=clock.clock_type))
    buffer.set("odom", "base_link", Pose(), 100 * S, static=False)
    buffer.set("base_link", "laser", Pose(), 0, static=True)
    clock.set_ros_time_override(Time(seconds=101, clock_type=clock.clock_type))
    assert buffer.can_transform("odom", "laser", Time())
    clock.set_ros_time_override(Time(seconds=5, clock_type=clock.clock_type))
    assert not buffer.can_transform("odom", "laser", Time())
    assert buffer.can_transform("base_link", "laser", Time())
    assert buffer.set("odom", "base_link", Pose(), 5 * S, static=False), (
        "what comes now is not too old"
    )
    listener.close()


def test_a_program_that_never_closes_its_listener_ends(domain: Any) -> None:
    code = (
        "from tfcompose.tf.tf2 import Buffer, TransformListener; TransformListener(Buffer());"
        " print('up', flush=True)"
    )
    done = processes.run([sys.executable, "-c", code], env=domain.environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "up\n", "")


def test_a_wait_is_ended_by_ctrl_c(domain: Any) -> None:
    code = (
        "from tfcompose.tf.tf2 import Buffer, TransformListener\nbuffer ="
        " Buffer()\nTransformListener(buffer)\ntry:\n    print('up', flush=True)\n   "
        " buffer.lookup_transform('a', 'b', 0, 60 * 10**9)\nexcept KeyboardInterrupt:\n   "
        " print('out')"
    )
    with processes.start(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, env=domain.environment
    ) as it:
        assert it.stdout
        assert it.stdout.readline() == "up\n"
        it.send_signal(signal.SIGINT)
        assert it.stdout.read() == "out\n"
        assert it.wait(60) == 0


def test_rclpy_is_not_started_by_importing_the_classes() -> None:
    code = (
        "import tfcompose.tf.tf2, sys; print([m for m in ('rclpy', 'numpy') if m in sys.modules])"
    )
    assert processes.run([sys.executable, "-c", code], check=True).stdout == "[]\n"
    assert issubclass(LookupException, TransformException)
    assert rclpy is not None
