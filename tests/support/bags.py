"""Bags as ros2 bag records them, written with the library rosbags and its own encoder."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
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
    sent: Iterable[Sent] = (),
    *,
    mcap: bool = True,
    compressed: CompressionMode = CompressionMode.NONE,
    messages: Iterable[tuple[str, float, str, Any]] = (),
) -> Path:
    """Write a bag with one message for each transform; times count from START_S.

    ``messages`` are further ones, of any type: topic, seconds of the recording, type, and message
    or bytes.
    """
    kind = "tf2_msgs/msg/TFMessage"
    bag = Writer(
        folder, version=9, storage_plugin=StoragePlugin.MCAP if mcap else StoragePlugin.SQLITE3
    )
    if compressed is not CompressionMode.NONE:
        bag.set_compression(compressed, CompressionFormat.ZSTD)
    with bag as writer:
        connections: dict[str, Any] = {}
        for topic, at_s, other_kind, message in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, other_kind, typestore=STORE)
            is_raw = isinstance(message, bytes)
            writer.write(
                connections[topic],
                round((START_S + at_s) * 1e9),
                message if is_raw else STORE.serialize_cdr(message, other_kind),
            )
        for topic, at_s, parent, child, stamp_s, xyz, quat_xyzw in sent:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            data = STORE.serialize_cdr(tf_message(parent, child, stamp_s, xyz, quat_xyzw), kind)
            writer.write(connections[topic], round((START_S + at_s) * 1e9), data)
    return folder


def tf_message(
    parent: str,
    child: str,
    stamp_s: float,
    xyz: tuple[float, float, float],
    quat_xyzw: tuple[float, float, float, float],
) -> Any:
    """Return a message with one transform; the stamp counts from START_S."""
    transform = message(
        "geometry_msgs/msg/TransformStamped",
        header=header(stamp_s, parent),
        child_frame_id=child,
        transform=message(
            "geometry_msgs/msg/Transform",
            translation=STORE.types["geometry_msgs/msg/Vector3"](*xyz),
            rotation=STORE.types["geometry_msgs/msg/Quaternion"](*quat_xyzw),
        ),
    )
    return message("tf2_msgs/msg/TFMessage", transforms=[transform])


def message(kind: str, **fields: Any) -> Any:
    """Return a message with these fields; the others have their defaults."""
    return STORE.types[kind](**fields)


def header(at_s: float, frame: str) -> Any:
    seconds, nanoseconds = divmod(round((START_S + at_s) * 1e9), 10**9)
    stamp = message("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return message("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def camera_info(at_s: float, frame: str, binning_x: int = 0) -> tuple[str, float, str, Any]:
    """Return what a camera sends of its lens, as ``write_bag`` takes it."""
    kind = "sensor_msgs/msg/CameraInfo"
    info = message(
        kind,
        header=header(at_s, frame),
        height=480,
        width=640,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.ones(9),
        r=np.ones(9),
        p=np.ones(12),
        binning_x=binning_x,
        binning_y=0,
        roi=message(
            "sensor_msgs/msg/RegionOfInterest",
            x_offset=0, y_offset=0, height=0, width=0, do_rectify=False,
        ),
    )  # fmt: skip
    return ("/camera/camera_info", at_s, kind, info)


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
        (
            topic,
            index / rate + late_s,
            "odom",
            "base_link",
            index / rate,
            (index / rate, 0.0, 0.0),
            UP,
        )
        for index in range(count)
    ]
