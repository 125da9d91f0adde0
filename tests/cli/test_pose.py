"""``tfcompose pose``: what it prints is the pose of B in A, and it says what moves on the way."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.findings import words_of
from tfcompose.cli import main

ROBOT = """
tfcompose: 1
robot: r
links: {base_link: {}, arm: {}, hand: {}}
joints:
  pan: {type: continuous, parent: base_link, child: arm, xyz: [0, 0, 1], rpy: [0.1, 0.2, 0.3]}
  tilt: {type: continuous, parent: arm, child: hand, xyz: [0.5, 0, 0], rpy: [-0.4, 0.5, 0.6]}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, xyz: [3, 0, 0], rate: 50}
  mast: {parent: base_link, xyz: [1, 2, 3], rpy: [0.7, -0.8, 0.9]}
  marker: {}
  corner: {parent: marker, xyz: [0, 1, 0]}
processes: {drive: {external: true}}
rules: {TF204: off}
"""


@pytest.fixture
def robot(tmp_path: Path) -> str:
    (tmp_path / "r.yaml").write_text(ROBOT)
    return str(tmp_path / "r.yaml")


def matrix(xyz: list[float], rotation: Rotation) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation.as_matrix(), xyz
    return made


def test_the_pose_up_one_branch_and_down_another(
    robot: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def step(xyz: list[float], rpy: list[float]) -> np.ndarray:
        return matrix(xyz, Rotation.from_euler("xyz", rpy))

    mast = step([1, 2, 3], [0.7, -0.8, 0.9])
    hand = step([0, 0, 1], [0.1, 0.2, 0.3]) @ step([0.5, 0, 0], [-0.4, 0.5, 0.6])
    assert main(["pose", robot, "mast", "hand", "--format", "json"]) == 0
    output = json.loads(capsys.readouterr().out)
    assert (output["parent"], output["child"]) == ("mast", "hand")
    expected = np.linalg.inv(mast) @ hand
    assert matrix(output["xyz"], Rotation.from_quat(output["quat_xyzw"])) == pytest.approx(
        expected, abs=1e-11
    )
    assert matrix(output["xyz"], Rotation.from_euler("xyz", output["rpy"])) == pytest.approx(
        expected, abs=1e-11
    )


@pytest.mark.parametrize(
    ("a", "b", "moving"),
    [
        ("base_link", "mast", ""),
        ("mast", "mast", ""),
        ("mast", "arm", "pan"),
        ("hand", "mast", "tilt, pan"),
        ("odom", "mast", "odom → base_link"),
        ("odom", "hand", "pan, tilt"),
    ],
)
def test_what_moves_on_the_way_is_named_and_nothing_else(
    robot: str, a: str, b: str, moving: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["pose", robot, a, b]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"pose of {b} in {a}"
    assert len(lines) == 5 + bool(moving)
    assert moving in lines[-1]


@pytest.mark.parametrize("command", ["pose", "explain"])
def test_between_two_trees_there_is_no_pose(
    robot: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, robot, "mast", "corner"]) == 1
    output = capsys.readouterr()
    assert (output.out, words_of(output.err) >= {"mast", "corner"}) == ("", True)
    assert main([command, robot, "mast", "conrer"]) == 1
    assert " corner?" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", ["pose {} a", "pose --format text a {}", "pose a --set vars.x=1 {}", "explain a {}"]
)
def test_two_frames_alone_are_those_of_the_robot_file_here(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (
        "tfcompose: 1\nrobot: r\nvars: {x: 2}\nframes: {a: {}, b: {parent: a, xyz: ['${x}', 0,"
        " 0]}}\n"
    )
    (tmp_path / "robot.yaml").write_text(text)
    (tmp_path / "other.yaml").write_text(text.replace("x: 2", "x: 7"))
    monkeypatch.chdir(tmp_path)
    assert main(words.format("b").split()) == 0
    here = capsys.readouterr().out
    assert "xyz 7" not in here
    assert "7, 0, 0" not in here
    assert main(["pose", "other.yaml", "--format", "json", "a", "b"]) == 0
    assert json.loads(capsys.readouterr().out)["xyz"] == [7, 0, 0]
