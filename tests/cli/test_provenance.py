"""Where each value is from, and what it was laid over.

In findings, and in ``tfcompose explain FILE A B``.
"""

import json
from pathlib import Path

import pytest

from tfcompose.cli import main

BASE = """\
tfcompose: 1
robot: rover
links: {base_link: {}}
frames:
  mast: {parent: base_link, xyz: [0, 0, 0.3]}
  head_optical: {parent: mast, rpy: [-90 deg, 0, -90 deg], owner: static}
"""
ROBOT = """\
include: [base.yaml]
frames:
  mast: {xyz: [0, 0, 0.4]}
profiles:
  tilt: {frames: {head_optical: {axis_angle: {axis: [0, 1, 0], angle: 0}}}}
  far: {frames: {mast: {xyz: [0, 0, 400]}}}
  lost: {frames: {mast: {parent: base_lnk}}}
  bent: {frames: {head_optical: {rpy: [-1.57, 0, -1.57]}}}
"""


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "base.yaml").write_text(BASE, "utf-8")
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    (tmp_path / "over.yaml").write_text("frames: {mast: {xyz: [0, 0, 0.5]}}\n", "utf-8")
    return "robot.yaml"


def test_explain_names_the_place_of_each_value_and_of_all_that_it_replaced(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "explain",
        robot,
        "base_link",
        "mast",
        "-f",
        "over.yaml",
        "--set",
        "frames.mast.xyz=[0, 0, 0.6]",
    ]
    assert main(words) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert "parent: base_link  base.yaml:5:18" in lines
    assert (
        "xyz: [0, 0, 0.6]  --set frames.mast.xyz=[0, 0, 0.6]:1:1"
        ", over over.yaml:1:22, over robot.yaml:3:15, over base.yaml:5:34" in lines
    )


CELL = """\
tfcompose: 1
robot: cell
links: {world: {}}
parts: {left: {spec: robot.yaml, prefix: l_, parent: world, xyz: [1, 0, 0], profiles: [bent]}}
"""


def test_the_values_of_parts_have_their_places_in_the_files_of_the_parts(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("outer.yaml").write_text(
        CELL.replace("robot.yaml", "cell.yaml").replace(", profiles: [bent]", ""), "utf-8"
    )
    Path("cell.yaml").write_text(CELL.replace(robot, "robot.yaml"), "utf-8")
    assert main(["explain", "outer.yaml", "world", "l_l_head_optical"]) == 0
    output = capsys.readouterr()
    lines = [line.strip() for line in output.out.splitlines()]
    assert [line for line in lines if line.startswith("xyz: ")] == [
        "xyz: [1, 0, 0]  outer.yaml:4:65",
        "xyz: [1, 0, 0]  cell.yaml:4:66",
        "xyz: [0, 0, 0.4]  robot.yaml:3:15, over base.yaml:5:34",
    ]
    assert "note: base.yaml:6:37: " in output.err


def test_explain_names_the_rotation_that_another_way_to_write_it_replaced(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["explain", robot, "mast", "head_optical", "--set", "frames.head_optical.look=forward"])
    assert (
        "look: forward  --set frames.head_optical.look=forward:1:1, over base.yaml:6:37"
        in capsys.readouterr().out
    )


@pytest.mark.parametrize(
    ("profile", "found_at", "replaced"),
    [
        ("far", "TF414 robot.yaml:6:37", ["robot.yaml:3:15"]),
        ("lost", "TF203 robot.yaml:7:34", ["base.yaml:5:18"]),
        ("tilt", "TF401 base.yaml:6:26", ["base.yaml:6:37", "axis_angle", "robot.yaml:5:46"]),
    ],
)
def test_a_finding_about_a_replaced_value_names_what_it_replaced(
    robot: str,
    profile: str,
    found_at: str,
    replaced: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    main(["lint", robot, "--profile", profile, "--format", "json"])
    notes_by_line = {
        f"{entry['code']} {entry['file']}:{entry['line']}:{entry['column']}": entry["notes"]
        for entry in json.loads(capsys.readouterr().out)
    }
    (note,) = notes_by_line[found_at]
    assert f"{note['file']}:{note['line']}:{note['column']}" == replaced[0]
    assert all(name in note["message"] for name in replaced[1:])


def test_a_finding_in_a_setting_names_what_it_replaced(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["build", robot, "-o", "out", "--set", "frames.mast.xyz=[0, 0, 400]"])
    output = capsys.readouterr().err
    assert "TF414" in output
    assert "note: robot.yaml:3:15: " in output


def test_a_finding_about_what_nothing_replaced_has_no_such_note(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["lint", robot, "--profile", "far", "--format", "json"])
    entries = [entry for entry in json.loads(capsys.readouterr().out) if entry["code"] != "TF414"]
    assert not [
        note for entry in entries for note in entry["notes"] if "replaces" in note["message"]
    ]
