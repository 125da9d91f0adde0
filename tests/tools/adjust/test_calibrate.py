"""``tfcompose calibrate``: results of calibration tools in the overlay of one robot."""

import math
import os
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
import yourdfpy
from scipy.spatial.transform import Rotation

from tests.support.cli import tfcompose_in
from tests.support.house import ROOT

SECTION = "overlays: {by: hostname, folder: overlays}"
LENS = "eye_color_optical_frame"
#: The measured pose of the lens in the tool.
XYZ, RPY_DEG = [0.004, -0.066, 0.0235], [1.0, -0.4, 0.2]
QUAT = Rotation.from_euler("xyz", RPY_DEG, degrees=True).as_quat()
ROVER = f"""\
tfcompose: 1
robot: rover
links: {{base_link: {{visual: {{box: [2, 2, 2]}}}}}}
rules: {{TF640: off}}
{SECTION}
frames:
  imu: {{parent: base_link, xyz: [0.1, 0, 0.2]}}
sensors:
  camera:
    preset: realsense/d435i
    parent: imu
    tf: tfcompose
    driver: none
    place: camera_color_optical_frame
    xyz: [0.1, 0, 0]
    look: left
"""


def handeye(parent: str = "tool0", child: str = LENS, xyz: list[float] = XYZ) -> str:
    names = ("x", "y", "z", "w")
    return yaml.safe_dump(
        {
            "parameters": {
                "calibration_type": "eye_in_hand",
                "robot_effector_frame": parent,
                "tracking_base_frame": child,
            },
            "transform": {
                "translation": dict(zip(names, xyz, strict=False)),
                "rotation": {name: float(x) for name, x in zip(names, QUAT, strict=True)},
            },
        }
    )


@pytest.fixture
def picker(tmp_path: Path) -> Path:
    text = (ROOT / "robots/picker.yaml").read_text("utf-8")
    (tmp_path / "robot.yaml").write_text(f"{text}\n{SECTION}\n", "utf-8")
    shutil.copytree(ROOT / "robots/calibration", tmp_path / "calibration")
    (tmp_path / "new.calib").write_text(handeye(), "utf-8")
    return tmp_path


def transform(folder: Path, parent: str, child: str) -> Any:
    """Return the pose of a link in another one, as yourdfpy reads the built URDF."""
    built = tfcompose_in(folder, "build", "-o", "out", "--robot", "arm7")
    assert built.returncode == 0, built.stderr
    urdf = yourdfpy.URDF.load(str(folder / "out/robot.urdf"), load_meshes=False)
    return urdf.get_transform(child, parent)


def expected() -> Any:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_quat(QUAT).as_matrix(), XYZ
    return pose


#: Results of several tools, each with the pose of the lens in the tool.
KIT = {
    "tool0": {
        LENS: dict(zip(("x", "y", "z"), XYZ, strict=True))
        | dict(zip(("roll", "pitch", "yaw"), map(math.radians, RPY_DEG), strict=True)),
        "gripper": dict.fromkeys(("x", "y", "z", "roll", "pitch", "yaw"), 0.0),
    }
}
FORMATS = {"easy_handeye2": handeye(), "autoware": yaml.safe_dump(KIT)}


def findings(text: str) -> set[tuple[str, str]]:
    """Return (place, code) of the findings on stderr."""
    return set(re.findall(r"^(\S.*?): \w+\[(TF\d+)\]", text, re.MULTILINE))


