"""Clearpath's robot.yaml and Autoware's calibration files, imported."""

from pathlib import Path

import pytest
import yaml
from scipy.spatial.transform import Rotation

from tests.support.bringups import compiled, import_of, places, printed_errors
from tests.support.importing import PRESETS
from tfcompose.cli import compiling, main
from tfcompose.foundation.geometry import angle_between


@pytest.fixture(autouse=True)
def _one_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "library", lambda: PRESETS)


SENSORS = """base_link:
  sensor_kit_base_link: {x: 0.9, y: 0.0, z: 2.0, roll: -0.001, pitch: 0.015, yaw: -0.0364}
"""
KIT = """sensor_kit_base_link:
  camera0/camera_link:
    x: 0.10731
    y: 0.56343
    z: -0.27697
    roll: -0.025
    pitch: 0.315
    yaw: 1.035
  gnss_link: {x: -0.1, y: 0.0, z: -0.2, roll: 0.0, pitch: 0.0, yaw: 0.0, spare: 1}
"""


def test_calibrations_of_autoware_are_frames(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "sensor_kit_calibration.yaml").write_text(KIT, encoding="utf-8")
    source = tmp_path / "sensors_calibration.yaml"
    source.write_text(SENSORS, encoding="utf-8")
    text, data = import_of(source, str(tmp_path / "sensor_kit_calibration.yaml"))
    assert list(data["frames"]) == [
        "base_link",
        "sensor_kit_base_link",
        "camera0/camera_link",
        "gnss_link",
    ]
    robot = compiled(text, tmp_path).robot
    assert robot
    camera = next(edge for edge in robot.edges if edge.child == "camera0/camera_link")
    assert camera.pose.xyz == (0.10731, 0.56343, -0.27697)
    expected = Rotation.from_euler("xyz", (-0.025, 0.315, 1.035)).as_quat()
    assert angle_between(camera.pose.quat_xyzw, tuple(expected)) < 1e-9
    assert places(printed_errors(capsys), "TF020") == ["sensor_kit_calibration.yaml:9"]


def individual_params(folder: Path, **kits: dict[str, str]) -> Path:
    """Write a package of individual parameters.

    By vehicle, the kits with their calibrations below the kit's base.
    """
    for vehicle, texts in kits.items():
        for kit, text in texts.items():
            inner = folder / "individual_params/config" / vehicle / kit
            inner.mkdir(parents=True)
            (inner / "sensors_calibration.yaml").write_text(SENSORS, encoding="utf-8")
            (inner / "sensor_kit_calibration.yaml").write_text(text, encoding="utf-8")
    return folder / "individual_params"


WITHOUT_GNSS = KIT.partition("  gnss_link")[0]


def test_the_vehicle_chooses_among_autowares_individual_parameters(tmp_path: Path) -> None:
    moved = WITHOUT_GNSS.replace("x: 0.10731", "x: 0.2")
    source = individual_params(
        tmp_path, default={"kit": KIT.replace(", spare: 1", "")}, lexus={"kit": moved}
    )
    text, data = import_of(source)
    assert data["args"] == {
        "vehicle_id": {"type": "string", "default": "default", "choices": ["default", "lexus"]}
    }
    assert data["frames"]["gnss_link"]["when"] == "${args.vehicle_id == 'default'}"
    for vehicle, x in (("default", 0.10731), ("lexus", 0.2)):
        robot = compiled(text, tmp_path, vehicle_id=vehicle).robot
        assert robot
        poses = {edge.child: edge.pose.xyz[0] for edge in robot.edges}
        assert poses["camera0/camera_link"] == x
        assert ("gnss_link" in poses) is (vehicle == "default")
    text, data = import_of(source, "vehicle_id:=lexus")
    assert data["args"]["vehicle_id"]["default"] == "lexus"


