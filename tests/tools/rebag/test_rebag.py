"""``tfcompose rebag``: corrected copies of recordings, read back by other people's libraries."""

import json
import resource
import signal
import sqlite3
import sys
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Metadata
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import CompressionMode, Reader

from tests.support import processes
from tests.support.bags import (
    START_S,
    STORE,
    UP,
    Sent,
    camera_info,
    header,
    message,
    tf_message,
    tfcompose_without_ros,
    write_bag,
)
from tests.support.cli import tfcompose_in
from tests.support.waiting import until
from tfcompose.tf.bags import Recording
from tfcompose.tf.tf2 import Buffer

ROBOT = """\
tfcompose: 1
robot: cart
links: {base_link: {}, laser: {}, bracket: {}, lens: {}}
joints:
  laser_joint:
    {type: fixed, parent: base_link, child: laser, xyz: [0.24, 0, 0.3], rpy: [0, 0, 5 deg]}
  bracket_joint: {type: fixed, parent: base_link, child: bracket, xyz: [0, 0.1, 0.2]}
  lens_joint: {type: fixed, parent: bracket, child: lens, xyz: [0.01, 0, 0]}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive}
processes: {drive: {external: true, node: drive}}
"""
HALF_CIRCLE = (0.0, 0.0, 1.0, 0.0)
#: laser is wrong, bracket is sent as a moving edge, lens is missing, tag is not declared.
RECORDED: tuple[Sent, ...] = (
    ("/tf_static", 0.2, "base_link", "laser", 0.0, (0.2, 0.0, 0.3), UP),
    ("/tf_static", 0.2, "base_link", "tag", 0.0, (1.0, 0.0, 0.0), HALF_CIRCLE),
    *(
        ("/tf", 0.1 + 0.02 * i, "odom", "base_link", 0.02 * i, (0.01 * i, 0.0, 0.0), UP)
        for i in range(50)
    ),
    ("/tf", 0.5, "base_link", "bracket", 0.5, (0.0, 0.0, 0.0), UP),
)
KINDS: dict[str, dict[str, Any]] = {
    "mcap": {},
    "mcap in compressed chunks": {"compressed": CompressionMode.STORAGE},
    "mcap of compressed messages": {"compressed": CompressionMode.MESSAGE},
    "sqlite": {"mcap": False},
    "sqlite of compressed messages": {"mcap": False, "compressed": CompressionMode.MESSAGE},
    "compressed sqlite file": {"mcap": False, "compressed": CompressionMode.FILE},
}


class Message(NamedTuple):
    topic: str
    time_ns: int
    data: bytes


OTHERS = (
    camera_info(0.3, "old_lens", binning_x=2),
    ("/text", 0.3, "std_msgs/msg/String", message("std_msgs/msg/String", data="old_lens")),
    ("/text", 0.7, "std_msgs/msg/String", message("std_msgs/msg/String", data="")),
)


def messages_of(bag: Path) -> list[Message]:
    with Reader(bag) as reader:
        return [
            Message(connection.topic, time_ns, bytes(data))
            for connection, time_ns, data in reader.messages()
        ]


def not_tf(messages: Sequence[Message]) -> list[Message]:
    return [each for each in messages if each.topic not in {"/tf", "/tf_static"}]


def buffer_of(bag: Path) -> Buffer:
    buffer = Buffer()
    for each in Recording(str(bag)).messages(("/tf", "/tf_static")):
        assert each.rows is not None
        buffer.insert(each.rows, static=each.static)
    return buffer


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cart.yaml").write_text(ROBOT, "utf-8")
    return tmp_path


