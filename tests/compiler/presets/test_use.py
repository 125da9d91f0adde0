"""What a robot makes of presets.

Who publishes, what the driver is told, what is refused, and presets of one's own.
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.findings import expect
from tests.support.presets import MAST, WRONG_IN_MAST
from tests.support.texts import robot_in
from tfcompose.cli import compiling
from tfcompose.cli.commands import presets as presets_command
from tfcompose.cli.compiling import library
from tfcompose.cli.parser import main
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.resolve.presets import fill_name
from tfcompose.model.robot import Edge, Process, Robot
from tfcompose.spec.language.preset import Chosen

KNOWN = library()
NAMES = KNOWN.names
HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"


def compiled(preset: str, top: str = "", file: str = "r.yaml", **keys: Any) -> Compiled:
    declared = {"s": {"preset": preset, "parent": "base_link"} | keys}
    return compile_robot(f"{HEAD}{top}sensors: {json.dumps(declared)}\n", file, library())


def robot_of(preset: str, top: str = "", **keys: Any) -> Robot:
    return robot_in(compiled(preset, top, **keys))


def edge_of(robot: Robot, child: str) -> Edge:
    edge = robot.parent_edge(child)
    assert edge
    return edge


def driver_of(robot: Robot) -> Process:
    return next(process for process in robot.processes if process.name == "s")


def driver_parameters(robot: Robot) -> dict[str, Any]:
    """Return the driver's settings from its parameter file or command line after a build."""
    files = {file.path: file.text for file in emit(robot)}
    plan = json.loads(files["plan.json"])
    process = next(process for process in plan["processes"] if process["name"] == "s")
    if any("launch:" in word for word in process["argv"]):
        return {
            key: yaml.safe_load(value)
            for key, _, value in (word.partition(":=") for word in process["argv"][1:])
        }
    node = driver_of(robot).node
    parameters: dict[str, Any] = yaml.safe_load(files[process["params_file"]])[node][
        "ros__parameters"
    ]
    assert process["nodes"] == [node]
    return parameters


def unknown(preset: str, **keys: Any) -> dict[str, Any]:
    findings = compiled(preset, **keys).findings
    requested: dict[str, Any] = {}
    for finding in findings:
        if finding.code == "TF605":
            requested |= yaml.safe_load(finding.help.partition(" write: ")[2])["sensors"]["s"][
                "frames"
            ]
    values = {"xyz": [1, 2, 3], "rpy": [0, 0, 0]}
    return {frame: {key: values[key] for key in keys} for frame, keys in requested.items()}


DRIVEN = [name for name in NAMES if any(frame.driver for frame in KNOWN.get(name).frames.values())]
WITH_SWITCH = [name for name in DRIVEN if (driver := KNOWN.get(name).driver) and driver.off]
WITH_CLAIMS = [name for name in NAMES if (driver := KNOWN.get(name).driver) and driver.claims]


@pytest.mark.parametrize("name", WITH_SWITCH)
def test_the_switch_is_among_the_parameters_of_the_driver(name: str) -> None:
    preset = KNOWN.get(name)
    assert preset.driver
    options = {key: True for key, option in preset.options.items() if option.type == "bool"}
    keys: dict[str, Any] = {"options": options, "tf": "tfcompose"}
    keys["frames"] = unknown(name, **keys)
    robot = robot_of(name, **keys)
    assert preset.driver.off
    assert preset.driver.off.items() <= driver_parameters(robot).items()
    assert {edge.owner for edge in robot.edges} == {"static"}
    keys["tf"] = "driver"
    robot = robot_of(name, **keys)
    assert preset.driver.on
    assert preset.driver.on.items() <= driver_parameters(robot).items()
    assert {edge.owner for edge in robot.edges} == {"static", "s"}