def test_a_single_vehicle_is_no_argument_and_one_of_several_kits_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = individual_params(tmp_path, default={"a": KIT, "b": KIT})
    for words in (
        (),
        ("sensor_model:=c",),
        ("sensor_model:=a", "vehicle_id:=lexus"),
        ("other:=a",),
    ):
        assert exit_code("import", str(source), *words) in {1, 2}, words
    assert "sensor_model:=a|b" in printed_errors(capsys)
    _, data = import_of(source, "sensor_model:=b")
    assert "args" not in data
    assert data["frames"]["gnss_link"]["calibration"].endswith(
        "config/default/b/sensor_kit_calibration.yaml"
    )
    assert exit_code("import", str(tmp_path / "individual_params/config/default")) == 1
    _, data = import_of(
        tmp_path / "individual_params/config/default/a"
    )  # as in the description of a kit
    assert list(data["frames"])[:3] == ["base_link", "sensor_kit_base_link", "camera0/camera_link"]


def exit_code(*words: str) -> object:
    try:
        return main(list(words))
    except SystemExit as stopped:
        return stopped.code


XACRO = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">'
BASE = (
    '<link name="base_link"/><link name="top"/><joint name="t" type="fixed"><parent'
    ' link="base_link"/>'
)
JOINT = (
    '<joint name="${name}_joint" type="fixed"><xacro:insert_block name="origin"/><parent'
    ' link="${parent_link}"/>'
)
#: Macros in the places and with the parameters of Clearpath's; the figures are made up.
FILES = {
    "clearpath_platform_description/urdf/common.urdf.xacro": '<xacro:macro name="nothing"/>',
    "clearpath_platform_description/urdf/a200/a200.urdf.xacro": (
        '<xacro:arg name="is_sim" default="false"/><xacro:macro name="a200"'
        f' params="wheel:=default">{BASE}<child link="top"/><origin xyz="0 0'
        ' 0.2"/></joint></xacro:macro>'
    ),
    "clearpath_mounts_description/urdf/pacs/bracket.urdf.xacro": (
        '<xacro:macro name="bracket" params="name parent_link model:=none *origin"><link'
        f' name="${{name}}_mount"/>{JOINT}<child link="${{name}}_mount"/></joint></xacro:macro>'
    ),
    "clearpath_sensors_description/urdf/hokuyo_ust.urdf.xacro": (
        '<xacro:macro name="hokuyo_ust" params="name parent_link *origin"><link'
        f' name="${{name}}_link"/><xacro:unless value="$(arg is_sim)">{JOINT}<child'
        ' link="${name}_link"/></joint></xacro:unless></xacro:macro>'
    ),
}
CLEARPATH = """serial_number: a200-0000
version: 0
system:
  hosts: []
  ros2: {namespace: a200_0000}
mounts:
  bracket:
  - parent: top
    xyz: [0.1, 0.0, 0.05]
    rpy: [0.0, 0.0, 0.5]
    model: horizontal
sensors:
  lidar2d:
  - model: hokuyo_ust
    urdf_enabled: true
    launch_enabled: true
    parent: bracket_0_mount
    xyz: [0.0, 0.0, 0.01]
    rpy: [0.0, 0.0, 0.0]
    ros_parameters: {urg_node: {ip_address: 192.168.131.20}}
  - {model: sick_lms1xx, urdf_enabled: false, parent: top, xyz: [0, 0, 0], rpy: [0, 0, 0]}
"""