def rebag(folder: Path, *words: str, code: int = 0) -> str:
    """Run the command and return what it prints."""
    done = tfcompose_in(folder, "rebag", *words, "--with", "cart.yaml")
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("kind", KINDS)
def test_fixed_edges_become_those_of_the_file_and_all_else_stays(folder: Path, kind: str) -> None:
    bag = write_bag(folder / "drive", RECORDED, messages=OTHERS, **KINDS[kind])
    output = rebag(folder, "drive", "right")
    assert "base_link → laser: off by 40 mm and 5 deg" in output
    before, after = messages_of(bag), messages_of(folder / "right")
    assert not_tf(after) == not_tf(before)
    moving = [each for each in after if each.topic == "/tf"]
    assert moving == [
        each for each in before if each.topic == "/tf" and b"bracket" not in each.data
    ]
    assert after[0].topic == "/tf_static"
    assert after[0].time_ns == before[0].time_ns
    buffer = buffer_of(folder / "right")
    laser = buffer.lookup_transform("base_link", "laser", 0).transform
    assert laser.translation.x == pytest.approx(0.24, abs=1e-9)
    assert laser.rotation.z == pytest.approx(np.sin(np.radians(2.5)), abs=1e-9)
    lens = buffer.lookup_transform("base_link", "lens", 0).transform.translation
    assert (lens.x, lens.y, lens.z) == pytest.approx((0.01, 0.1, 0.2), abs=1e-9)
    assert buffer.lookup_transform("odom", "tag", 0)
    metadata = [
        yaml.safe_load((folder / name / "metadata.yaml").read_text("utf-8"))[
            "rosbag2_bagfile_information"
        ]
        for name in ("drive", "right")
    ]
    assert metadata[1]["message_count"] == len(after)
    assert metadata[1]["custom_data"]["tfcompose_robot"] == "cart"
    for key in ("compression_mode", "storage_identifier", "starting_time", "duration"):
        assert metadata[0][key] == metadata[1][key]


def test_poses_are_those_of_the_calibration_of_the_recording_s_day(folder: Path) -> None:
    """Recordings begin on 2023-11-14; the other calibration is that of today."""
    for name, x in (("old", 0.25), ("new", 0.26)):
        transform = f"{{x: {x}, y: 0, z: 0.3, roll: 0, pitch: 0, yaw: 0}}"
        (folder / f"{name}.yaml").write_text(f"base_link: {{laser: {transform}}}\n", "utf-8")
    files = (
        "[{file: old.yaml, valid: {to: 2023-11-14}}, {file: new.yaml, valid: {from: 2023-11-15}}]"
    )
    (folder / "cart.yaml").write_text(
        "tfcompose: 1\nrobot: cart\nlinks: {base_link: {}}\n"
        f"frames: {{laser: {{parent: base_link, xyz: [0.24, 0, 0.3], calibration: {files}}}}}\n",
        "utf-8",
    )
    write_bag(folder / "drive", RECORDED)
    rebag(folder, "drive", "right")
    laser = buffer_of(folder / "right").lookup_transform("base_link", "laser", 0).transform
    assert laser.translation.x == 0.25
    assert tfcompose_in(folder, "verify", "cart.yaml", "--bag", "right").returncode == 0


def test_a_corrected_bag_has_nothing_more_to_correct(folder: Path) -> None:
    write_bag(folder / "drive", RECORDED)
    assert "off by" in rebag(folder, "drive", "--check", code=1)
    rebag(folder, "drive", "right")
    assert rebag(folder, "right", "--check") == "3 fixed edges already match the robot file\n"
    rebag(folder, "right", "again")
    assert messages_of(folder / "again") == messages_of(folder / "right")


def test_check_writes_nothing_and_says_how_far_each_edge_is_off(folder: Path) -> None:
    write_bag(folder / "drive", RECORDED)
    report = json.loads(rebag(folder, "drive", "--check", "--format", "json", code=1))
    changes = [(each["edge"], each["change"], each["transforms"]) for each in report["edges"]]
    assert changes == [
        ("base_link → laser", "moved", 0),
        ("base_link → bracket", "added", 0),
        ("bracket → lens", "added", 0),
        ("base_link → bracket", "removed from /tf", 1),
    ]
    (laser,) = [each for each in report["edges"] if each["change"] == "moved"]
    assert (laser["mm"], laser["deg"]) == pytest.approx((40, 5))
    assert {each.name for each in folder.iterdir()} == {"cart.yaml", "drive"}


def test_undeclared_edges_are_dropped_only_on_request(folder: Path) -> None:
    write_bag(folder / "drive", RECORDED)
    assert "base_link → tag: dropped" in rebag(folder, "drive", "right", "--only-declared")
    assert not any(b"tag" in each.data for each in messages_of(folder / "right"))


#: An interrupted recording has no index; the library's reader takes messages in their order.
NO_SUMMARY: dict[str, Any] = {
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
    "use_statistics": False,
    "use_summary_offsets": False,
}


