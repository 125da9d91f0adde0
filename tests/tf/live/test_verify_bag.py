"""``verify --bag`` and ``tree --bag`` at the command line, without ROS."""

import json
import math
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.support.bags import UP, Sent, drive, tfcompose_without_ros, write_bag
from tests.support.cli import tfcompose
from tfcompose.foundation.geometry import quat_from_rpy

ROBOT = """\
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  laser_link: {parent: base_link, xyz: [0, 0, 0.3]}
  mast_link: {parent: base_link}
processes:
  drive: {external: true, node: diff_drive}
"""


def fixed(child: str, z: float = 0.0, pitch: float = 0.0) -> Sent:
    return ("/tf_static", 0.0, "base_link", child, 0.0, (0.0, 0.0, z), quat_from_rpy(0, pitch, 0))


RIGHT = [fixed("laser_link", 0.3), fixed("mast_link"), *drive()]


@pytest.fixture
def robot(tmp_path: Path) -> str:
    file = tmp_path / "rover.yaml"
    file.write_text(ROBOT)
    return str(file)


def test_a_right_bag_is_as_expected(tmp_path: Path, robot: str) -> None:
    bag = write_bag(tmp_path / "bag", RIGHT)
    output = tfcompose_without_ros("verify", robot, "--bag", str(bag)).stdout
    assert all(word in output for word in ("rover", "3 of 3", str(bag)))


def test_a_built_plan_or_its_folder_does_as_well(tmp_path: Path, robot: str) -> None:
    bag = write_bag(tmp_path / "bag", [*RIGHT[1:], fixed("laser_link", 0.4)])
    tfcompose("build", robot, "-o", str(tmp_path / "out"))
    for plan in (tmp_path / "out", tmp_path / "out" / "plan.json"):
        output = tfcompose("verify", plan, "--bag", str(bag), code=1).stdout
        assert all(
            name in output
            for name in ("error[TF846]", "base_link → laser_link", "100 mm", "rover.yaml:6")
        )


def test_what_is_wrong_is_reported_with_the_place_in_the_file(tmp_path: Path, robot: str) -> None:
    bag = write_bag(
        tmp_path / "bag",
        [fixed("laser_link", 0.3, math.radians(2)), fixed("mast", 0.5), *drive(rate=20)],
    )
    output = tfcompose("verify", robot, "--bag", bag, code=1).stdout
    for line, code in ((5, "TF805"), (6, "TF846"), (7, "TF811")):
        assert re.findall(rf"{robot}:{line}:\d+: error\[(TF\d+)\]", output) == [code]
    assert all(
        name in output
        for name in (" 2 deg", " mast?", " 20 Hz", "warning[TF803] base_link → mast ")
    )
    assert all(word in output.splitlines()[-1] for word in ("0 of 3", str(bag)))


def test_the_tolerance_is_the_given_one(tmp_path: Path, robot: str) -> None:
    bag = write_bag(
        tmp_path / "bag",
        [fixed("laser_link", 0.304, math.radians(2)), fixed("mast_link"), *drive()],
    )
    for words, code in (("5mm,3deg", 0), ("5 mm", 1), ("3deg", 1), ("0.5cm,0.1rad", 0)):
        tfcompose("verify", robot, "--bag", bag, "--tolerance", words, code=code)
    for words in ("5", "5mm,3mm", "five", "5 ft", "-1mm"):
        assert (
            "--tolerance"
            in tfcompose("verify", robot, "--bag", bag, f"--tolerance={words}", code=2).stderr
        )


def test_warnings_alone_fail_only_where_they_are_to(tmp_path: Path, robot: str) -> None:
    bag = write_bag(tmp_path / "bag", [*RIGHT, fixed("table")])
    tfcompose("verify", robot, "--bag", bag)
    tfcompose("verify", robot, "--bag", bag, "--fail-on", "warning", code=1)


def test_json_is_a_list_of_findings_as_lints(tmp_path: Path, robot: str) -> None:
    bag = write_bag(tmp_path / "bag", RIGHT[1:])
    [finding] = json.loads(
        tfcompose("verify", robot, "--bag", bag, "--format", "json", code=1).stdout
    )
    assert (finding["code"], finding["name"], finding["line"]) == ("TF811", "edge_never_seen", 6)


def test_junit_has_a_case_for_each_edge(tmp_path: Path, robot: str) -> None:
    bag = write_bag(tmp_path / "bag", [*RIGHT[1:], fixed('t<a>&"\x01ble')])
    root = ET.fromstring(  # noqa: S314
        tfcompose("verify", robot, "--bag", bag, "--format", "junit", code=1).stdout
    )
    [suite] = root
    assert (suite.get("tests"), suite.get("failures")) == ("4", "1")
    cases = {(case.get("classname"), case.get("name")): case for case in suite}
    assert set(cases) == {
        ("rover.drive", "odom → base_link"),
        ("rover.static", "base_link → laser_link"),
        ("rover.static", "base_link → mast_link"),
        ("rover.undeclared", 'base_link → t<a>&"?ble'),
    }
    failure = cases["rover.static", "base_link → laser_link"].find("failure")
    assert failure is not None
    assert failure.get("type") == "TF811"
    assert cases["rover.static", "base_link → mast_link"].find("failure") is None


