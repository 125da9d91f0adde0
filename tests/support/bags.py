"""Bags as ros2 bag records them, written with the library rosbags and its own encoder."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tests.support import processes

#: Topic, seconds of the recording, and (parent, child, stamp in seconds, xyz, quaternion x y z w).
Sent = tuple[
    str, float, str, str, float, tuple[float, float, float], tuple[float, float, float, float]
]

STORE = get_typestore(Stores.ROS2_JAZZY)
START_S = 1_700_000_000
UP = (0.0, 0.0, 0.0, 1.0)


def write_bag(
    folder: Path,
    sent: Iterable[Sent],
    *,
    mcap: bool = True,
    compressed: CompressionMode = CompressionMode.NONE,
    others: Iterable[tuple[str, float, str, Any]] = (),
) -> Path:
    """Write a bag with one message for each transform; times count from START_S.

    ``others`` are other messages: topic, seconds of the recording, type and message.
    """
    types = STORE.types
    kind = "tf2_msgs/msg/TFMessage"
    bag = Writer(
        folder, version=9, storage_plugin=StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    )
    if compressed is not CompressionMode.NONE:
        bag.set_compression(compressed, CompressionFormat.ZSTD)
    with bag as writer:
        connections: dict[str, Any] = {}
        for topic, at_s, other_kind, message in others:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, other_kind, typestore=STORE)
            writer.write(
                connections[topic],
                round((START_S + at_s) * 1e9),
                STORE.serialize_cdr(message, other_kind),
            )
        for topic, at_s, parent, child, stamp_s, xyz, quat_xyzw in sent:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            seconds, nanoseconds = divmod(round((START_S + stamp_s) * 1e9), 10**9)
            transform = types["geometry_msgs/msg/TransformStamped"](
                types["std_msgs/msg/Header"](
                    types["builtin_interfaces/msg/Time"](seconds, nanoseconds), parent
                ),
                child,
                types["geometry_msgs/msg/Transform"](
                    types["geometry_msgs/msg/Vector3"](*xyz),
                    types["geometry_msgs/msg/Quaternion"](*quat_xyzw),
                ),
            )
            data = STORE.serialize_cdr(types[kind]([transform]), kind)
            writer.write(connections[topic], round((START_S + at_s) * 1e9), data)
    return folder


def tfcompose_without_ros(*words: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Run the command line where rclpy cannot be imported."""
    program = (
        "import sys; sys.modules['rclpy'] = None; from tfcompose.cli import main; sys.exit(main())"
    )
    command = [sys.executable, "-c", program, *words]
    done = processes.run(command)
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == code, done.stdout + done.stderr
    return done


def drive(
    seconds: float = 4.0, rate: float = 50.0, topic: str = "/tf", late_s: float = 0.004
) -> list[Sent]:
    """A base that moves along x at 1 m/s, and comes a little late."""
    count = round(seconds * rate)
    return [
        (topic, at / rate + late_s, "odom", "base_link", at / rate, (at / rate, 0.0, 0.0), UP)
        for at in range(count)
    ]