@pytest.mark.parametrize("form", FORMATS)
def test_a_calibration_of_the_wrist_places_the_lens_of_this_robot(picker: Path, form: str) -> None:
    (picker / "new.calib").write_text(FORMATS[form], "utf-8")
    options = ("eye", "--with", "new.calib", "--robot", "arm7")
    ended = tfcompose_in(picker, "calibrate", *options, "--picture", "eye.svg")
    assert ended.returncode == 0, ended.stderr
    before, after = ([*map(float, line.split()[1:])] for line in ended.stdout.splitlines()[2:4])
    assert before[:3] == [2.1, -68.7, 22.6]
    assert after == [4.0, -66.0, 23.5, 1.0, -0.4, 0.2]
    moved = np.linalg.norm(np.subtract(after[:3], before[:3]))
    assert f"moved {moved:.2f} mm" in ended.stdout
    assert transform(picker, "tool0", LENS) == pytest.approx(expected(), abs=2e-7)
    assert (picker / "eye.svg").read_text("utf-8").startswith("<svg")
    overlay = yaml.safe_load((picker / "overlays/arm7.yaml").read_text("utf-8"))
    (adjustment,) = overlay["x-adjustments"]["sensors.eye"]
    assert adjustment["tool"] == "calibrate"
    assert adjustment["from"] == f"new.calib ({form})"
    assert adjustment["replaced"]["xyz"] == [0.0021, -0.0687, 0.0226]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", adjustment["date"])
    assert tfcompose_in(picker, "lint", "robot.yaml").stdout == "no findings in 1 file\n"


def test_undo_restores_each_earlier_pose(picker: Path) -> None:
    path = picker / "overlays/arm7.yaml"
    options = ("calibrate", "eye", "--robot", "arm7")
    assert tfcompose_in(picker, *options, "--with", "new.calib").returncode == 0
    first = path.read_text("utf-8")
    (picker / "new.calib").write_text(handeye(xyz=[0.003, -0.067, 0.0235]), "utf-8")
    assert tfcompose_in(picker, *options, "--with", "new.calib").returncode == 0
    assert path.read_text("utf-8") != first
    assert "moved 1.41 mm" in tfcompose_in(picker, *options, "--undo").stdout
    assert path.read_text("utf-8") == first
    assert tfcompose_in(picker, *options, "--undo").returncode == 0
    assert path.read_text("utf-8") == "tfcompose: 1\n"
    assert transform(picker, "tool0", LENS)[0, 3] == pytest.approx(0.0021)
    ended = tfcompose_in(picker, *options, "--undo")
    assert (ended.returncode, {code for _, code in findings(ended.stderr)}) == (1, {"TF663"})


def test_calibrate_replaces_a_pose_of_a_file_for_all_mounts(picker: Path) -> None:
    text = (picker / "robot.yaml").read_text("utf-8")
    inline = re.compile("^    calibration: .*\n", re.MULTILINE)
    text = f"{inline.sub('', text)}\ncalibrations: [calibration/picker.calib]\n"
    (picker / "robot.yaml").write_text(text, "utf-8")
    ended = tfcompose_in(picker, "calibrate", "eye", "--with", "new.calib", "--robot", "arm7")
    assert ended.returncode == 0, ended.stderr
    assert transform(picker, "tool0", LENS) == pytest.approx(expected(), abs=2e-7)
    assert tfcompose_in(picker, "lint", "robot.yaml").stdout == "no findings in 1 file\n"


def test_the_hostname_names_the_overlay(picker: Path) -> None:
    node = tfcompose_in(picker, "calibrate", "eye", "--with", "new.calib")
    assert node.returncode == 0
    (file,) = (picker / "overlays").iterdir()
    assert file.name == f"{os.uname().nodename}.yaml"


def test_kalibr_has_names_of_its_own_and_the_mount_is_solved_for(tmp_path: Path) -> None:
    imu_from_camera = np.eye(4)
    imu_from_camera[:3, :3] = Rotation.from_euler("xyz", [-90, 0, 1], degrees=True).as_matrix()
    imu_from_camera[:3, 3] = [0.1, 0.02, 0]
    camera_from_imu = np.linalg.inv(imu_from_camera)
    chain = {"cam0": {"T_cam_imu": camera_from_imu.tolist()}}
    (tmp_path / "robot.yaml").write_text(ROVER, "utf-8")
    (tmp_path / "bag-camchain-imucam.yaml").write_text(yaml.safe_dump(chain), "utf-8")
    names = ("--parent", "imu0", "--child", "cam0", "--robot", "arm7")
    ended = tfcompose_in(tmp_path, "calibrate", "camera", "--with", "kalibr", *names)
    assert ended.returncode == 0, ended.stderr
    measured = transform(tmp_path, "imu", "camera_color_optical_frame")
    assert measured == pytest.approx(imu_from_camera, abs=2e-7)


