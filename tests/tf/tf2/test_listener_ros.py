"""Programs written for tf2_ros run with this package's classes.

The listener takes what tf2's would.
"""

import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from tests.support import processes
from tests.support.waiting import none_but, until
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import PlanEdge, PlanProcess, Simulation
from tfcompose.tf.ros.graph import writers
from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.tf2 import Buffer, TransformListener

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
def outputs(changed: Callable[[str], Path]) -> Callable[..., list[list[str]]]:
    """Run changed programs at once, to their ends; return the lines of each."""

    def run(*commands: str) -> list[list[str]]:
        started = [
            processes.start(
                [sys.executable, changed(name), *arguments],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
            )
            for name, *arguments in map(str.split, commands)
        ]
        ended = [(*program.communicate(timeout=60), program.returncode) for program in started]
        assert [end[1:] for end in ended] == [("", 0)] * len(started), ended
        return [
            [line for line in output.splitlines() if not line.startswith("not yet: ")]
            for output, *_ in ended
        ]

    return run


@pytest.fixture
def running(changed: Callable[[str], Path]) -> Callable[..., None]:
    """Start a changed program that spins until the test's end."""

    def run(name: str, *arguments: str) -> None:
        processes.start([sys.executable, changed(name), *arguments], stderr=subprocess.DEVNULL)

    return run


@pytest.mark.usefixtures("rover")
def test_programs_run_after_changing_their_imports(
    outputs: Callable[..., list[list[str]]],
) -> None:
    """One waits for the next sample in a timer callback, which blocks the executor.

    One awaits transforms in its callbacks, for a time that has not come yet, too; the module keeps
    the name that it gives it. One moves clouds at their own time.
    """
    listener, awaiting, *clouds = outputs("listener", "awaiting", "cloud", "cloud --thread")
    assert listener[0] == "laser_link in base_link: (0.000, 0.000, 0.300) base_link laser_link"
    assert listener[-3:] == [
        "point in odom: (4.000, 0.000, 0.300)",
        "point in base_link: (2.000, 0.000, 0.300)",
        "end",
    ]
    assert sorted(awaiting[:-1]) == [
        "LookupException",
        "now laser_link is at 2.000",
        "then laser_link is at 2.000 in odom",
    ]
    assert awaiting[-1] == "end"
    assert clouds == [["cloud in odom: 2.000 keep", "same time: True", "end"]] * 2


def test_programs_that_send_transforms_serve_those_that_use_them(
    running: Callable[..., None], outputs: Callable[..., list[list[str]]]
) -> None:
    running("mounts")
    running("circle")
    assert outputs("camera_in_base") == [
        ["at (0.100, 0.000, 0.200) turned (0.131, 0.991)", "end"],
    ]
    with TransformListener(buffer := Buffer()):
        assert until(lambda: bool(buffer.can_transform("odom", "laser_link", Time())))
        translation = buffer.lookup_transform("odom", "laser_link", Time()).transform.translation
    assert (translation.x**2 + translation.y**2, translation.z) == pytest.approx((1.0, 0.3))


def test_a_sender_of_camera_frames_serves_a_program_that_moves_its_clouds(
    running: Callable[..., None], outputs: Callable[..., list[list[str]]]
) -> None:
    running("camera", "--ros-args", "-p", "camera_pitch:=1.5707963267948966")
    assert outputs("points") == [["[0.1, 0.0, -1.8] True", "end"]], (
        "2 m ahead of a camera that looks down"
    )


def encoded(x: float, stamp_ns: int, parent: str = "odom", child: str = "base_link") -> bytes:
    return encode([SentTransform(stamp_ns, parent, child, (x, 0.0, 0.0), UNIT)])


@pytest.fixture
def talker(domain: object) -> Iterator[Any]:
    assert domain
    with open_node("talks", "/test") as opened:
        yield opened


def test_a_listener_without_a_node_hears_a_namespace_from_its_own_thread(talker: Any) -> None:
    before, buffer, profile = threading.enumerate(), Buffer(), cast("Any", QoSProfile)
    requested = {"qos": profile(depth=7, reliability=2), "static_qos": 5}  # best effort
    with TransformListener(buffer, namespace="robot1", **requested) as listener:
        publisher = TFPublisher(talker, static=True, topic="/robot1/tf_static")
        publisher.publish(encoded(0.5, 0))
        stamped = buffer.lookup_transform("odom", "base_link", 0, timeout=60 * S)
        assert stamped.transform.translation.x == 0.5
        assert [writer.node for writer in writers(talker, "/robot1/tf_static")] == ["/test/talks"]
        own_node = listener._ros.node
        moving, fixed = (
            own_node.get_subscriptions_info_by_topic(f"/robot1/{name}")[0].qos_profile
            for name in ("tf", "tf_static")
        )
    assert moving.reliability.name == "BEST_EFFORT"
    assert (fixed.reliability.name, fixed.durability.name) == ("RELIABLE", "TRANSIENT_LOCAL")
    assert none_but(before), "the listener's thread has ended"


