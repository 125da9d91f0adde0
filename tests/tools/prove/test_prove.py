"""``tfcompose prove`` on recordings of a rover that MuJoCo simulates."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import camera_info, header, message, tfcompose_without_ros, write_bag
from tests.support.cli import tfcompose_in
from tests.support.simulated_rover import (
    MOUNTS,
    RECORDING,
    Measured,
    Mount,
    messages_of,
    robot_file,
    simulate,
)

ROBOT = """\
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  camera_link: {parent: base_link, xyz: [0.3, 0, 0.3]}
  camera_optical_frame: {parent: camera_link, rpy: [-90 deg, 0, -90 deg]}
sensors:
  front_imu: {preset: generic/imu, parent: base_link, xyz: [5 cm, 0.02, 0.03]}
processes:
  drive: {external: true, node: diff_drive}
"""
MOUNT_LINE = 9
Sent = list[tuple[str, float, str, Any]]


@pytest.fixture(scope="module")
def driven() -> Measured:
    return simulate(seed=4, cloud_rate=0, seconds=16)


@pytest.fixture
def record(tmp_path: Path, driven: Measured) -> Callable[..., Path]:
    """Return a function that writes robot.yaml and a bag, and returns their folder."""

    def write(
        *messages: tuple[str, float, str, Any],
        frame: str = "front_imu_link",
        factors: tuple[float, float, float] = (1, 1, 1),
        robot: str = ROBOT,
    ) -> Path:
        flipped = Measured(
            [(time_s, force * factors, rate * factors) for time_s, force, rate in driven.imu],
            driven.odometry,
        )
        sent = messages_of(flipped, {"imu": frame})
        write_bag(tmp_path / "bag", messages=sorted([*sent, *messages], key=lambda each: each[1]))
        (tmp_path / "robot.yaml").write_text(robot, "utf-8")
        return tmp_path

    return write


def prove(
    folder: Path, *words: str, bag: str | Path = "bag", code: int = 0
) -> tuple[dict[tuple[str, str], Any], str]:
    """Return the checks by sensor and name, and what went to stderr."""
    command = ("prove", "robot.yaml", "--bag", str(bag), "--format", "json", *words)
    done = tfcompose_in(folder, *command)
    assert done.returncode == code, done.stdout + done.stderr
    checks = json.loads(done.stdout)["checks"]
    return {(each["sensor"], each["check"]): each for each in checks}, done.stderr


def test_a_right_mount_agrees_with_measured_values(record: Callable[..., Path]) -> None:
    checks, errors = prove(record())
    assert {name: check["answer"] for (_, name), check in checks.items()} == {
        "frame": "agrees",
        "gravity": "agrees",
        "yaw rate": "agrees",
        "heading": "agrees",
    }
    assert checks["front_imu", "yaw rate"]["values"]["scale"] == pytest.approx(1, abs=0.1)
    assert not errors


#: An IMU upside down about x sends these signs.
FLIPPED = (1.0, -1.0, -1.0)


def test_fix_writes_the_rotation_that_fits_and_leaves_the_rest(
    record: Callable[..., Path],
) -> None:
    folder = record(factors=FLIPPED)
    checks, errors = prove(folder, code=1)
    assert checks["front_imu", "gravity"]["code"] == "TF650"
    assert f"robot.yaml:{MOUNT_LINE}:" in errors
    assert "[180 deg, 0 deg, 0 deg]" in errors
    checks, errors = prove(folder, "--fix")
    assert {check["answer"] for check in checks.values()} == {"agrees"}
    expected = ROBOT.replace("0.03]}", "0.03], rpy: [180 deg, 0, 0]}")
    assert (folder / "robot.yaml").read_text("utf-8") == expected


def test_a_value_that_a_variable_holds_is_not_edited(record: Callable[..., Path]) -> None:
    robot = ROBOT.replace("0.03]}", '0.03], rpy: ["${roll}", 0, 0]}').replace(
        "frames:\n", "vars: {roll: 0 deg}\nframes:\n"
    )
    folder = record(factors=FLIPPED, robot=robot)
    _, errors = prove(folder, "--fix", code=1)
    assert "TF650" in errors
    assert "${roll}" in errors, "the reason names it"
    assert (folder / "robot.yaml").read_text("utf-8") == robot


def test_rules_of_the_file_set_the_limit(record: Callable[..., Path]) -> None:
    robot = ROBOT.replace("0.03]}", "0.03], rpy: [0, 6 deg, 0]}")
    folder = record(robot=robot)
    assert "TF650" in prove(folder, code=1)[1]
    (folder / "robot.yaml").write_text(robot + "rules: {TF650: {limit: 10 deg}}\n", "utf-8")
    prove(folder)


def test_a_comment_allows_a_mount_that_differs(record: Callable[..., Path]) -> None:
    comment = "0.03]}  # tfcompose: allow TF650 because it is bent"
    folder = record(factors=FLIPPED, robot=ROBOT.replace("0.03]}", comment))
    checks, errors = prove(folder)
    assert checks["front_imu", "gravity"]["answer"] == "differs"
    assert "TF650" not in errors


def test_forces_of_another_scale_are_the_drivers_fault(
    record: Callable[..., Path],
) -> None:
    folder = record(factors=(2.0, 2.0, 2.0))
    _, errors = prove(folder, code=1)
    assert "TF651" in errors
    assert "TF650" not in errors


@pytest.mark.parametrize(
    ("frame", "answer"),
    [("camera_optical_frame", "agrees"), ("camera_link", "differs"), ("lens", "differs")],
)
def test_images_need_a_declared_optical_frame(
    frame: str, answer: str, record: Callable[..., Path]
) -> None:
    folder = record(*(camera_info(index / 10, frame) for index in range(5)))
    checks, errors = prove(folder, code=int(answer == "differs"))
    name = next(sensor for sensor, check in checks if check == "frame" and sensor != "front_imu")
    assert checks[name, "frame"]["answer"] == answer
    assert ("TF652" in errors) == (answer == "differs")


@pytest.mark.parametrize(
    ("robot", "names", "advice"),
    [
        (ROBOT, ("front_imo", "mast"), ("did you mean front_imu?", "mast", "are front_imu")),
        (ROBOT.partition("sensors:")[0], ("mast",), ("mast", "no sensors")),
    ],
    ids=["unknown names", "an unknown frame without sensors"],
)
def test_an_unknown_sensor_or_frame_is_refused(
    robot: str, names: tuple[str, ...], advice: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "robot.yaml").write_text(robot.replace("odom, owner: drive, rate: 20 Hz", "odom"))
    done = tfcompose_in(tmp_path, "prove", "robot.yaml", *names)
    assert done.returncode == 2
    assert all(text in done.stderr for text in advice), done.stderr
    assert not done.stdout


def test_a_robot_without_sensors_says_that_nothing_came_in_its_frames(
    tmp_path: Path, driven: Measured
) -> None:
    sent = [
        each for each in messages_of(driven, {"imu": "front_imu_link"}) if "Imu" not in each[2]
    ]
    write_bag(tmp_path / "bag", messages=sent)
    frames, _, rest = ROBOT.partition("sensors:")
    robot = f"{frames}processes:{rest.partition('processes:')[2]}"
    (tmp_path / "robot.yaml").write_text(robot, "utf-8")
    done = tfcompose_in(tmp_path, "prove", "robot.yaml", "--bag", "bag")
    assert done.returncode == 2
    assert "no sensors" in done.stderr


def test_only_named_sensors_are_checked(record: Callable[..., Path]) -> None:
    folder = record(camera_info(0.0, "camera_link"))
    checks, _ = prove(folder, "front_imu")
    assert {sensor for sensor, _ in checks} == {"front_imu"}
    done = tfcompose_in(folder, "prove", "robot.yaml", "frnt_imu", "--bag", "bag")
    assert done.returncode == 2
    assert "front_imu" in done.stderr


def test_a_sensor_that_sent_nothing_cannot_be_judged(record: Callable[..., Path]) -> None:
    folder = record(frame="camera_link")
    checks, _ = prove(folder, "front_imu", code=2)
    assert checks["front_imu", "data"]["answer"] == "cannot tell"


def test_bad_input_is_refused_before_anything_is_read(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    done = tfcompose_in(tmp_path, "prove", "robot.yaml", "--bag", "none")
    assert (done.returncode, "TF907" in done.stderr) == (2, True)
    done = tfcompose_in(tmp_path, "prove", "robot.yaml", "--bag", "none", "--for", "3")
    assert done.returncode == 2
    for duration in ("-1 s", "5 m", "soon", "0"):
        done = tfcompose_in(tmp_path, "prove", "robot.yaml", "--for", duration)
        assert (done.returncode, "--for" in done.stderr) == (2, True)
    done = tfcompose_in(tmp_path, "prove", "none.yaml", "--for", "1 s")
    assert (done.returncode, "TF001" in done.stderr) == (2, True)


def test_a_recording_needs_no_ros(record: Callable[..., Path]) -> None:
    folder = record()
    done = tfcompose_without_ros("prove", str(folder / "robot.yaml"), "--bag", str(folder / "bag"))
    assert "front_imu: gravity agrees" in done.stdout


def test_a_presets_topic_needs_the_frame_of_its_sensor(record: Callable[..., Path]) -> None:
    """The driver's topic, moved by a remapping, has the frame of another sensor."""
    scanner = (
        "sensors:\n  scanner: {preset: rplidar/a2, parent: base_link, xyz: [0.1, 0, 0.2],"
        " driver: {remap: {scan: front_scan}}}\n"
    )
    scan = message(
        "sensor_msgs/msg/LaserScan",
        header=header(1.0, "camera_link"),
        angle_min=0.0, angle_max=1.0, angle_increment=0.5, time_increment=0.0, scan_time=0.1,
        range_min=0.1, range_max=9.0,
        ranges=np.ones(3, dtype=np.float32), intensities=np.zeros(0, dtype=np.float32),
    )  # fmt: skip
    sent = ("/scanner/front_scan", 1.0, "sensor_msgs/msg/LaserScan", scan)
    folder = record(sent, robot=ROBOT.replace("sensors:\n", scanner))
    checks, errors = prove(folder, code=1)
    assert checks["scanner", "frame"]["code"] == "TF652"
    assert "instead of scanner" in errors


