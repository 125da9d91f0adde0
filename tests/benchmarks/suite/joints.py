"""Joint states to transforms: processor time, and the time until they arrive."""

from __future__ import annotations

import struct
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import yaml

from tests.benchmarks.benchmark import Benchmark, Contender, Opened, Row
from tests.benchmarks.contenders import RCLPY, STATE_PUBLISHER, TFCOMPOSE_ON_ROS, executable
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.measures import pss_mb, tree
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import Plan, PlanEdge, PlanJoint, PlanProcess, RosSettings, SourceLine
from tfcompose.model.plan.file import write_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

JOINTS = (100, 500)
RATE = 500
SECONDS, WARM_UP_S = 3.0, 1.0
TIMEOUT_S = 20.0


def planned_command(workspace: Workspace, joints: int) -> list[str]:
    """Write the plan of a robot with this many joints; return the command of ``joints``."""
    source = SourceLine("r", 1)
    edges = tuple(
        PlanEdge(
            f"link_{n}",
            f"link_{n + 1}",
            "joint",
            "joints",
            "/rover/joints",
            pose=Pose((0.1, 0.0, 0.2)),
            rate=None,
            source=source,
            joint=PlanJoint(f"joint_{n}", "revolute", (0.0, 0.0, 1.0)),
        )
        for n in range(joints)
    )
    processes = (PlanProcess("joints", "joints", nodes=("/rover/joints",)),)
    plan = Plan("rover", "", "link_0", RosSettings("/rover"), edges, processes)
    file = workspace.folder / "plan.json"
    file.write_text(write_plan(plan), encoding="utf-8")
    return [*HERE, "joints", str(file), "joints"]


def plain(workspace: Workspace, joints: int) -> list[str]:
    """Return the command of a plain rclpy node that answers with ready bytes."""
    del workspace
    return [sys.executable, str(PROGRAMS / "plain_joints.py"), str(joints)]


def state_publisher(workspace: Workspace, joints: int) -> list[str]:
    """Write the robot's description; return the command of robot_state_publisher."""
    links = "".join(f'<link name="link_{n}"/>' for n in range(joints + 1))
    chain = "".join(
        f'<joint name="joint_{n}" type="continuous"><parent link="link_{n}"/>'
        f'<child link="link_{n + 1}"/><origin xyz="0.1 0 0.2"/><axis xyz="0 0 1"/></joint>'
        for n in range(joints)
    )
    parameters = {
        "robot_description": f'<robot name="rover">{links}{chain}</robot>',
        "publish_frequency": 1000.0,  # it answers each joint state, as the others do
    }
    file = workspace.folder / "parameters.yaml"
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}), encoding="utf-8")
    program = executable("robot_state_publisher", "robot_state_publisher")
    return [
        str(program),
        "--ros-args",
        *("-r", "__ns:=/rover"),
        *("--params-file", str(file)),
    ]


def opened(command_of: Callable[[Workspace, int], list[str]]) -> Opened:
    """Return the function that opens a contender, which is started anew for each size."""

    @contextmanager
    def publisher(workspace: Workspace) -> Iterator[Sampler]:
        # It reads ROS's variables.
        from tfcompose.tf.ros.node import open_node  # noqa: PLC0415

        with workspace.entered(), open_node("bench", "/rover") as node:

            def sample() -> Mapping[str, float]:
                values: dict[str, float] = {}
                for joints in JOINTS:
                    with workspace.running(*command_of(workspace, joints)) as process:
                        figures = _measure(process.pid, _sender(node, joints))
                        values |= {f"{name}_{joints}": value for name, value in figures.items()}
                return values

            yield sample

    return publisher


def _sender(node: Any, joints: int) -> Callable[[], float | None]:
    """Return a function that sends a joint state and returns how long its answer took, in seconds.

    It waits for the rest of its period.
    """
    # After ROS's variables are set.
    from rclpy.serialization import serialize_message  # noqa: PLC0415
    from sensor_msgs.msg import JointState  # noqa: PLC0415 (the same)

    from tfcompose.foundation.signals import Stop  # noqa: PLC0415 (the same)
    from tfcompose.tf.ros.node import TFSubscription, wait  # noqa: PLC0415 (the same)

    message = JointState(
        name=[f"joint_{n}" for n in range(joints)], position=[0.01 * n for n in range(joints)]
    )
    data = bytearray(serialize_message(message))
    publisher = node.create_publisher(JointState, "joint_states", 10)
    answers, stop = TFSubscription(node, static=False), Stop()

    def send() -> float | None:
        start_ns, due, delay = time.time_ns(), time.monotonic() + 1 / RATE, None
        struct.pack_into("<iI", data, 4, *divmod(start_ns, 1_000_000_000))
        publisher.publish(bytes(data))
        while (left := due - time.monotonic()) > 0:
            wait(node, [answers], left, stop)
            for _ in answers.take():
                delay = (time.time_ns() - start_ns) / 1e9
        return delay

    return send


def _measure(pid: int, send: Callable[[], float | None]) -> dict[str, float]:
    end = time.monotonic() + TIMEOUT_S
    while send() is None:
        if time.monotonic() > end:
            raise TimeoutError("nothing came on /tf")
    end = time.monotonic() + WARM_UP_S
    while time.monotonic() < end:
        send()
    used, end, delays, sent = _cpu_s(pid), time.monotonic() + SECONDS, [], 0
    while time.monotonic() < end:
        delay = send()
        sent += 1
        if delay is not None:
            delays.append(delay)
    if len(delays) < sent / 2:
        raise TimeoutError(f"{len(delays)} of {sent} joint states were answered in time")
    return {
        "core": 100 * (_cpu_s(pid) - used) * RATE / sent,
        "median": 1e3 * median(delays),
        "p99": 1e3 * sorted(delays)[len(delays) * 99 // 100],
        "memory": pss_mb(tree(pid)),
    }


def _cpu_s(pid: int) -> float:
    """Return the processor time of all threads, which the scheduler counts in nanoseconds."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return sum(int((task / "schedstat").read_text("ascii").split()[0]) for task in tasks) / 1e9


def _rows(joints: int) -> dict[str, Row]:
    title = f"`joints`: {joints} joints at {RATE} Hz"
    return {
        f"core_{joints}": Row(title, "% of a core"),
        f"median_{joints}": Row("… from joint state to transforms, median", "ms"),
        f"p99_{joints}": Row("… 99th percentile", "ms"),
        f"memory_{joints}": Row("… memory", "MB"),
    }


CONTENDERS: dict[Contender, Callable[[Workspace, int], list[str]]] = {
    TFCOMPOSE_ON_ROS: planned_command,
    RCLPY: plain,
    STATE_PUBLISHER: state_publisher,
}
BENCHMARK = Benchmark(
    name="joints",
    about="a node sends joint states at 500 Hz and takes the transforms; plain rclpy answers with"
    " ready bytes and computes nothing",
    rows=_rows(100) | _rows(500),
    contenders={contender: opened(command) for contender, command in CONTENDERS.items()},
    runs=5,
    quick_runs=1,
)
