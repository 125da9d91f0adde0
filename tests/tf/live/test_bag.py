"""``--bag``: MCAP and SQLite, without ROS."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.support import processes
from tests.support.bags import START_S, STORE, UP, Sent, drive, tfcompose_without_ros, write_bag
from tests.support.cli import tfcompose
from tfcompose.cli import main

FIXED: list[Sent] = [("/tf_static", 0.0, "base_link", "laser_link", 0.0, (0.0, 0.0, 0.3), UP)]


def edges(done: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    return {each["child"]: each for each in json.loads(done.stdout)["edges"]}


@pytest.mark.parametrize("mcap", [True, False], ids=["mcap", "sqlite"])
def test_monitor_tells_rates_and_delays_of_a_bag(tmp_path: Path, *, mcap: bool) -> None:
    bag = write_bag(tmp_path / "bag", [*FIXED, *drive()], mcap=mcap)
    observed = edges(tfcompose_without_ros("monitor", "--bag", str(bag), "--format", "json"))
    base, laser = observed["base_link"], observed["laser_link"]
    assert (base["kind"], base["count"], base["publisher"]) == ("dynamic", 200, None)
    assert base["rate"] == pytest.approx(50, rel=1e-3)
    assert base["jitter_s"] == pytest.approx(0, abs=1e-5)
    assert base["delay_s"] == pytest.approx(0.004, abs=1e-6)
    assert (laser["kind"], laser["count"], laser["rate"]) == ("static", 1, None)


@pytest.mark.parametrize("mcap", [True, False], ids=["mcap", "sqlite"])
def test_a_single_file_and_a_folder_without_metadata_are_read_too(
    tmp_path: Path, *, mcap: bool
) -> None:
    bag = write_bag(tmp_path / "bag", [*FIXED, *drive()], mcap=mcap)
    (bag / "metadata.yaml").unlink()
    [file] = bag.iterdir()
    for path in (bag, file):
        assert set(edges(tfcompose("monitor", "--bag", path, "--format", "json"))) == {
            "base_link",
            "laser_link",
        }


def test_the_table_has_a_line_for_each_edge(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", [*FIXED, *drive()])
    lines = tfcompose("monitor", "--bag", bag).stdout.splitlines()
    assert all(number in lines[0] for number in ("2 edges", "201 messages", "4.0 s"))
    assert lines[1].split() == [
        "edge",
        "publisher",
        "kind",
        "rate",
        "jitter",
        "gap",
        "age",
        "delay",
    ]
    assert lines[3].split() == ["base_link", "→", "laser_link", "–", "static"]
    assert lines[2].split()[3:] == [
        "–",
        "dynamic",
        "50.0",
        "Hz",
        "0.0",
        "ms",
        "20.0",
        "ms",
        "4.0",
        "ms",
        "4.0",
        "ms",
    ]


def test_the_table_says_how_many_were_refused(tmp_path: Path) -> None:
    nan = (float("nan"), 0.0, 0.0)
    some = [
        (*sent[:5], nan if index % 10 == 0 else sent[5], UP) for index, sent in enumerate(drive())
    ]
    lines = tfcompose(
        "monitor", "--bag", str(write_bag(tmp_path / "bag", some))
    ).stdout.splitlines()
    assert "  20 of 200 refused" in lines[2]
    bag = write_bag(tmp_path / "all", [(*sent[:5], nan, UP) for sent in drive()])
    assert "  refused" in tfcompose("monitor", "--bag", bag).stdout.splitlines()[2]


def test_a_namespace_is_observed_alone_and_where_tf_is_instead_is_reported(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", drive(topic="/robot1/tf"))
    assert edges(tfcompose("monitor", "--bag", bag, "--namespace", "robot1", "--format", "json"))
    errors = tfcompose("monitor", "--bag", bag, code=2).stderr
    assert all(name in errors for name in ("TF907", "/robot1/tf", "--namespace /robot1"))


def test_what_is_no_bag_is_reported_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mcap").write_text("this is no recording, however long it is\n" * 10)
    (tmp_path / "text.db3").write_text("nor is this")
    (tmp_path / "old.bag").write_text("#ROSBAG V2.0\n")
    full = write_bag(tmp_path / "whole", drive())
    [file] = full.glob("*.mcap")
    (tmp_path / "whole.zstd").write_bytes(b"")
    (tmp_path / "cut.mcap").write_bytes(file.read_bytes()[:2000])
    (tmp_path / "noise.mcap").write_bytes(file.read_bytes().replace(b"/tf", b"\xff\xfe\xfd"))
    for name, why in [
        ("none", "does not exist"),
        ("noise.mcap", "help: mcap recover"),
        ("empty", "no recording"),
        ("text.mcap", "text.mcap"),
        ("text.db3", "text.db3"),
        ("old.bag", "ROS 1"),
        ("cut.mcap", "help: mcap recover"),
        ("whole.zstd", "compressed"),
    ]:
        done = tfcompose("monitor", "--bag", str(tmp_path / name), code=2)
        assert "error[TF907]" in done.stderr
        assert why in done.stderr
        assert done.stdout == ""


def test_without_the_library_it_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setitem(sys.modules, "rosbags", None)
    for words in (["monitor"], ["verify", "robots/my_robot.yaml"], ["tree"], ["echo", "a", "b"]):
        assert main([*words, "--bag", "some.mcap"]) == 2
        output = capsys.readouterr()
        assert "error[TF906]" in output.err
        assert "pip install 'tfcompose[bag]'" in output.err
        assert output.out == ""


def poses(*words: str) -> list[Any]:
    """Return x in metres and the time in seconds of the recording of what is echoed."""
    rows = [
        json.loads(line)
        for line in tfcompose("echo", *words, "--format", "json").stdout.splitlines()
    ]
    return [(row["xyz"][0], row["stamp_ns"] and row["stamp_ns"] / 1e9 - START_S) for row in rows]


@pytest.mark.parametrize("mcap", [True, False], ids=["mcap", "sqlite"])
def test_echo_follows_a_recording_at_the_rate_that_is_requested(
    tmp_path: Path, *, mcap: bool
) -> None:
    bag = str(write_bag(tmp_path / "bag", [*FIXED, *drive()], mcap=mcap))
    rows = poses("odom", "laser_link", "--bag", bag, "--rate", "2")
    assert rows == [
        (pytest.approx(time_s), pytest.approx(time_s, abs=1e-6))
        for time_s in (0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5)
    ]


def test_echo_says_the_first_pose_the_one_at_a_time_or_the_fixed_one(tmp_path: Path) -> None:
    bag = str(write_bag(tmp_path / "bag", [*FIXED, *drive(30.0)]))
    assert poses("odom", "base_link", "--bag", bag, "--once") == [(0.0, 0.0)]
    for time_s in (0.013, 2.25, 29.5):
        [(x, stamp)] = poses("odom", "base_link", "--bag", bag, "--at", f"{START_S + time_s:.9f}")
        assert (x, stamp) == (pytest.approx(time_s, abs=1e-6), pytest.approx(time_s, abs=1e-6))
    [(x, _)] = poses("odom", "base_link", "--bag", bag, "--at=-0.5")
    assert x == pytest.approx(29.98 - 0.5)
    assert poses("base_link", "laser_link", "--bag", bag) == [(0.0, None)]


def test_where_echo_finds_no_pose_in_a_bag_it_says_why(tmp_path: Path) -> None:
    bag = str(write_bag(tmp_path / "bag", [*FIXED, *drive(30.0)]))
    for words, why in [
        (("odom", "lasr_link"), "laser_link?"),
        (("odom", "base_link", "--at", f"{START_S - 1}"), "oldest sample is 1000 ms"),
        (("odom", "base_link", "--at", f"{START_S + 31}"), "newest sample is 1020 ms"),
    ]:
        errors = tfcompose("echo", *words, "--bag", bag, code=1).stderr
        assert "error[TF814]" in errors
        assert why in errors
    assert "does not exist" in tfcompose("echo", "a", "b", "--bag", "none", code=2).stderr


@pytest.mark.parametrize(
    ("mcap", "compressed"),
    [
        (True, CompressionMode.FILE),
        (True, CompressionMode.MESSAGE),
        (True, CompressionMode.STORAGE),
        (False, CompressionMode.FILE),
        (False, CompressionMode.MESSAGE),
    ],
)
def test_compressed_bags_are_read(
    tmp_path: Path, compressed: CompressionMode, *, mcap: bool
) -> None:
    bag = write_bag(tmp_path / "bag", [*FIXED, *drive()], mcap=mcap, compressed=compressed)
    observed = edges(tfcompose("monitor", "--bag", bag, "--format", "json"))
    assert (observed["base_link"]["count"], observed["laser_link"]["count"]) == (200, 1)


@pytest.mark.parametrize("mcap", [True, False], ids=["mcap", "sqlite"])
def test_a_bag_that_was_split_is_read_in_order_without_its_metadata_too(
    tmp_path: Path, *, mcap: bool
) -> None:
    """The recorder writes metadata.yaml when it ends, and numbers the files: 10 comes after 9."""
    folder = tmp_path / "split"
    folder.mkdir()
    for part in range(11):
        sent = [transform for transform in drive(11.0) if part <= transform[1] < part + 1]
        [file] = [
            f
            for f in write_bag(tmp_path / f"part_{part}", sent, mcap=mcap).iterdir()
            if f.suffix != ".yaml"
        ]
        file.rename(folder / f"run_{part}{file.suffix}")
    base = edges(tfcompose("monitor", "--bag", folder, "--format", "json"))["base_link"]
    assert (base["count"], base["stamps_back"]) == (550, 0)
    assert base["longest_gap_s"] == pytest.approx(0.02, abs=1e-5)
    stamps = [time_s for _, time_s in poses("odom", "base_link", "--bag", str(folder))]
    assert stamps == pytest.approx(list(range(11)), abs=0.03)


def test_a_bag_without_messages_differs_from_one_of_another_type(tmp_path: Path) -> None:
    text = ("/tf", 0.0, "std_msgs/msg/String", STORE.types["std_msgs/msg/String"]("a"))
    strange = write_bag(tmp_path / "strange", [], messages=[text])
    errors = tfcompose("monitor", "--bag", strange, code=2).stderr
    assert all(
        name in errors
        for name in (f"/tf in {strange}", "std_msgs/msg/String", "tf2_msgs/msg/TFMessage")
    )
    silent = tmp_path / "silent"
    with Writer(silent, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        writer.add_connection("/tf", "tf2_msgs/msg/TFMessage", typestore=STORE)
    errors = tfcompose("monitor", "--bag", silent, code=1).stderr
    assert "error[TF811]" in errors


def test_a_bag_with_another_definition_of_the_message_is_not_misread(tmp_path: Path) -> None:
    """Somebody put a number behind the transforms."""
    store = get_typestore(Stores.ROS2_JAZZY)
    changed = "geometry_msgs/TransformStamped[] transforms\nint32 number\n"
    changed_store = get_typestore(Stores.EMPTY)
    changed_store.register(
        {
            name: fields
            for name, fields in store.fielddefs.items()
            if name != "tf2_msgs/msg/TFMessage"
        }
    )
    changed_store.register(get_types_from_msg(changed, "tf2_msgs/msg/TFMessage"))
    bag = tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(
            "/tf", "tf2_msgs/msg/TFMessage", typestore=changed_store
        )
        message = changed_store.types["tf2_msgs/msg/TFMessage"]([], 7)
        writer.write(connection, 1, changed_store.serialize_cdr(message, "tf2_msgs/msg/TFMessage"))
    errors = tfcompose("monitor", "--bag", bag, code=2).stderr
    assert all(name in errors for name in ("error[TF907]", "/tf", "tf2_msgs/msg/TFMessage"))


def test_messages_that_cannot_be_read_are_counted(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/tf", "tf2_msgs/msg/TFMessage", typestore=STORE)
        for time_ns in range(3):
            writer.write(connection, time_ns, b"\x00\x01\x00\x00\xff\xff\xff\x7f none")
    output = tfcompose("monitor", "--bag", bag).stdout
    assert all(number in output for number in ("0 edges", "0 messages", "3 unreadable"))


def test_stamps_of_a_simulation_are_compared_with_the_recorded_clock(
    tmp_path: Path,
) -> None:
    def clock(at_s: float) -> tuple[str, float, str, Any]:
        seconds, nanoseconds = divmod(round(at_s * 1e9), 10**9)
        time = STORE.types["builtin_interfaces/msg/Time"](seconds, nanoseconds)
        return (
            "/clock",
            at_s,
            "rosgraph_msgs/msg/Clock",
            STORE.types["rosgraph_msgs/msg/Clock"](time),
        )

    sent: list[Sent] = [
        (topic, time_s, a, b, stamp - START_S, xyz, q)
        for topic, time_s, a, b, stamp, xyz, q in drive()
    ]
    with_clock = write_bag(
        tmp_path / "sim", sent, messages=[clock(index / 100) for index in range(400)]
    )
    without = write_bag(tmp_path / "lost", sent)
    base = edges(tfcompose("monitor", "--bag", str(with_clock), "--format", "json"))["base_link"]
    assert base["delay_s"] == pytest.approx(0.0, abs=0.011)
    assert "other clock" in tfcompose("monitor", "--bag", str(without)).stdout


def test_what_ended_before_the_recording_did_is_silent(tmp_path: Path) -> None:
    robot = tmp_path / "rover.yaml"
    robot.write_text(
        "{tfcompose: 1, robot: rover, frames: {odom: {}, base_link: {parent: odom, owner: drive,"
        " rate: 50 Hz}}, processes: {drive: {external: true, node: diff_drive}}}"
    )
    text = STORE.types["std_msgs/msg/String"]("a")
    chatter = [("/chatter", float(second), "std_msgs/msg/String", text) for second in range(20)]
    bag = write_bag(tmp_path / "bag", drive(4.0), messages=chatter)
    output = tfcompose("verify", str(robot), "--bag", str(bag), code=1).stdout
    assert all(
        name in output
        for name in ("error[TF804]", "drive (/diff_drive)", "odom → base_link", "15 s")
    )


def test_a_large_bag_takes_no_more_memory_than_a_small_one(tmp_path: Path) -> None:
    """Messages are read one after the other.

    Of MCAP a chunk at a time, and this writer makes one chunk of all.
    """

    def most_kib(seconds: float) -> int:
        bag = write_bag(tmp_path / f"bag_{seconds}", drive(seconds, 500.0), mcap=False)
        program = (
            "import sys; from tfcompose.cli import main; main(sys.argv[1:]); "
            "sys.stderr.write(open('/proc/self/status').read().split('VmHWM:')[1].split()[0])"
        )
        command = [sys.executable, "-c", program, "monitor", "--bag", str(bag)]
        return int(processes.run(command, check=True).stderr)

    small, large = most_kib(2.0), most_kib(100.0)
    assert large < small + 5_000, (small, large)