@pytest.mark.parametrize(
    ("tool", "folder", "name"),
    [
        ("easy_handeye2", "home/.ros2/easy_handeye2/calibrations", "eye.calib"),
        ("CalibrationTools", ".", "calibration_results.yaml"),
    ],
)
def test_a_tools_name_stands_for_its_newest_result(
    tool: str, folder: str, name: str, picker: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(picker / "home"))
    options = ("calibrate", "eye", "--with", tool, "--robot", "arm7")
    ended = tfcompose_in(picker, *options)
    assert (ended.returncode, "[TF668]" in ended.stderr) == (1, True), ended.stderr
    file = picker / folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(handeye() if tool == "easy_handeye2" else FORMATS["autoware"], "utf-8")
    old = file.with_stem(f"{file.stem}_old")
    old.write_text("no calibration", "utf-8")
    os.utime(old, (1, 1))
    ended = tfcompose_in(picker, *options)
    assert ended.returncode == 0, ended.stderr
    assert name in ended.stdout.partition("\n")[0]
    assert transform(picker, "tool0", LENS) == pytest.approx(expected(), abs=2e-7)


@pytest.mark.parametrize(
    ("arguments", "place", "code"),
    [
        (("eyes", "--with", "new.calib"), "robot.yaml:36:1", "TF660"),
        (("wrist_3", "--with", "new.calib"), "robot.yaml:30:46", "TF661"),
        (("bench", "--with", "new.calib"), "robot.yaml:12:3", "TF661"),
        (("eye", "--with", "robot.yaml"), "--with robot.yaml:1:39", "TF611"),
        (("eye", "--with", "none.calib"), "--with none.calib:1:39", "TF610"),
        (("workpiece", "--with", "new.calib"), "--with new.calib:1:44", "TF612"),
        (("eye", "--undo"), "robot.yaml:52:1", "TF663"),
        (("eye", "--with", "new.calib", "--robot", "../arm7"), "robot.yaml:52:1", "TF023"),
    ],
)
def test_what_cannot_be_calibrated_is_a_finding(
    picker: Path, arguments: tuple[str, ...], place: str, code: str
) -> None:
    options = () if "--robot" in arguments else ("--robot", "arm7")
    ended = tfcompose_in(picker, "calibrate", *arguments, *options)
    assert ended.returncode == 1
    assert findings(ended.stderr) == {(place, code)}
    assert not (picker / "overlays").exists()


def test_a_robot_file_without_overlays_says_what_to_add(picker: Path) -> None:
    text = (picker / "robot.yaml").read_text("utf-8")
    (picker / "robot.yaml").write_text(text.replace(SECTION, ""), "utf-8")
    ended = tfcompose_in(picker, "calibrate", "eye", "--with", "new.calib", "--robot", "arm7")
    assert findings(ended.stderr) == {("robot.yaml:1:1", "TF023")}
    assert SECTION in ended.stderr


@pytest.mark.parametrize(
    ("calibration", "code"),
    [(handeye(xyz=[0.03, -0.066, 0.0235]), "TF616"), (handeye(LENS, "tool0"), "TF615")],
    ids=["far", "inverse"],
)
def test_a_doubtful_pose_needs_force(picker: Path, calibration: str, code: str) -> None:
    (picker / "new.calib").write_text(calibration, "utf-8")
    options = ("calibrate", "eye", "--with", "new.calib", "--robot", "arm7")
    ended = tfcompose_in(picker, *options)
    assert ended.returncode == 1
    assert {actual for _, actual in findings(ended.stderr)} == {code}
    assert not (picker / "overlays").exists()
    assert tfcompose_in(picker, *options, "--force").returncode == 0
    assert (picker / "overlays/arm7.yaml").exists()


def test_a_dry_run_writes_no_overlay(picker: Path) -> None:
    options = ("--robot", "arm7", "--dry-run")
    ended = tfcompose_in(picker, "calibrate", "eye", "--with", "new.calib", *options)
    assert ended.returncode == 0
    assert "moved" in ended.stdout
    assert not (picker / "overlays").exists()