@pytest.mark.parametrize("name", [name for name in DRIVEN if name not in WITH_SWITCH])
def test_without_a_switch_tfcompose_cannot_publish_what_the_driver_does(name: str) -> None:
    frames = unknown(name, tf="tfcompose", driver="none")
    (finding,) = compiled(name, tf="tfcompose", frames=frames).errors
    expect(finding, "TF604", name)
    assert not compiled(name, tf="tfcompose", driver="none", frames=frames).errors
    assert not compiled(name, tf="driver", frames=unknown(name)).errors


@pytest.mark.parametrize("name", WITH_CLAIMS)
def test_claims_outside_the_sensor_are_switched_off_unless_owned(
    name: str,
) -> None:
    driver = KNOWN.get(name).driver
    assert driver
    frames = unknown(name)
    off = {key: value for claim in driver.claims for key, value in claim.off.items()}
    assert off
    assert off.items() <= driver_parameters(robot_of(name, frames=frames)).items()
    assert not off.keys() & driver_parameters(robot_of(name, frames=frames, owner="s")).keys()


@pytest.mark.parametrize(
    "name", [name for name in NAMES if (driver := KNOWN.get(name).driver) and driver.naming]
)
def test_a_driver_gets_the_final_names_of_its_frames(name: str) -> None:
    preset = KNOWN.get(name)
    assert preset.driver
    frames = unknown(name)
    renamed = {
        fill_name(frame, "s", preset.words): "other"
        for frame in list(preset.driver.naming.values())[:1]
    }
    overrides = frames | {
        frame: frames.get(frame, {}) | {"name": new} for frame, new in renamed.items()
    }
    for prefix in ("", "robot1/"):
        done = compiled(
            name, f'ros: {{frame_prefix: "{prefix}"}}\n' if prefix else "", frames=overrides
        )
        if prefix and any(finding.code == "TF604" for finding in done.errors):
            continue  # other frames of it have no parameter
        assert done.robot
        assert not done.errors
        declared = driver_parameters(done.robot)
        for key, frame in preset.driver.naming.items():
            plain = fill_name(frame, "s", preset.words)
            assert declared[key] == prefix + renamed.get(plain, plain)


def test_every_parameter_that_depends_on_an_option_changes_with_it() -> None:
    for name in NAMES:
        driver = KNOWN.get(name).driver
        for value in (driver.params | driver.args).values() if driver else ():
            assert not isinstance(value, Chosen) or value.option or value.when


def test_two_of_one_kind_share_no_frame_no_node_and_no_serial_number() -> None:
    sensors = {
        side: {
            "preset": "realsense/d455",
            "parent": "base_link",
            "xyz": [0, y, 0],
            "options": {"serial": serial},
        }
        for side, y, serial in (("left", 0.1, "1"), ("right", -0.1, "2"))
    }
    done = compile_robot(f"{HEAD}sensors: {json.dumps(sensors)}\n", "r.yaml", KNOWN)
    assert done.robot
    assert not done.findings
    nodes = {process.name: process.node for process in done.robot.processes}
    assert (nodes["left"], nodes["right"]) == ("/left/left", "/right/right")
    files = {
        file.path: yaml.safe_load(file.text)
        for file in emit(done.robot)
        if file.path.startswith("params/")
    }
    left, right = (
        files[f"params/{side}.yaml"][nodes[side]]["ros__parameters"] for side in ("left", "right")
    )
    assert (left["camera_name"], left["serial_no"]) == ("left", "1")
    assert (right["camera_name"], right["serial_no"]) == ("right", "2")
    assert not {frame for frame in done.robot.frames if frame.startswith("left")} & {
        frame.replace("right", "left", 0)
        for frame in done.robot.frames
        if frame.startswith("right")
    }


def test_only_with_infra1_the_optical_frame_hangs_on_aligned_depth() -> None:
    options = {"streams": ["depth", "color", "infra1"]}
    by_driver, ours = (
        robot_of("realsense/d455", options=options, tf=tf) for tf in ("driver", "tfcompose")
    )
    assert edge_of(by_driver, "s_infra1_optical_frame").parent == "s_aligned_depth_to_infra1_frame"
    assert edge_of(by_driver, "s_aligned_depth_to_infra1_frame").owner == "s"
    assert edge_of(ours, "s_infra1_optical_frame").parent == "s_infra1_frame"
    assert "s_aligned_depth_to_infra1_frame" not in ours.frames