def write_mcap(file: Path, **options: Any) -> None:
    """Write RECORDED and a text after each with the library mcap, as its options are."""
    with file.open("wb") as stream:
        writer: Any = Writer(stream, chunk_size=400, **options)
        writer.start("ros2", "test")
        ids = {}
        for topic, kind in (
            ("/tf", "tf2_msgs/msg/TFMessage"),
            ("/tf_static", "tf2_msgs/msg/TFMessage"),
            ("/text", "std_msgs/msg/String"),
        ):
            text, _ = STORE.generate_msgdef(kind, ros_version=2)
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            ids[topic] = writer.register_channel(topic, "cdr", schema)
        for number, (topic, at_s, parent, child, stamp_s, xyz, quat) in enumerate(RECORDED):
            transform = tf_message(parent, child, stamp_s, xyz, quat)
            for name, kind, content in (
                (topic, "tf2_msgs/msg/TFMessage", transform),
                ("/text", "std_msgs/msg/String", message("std_msgs/msg/String", data="x")),
            ):
                log_ns = round((START_S + at_s) * 1e9)
                data = bytes(STORE.serialize_cdr(content, kind))
                writer.add_message(ids[name], log_ns, data, log_ns - number, number)
        writer.add_attachment(1, 2, "map.pgm", "image/pgm", b"pixels")
        writer.add_metadata("route", {"to": "dock"})
        writer.add_metadata("rosbag2", {"serialized_metadata": "of the old bag"})
        writer.finish()


def records_of(file: Path) -> dict[type, list[Any]]:
    """Return messages, attachments, metadata and chunks in the order of the file."""
    records: dict[type, list[Any]] = {Message: [], Attachment: [], Metadata: [], Chunk: []}
    topics = {}
    with file.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            inner = breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else ()
            for each in (record, *inner):
                if isinstance(each, Channel):
                    topics[each.id] = each.topic
                elif isinstance(each, McapMessage):
                    records[Message].append(
                        (
                            topics[each.channel_id],
                            each.log_time,
                            each.publish_time,
                            each.sequence,
                            each.data,
                        )
                    )
                elif isinstance(each, Attachment):
                    records[Attachment].append((each.name, each.log_time, each.data))
                elif isinstance(each, Metadata):
                    records[Metadata].append((each.name, each.metadata))
                elif isinstance(each, Chunk):
                    expanded, size = get_chunk_data_stream(each)
                    records[Chunk].append((each.data, expanded.read(size)))
    return records