def test_clearpaths_robot_has_the_frames_of_its_macros(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, macro in FILES.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{XACRO}{macro}</robot>", encoding="utf-8")
    source = tmp_path / "robot.yaml"
    source.write_text(CLEARPATH, encoding="utf-8")
    packages = dict.fromkeys(name.partition("/")[0] for name in FILES)
    words = [word for name in packages for word in ("--package", f"{name}={tmp_path / name}")]
    text, data = import_of(source, *words)
    assert data["ros"] == {"namespace": "a200_0000", "isolate": "topics"}
    assert list(data["parts"]) == ["platform", "bracket_0", "lidar2d_0"]
    robot = compiled(text, tmp_path).robot
    assert robot
    assert {(edge.name, edge.pose.xyz) for edge in robot.edges} == {
        ("base_link → top", (0, 0, 0.2)),
        ("top → bracket_0_mount", (0.1, 0, 0.05)),
        ("bracket_0_mount → lidar2d_0_link", (0, 0, 0.01)),
    }
    lines = [
        CLEARPATH[: CLEARPATH.index(words)].count("\n") + 1
        for words in ("hosts", "model: hokuyo", "{model: sick")
    ]
    assert sorted(places(printed_errors(capsys), "TF020")) == sorted(
        f"robot.yaml:{line}" for line in lines
    )


ARM = """serial_number: a200-0000
version: 0
system:
  ros2: {namespace: /a200_0000/, domain_id: 5}
platform:
  attachments:
  - {name: arch, type: a200.sensor_arch, enabled: false, parent: default_mount, xyz: [0, 0, 0], rpy: [0, 0, 0]}
  - {name: bumper, type: a200.bumper, parent: front_bumper_mount, xyz: [0, 0, 0], rpy: [0, 0, 0]}
manipulators:
  arms:
  - model: kinova_gen3_6dof
    parent: top
    xyz: [0.1, 0.0, 0.05]
    rpy: [0.0, 0.0, 0.0]
    ip: 10.0.0.4
    gripper: {model: robotiq_2f_85, xyz: [0, 0, 0.01], rpy: [0, 0, 0]}
"""  # noqa: E501 (a text as its reader has it)


def test_a_clearpath_arm_carries_its_gripper_and_omits_disabled_parts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "robot.yaml"
    source.write_text(ARM, encoding="utf-8")
    main(["import", str(source), "--keep-going", "-o", str(tmp_path / "out.yaml")])
    data = yaml.safe_load((tmp_path / "out.yaml").read_text(encoding="utf-8"))
    assert data["ros"] == {"namespace": "a200_0000", "isolate": "topics", "domain_id": 5}
    assert list(data["parts"]) == ["platform", "bumper", "arm_0", "arm_0_gripper"]
    gripper = data["parts"]["arm_0_gripper"]
    assert gripper["params"]["parent_link"] == "arm_0_end_effector_link"
    assert gripper["macro"] == "robotiq_2f_85"
    assert "robot.yaml:7" in places(printed_errors(capsys), "TF020")
    arm = data["parts"]["arm_0"]["params"]
    assert (arm["gripper_joint_name"], arm["robot_ip"]) == (
        "arm_0_gripper_robotiq_85_left_knuckle_joint",
        "10.0.0.4",
    )


USUAL = """serial_number: a200-0000
platform:
  attachments:
  - {name: plate, type: top_plate}
  - {name: front, type: a200.bumper}
  - {name: arch, type: a200.sensor_arch}
  - {name: fender, type: j100.fender}
links:
  mesh:
  - {name: cover, visual: {package: covers, path: meshes/cover.stl}, offset_xyz: [0, 0, 1]}
mounts:
  post:
  - {model: dual}
sensors:
  camera:
  - {model: stereolabs_zed, ros_parameters: {stereolabs_zed: {general.camera_model: zed2i}}}
"""


def test_clearpath_entries_take_the_defaults_of_its_generator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "robot.yaml"
    source.write_text(USUAL, encoding="utf-8")
    main(["import", str(source), "-o", str(tmp_path / "out.yaml")])
    parts = yaml.safe_load((tmp_path / "out.yaml").read_text(encoding="utf-8"))["parts"]
    params = {name: part["params"] for name, part in parts.items() if name != "platform"}
    assert {name: value["parent_link"] for name, value in params.items()} == {
        "plate": "default_mount",
        "front": "front_bumper_mount",
        "arch": "default_mount",
        "fender": "base_link",
        "cover": "default_mount",
        "post_0": "default_mount",
        "camera_0": "default_mount",
    }
    models = {name: value["model"] for name, value in params.items() if "model" in value}
    assert models == {
        "plate": "default",
        "front": "default",
        "arch": "sensor_arch_300",
        "fender": "default",
        "post_0": "dual",
        "camera_0": "zed2i",
    }
    assert params["cover"]["visual"] == "package://covers/meshes/cover.stl"
    assert "robot.yaml:10" in places(printed_errors(capsys), "TF020")


def test_another_yaml_file_is_refused(tmp_path: Path) -> None:
    source = tmp_path / "other.yaml"
    source.write_text("a: {b: 1}\n", encoding="utf-8")
    assert main(["import", str(source)]) == 1