def test_a_zed_sends_its_lenses_on_tf_by_version_and_intra_process_option() -> None:
    frames = ("s_left_camera_frame", "s_right_camera_frame")
    for options, kind, owner in (
        ({}, "dynamic", "s"),
        ({"ipc": False}, "static", "s"),
        ({"wrapper": "before-5.1"}, "static", "static"),
    ):
        robot = robot_of("zed/zed2i", options=options)
        assert [(edge_of(robot, frame).kind, edge_of(robot, frame).owner) for frame in frames] == [
            (kind, owner)
        ] * 2
    placed = robot_of(
        "zed/zed2i", place="s_left_camera_frame_optical", xyz=[1, 0, 0], look="forward"
    )
    assert edge_of(placed, "s_camera_link").pose.xyz == pytest.approx((1.01, -0.06, -0.015))


def test_the_l515_imu_hangs_on_colour_by_urdf_and_on_the_link_by_driver() -> None:
    ours, by_driver = (
        robot_of("realsense/l515", options={"imu": True}, tf=tf) for tf in ("tfcompose", "driver")
    )
    assert edge_of(ours, "s_gyro_frame").parent == "s_color_frame"
    assert edge_of(by_driver, "s_gyro_frame").parent == "s_link"
    assert edge_of(by_driver, "s_gyro_frame").pose.xyz == (-0.00057, -0.01245, 0.01642)


def test_who_publishes_is_by_default_as_the_vendor_has_it() -> None:
    owners = {
        name: edge_of(robot_of(name), frame).owner
        for name, frame in (
            ("realsense/d435", "s_depth_frame"),
            ("ouster/os1", "s_lidar"),
            ("oak/oak-d", "s_left_camera_frame"),
            ("orbbec/gemini-335", "s_depth_frame"),
            ("velodyne/vlp16", "s"),
        )
    }
    assert owners == {
        "realsense/d435": "s",
        "ouster/os1": "s",
        "oak/oak-d": "static",
        "orbbec/gemini-335": "s",
        "velodyne/vlp16": "static",
    }


def test_a_driver_that_does_nothing_until_it_is_active_is_made_active() -> None:
    for preset, options, state in (
        ("ouster/os1", {}, "active"),
        ("hokuyo/utm-30lx", {}, "active"),
        ("hokuyo/utm-30lx", {"driver": "urg_node"}, None),
        ("realsense/d435", {}, None),
    ):
        assert driver_of(robot_of(preset, options=options)).ros_nodes[0].lifecycle == state
    driver = {"run": {"package": "mine", "executable": "lidar"}}
    assert driver_of(robot_of("ouster/os1", driver=driver)).ros_nodes[0].lifecycle is None


def test_a_unit_whose_cameras_hang_otherwise_says_on_what() -> None:
    frames = {"s_left_camera_frame": {"parent": "s_right_camera_frame", "xyz": [0, 0.075, 0]}}
    robot = robot_of("oak/oak-d", tf="driver", frames=frames)
    assert edge_of(robot, "s_left_camera_frame").parent == "s_right_camera_frame"
    frames = {"s_left_camera_frame": {"parent": "s_righ_camera_frame"}}
    findings = compiled("oak/oak-d", tf="driver", frames=frames).errors
    assert [(finding.code, finding.help) for finding in findings] == [
        ("TF203", "did you mean s_right_camera_frame?")
    ]


