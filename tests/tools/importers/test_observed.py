"""Trees that were observed, live or in a bag, imported."""

from pathlib import Path

import pytest

from tests.support.bags import START_S, UP, write_bag
from tests.support.bringups import compiled
from tests.support.importing import PRESETS
from tests.support.tree_history import BEGUN_NS, END_NS, TreeHistory, sound_tree
from tfcompose.cli import main
from tfcompose.spec.load import load
from tfcompose.tf.live.publishers import Publisher
from tfcompose.tf.live.state import NO_NODE
from tfcompose.tools.importers.draft import ImportDraft
from tfcompose.tools.importers.observed import Observed, parse_command_line, round_rate


def drafted(history: TreeHistory, where: str = "", words: tuple[str, ...] = ()) -> ImportDraft:
    draft = ImportDraft("rover")
    Observed(draft, lambda _: where, lambda _: words).add(history.observer.edges(END_NS))
    return draft


def test_edges_have_their_values_rates_and_owners(tmp_path: Path) -> None:
    words = ("/opt/ros/jazzy/lib/drive/driver", "--fast", "--ros-args", "-r", "__node:=drive")
    draft = drafted(sound_tree(), "on this machine as pid 7: …", words)
    data = load(draft.text(), "robot.yaml").data
    assert data["frames"] == {
        "odom": {},
        "base_link": {"parent": "odom", "owner": "drive", "rate": "50 Hz"},
        "laser": {"parent": "base_link", "owner": "static_2", "static": True},
    }
    assert data["processes"] == {
        "drive": {"external": True},
        "static_2": {"external": True, "node": "/static"},
    }
    assert "package: drive, executable: driver, args: [" in draft.text()
    result = compiled(draft.text(), tmp_path)
    assert result.robot
    assert not result.errors


UPRIGHT, OPTICAL = (0.0, 0.0, 0.0, 1.0), (-0.5, 0.5, -0.5, 0.5)
#: The frames of a camera of the D400 series, with their parents, positions, rotations and senders.
CAMERA = {
    "cam_bottom_screw_frame": ("base_link", (0.3, 0.0, 0.2), UPRIGHT, b"s"),
    "cam_link": ("cam_bottom_screw_frame", (0.0106, 0.0175, 0.0125), UPRIGHT, b"s"),
    "cam_depth_frame": ("cam_link", (0.0, 0.0, 0.0), UPRIGHT, b"e"),
    "cam_depth_optical_frame": ("cam_depth_frame", (0.0, 0.0, 0.0), OPTICAL, b"e"),
    "cam_color_frame": ("cam_link", (-0.0002, 0.0148, 0.0001), UPRIGHT, b"e"),
    "cam_color_optical_frame": ("cam_color_frame", (0.0, 0.0, 0.0), OPTICAL, b"e"),
}


def test_a_calibrated_camera_that_fits_several_models_stays_a_question() -> None:
    history = TreeHistory().knows(b"s", b"e")
    for child, (parent, xyz, quat_xyzw, gid) in CAMERA.items():
        history.takes((parent, child, 0, 0, *xyz, *quat_xyzw), gid, BEGUN_NS, static=True)
    draft = ImportDraft("rover")
    observed = Observed(draft, lambda _: "", lambda _: ())
    observed.add(history.observer.edges(END_NS))
    observed.recognise(PRESETS)
    assert any(
        "realsense/d435i" in note for note in draft.notes["frames", "cam_bottom_screw_frame"]
    )
    assert "cam_color_frame" in draft.sections["frames"]


def test_a_second_publisher_is_named() -> None:
    draft = drafted(sound_tree().moving("map base_link", b"x"))
    assert [finding.code for finding in draft.findings] == ["TF020"]


def test_a_publisher_that_is_no_ros_node_is_external_with_what_it_is(tmp_path: Path) -> None:
    history = TreeHistory().moving("odom base_link", b"dds")
    history.observer.take_graph([Publisher(b"dds", NO_NODE, static=False)])
    draft = drafted(history)
    assert draft.sections["processes"] == {"external": {"external": True}}
    assert any(NO_NODE in note for note in draft.notes["processes", "external"])
    assert not compiled(draft.text(), tmp_path).errors


