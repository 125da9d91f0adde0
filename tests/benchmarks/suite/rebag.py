"""Correction of a large recording, beside a plain copy of it with the same library."""

from __future__ import annotations

import compileall
import random
import shutil
import time
from contextlib import contextmanager
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Contender, Limit, Row
from tests.benchmarks.building import TFCOMPOSE_CODE
from tests.benchmarks.measures import usage
from tests.benchmarks.record import ROOT
from tests.support.bags import START_S, STORE, UP, header, message, tf_message

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from tests.benchmarks.benchmark import Sampler, Workspace

#: Bytes of the images in the recording, and in that of a trial.
SIZE, QUICK_SIZE = 2_000_000_000, 60_000_000
WIDTH, HEIGHT = 1280, 720
COPY = Contender("mcap", version=lambda: version("mcap"))
ROBOT = """
tfcompose: 1
robot: cart
links: {base_link: {}, camera: {}}
joints: {camera_joint: {type: fixed, parent: base_link, child: camera, xyz: [0.2, 0, 0.3]}}
frames: {odom: {}, base_link: {parent: odom, owner: drive}}
processes: {drive: {external: true, node: drive}}
"""
#: Its reader and its writer as streams: one chunk is in memory.
COPY_CODE = """import sys
from mcap.records import Channel, DataEnd, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
with open(sys.argv[1], "rb") as old, open(sys.argv[2], "wb") as new:
    writer, schemas, channels = Writer(new, compression=CompressionType.NONE), {}, {}
    writer.start()
    for record in StreamReader(old).records:
        if isinstance(record, DataEnd):
            break
        if isinstance(record, Schema) and record.id not in schemas:
            schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel) and record.id not in channels:
            channels[record.id] = writer.register_channel(
                record.topic, record.message_encoding, schemas[record.schema_id], record.metadata
            )
        elif isinstance(record, Message):
            writer.add_message(
                channels[record.channel_id],
                record.log_time,
                record.data,
                record.publish_time,
                record.sequence,
            )
    writer.finish()
"""


def record_drive(folder: Path, size: int) -> None:
    """Write a bag of images at 30 Hz, /tf at 90 Hz and a wrong fixed edge, as they come."""
    pixels = np.frombuffer(random.Random(0).randbytes(WIDTH * HEIGHT * 3), np.uint8)
    image_type, tf_type = "sensor_msgs/msg/Image", "tf2_msgs/msg/TFMessage"
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topics: dict[str, Any] = {
            topic: bag.add_connection(topic, kind, typestore=STORE)
            for topic, kind in (("/image", image_type), ("/tf", tf_type), ("/tf_static", tf_type))
        }

        def write(topic: str, at_s: float, data: Any) -> None:
            kind = topics[topic].msgtype
            bag.write(
                topics[topic], round((START_S + at_s) * 1e9), STORE.serialize_cdr(data, kind)
            )

        write("/tf_static", 0.0, tf_message("base_link", "camera", 0.0, (0.1, 0.0, 0.3), UP))
        for number in range(size // len(pixels)):
            at_s = number / 30
            image = message(
                image_type,
                header=header(at_s, "camera"),
                height=HEIGHT,
                width=WIDTH,
                encoding="rgb8",
                is_bigendian=0,
                step=3 * WIDTH,
                data=pixels,
            )
            write("/image", at_s, image)
            for tick in range(3 * number, 3 * number + 3):
                pose = tf_message("odom", "base_link", tick / 90, (0.01 * tick, 0.0, 0.0), UP)
                write("/tf", tick / 90, pose)


def _record(workspace: Workspace) -> Path:
    """Write the robot file and the recording, and return the recording's only file."""
    (workspace.folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    record_drive(workspace.folder / "drive", QUICK_SIZE if workspace.is_quick else SIZE)
    (file,) = (workspace.folder / "drive").glob("*.mcap")
    return file


def _measured(workspace: Workspace, code: str, *argv: str) -> Mapping[str, float]:
    began = time.monotonic()
    cpu_s, megabytes = usage(workspace, "-c", code, *argv)
    return {"time": time.monotonic() - began, "cpu": cpu_s, "memory": megabytes}


@contextmanager
def corrected(workspace: Workspace) -> Iterator[Sampler]:
    """Replace the fixed edge."""
    compileall.compile_dir(ROOT / "tfcompose", quiet=2)
    _record(workspace)

    def sample() -> Mapping[str, float]:
        rebag = ("rebag", "drive", "right", "--with", "robot.yaml")
        values = _measured(workspace, TFCOMPOSE_CODE, *rebag)
        shutil.rmtree(workspace.folder / "right")
        return values

    yield sample


@contextmanager
def copied(workspace: Workspace) -> Iterator[Sampler]:
    """Copy each message."""
    file = _record(workspace)

    def sample() -> Mapping[str, float]:
        values = _measured(workspace, COPY_CODE, str(file), "copy.mcap")
        (workspace.folder / "copy.mcap").unlink()
        return values

    yield sample


BENCHMARK = Benchmark(
    name="rebag",
    about="a recording of 2 GB of images and TF; the library mcap copies its messages",
    rows={
        "time": Row("`rebag` from start to end", "s", (Limit(1.3, "least", times=COPY),)),
        "cpu": Row("… its processor time, user and system", "s"),
        "memory": Row("… its largest resident size", "MB", (Limit(300, "worst"),)),
    },
    contenders={TFCOMPOSE: corrected, COPY: copied},
    runs=3,
    quick_runs=1,
)