def test_an_unknown_value_is_requested_with_its_yaml_and_is_never_zero() -> None:
    findings = compiled("realsense/d457", tf="tfcompose").findings
    yaml_to_write = (
        "sensors: {s: {frames: {s_color_frame: {xyz: [x, y, z], rpy: [roll, pitch, yaw]}}}}"
    )
    expect(findings[0], "TF605", "realsense/d457", "s_color_frame", "s_link", yaml_to_write)
    (unpublished,) = compiled(
        "realsense/d457", tf="tfcompose", options={"streams": ["infra2", "color"]}
    ).findings
    expect(unpublished, "TF605", "s_color_frame and s_infra2_frame")
    robot = robot_of(
        "realsense/d457", frames={"s_color_frame": {"xyz": [0, -0.059, 0], "rpy": [0, 0, 0]}}
    )
    assert edge_of(robot, "s_color_frame").pose.xyz == (0, -0.059, 0)
    assert not edge_of(robot, "s_color_frame").nominal
    assert [
        finding.code
        for finding in compiled("realsense/d457", options={"streams": ["depth"]}).findings
    ] == []


@pytest.mark.parametrize("name", NAMES)
def test_every_preset_has_no_findings_with_its_default_options(name: str) -> None:
    findings = compiled(name, xyz=[0.1, 0, 0.2]).findings
    assert findings == ()


def test_an_edge_that_only_the_driver_knows_is_declared_without_a_pose() -> None:
    on_it = 'frames: {"on_color": {"parent": "s_color_frame", "xyz": [0, 0, 1]}}\n'
    robot = robot_of("realsense/d457", on_it, options={"streams": ["depth", "color"]})
    edges = {edge.child: (edge.owner, edge.pose_known) for edge in robot.edges}
    assert edges["s_color_frame"] == ("s", False)
    assert edges["s_color_optical_frame"] == ("s", True)
    assert edges["on_color"] == ("static", True)
    files = {file.path: file.text for file in emit(robot)}
    plan = json.loads(files["plan.json"])
    assert [edge["child"] for edge in plan["edges"] if not edge.get("pose_known", True)] == [
        "s_color_frame"
    ]
    (driven,) = next(process for process in plan["processes"] if process["name"] == "s")["drives"]
    assert driven["frames"]["s_color_frame"] == "unknown"
    for path in ("r.urdf", "robot.state_publisher.urdf", "robot.urdf"):
        text = files.get(path)
        if text is not None:
            links = set(re.findall(r'<link name="([^"]+)"', text))
            assert not links & {"s_color_frame", "s_color_optical_frame", "on_color"}
            assert {"s_depth_frame", "s_depth_optical_frame"} <= links
            assert re.search(r"<!-- .*s_color_frame.* -->", text)


def test_what_needs_an_unknown_pose_is_refused_and_says_what_would_give_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    placed = compiled("realsense/d457", place="s_color_optical_frame", xyz=[0, 0, 1]).errors
    expect(placed[0], "TF404", "s_color_frame", "frames: {s_color_frame: {xyz:")
    file = tmp_path / "r.yaml"
    file.write_text(
        f"{HEAD}sensors: {{s: {{preset: realsense/d457, parent: base_link, xyz: [1, 0, 0]}}}}\n"
    )
    assert main(["pose", str(file), "base_link", "s_depth_optical_frame"]) == 0
    assert main(["pose", str(file), "base_link", "s_color_optical_frame"]) == 1
    assert "s_color_frame" in capsys.readouterr().err
    capsys.readouterr()
    assert main(["tree", str(file), "--format", "json"]) == 0
    (tree,) = json.loads(capsys.readouterr().out)["trees"]
    positions = {edge["child"]: edge["xyz"] for edge in tree["edges"]}
    assert (positions["s_color_frame"], positions["s_depth_frame"]) == (None, [0.0, 0.0, 0.0])


def test_an_unknown_frame_stays_out_of_what_a_stock_publisher_takes_over() -> None:
    on_it = (
        'frames: {"on_color": {"parent": "s_color_frame"}}\nros: {"state_publisher": "stock"}\n'
    )
    robot = robot_of("realsense/d457", on_it)
    owners = {edge.child: edge.owner for edge in robot.edges}
    assert (owners["on_color"], owners["s_link"], owners["s_color_frame"]) == (
        "static",
        "joints",
        "s",
    )