@pytest.mark.parametrize(
    ("measured", "expected"),
    [
        (49.7, 50),
        (10.02, 10),
        (29.4, 30),
        (0.99, 1),
        (7.49, 7.5),
        (43.9, 43),
        (201, 200),
        (None, None),
        (0.0, None),
    ],
)
def test_rates_are_round_where_a_round_one_is_near(
    measured: float | None, expected: float | None
) -> None:
    assert round_rate(measured) == expected


def test_a_comment_names_a_node_whose_name_is_another_one_at_each_start() -> None:
    node = "static_transform_publisher_aB3dE6gH9jK2mN5p"
    history = TreeHistory().takes(
        ("base_link", "laser", 0, 0, 0.0, 0.0, 0.0, *UPRIGHT), b"s", BEGUN_NS, static=True
    )
    history.observer.take_graph([Publisher(b"s", f"/{node}", static=True)])
    text = drafted(history).text()
    assert "name changes at each start" in text


def test_a_command_line_names_its_package() -> None:
    assert parse_command_line(("python3", "/ws/install/drive/lib/drive/node", "-v")) == {
        "package": "drive",
        "executable": "node",
        "args": ["-v"],
    }
    assert parse_command_line(("/usr/bin/rviz2",)) == {}
    assert parse_command_line(()) == {}


def test_a_bag_becomes_a_robot_that_verify_finds_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    turned = (0.0, 0.0, 0.38268343236508984, 0.9238795325112867)
    sent = [("/tf_static", 0.0, "base_link", "laser", 0.0, (0.1, 0.0, 0.25), turned)]
    sent += [
        ("/tf", tick / 20, "odom", "base_link", tick / 20, (tick / 20, 0.0, 0.0), UP)
        for tick in range(100)
    ]
    bag, out = write_bag(tmp_path / "bag", sent), tmp_path / "robot.yaml"
    assert START_S
    assert main(["import", "--bag", str(bag), "-o", str(out)]) == 0
    data = load(out.read_text("utf-8"), str(out)).data
    assert data["frames"]["laser"] == {
        "parent": "base_link",
        "xyz": [0.1, 0, 0.25],
        "rpy": [0, 0, "45 deg"],
    }
    assert data["frames"]["base_link"] == {"parent": "odom", "owner": "recorded", "rate": "20 Hz"}
    capsys.readouterr()
    assert main(["verify", str(out), "--bag", str(bag)]) == 0, capsys.readouterr().out


SENSED = """
tfcompose: 1
robot: r
links: {base_link: {}}
sensors:
  front: {preset: realsense/d435i, parent: base_link, xyz: [0.1, 0, 0.2], driver: none, options: {imu: true}}
"""  # noqa: E501 (a text as its reader has it)


def test_sensors_of_a_recording_have_their_presets(tmp_path: Path) -> None:
    robot = compiled(SENSED, tmp_path).robot
    assert robot
    edges = [
        ("/tf_static", 0.0, edge.parent, edge.child, 0.0, edge.pose.xyz, edge.pose.quat_xyzw)
        for edge in robot.edges
    ]
    bag, out = write_bag(tmp_path / "bag", edges), tmp_path / "robot.yaml"
    assert main(["import", "--bag", str(bag), "-o", str(out)]) == 0
    data = load(out.read_text("utf-8"), str(out)).data
    assert data["sensors"] == {
        "front": {
            "preset": "realsense/d435i",
            "parent": "base_link",
            "xyz": [0.1, 0, 0.2],
            "options": {"imu": True},
            "driver": "none",
        },
    }
    assert data["frames"] == {"base_link": {}}
    assert main(["verify", str(out), "--bag", str(bag)]) == 0
    assert main(["import", "--bag", str(bag), "-o", str(out), "--force", "--no-sensors"]) == 0
    assert "front_depth_frame" in load(out.read_text("utf-8"), str(out)).data["frames"]