LIDAR = """\
tfcompose: 1
robot: rover
frames:
  odom: {}
  base_footprint: {parent: odom, owner: drive, rate: 20 Hz}
  base_link: {parent: base_footprint, xyz: [0, 0, 0.2]}
sensors:
  front: {preset: generic/lidar3d, parent: base_link, xyz: [0.3, 0.2, 36 cm]}
processes:
  drive: {external: true, node: diff_drive}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "robot",
    [
        LIDAR,
        LIDAR.replace("robot: ", "ground: floor\nrobot: ").replace(
            "0.2]}\nsensors", "0.5]}\n  floor: {parent: base_link, xyz: [0, 0, -0.2]}\nsensors"
        ),
    ],
    ids=["base_footprint", "ground"],
)
def test_the_floor_shows_a_lidars_height_and_fix_writes_it(robot: str, tmp_path: Path) -> None:
    """The lidar is 0.4 m above the base, which is not the root."""
    measured = simulate(seed=5, seconds=9)
    del measured.clouds["rear"], measured.clouds["camera"]
    sent = messages_of(measured, {"imu": "base_link", "front": "front_link"})
    write_bag(tmp_path / "bag", messages=[each for each in sent if each[0] != "/imu"])
    (tmp_path / "robot.yaml").write_text(robot, "utf-8")
    checks, errors = prove(tmp_path, code=1)
    assert checks["front", "height"]["code"] == "TF653"
    assert checks["front", "height"]["values"]["off_m"] == pytest.approx(0.04, abs=0.005)
    assert checks["front", "forward"]["answer"] == "agrees"
    line = 1 + robot[: robot.index("36 cm")].count("\n")
    assert f"robot.yaml:{line}:" in errors
    prove(tmp_path, "--fix")
    expected = robot.replace("36 cm", "40 cm")
    assert (tmp_path / "robot.yaml").read_text("utf-8") == expected


@pytest.mark.parametrize("option", ["--as", "--robot"])
def test_fix_writes_the_overlay_of_one_robot(option: str, record: Callable[..., Path]) -> None:
    robot = ROBOT.replace("frames:", "overlays: {by: hostname, folder: overlays}\nframes:", 1)
    folder = record(factors=FLIPPED, robot=robot)
    overlay = folder / "overlays/ant.yaml"
    overlay.parent.mkdir()
    if option == "--robot":
        overlay.write_text("tfcompose: 1\nsensors: {front_imu: {rpy: [0, 0, 1 deg]}}  # mine\n")
    checks, errors = prove(folder, "--fix", option, "ant")
    assert {check["answer"] for check in checks.values()} == {"agrees"}
    assert "wrote overlays/ant.yaml" in errors
    assert (folder / "robot.yaml").read_text("utf-8") == robot
    text = overlay.read_text("utf-8")
    assert "rpy: [180 deg, 0" in text
    assert ("# mine" in text) == (option == "--robot")
    assert "tool: prove" in text.partition("x-adjustments:")[2]
    assert "from: bag" in text
    prove(folder, "--robot", "ant")
    undone = tfcompose_in(
        folder, "calibrate", "robot.yaml", "front_imu", "--robot", "ant", "--undo"
    )
    assert undone.returncode == 0, undone.stderr
    prove(folder, "--robot", "ant", code=1)


def test_fix_joins_a_mounts_poses_and_leaves_what_a_setting_places(tmp_path: Path) -> None:
    x, y, z = MOUNTS["front"].xyz
    mounts = MOUNTS | {"front": Mount((x, y, z - 0.05), (0.0, 5.0, 0.0))}
    robot = robot_file(mounts).replace("frames:", "overlays: {folder: units}\nframes:")
    (tmp_path / "robot.yaml").write_text(robot, "utf-8")
    options = ("imu", "front", "--set", "sensors.imu.rpy=[180 deg, 0, 0]")
    checks, errors = prove(tmp_path, *options, bag=RECORDING, code=1)
    assert "--set" in errors
    assert "--as NAME" not in errors, "the overlay would be refused"
    assert {checks["front", check]["code"] for check in ("floor", "height")} == {"TF650", "TF653"}
    checks, errors = prove(tmp_path, *options, "--fix", "--as", "ant", bag=RECORDING, code=1)
    differing = {key for key, each in checks.items() if each["answer"] == "differs"}
    assert differing == {("imu", "gravity")}
    assert "TF662" in errors
    assert "units/ant.yaml" in errors
    text = (tmp_path / "units/ant.yaml").read_text("utf-8")
    assert text.count("tool: prove") == 1
    undone = tfcompose_in(tmp_path, "calibrate", "robot.yaml", "front", "--robot", "ant", "--undo")
    assert undone.returncode == 0, undone.stderr
    assert "front" not in (tmp_path / "units/ant.yaml").read_text("utf-8")


def test_a_robot_without_overlays_and_two_names_are_refused(record: Callable[..., Path]) -> None:
    folder = record(factors=FLIPPED)
    assert "TF" in prove_text(folder, "--fix", "--as", "ant", code=1)
    assert prove_text(folder, "--as", "ant", code=2)
    assert prove_text(folder, "--fix", "--as", "ant", "--robot", "bee", code=2)


def prove_text(folder: Path, *words: str, code: int) -> str:
    """Return what went to stderr."""
    done = tfcompose_in(folder, "prove", "robot.yaml", "--bag", "bag", *words)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stderr


@pytest.mark.parametrize(
    ("sensor", "rpy_deg", "check"),
    [
        ("imu", MOUNTS["imu"].rpy_deg, None),
        ("imu", (180.0, 0.0, 0.0), "gravity"),
        ("front", (0.0, 0.0, 90.0), "forward"),
        ("rear", (0.0, 5.0, 180.0), "floor"),
        ("camera", (0.0, 25.0, 0.0), "floor"),
    ],
)
def test_the_kept_recording_of_all_sensors_differs_from_a_wrong_mount_only(
    sensor: str, rpy_deg: tuple[float, float, float], check: str | None, tmp_path: Path
) -> None:
    mount = Mount(MOUNTS[sensor].xyz, rpy_deg)
    (tmp_path / "robot.yaml").write_text(robot_file(MOUNTS | {sensor: mount}), "utf-8")
    checks, _ = prove(tmp_path, bag=RECORDING, code=0 if check is None else 1)
    answers = [each["answer"] for each in checks.values()]
    assert answers.count("agrees") >= 15, "nearly all checks can tell"
    differing = {key for key, each in checks.items() if each["answer"] == "differs"}
    frame = "camera_optical_frame" if sensor == "camera" else sensor
    assert differing == ({(frame, check)} if check else set())