def test_a_name_that_the_driver_makes_itself_cannot_be_changed() -> None:
    done = compiled(
        "realsense/d435", frames={"s_color_optical_frame": {"name": "eye_optical_frame"}}
    )
    (finding,) = done.errors
    expect(finding, "TF604", "s_color_optical_frame", "eye_optical_frame")
    assert not compiled("ouster/os1", frames={"s_lidar": {"name": "roof_lidar"}}).errors
    assert (
        driver_parameters(robot_of("ouster/os1", frames={"s_lidar": {"name": "roof_lidar"}}))[
            "lidar_frame"
        ]
        == "roof_lidar"
    )
    prefixed = compiled("orbbec/gemini-335", 'ros: {frame_prefix: "robot1/"}\n')
    expect(prefixed.errors[0], prefixed.errors[0].code, "robot1/")


def test_misspelt_names_of_presets_and_options_get_the_nearest() -> None:
    wrong = {
        ("realsense/d445i", "{}"): "did you mean realsense/d435i?",
        ("realsens/d435i", "{}"): "did you mean realsense/d435i?",
        ("ouster/os9", "{}"): "did you mean ouster/os",
        ("ouster/os1", '{"revison": "7"}'): "did you mean revision?",
        ("zed/zed2i", '{"wrapper": "before-5.0"}'): "did you mean before-5.1?",
        ("ouster/os1", '{"revision": 8}'): "one of: c, d, 7",
    }
    for (preset, options), advice in wrong.items():
        findings = compiled(preset, options=json.loads(options)).findings
        assert findings
        assert advice in findings[0].help, findings[0]


def write(folder: Path, name: str, text: str) -> None:
    file = folder / f"{name}.yaml"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")


def test_a_folder_next_to_the_robot_adds_presets(tmp_path: Path) -> None:
    write(tmp_path / "presets", "me/mast", MAST)
    write(
        tmp_path / "presets",
        "me/long-mast",
        'preset: 1\nextends: me/mast\nframes:\n  "{name}_optical_frame": {xyz: [0, 0, 1]}\n',
    )
    top, file = "preset_path: [presets]\n", str(tmp_path / "r.yaml")
    for name, height in (("me/mast", 0.3), ("me/long-mast", 1.0)):
        done = compiled(name, top, file)
        assert done.robot
        assert done.findings == ()
        assert edge_of(done.robot, "s_optical_frame").pose.xyz == (0, 0, height)
    assert compiled("me/mist", top, file).findings[0].help == "did you mean me/mast?"


def test_a_preset_that_shadows_a_built_in_is_reported_and_may_change_it(
    tmp_path: Path,
) -> None:
    text = (
        'preset: 1\nextends: realsense/d435i\nframes:\n  "{name}_color_frame": {xyz: [0, 0.0149,'
        " 0]}\n"
    )
    write(tmp_path / "mine", "realsense/d435i", text)
    done = compiled("realsense/d435i", "preset_path: mine/\n", str(tmp_path / "r.yaml"))
    assert done.robot
    assert edge_of(done.robot, "s_color_frame").pose.xyz == (0, 0.0149, 0)
    assert [(finding.code, finding.severity) for finding in done.findings] == [
        ("TF607", "warning")
    ]
    assert (
        compiled("realsense/d435", "preset_path: mine\n", str(tmp_path / "r.yaml")).findings == ()
    )


def test_a_folder_that_is_not_there_is_reported(tmp_path: Path) -> None:
    findings = compiled(
        "generic/imu", "preset_path: [mine, .]\n", str(tmp_path / "r.yaml")
    ).findings
    assert [(finding.code, finding.message) for finding in findings] == [
        ("TF001", f"preset_path: no folder {tmp_path}/mine")
    ]


@pytest.mark.parametrize(("old", "new"), WRONG_IN_MAST)
def test_what_is_wrong_in_a_preset_is_found_in_its_file(
    tmp_path: Path, old: str, new: str
) -> None:
    assert old in MAST
    write(tmp_path, "me/mast", MAST.replace(old, new, 1))
    findings = compiled("me/mast", "preset_path: [.]\n", str(tmp_path / "r.yaml")).findings
    assert findings
    assert all(finding.span and finding.span.file.endswith("mast.yaml") for finding in findings)