#: Arguments of the library's writer, and whether the recording has chunks.
LAYOUTS: dict[str, tuple[dict[str, Any], bool]] = {
    "zstd": ({"compression": CompressionType.ZSTD}, True),
    "lz4": ({"compression": CompressionType.LZ4}, True),
    "without a summary": ({**NO_SUMMARY, "compression": CompressionType.NONE}, True),
    "without chunks": ({"use_chunking": False}, False),
    "without chunks and a summary": ({**NO_SUMMARY, "use_chunking": False}, False),
    "without schemas in its summary": ({"repeat_schemas": False}, True),
    "without channels in its summary": ({"repeat_channels": False}, True),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_an_mcap_file_keeps_all_but_the_transforms_in_its_layout(
    folder: Path, layout: str
) -> None:
    options, has_chunks = LAYOUTS[layout]
    write_mcap(folder / "drive.mcap", **options)
    assert "base_link → laser: off by 40 mm" in rebag(folder, "drive.mcap", "right.mcap")
    before, after = (records_of(folder / name) for name in ("drive.mcap", "right.mcap"))
    assert after[Message][0][0] == "/tf_static"
    for kind in (Message, Attachment):
        kept = [
            [each for each in records[kind] if not each[0].startswith("/tf")]
            for records in (before, after)
        ]
        assert kept[0] == kept[1]
        assert kept[0]
    assert [name for name, _ in after[Metadata]] == ["route", "tfcompose"]
    chunks = [chunk for chunk in before[Chunk] if b"bracket" not in chunk[1]]
    assert (len(chunks) > 3) == has_chunks
    assert set(chunks[2:]) <= set(after[Chunk])
    with (folder / "right.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        ordered = [
            (channel.topic, each.log_time, each.publish_time, each.sequence, each.data)
            for _, channel, each in reader.iter_messages()
        ]
        summary = reader.get_summary()
    assert sorted(ordered) == sorted(after[Message])
    assert summary
    assert summary.statistics
    assert summary.statistics.message_count == len(ordered)
    assert summary.statistics.message_start_time == min(each[1] for each in ordered)
    assert summary.statistics.message_end_time == max(each[1] for each in ordered)


def test_every_file_of_a_split_bag_begins_with_all_fixed_edges(folder: Path) -> None:
    split_bag(folder / "drive")
    rebag(folder, "drive", "right")
    for name in ("part_0.mcap", "part_1.mcap"):
        buffer = buffer_of(folder / "right" / name)
        assert buffer.lookup_transform("base_link", "lens", 0)
        assert buffer.lookup_transform("base_link", "tag", 0), "recorded, and not in the file"
    with Reader(folder / "right") as reader:
        assert reader.message_count == len(messages_of(folder / "right"))


def split_bag(folder: Path) -> None:
    """Write a bag of two files, the second without fixed edges."""
    folder.mkdir()
    merged: dict[str, Any] = {}
    for number, sent in enumerate((RECORDED[:20], RECORDED[20:])):
        part = write_bag(folder / f"part_{number}", sent)
        (part / f"part_{number}.mcap").rename(folder / f"part_{number}.mcap")
        information = yaml.safe_load((part / "metadata.yaml").read_text("utf-8"))
        information = information["rosbag2_bagfile_information"]
        if not merged:
            merged = information
        else:
            merged["relative_file_paths"] += information["relative_file_paths"]
            merged["files"] += information["files"]
            merged["message_count"] += information["message_count"]
            begin, end = (
                each["starting_time"]["nanoseconds_since_epoch"] for each in (merged, information)
            )
            nanoseconds = end - begin + information["duration"]["nanoseconds"]
            merged["duration"]["nanoseconds"] = nanoseconds
            counts = {
                each["topic_metadata"]["name"]: each["message_count"]
                for each in information["topics_with_message_count"]
            }
            for each in merged["topics_with_message_count"]:
                each["message_count"] += counts.get(each["topic_metadata"]["name"], 0)
    text = yaml.safe_dump({"rosbag2_bagfile_information": merged})
    (folder / "metadata.yaml").write_text(text, "utf-8")


@pytest.mark.parametrize("topic", ["/tf_static", "/tf"])
def test_the_pose_that_a_device_calibrated_itself_stays(folder: Path, topic: str) -> None:
    (folder / "cart.yaml").write_text(
        "tfcompose: 1\nrobot: cart\nlinks: {base_link: {}}\nsensors:\n"
        "  camera: {preset: realsense/d435i, parent: base_link, tf: driver}\n",
        "utf-8",
    )
    measured = (0.0, 0.0151, 0.0)
    recorded = [(topic, 0.1, "camera_link", "camera_color_frame", 0.0, measured, UP)]
    write_bag(folder / "drive", recorded)
    assert "camera_link → camera_color_frame" not in rebag(folder, "drive", "right")
    buffer = buffer_of(folder / "right")
    colour = buffer.lookup_transform("camera_link", "camera_color_frame", 0).transform.translation
    assert (colour.x, colour.y, colour.z) == measured
    assert buffer.lookup_transform("base_link", "camera_depth_optical_frame", 0)


def test_frames_are_renamed_in_tf_in_headers_and_at_any_depth(folder: Path) -> None:
    path = message(
        "nav_msgs/msg/Path",
        header=header(0.0, "odom"),
        poses=[
            message(
                "geometry_msgs/msg/PoseStamped",
                header=header(0.0, "/old_laser"),
                pose=message(
                    "geometry_msgs/msg/Pose",
                    position=message("geometry_msgs/msg/Point", x=1.0, y=2.0, z=3.0),
                    orientation=message(
                        "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0
                    ),
                ),
            )
        ],
    )
    sent = [("/tf_static", 0.1, "base_link", "old_laser", 0.0, (0.2, 0.0, 0.3), UP)]
    messages = [*OTHERS, ("/path", 0.4, "nav_msgs/msg/Path", path)]
    write_bag(folder / "drive", sent, messages=messages)
    renames = ("--rename", "/old_laser:=laser", "--rename", "old_lens:=/lens")
    assert "base_link → laser: off by 40 mm" in rebag(folder, "drive", "right", *renames)
    data = {each.topic: each.data for each in messages_of(folder / "right")}
    read: Any = STORE.deserialize_cdr(data["/path"], "nav_msgs/msg/Path")
    assert (read.header.frame_id, read.poses[0].header.frame_id) == ("odom", "laser")
    assert read.poses[0].pose.position.z == 3.0
    info: Any = STORE.deserialize_cdr(data["/camera/camera_info"], "sensor_msgs/msg/CameraInfo")
    assert info.header.frame_id == "lens"
    texts = [each.data for each in messages_of(folder / "right") if each.topic == "/text"]
    assert texts == [each.data for each in messages_of(folder / "drive") if each.topic == "/text"]


def test_a_topic_of_an_unknown_type_is_named(folder: Path) -> None:
    write_bag(folder / "drive", RECORDED, messages=OTHERS, mcap=False)
    with sqlite3.connect(folder / "drive" / "drive.db3") as database:
        database.execute("DELETE FROM message_definitions")
        database.execute("UPDATE topics SET type = 'acme/msg/Beep' WHERE name = '/text'")
    output = rebag(folder, "drive/drive.db3", "right.db3", "--rename", "a:=b")
    assert "warning[TF925] /text" in output


CALIBRATION = """\
image_width: 1280
image_height: 720
camera_name: front
distortion_model: rational_polynomial
camera_matrix: {rows: 3, cols: 3, data: [1, 0, 2, 0, 3, 4, 0, 0, 1]}
distortion_coefficients: {rows: 1, cols: 8, data: [1, 2, 3, 4, 5, 6, 7, 8]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [1, 0, 2, 0, 0, 3, 4, 0, 0, 0, 1, 0]}
"""


def test_camera_info_is_replaced_but_for_its_header_binning_and_region(folder: Path) -> None:
    (folder / "front.yaml").write_text(CALIBRATION, "utf-8")
    write_bag(folder / "drive", RECORDED, messages=OTHERS)
    rebag(folder, "drive", "right", "--camera-info", "/camera/camera_info=front.yaml")
    data = {each.topic: each.data for each in messages_of(folder / "right")}
    info: Any = STORE.deserialize_cdr(data["/camera/camera_info"], "sensor_msgs/msg/CameraInfo")
    assert (info.width, info.height, info.distortion_model) == (1280, 720, "rational_polynomial")
    assert [list(info.d), list(info.k)] == [[1, 2, 3, 4, 5, 6, 7, 8], [1, 0, 2, 0, 3, 4, 0, 0, 1]]
    assert (info.header.frame_id, info.binning_x) == ("old_lens", 2)


@pytest.mark.parametrize("kind", ["mcap", "mcap of compressed messages", "sqlite"])
def test_a_message_that_cannot_be_decoded_stays(folder: Path, kind: str) -> None:
    topic, at_s, type_, info = camera_info(0.3, "old_lens")
    complete = bytes(STORE.serialize_cdr(info, type_))
    parts = complete[:60], complete, complete + bytes(9)
    bag = write_bag(
        folder / "drive", messages=[(topic, at_s, type_, data) for data in parts], **KINDS[kind]
    )
    output = rebag(folder, "drive", "right", "--rename", "old_lens:=lens")
    assert "warning[TF925] 2 messages on /camera/camera_info" in output
    before, after = messages_of(bag), not_tf(messages_of(folder / "right"))
    assert [each.data for each in after][::2] == [each.data for each in before][::2]
    assert b"old_lens" not in after[1].data


@pytest.mark.parametrize("names", ["laser:=", "laser:=/", "/:=laser"])
def test_an_empty_name_of_a_frame_is_refused(folder: Path, names: str) -> None:
    write_bag(folder / "drive", RECORDED)
    assert "--rename" in rebag(folder, "drive", "right", "--rename", names, code=2)
    assert not (folder / "right").exists()


def test_a_database_with_a_log_of_writes_gets_no_new_file(folder: Path) -> None:
    write_bag(folder / "drive", RECORDED, mcap=False)
    with closing(sqlite3.connect(folder / "drive" / "drive.db3")) as database:
        database.execute("PRAGMA journal_mode = WAL")
    before = {each.name for each in (folder / "drive").iterdir()}
    rebag(folder, "drive", "right")
    assert {each.name for each in (folder / "drive").iterdir()} == before


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("drive", "cart.yaml"), "TF924"),
        (("drive/drive.mcap", "right.db3"), "TF924"),
        (("drive/drive.mcap", "right"), "TF924"),
        (("foreign.mcap", "right.mcap"), "TF907"),
        (("drive", "no/folder"), "TF924"),
        (("nothing", "right"), "TF907"),
        (("cart.yaml", "right"), "TF907"),
        (("damaged.mcap", "right.mcap"), "TF907"),
        (("damaged.db3", "right.db3"), "TF907"),
        (("drive", "right", "--camera-info", "/text=cart.yaml"), "TF926"),
        (("drive", "right", "--camera-info", "/text=front.yaml"), "TF926"),
        (("drive", "right", "--camera-info", "/text=nothing.yaml"), "TF001"),
        (("drive", "right", "--camera-info", "/camera/camera_info=endless.yaml"), "TF926"),
        (("drive", "right", "--camera-info", "/camera/camera_info=negative.yaml"), "TF926"),
    ],
)
def test_a_bag_or_file_that_cannot_be_used_is_a_finding(
    folder: Path, words: tuple[str, ...], code: str
) -> None:
    (folder / "front.yaml").write_text(CALIBRATION, "utf-8")
    bag = write_bag(folder / "drive", RECORDED, messages=OTHERS)
    (folder / "damaged.mcap").write_bytes((bag / "drive.mcap").read_bytes()[:-3000])
    for name, width in (("endless", ".inf"), ("negative", "-1")):
        (folder / f"{name}.yaml").write_text(CALIBRATION.replace("1280", width), "utf-8")
    with (folder / "foreign.mcap").open("wb") as stream:
        foreign: Any = Writer(stream)
        foreign.start()
        channel = foreign.register_channel(
            "/beep", "json", foreign.register_schema("beep", "jsonschema", b"{}")
        )
        foreign.add_message(channel, 1, b"{}", 1)
        foreign.finish()
    (folder / "damaged.db3").write_bytes(b"SQLite format 3\0" + bytes(3000))
    before = {each.name for each in folder.iterdir()}
    done = tfcompose_in(folder, "rebag", *words, "--with", "cart.yaml")
    assert done.returncode in {1, 2}
    assert f"error[{code}]" in done.stderr
    if words[1] in {"right", "right.db3"} and words[0].startswith("drive/"):
        assert "right.mcap" in done.stderr
    assert "Traceback" not in done.stderr
    assert {each.name for each in folder.iterdir()} == before