@pytest.mark.parametrize(
    ("sent", "code", "names"),
    [
        (
            [
                fixed("mast_link"),
                ("/tf_static", 0.0, "odom", "laser_link", 0.0, (0.0, 0.0, 0.3), UP),
                *drive(),
            ],
            "TF802",
            ["odom → laser_link", "base_link → laser_link"],
        ),
        (
            [
                fixed("mast_link"),
                ("/tf", 0.0, "base_link", "laser_link", 0.0, (0.0, 0.0, 0.3), UP),
                *drive(),
            ],
            "TF809",
            ["base_link → laser_link", "/tf,", "/tf_static"],
        ),
        (
            [
                *RIGHT[:2],
                *drive(2.0),
                (*fixed("laser_link", 0.3)[:1], 9.0, *fixed("laser_link", 0.3)[2:]),
            ],
            "TF804",
            ["fell silent", "odom → base_link", "7.02 s"],
        ),
        (
            [*RIGHT[:2], *(transform for transform in drive() if not 1.0 < transform[1] < 2.0)],
            "TF804",
            ["was silent", "odom → base_link", "1.02 s"],
        ),
    ],
    ids=["parent", "topic", "silent", "gap"],
)
def test_each_difference_is_reported_of_a_bag_without_a_publisher(
    tmp_path: Path, robot: str, sent: list[Sent], code: str, names: list[str]
) -> None:
    bag = write_bag(tmp_path / "bag", sent)
    [finding] = json.loads(
        tfcompose("verify", robot, "--bag", bag, "--format", "json", code=1).stdout
    )
    assert (finding["code"], [name for name in names if name not in finding["message"]]) == (
        code,
        [],
    )


def test_wrong_use_and_what_cannot_be_read_is_exit_code_2(tmp_path: Path, robot: str) -> None:
    bag = write_bag(tmp_path / "bag", RIGHT)
    tfcompose("verify", robot, "--bag", bag, "--live", code=2)
    tfcompose("tree", "--bag", bag, "--live", code=2)
    tfcompose("monitor", "--bag", bag, "--for", "3", code=2)
    tfcompose("verify", str(tmp_path / "none.yaml"), "--bag", str(bag), code=2)
    tfcompose("verify", robot, "--bag", str(tmp_path / "none"), code=2)
    tfcompose("verify", str(tmp_path / "bag"), "--bag", str(bag), code=2)


def test_without_ros_the_running_tree_is_no_traceback(robot: str) -> None:
    observing = (
        ("monitor",),
        ("tree", "--live"),
        ("graph", "--live"),
        ("echo", "a", "b"),
        ("doctor",),
        ("doctor", robot),
    )
    for words in (("verify", robot), *observing):
        done = tfcompose_without_ros(*words, code=2)
        first, advice = (done.stdout + done.stderr).splitlines()
        assert first.startswith("error[TF901]")
        assert "pip install 'tfcompose[ros]'" in advice


def test_the_tree_of_a_bag_says_what_is_expected_unexpected_and_missing(
    tmp_path: Path, robot: str
) -> None:
    bag = write_bag(tmp_path / "bag", [fixed("laser_link", 0.3), fixed("table"), *drive()])
    rows = tfcompose("tree", robot, "--bag", bag).stdout.splitlines()
    assert rows[0] == "odom"
    assert [row.replace("├── ", "").replace("└── ", "").split()[0] for row in rows[1:]] == [
        "base_link",
        "laser_link",
        "mast_link",
        "table",
    ]
    assert "50.0 Hz" in rows[1]
    assert rows[2].endswith("expected")
    assert rows[3].endswith("missing: owner static (/tfcompose_static)")
    assert rows[4].endswith("unexpected")


def test_the_tree_in_a_json_file_has_the_shape_of_the_published_one(
    tmp_path: Path, robot: str
) -> None:
    bag = write_bag(tmp_path / "bag", RIGHT)
    planned = json.loads(tfcompose("tree", robot, "--format", "json").stdout)
    published = json.loads(tfcompose("tree", robot, "--bag", bag, "--format", "json").stdout)
    [of_file], [of_bag] = planned["trees"], published["trees"]
    assert of_file["root"] == of_bag["root"] == "odom"
    names = [
        [(edge["parent"], edge["child"]) for edge in tree["edges"]] for tree in (of_file, of_bag)
    ]
    assert names[0] == names[1]
    rates = [(edge["owner"], edge["rate"]) for edge in of_file["edges"]]
    assert rates == [("drive", 50), ("static", None), ("static", None)]


def test_disconnected_trees_and_loops_are_shown_as_such(tmp_path: Path) -> None:
    loop: list[Sent] = [
        ("/tf", 0.0, a, b, 0.0, (0.0, 0.0, 0.0), UP)
        for a, b in (("x", "y"), ("y", "z"), ("z", "x"), ("z", "leaf"))
    ]
    bag = write_bag(
        tmp_path / "bag", [*RIGHT, ("/tf", 0.0, "world", "table", 0.0, (0.0, 0.0, 0.0), UP), *loop]
    )
    output = tfcompose("tree", "--bag", bag).stdout
    heading, *parts = output.split("\n\n")
    assert heading.startswith("3 ")
    assert parts[0].startswith("odom\n└── base_link")
    assert parts[1].startswith("world\n└── table")
    assert parts[2].splitlines()[0].endswith(": x → y → z → x")
    assert "\nleaf " in parts[2]
    trees = json.loads(tfcompose("tree", "--bag", bag, "--format", "json").stdout)["trees"]
    assert [(tree["root"], len(tree["edges"])) for tree in trees] == [
        ("odom", 3),
        ("world", 1),
        (None, 4),
    ]
    assert trees[2]["loop"] == ["x", "y", "z", "x"]