def test_a_python_package_adds_presets_by_an_entry_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "my_sensors" / "presets", "me/mast", MAST)
    (tmp_path / "my_sensors" / "__init__.py").write_text("")
    (tmp_path / "my_sensors" / "presets" / "__init__.py").write_text("")
    info = tmp_path / "my_sensors-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-sensors\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[tfcompose.presets]\nmine = my_sensors.presets\ngone = not_there.presets\n"
    )
    with monkeypatch.context() as patch:
        patch.setattr(sys, "path", [str(tmp_path), *sys.path])
        compiling._preset_packages.cache_clear()
        assert compiled("me/mast").findings == ()
        assert "me/mast" in library().names
    compiling._preset_packages.cache_clear()
    assert compiled("me/mast").findings[0].code == "TF601"


@pytest.mark.parametrize(
    ("text", "folder"),
    [("", "share/my_sensors/presets"), ("share/presets of mine\n", "share/presets of mine")],
)
def test_a_ros_package_adds_presets_by_the_ament_index(
    text: str, folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    overlay, underlay = tmp_path / "overlay", tmp_path / "underlay"
    for prefix, model in ((underlay, "me/old"), (overlay, "me/mast")):
        write(prefix / folder, model, MAST)
        marker = prefix / compiling.PRESET_INDEX / "my_sensors"
        marker.parent.mkdir(parents=True)
        marker.write_text(text)
    with monkeypatch.context() as patch:
        patch.setenv("AMENT_PREFIX_PATH", f"{overlay}:{underlay}:")
        compiling._preset_packages.cache_clear()
        assert compiled("me/mast").findings == ()
        assert "me/old" not in library().names
    compiling._preset_packages.cache_clear()
    assert compiled("me/mast").findings[0].code == "TF601"


def test_only_the_presets_that_a_robot_uses_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def noted(_: object, path: str) -> str:
        read.append(Path(path).stem)
        return read_text(path)

    monkeypatch.setattr(compiling.PresetFolders, "read", noted)
    monkeypatch.setattr(
        compiling.PresetFolders, "models", lambda *_: pytest.fail("a folder was listed")
    )
    monkeypatch.setattr(
        compiling.PresetFolders, "packages", lambda *_: pytest.fail("packages were looked for")
    )
    assert compiled("realsense/d455").findings == ()
    assert sorted(read) == ["_base", "_d400", "_imu", "d455"]


def test_the_command_lists_all_presets_and_shows_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["presets"]) == 0
    declared = capsys.readouterr().out
    assert all(f"  {name} " in declared for name in NAMES)
    assert "(= orbbec/gemini-335)" in declared
    assert "(from realsense/d455)" in declared, "a D456 has no screw that is known"
    assert main(["presets", "--format", "json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows if row["kind"] != "node"] == NAMES
    assert main(["presets", "lidar2d"]) == 0
    listed = capsys.readouterr().out
    assert "hokuyo/ust-10lx" in listed
    assert "ouster/os1" not in listed
    for name in NAMES:
        assert main(["presets", name]) == 0
        assert name in capsys.readouterr().out
        assert main(["presets", name, "--format", "json"]) == 0
        assert json.loads(capsys.readouterr().out)["name"] == name
    assert main(["presets", "realsense/d445"]) == 1
    assert "did you mean realsense/d4" in capsys.readouterr().err
    assert presets_command.__doc__


def test_the_page_of_a_preset_has_its_values_its_switch_and_its_source(
    capsys: pytest.CaptureFixture[str],
) -> None:
    main(["presets", "realsense/d455"])
    page = capsys.readouterr().out
    for words in (
        [
            "NAME_color_frame ",
            "nominal",
            "driver, /tf_static",
            "with streams: color",
            "xyz 0 -0.059 0",
        ],
        ["NAME_link ", "exact", "static", "xyz 0.01115 0.0475 0.0145"],
        ["NAME_color_optical_frame ", "exact", "rpy -90 0 -90 deg"],
        ["switch", "publish_tf: false"],
        ["~/imu ", "sensor_msgs/Imu", "in NAME_imu_optical_frame"],
        ["realsenseai/realsense-ros", "_d455.urdf.xacro", "775b167c"],
    ):
        assert any(all(word in line for word in words) for line in page.splitlines()), words
    main(["presets", "realsense/d457"])
    page = capsys.readouterr().out
    assert any("NAME_color_frame " in line and "unknown" in line for line in page.splitlines())
    main(["presets", "zed/zed2i"])
    page = capsys.readouterr().out
    assert "there is none" in page
    assert "odom → NAME_camera_link" in page


def test_a_driver_of_several_processes_is_started_as_all_of_them() -> None:
    driver = {"host": "roof", "restart": "on-failure", "params": {"rpm": 300.0}}
    robot = robot_of(
        "velodyne/vlp16", 'ros: {"namespace": "r1"}\n', driver=driver, options={"scan": True}
    )
    plan = {
        process["name"]: process
        for process in json.loads({f.path: f.text for f in emit(robot)}["plan.json"])["processes"]
    }
    assert {name: value["nodes"] for name, value in plan.items() if name.startswith("s_")} == {
        "s_transform": ["/r1/s/velodyne_transform_node"],
        "s_laserscan": ["/r1/s/velodyne_laserscan_node"],
    }
    assert plan["s_transform"]["argv"] == [
        "${launch:velodyne_pointcloud/velodyne_transform_node-VLP16-launch.py}"
    ]
    assert plan["s_transform"]["namespace"] == "r1/s"
    assert (
        plan["s_laserscan"]["argv"][0]
        == "${executable:velodyne_laserscan/velodyne_laserscan_node}"
    )
    assert {
        value["host"]
        for name, value in plan.items()
        if name in {"s", "s_transform", "s_laserscan"}
    } == {"roof"}
    names = {process.name for process in robot_of("velodyne/vlp16").processes}
    assert {"s", "s_transform"} <= names
    assert "s_laserscan" not in names
    for alone in ("none", {"external": True}, {"run": {"package": "mine", "executable": "lidar"}}):
        assert not any(
            process.name.startswith("s_")
            for process in robot_of("velodyne/vlp16", driver=alone).processes
        )
    (wrong,) = compiled(
        "velodyne/vlp16", 'processes: {"s_transform": {"external": true}}\n'
    ).errors
    expect(wrong, "TF502", "s_transform")


def test_hdl32e_gives_the_cloud_its_calibration() -> None:
    robot = robot_of("velodyne/hdl32e", options={"calibration": "/maps/32.yaml"})
    (transform,) = (process for process in robot.processes if process.name == "s_transform")
    assert (transform.executable, transform.params["calibration"]) == (
        "velodyne_transform_node",
        "/maps/32.yaml",
    )


@pytest.mark.parametrize(
    ("release", "key"), [("v2", "camera.i_enable_imu"), ("v3", "pipeline_gen.i_enable_imu")]
)
def test_an_oak_without_its_imu_has_it_switched_off(release: str, key: str) -> None:
    for imu in (True, False):
        robot = robot_of("oak/oak-d", options={"imu": imu, "release": release})
        driver = driver_of(robot)
        assert {name: value for name, value in driver.params.items() if "imu" in name} == {
            key: imu
        }
        assert any(word.startswith("params_file:=") for word in driver.argv)
        assert ("s_imu_frame" in robot.frames) is imu


@pytest.mark.parametrize(
    ("word", "kinds"),
    [
        ("camera", {"camera", "rgbd", "stereo"}),
        ("depth", {"rgbd", "stereo"}),
        ("lidar", {"lidar2d", "lidar3d"}),
    ],
)
def test_a_word_lists_every_kind_that_it_names(
    word: str, kinds: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["presets", word, "--format", "json"]) == 0
    assert {row["kind"] for row in json.loads(capsys.readouterr().out)} == kinds