@pytest.mark.parametrize("kind", ["mcap", "sqlite"])
def test_a_full_disk_leaves_no_half_bag(folder: Path, kind: str) -> None:
    many = [("/tf", 0.01 * i, "odom", "base_link", 0.01 * i, UP[:3], UP) for i in range(3000)]
    write_bag(folder / "drive", many, **KINDS[kind])
    command = [sys.executable, "-m", "tfcompose", "rebag", "drive", "right", "--with", "cart.yaml"]
    done = processes.run(
        command,
        cwd=folder,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000)),
    )
    assert (done.returncode, "error[TF924]" in done.stderr) == (1, True), done.stderr
    assert {each.name for each in folder.iterdir()} == {"cart.yaml", "drive"}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_leaves_no_half_bag(folder: Path, number: signal.Signals) -> None:
    many = [("/tf", 0.01 * i, "odom", "base_link", 0.01 * i, UP[:3], UP) for i in range(40_000)]
    write_bag(folder / "drive", many)
    command = [sys.executable, "-m", "tfcompose", "rebag", "drive", "right", "--with", "cart.yaml"]
    process = processes.start(command, cwd=folder)
    assert until(lambda: any(each.name.startswith(".right") for each in folder.iterdir()))
    process.send_signal(number)
    assert process.wait(20) == 130
    assert {each.name for each in folder.iterdir()} == {"cart.yaml", "drive"}


def test_it_needs_no_ros(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    write_bag(folder / "drive", RECORDED)
    tfcompose_without_ros("rebag", "drive", "right", "--with", "cart.yaml")