def test_an_executor_spins_until_the_transform_is_there(node: Any, talker: Any) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    moving, fixed = TFPublisher(talker, static=False), TFPublisher(talker, static=True)
    assert until(lambda: moving.publisher.get_subscription_count() == 1)
    future = buffer.wait_for_transform_async("odom", "laser", Time(seconds=5))
    executor.spin_until_future_complete(future, timeout_sec=0.2)
    assert not future.done()
    fixed.publish(encoded(0.5, 0, "base_link", "laser"))
    for stamp in (4, 6):
        moving.publish(encoded(float(stamp), stamp * S))
    executor.spin_until_future_complete(future, timeout_sec=60)
    stamped = future.result()
    assert type(stamped).__module__.startswith("geometry_msgs")
    assert (stamped.transform.translation.x, stamped.header.stamp.sec) == (5.5, 5)
    listener.close()
    listener.close()
    executor.shutdown()


def test_a_callback_that_awaits_lets_the_executor_hear_what_it_waits_for(
    node: Any, talker: Any
) -> None:
    buffer = Buffer()
    listener = TransformListener(buffer, node)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    xs: list[float] = []

    async def on_timer() -> None:
        timer.cancel()
        transform = await buffer.lookup_transform_async("odom", "base_link", Time(seconds=5))
        xs.append(transform.transform.translation.x)

    timer = node.create_timer(0.01, on_timer)
    publisher = TFPublisher(talker, static=False)
    assert until(lambda: publisher.publisher.get_subscription_count() == 1)

    def requested() -> bool:
        executor.spin_once(timeout_sec=0.05)
        return bool(buffer.on_insert)

    assert until(requested)
    publisher.publish(encoded(1.0, 4 * S))
    publisher.publish(encoded(2.0, 6 * S))

    def answered() -> bool:
        executor.spin_once(timeout_sec=0.05)
        return bool(xs)

    assert until(answered)
    assert xs == [1.5]
    listener.close()
    executor.shutdown()


def test_a_private_listener_follows_simulated_time_and_reports_jumps_back(
    talker: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    buffer = Buffer()
    clock = talker.create_publisher(Clock, "/clock", 1)
    publisher = TFPublisher(talker, static=False)

    with TransformListener(buffer, use_sim_time=True) as listener:
        own_clock = listener._ros.node.get_clock()

        def at(seconds: int) -> bool:
            clock.publish(Clock(clock=Time(seconds=seconds).to_msg()))
            return bool(own_clock.now().nanoseconds == seconds * S)

        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        assert until(lambda: at(100))
        publisher.publish(encoded(1.0, 100 * S))
        assert until(lambda: buffer.can_transform("odom", "base_link", Time()))
        assert until(lambda: at(160))
        assert buffer.can_transform("odom", "base_link", Time()), "a jump forward forgets nothing"
        assert until(lambda: at(5))
        assert until(lambda: not buffer.can_transform("odom", "base_link", Time()))
        publisher.publish(encoded(2.0, 5 * S))
        assert until(lambda: buffer.can_transform("odom", "base_link", Time(seconds=5)))
    assert "back by 155.000 s" in capfd.readouterr().err


def test_a_thread_of_the_listeners_spins_the_entire_node_and_ends_with_it(
    node: Any, talker: Any
) -> None:
    before, ticks = threading.enumerate(), []
    node.create_timer(0.01, lambda: ticks.append(1))
    buffer = Buffer()
    with TransformListener(buffer, node, spin_thread=True):
        publisher = TFPublisher(talker, static=False)
        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        publisher.publish(encoded(1.0, S))
        assert (
            buffer.lookup_transform("odom", "base_link", 0, timeout=60 * S).transform.translation.x
            == 1.0
        )
        assert until(lambda: len(ticks) > 1)
    assert none_but(before)


def test_a_wait_ends_after_half_a_second_and_lets_tf_callbacks_run(node: Any, talker: Any) -> None:
    """The thread that waits is the only one, and nobody spins."""
    buffer = Buffer()
    with TransformListener(buffer, node):
        publisher = TFPublisher(talker, static=False)
        assert until(lambda: publisher.publisher.get_subscription_count() == 1)
        timer = threading.Timer(0.1, lambda: publisher.publish(encoded(3.0, 9 * S)))
        timer.start()
        assert buffer.can_transform("odom", "base_link", Time(seconds=9), timeout=60 * S)
        timer.join()
        possible, why = buffer.can_transform(
            "odom", "base_link", Time(seconds=10), timeout=S // 2, return_debug_tuple=True
        )
        assert not possible
        assert "odom → base_link at 10.000000000 s " in why
    buffer.set("odom", "base_link", Pose(), 10 * S, static=False)
    assert buffer.can_transform("odom", "base_link", Time(seconds=10))


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
