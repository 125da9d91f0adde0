"""What ``tfcompose import`` writes, says and refuses."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from tests.support.importing import PRESETS, built, imported, urdf_of
from tfcompose.cli import compiling, main
from tfcompose.spec.load import load

HEAD = '<robot name="r"><link name="base_link"/>'


@pytest.fixture(autouse=True)
def _one_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "library", lambda: PRESETS)


def data(text: str) -> Any:
    return load(text, "robot.yaml").data


def fixed(child: str, parent: str = "base_link", origin: str = "", name: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin {origin}/>'
    return (
        f'<link name="{child}"/><joint name="{name or child + "_joint"}"'
        f' type="fixed">{ends}</joint>'
    )


def moving(more: str, kind: str = "revolute") -> str:
    ends = '<parent link="base_link"/><child link="arm"/>'
    return (
        f'{HEAD}<link name="arm"/><joint name="shoulder"'
        f' type="{kind}">{ends}{more}</joint></robot>'
    )


def test_angles_are_emitted_in_degrees_where_that_is_exact(tmp_path: Path) -> None:
    output = 'rpy="1.5707963267948966 0 -0.7853981633974483"'
    limit = '<limit lower="-3.14159265359" upper="1.5708" effort="1" velocity="2"/>'
    joint = data(imported(moving(f"<origin {output}/>{limit}"), tmp_path))["joints"]["shoulder"]
    assert joint["rpy"] == ["90 deg", 0, "-45 deg"]
    assert joint["limit"] == {"lower": "-180 deg", "upper": 1.5708, "effort": 1, "velocity": 2}


def test_a_rotation_is_emitted_with_the_angles_of_the_source(tmp_path: Path) -> None:
    tool = fixed("tool", origin='rpy="-1.5708 1.5708 0.1"')
    text = imported(f"{HEAD}{tool}</robot>", tmp_path)
    assert data(text)["frames"]["tool"] == {
        "parent": "base_link",
        "rpy": [-1.5708, 1.5708, 0.1],
        "joint": "tool_joint",
    }


def test_what_cannot_be_taken_is_reported_at_its_place(tmp_path: Path) -> None:
    limit = '<limit lower="-1" upper="1" effort="1" velocity="2" jerk="5"/>'
    text = imported(
        moving(limit).replace(
            "</robot>", '<material name="grey"><color rgba="1 1 1 1"/></material></robot>'
        ),
        tmp_path,
    )
    lines = text.splitlines()
    assert lines[lines.index("joints:") + 1] == '  # left out: limit jerk="5"'
    assert any(
        line.startswith("# left out: ") and line.endswith("material grey") for line in lines
    )


BODY = '<visual><geometry><sphere radius="1"/></geometry></visual>'


@pytest.mark.parametrize("body", ["", BODY], ids=["frame", "link"])
def test_a_fixed_joint_keeps_its_name(body: str, tmp_path: Path) -> None:
    """Where it is not the one that build gives.

    What is fixed stands at its child, with a body and without.
    """
    names = ("mast_fix", "base_link_to_top")
    masts = "".join(
        fixed(child, name=name) for child, name in zip(("mast", "top"), names, strict=True)
    )
    masts = re.sub('<link name="(.*?)"/>', rf'<link name="\1">{body}</link>', masts)
    output = data(imported(f"{HEAD}{masts}</robot>", tmp_path))
    entries = output["links" if body else "frames"]
    assert (entries["mast"]["parent"], entries["mast"]["joint"]) == ("base_link", "mast_fix")
    assert "joint" not in entries["top"]
    assert "joints" not in output
    urdf = built(tmp_path / "robot.yaml")
    assert all(f'<joint name="{name}" type="fixed">' in urdf for name in names)


def test_names_with_other_characters_are_taken_and_lint_accepts_them(
    tmp_path: Path,
) -> None:
    text = imported(f"{HEAD}{fixed('the tool', name='a-b.c')}</robot>", tmp_path)
    assert data(text)["rules"] == {"TF501": "warning"}
    assert '<link name="the tool"/>' in built(tmp_path / "robot.yaml")
    assert "rules" not in data(imported(f"{HEAD}{fixed('tool', name='a-b.c')}</robot>", tmp_path))


def test_a_block_about_nothing_is_left_out_and_a_comment_says_so(tmp_path: Path) -> None:
    blocks = (
        '<gazebo reference="gone"><a/></gazebo><transmission name="t"><joint'
        ' name="gone"/></transmission>'
    )
    text = imported(f"{HEAD}{blocks}</robot>", tmp_path)
    assert "xml" not in data(text)
    assert '# left out: <gazebo reference="gone">: ' in text
    assert '# left out: <transmission name="t">: ' in text


def test_a_limit_without_ends_is_what_readers_take_it_for(tmp_path: Path) -> None:
    text = imported(moving('<limit effort="1" velocity="2"/>'), tmp_path)
    assert data(text)["joints"]["shoulder"]["limit"] == {
        "lower": 0,
        "upper": 0,
        "effort": 1,
        "velocity": 2,
    }
    assert "lower and upper limit" in text.split("shoulder:")[0]  # a comment above the joint


def test_a_limit_beyond_all_numbers_is_the_largest_that_there_is(tmp_path: Path) -> None:
    """Simulators write the largest float where they mean that there is no limit."""
    limit = (
        '<limit lower="-1.79769e+308" upper="1.7976931348623157e+308" effort="1e308"'
        ' velocity="2"/>'
    )
    text = imported(moving(limit + '<safety_controller k_velocity="1e300"/>'), tmp_path)
    assert data(text)["joints"]["shoulder"]["limit"] == {
        "lower": -1e30,
        "upper": 1e30,
        "effort": 1e30,
        "velocity": 2,
    }
    assert re.search("# TF721 .* lower ", text)
    assert 'lower="-1e+30" upper="1e+30"' in built(tmp_path / "robot.yaml")


def test_a_link_with_a_name_longer_than_a_line_is_a_link(tmp_path: Path) -> None:
    text = imported(moving("", "continuous").replace('"arm"', f'"{"a" * 150}"'), tmp_path)
    assert data(text)["links"] == {"base_link": {}, "a" * 150: {}}


def test_a_block_still_finds_the_fixed_joint_that_it_names(tmp_path: Path) -> None:
    block = '<gazebo reference="mast_fix"><preserveFixedJoint>true</preserveFixedJoint></gazebo>'
    output = data(imported(f"{HEAD}{fixed('mast', name='mast_fix')}{block}</robot>", tmp_path))
    assert output["frames"]["mast"]["joint"] == "mast_fix"
    assert list(output["xml"]) == ["gazebo_1"]
    built(tmp_path / "robot.yaml")


def test_a_free_joint_gets_an_owner_to_be_named(tmp_path: Path) -> None:
    text = imported(moving("", "floating"), tmp_path)
    assert data(text)["joints"]["shoulder"]["owner"] == "mover"
    assert "publishes shoulder" in text.split("mover:")[-2]  # a comment above the process
    assert 'type="floating"' in built(tmp_path / "robot.yaml")


def test_the_root_is_the_base_where_another_link_would_be(tmp_path: Path) -> None:
    text = f'<robot name="r"><link name="world"/>{fixed("base_link", "world")}</robot>'
    assert data(imported(text, tmp_path))["base"] == "world"
    assert '<link name="world"/>' in built(tmp_path / "robot.yaml")


CONTROL = """<ros2_control name="sys" type="system"><hardware><plugin>a/B</plugin><param name="port">0.10</param>
</hardware><joint name="shoulder"><command_interface name="position"><param name="min">-1</param></command_interface>
<state_interface name="position"/>{more}</joint></ros2_control>"""  # noqa: E501 (a text as its reader has it)
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="2"/>'


def test_ros2_control_becomes_the_section_and_texts_stay_what_they_are(tmp_path: Path) -> None:
    text = imported(
        moving(LIMIT).replace("</robot>", CONTROL.format(more="") + "</robot>"), tmp_path
    )
    assert data(text)["ros2_control"] == {
        "sys": {
            "plugin": "a/B",
            "params": {"port": "0.10"},
            "joints": {"shoulder": {"command": {"position": {"min": -1}}, "state": ["position"]}},
        }
    }
    assert '<param name="port">0.10</param>' in built(tmp_path / "robot.yaml")


def test_ros2_control_with_more_in_it_stays_as_it_is(tmp_path: Path) -> None:
    text = imported(
        moving(LIMIT).replace("</robot>", CONTROL.format(more="<other/>") + "</robot>"), tmp_path
    )
    assert "ros2_control" not in data(text)
    assert "<other/>" in data(text)["xml"]["ros2_control_1"]


def test_a_text_that_resembles_an_expression_is_none(tmp_path: Path) -> None:
    block = "<gazebo><plugin>${robot_namespace}</plugin></gazebo>"
    imported(f"{HEAD}{block}</robot>", tmp_path)
    assert "<plugin>${robot_namespace}</plugin>" in built(tmp_path / "robot.yaml")


def test_a_block_keeps_the_namespace_that_the_document_declares(tmp_path: Path) -> None:
    text = f'{HEAD}<drake:filter a="1"/></robot>'.replace(
        '"r"', '"r" xmlns:drake="http://drake"', 1
    )
    imported(text, tmp_path)
    assert ET.fromstring(built(tmp_path / "robot.yaml")).find("{http://drake}filter") is not None  # noqa: S314


@pytest.mark.parametrize(
    "block", ['<gazebo reference="base_link"/>', "<gazebo a='b > c' />", "<gazebo><a/></gazebo>"]
)
def test_a_block_ends_where_it_ends(block: str, tmp_path: Path) -> None:
    assert data(
        imported(
            f"{HEAD}{block}<link name='a'/>{fixed('b')}</robot>".replace("<link name='a'/>", ""),
            tmp_path,
        )
    )["xml"] == {"gazebo_1": f"{block}\n"}


def test_colours_get_names_that_the_language_has(tmp_path: Path) -> None:
    output = '<material name="{}"><color rgba="{} 0 0 1"/></material>'
    visual = "<visual><geometry><sphere radius='1'/></geometry>{}</visual>"
    visuals = "".join(
        visual.format(output.format(*colour))
        for colour in (("light blue", 1), ("light-blue", 0.5))
    )
    text = imported(f'<robot name="r"><link name="base_link">{visuals}</link></robot>', tmp_path)
    names = [visual["material"]["name"] for visual in data(text)["links"]["base_link"]["visual"]]
    assert names == ["light_blue", "light_blue_"]
    assert re.search(r"# .*light_blue .*'light blue'", text)


def test_a_relative_mesh_is_addressed_from_where_the_robot_file_is(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/a.stl").write_text("")
    visual = '<visual><geometry><mesh filename="meshes/a.stl"/></geometry></visual>'
    (tmp_path / "r.urdf").write_text(
        f'<robot name="r"><link name="base_link">{visual}</link></robot>'
    )
    (tmp_path / "sub").mkdir()
    assert main(["import", str(tmp_path / "r.urdf"), "-o", str(tmp_path / "sub/robot.yaml")]) == 0
    output = data((tmp_path / "sub/robot.yaml").read_text("utf-8"))
    assert output["links"]["base_link"]["visual"]["mesh"] == "../meshes/a.stl"


#: Sensors that nothing else has the frames of.
DISTINGUISHED = (
    "realsense/d455",
    "realsense/d405",
    "oak/oak-d-sr",
    "realsense/l515",
    "sick/nanoscan3",
)


@pytest.mark.parametrize("name", DISTINGUISHED)
def test_a_sensor_that_is_like_no_other_is_recognised(name: str, tmp_path: Path) -> None:
    sensor = {"preset": name, "parent": "base_link", "xyz": [0.1, 0, 0.2], "driver": "none"}
    spec = {"tfcompose": 1, "robot": "r", "links": {"base_link": {}}, "sensors": {"eye": sensor}}
    assert data(imported(urdf_of(spec, tmp_path), tmp_path))["sensors"] == {"eye": sensor}


D435 = {"preset": "realsense/d435i", "parent": "base_link", "driver": "none"}


def d435(folder: Path, **more: Any) -> str:
    name = more.pop("name", "eye")
    return urdf_of(
        {"tfcompose": 1, "robot": "r", "links": {"base_link": {}}, "sensors": {name: D435 | more}},
        folder,
    )


def test_frames_turned_as_every_cameras_are_name_no_vendor(tmp_path: Path) -> None:
    optical = fixed(
        "xtion_depth_optical_frame",
        "xtion_depth_frame",
        'rpy="-1.5707963267948966 0 -1.5707963267948966"',
    )
    frames = (
        fixed("xtion_link") + fixed("xtion_depth_frame", "xtion_link", 'xyz="0 0.047 0"') + optical
    )
    assert "sensors" not in data(imported(f"{HEAD}{frames}</robot>", tmp_path))


def test_options_follow_from_the_frames_that_there_are(tmp_path: Path) -> None:
    options = {"streams": ["depth", "infra1"], "imu": True, "unite_imu": False}
    text = imported(d435(tmp_path, name="d435i", options=options), tmp_path)
    assert data(text)["sensors"]["d435i"] == {**D435, "options": options}


def test_indistinguishable_sensors_stay_frames_with_a_comment(
    tmp_path: Path,
) -> None:
    text = imported(d435(tmp_path), tmp_path)
    assert "sensors" not in data(text)
    assert "realsense/d435i, realsense/d435" in " ".join(text.replace("#", "").split())


def test_the_name_of_a_sensor_can_say_which_model_it_is(tmp_path: Path) -> None:
    text = imported(d435(tmp_path, name="front_d435i"), tmp_path)
    assert data(text)["sensors"]["front_d435i"] == D435


def test_a_value_near_the_presets_is_kept_and_a_distant_one_is_no_match(
    tmp_path: Path,
) -> None:
    urdf = d435(tmp_path, name="d435i")
    near = urdf.replace('xyz="0 0.015 0"', 'xyz="0 0.0150005 0"')
    assert near != urdf
    sensor = data(imported(near, tmp_path))["sensors"]["d435i"]
    assert sensor["frames"] == {"d435i_color_frame": {"xyz": [0, 0.0150005, 0]}}
    far = urdf.replace('xyz="0 0.015 0"', 'xyz="0 0.0155 0"')
    sensor = data(imported(far, tmp_path))["sensors"]["d435i"]
    assert sensor["preset"] == "generic/rgbd"  # of which nobody knows where the colour imager is
    assert sensor["frames"] == {"d435i_color_frame": {"xyz": [0, 0.0155, 0]}}


def test_a_mesh_can_say_which_model_a_sensor_is(tmp_path: Path) -> None:
    for mesh, preset in (
        ("vlp16_base.dae", "velodyne/vlp16"),
        ("VLP-32C.stl", "velodyne/vlp32c"),
        ("puck.dae", ""),
    ):
        body = (
            f'<visual><geometry><mesh filename="package://x/meshes/{mesh}"/></geometry></visual>'
        )
        base = fixed("roof_base_link").replace(
            '<link name="roof_base_link"/>', f'<link name="roof_base_link">{body}</link>'
        )
        urdf = f"{HEAD}{base}{fixed('roof', 'roof_base_link', 'xyz=' + chr(34) + '0 0 0.0377' + chr(34))}</robot>"  # noqa: E501 (a text as its reader has it)
        assert body in urdf
        text = imported(urdf, tmp_path)
        sensors = data(text).get("sensors", {})
        assert [sensor["preset"] for sensor in sensors.values()] == ([preset] if preset else [])
        assert bool(preset) or "sensors: {roof: {preset: …" in " ".join(
            text.replace("#", "").split()
        )


def with_mesh(urdf: str, link: str, file: str) -> str:
    body = f'<visual><geometry><mesh filename="package://x/meshes/{file}"/></geometry></visual>'
    assert f'<link name="{link}"/>' in urdf
    return urdf.replace(f'<link name="{link}"/>', f'<link name="{link}">{body}</link>')


def words(text: str) -> str:
    """Return the text in one line, comments too."""
    return " ".join(text.replace("#", "").split())


def test_a_sensor_is_recognised_under_other_names_if_its_model_is_named(tmp_path: Path) -> None:
    """As in Clearpath's descriptions.

    The frames are lidar3d_0_link and lidar3d_0_laser, the mesh is VLP16_base_1.
    """
    lidar = fixed("lidar3d_0_link") + fixed(
        "lidar3d_0_laser", "lidar3d_0_link", 'xyz="0 0 0.0377"'
    )
    urdf = f"{HEAD}{lidar}</robot>"
    named = with_mesh(urdf, "lidar3d_0_link", "VLP16_base_1.dae")
    (sensor,) = data(imported(named, tmp_path))["sensors"].values()
    assert sensor["preset"] == "velodyne/vlp16"
    names = {name: frame["name"] for name, frame in sensor["frames"].items()}
    assert names == {"lidar3d_0_base_link": "lidar3d_0_link", "lidar3d_0": "lidar3d_0_laser"}
    assert '<child link="lidar3d_0_laser"/>' in built(tmp_path / "robot.yaml")
    assert "sensors" not in data(imported(urdf, tmp_path))
    text = imported(named.replace("0.0377", "0.05"), tmp_path)
    assert "sensors" not in data(text)
    assert "sensors: {lidar3d_0: {preset: velodyne/vlp16," in words(text)


def test_a_mesh_of_another_model_makes_it_a_question(tmp_path: Path) -> None:
    """The ZED X One GS of zed_description 0.1.2 has the frames of the ZED X One 4K."""
    spec = {"preset": "zed/zedx-one-4k", "parent": "base_link", "driver": "none"}
    urdf = urdf_of(
        {"tfcompose": 1, "robot": "r", "links": {"base_link": {}}, "sensors": {"zed": spec}},
        tmp_path,
    )
    assert data(imported(urdf, tmp_path))["sensors"] == {"zed": spec}
    text = imported(with_mesh(urdf, "zed_camera_link", "zedxonegs.stl"), tmp_path)
    assert "sensors" not in data(text)
    assert "preset: zed/zedx-one-gs" in words(text)


def test_a_sensor_of_which_there_is_no_more_than_a_name_is_one_question(tmp_path: Path) -> None:
    """At the frame named most exactly, at none above or below, nor at a known sensor."""
    bracket = (
        fixed("oakd_bracket")
        + fixed("oakd_link", "oakd_bracket")
        + fixed("oakd_imu_frame", "oakd_link")
    )
    text = imported(
        with_mesh(f"{HEAD}{bracket}{fixed('rplidar_link')}</robot>", "oakd_link", "oakd_pro.dae"),
        tmp_path,
    )
    assert text.count("# is it ") == 2
    assert "sensors: {oakd: {preset: oak/oak-d-pro, parent: oakd_bracket}}" in words(text)
    assert "rplidar/a1, rplidar/a2" in words(text)
    frames = fixed("vlp16_mast") + fixed("vlp16_base_link", "vlp16_mast")
    frames += fixed("vlp16", "vlp16_base_link", 'xyz="0 0 0.0377"')
    text = imported(f"{HEAD}{frames}</robot>", tmp_path)
    assert list(data(text)["sensors"]) == ["vlp16"]
    assert "# is it " not in text


def test_rotations_rounded_as_people_round_them_are_those_of_the_preset(tmp_path: Path) -> None:
    frames = fixed("camera_link") + fixed(
        "camera_rgb_frame", "camera_link", 'xyz="0.003 0.011 0.009"'
    )
    frames += fixed("camera_rgb_optical_frame", "camera_rgb_frame", 'rpy="-1.57 0 -1.57"')
    (sensor,) = data(imported(f"{HEAD}{frames}</robot>", tmp_path))["sensors"].values()
    assert sensor["preset"] == "robotis/pi-camera"
    assert sensor["frames"]["camera_rgb_optical_frame"]["rpy"] == [-1.57, 0, -1.57]
    assert "rpy" not in sensor["frames"]["camera_rgb_frame"]


def test_numbers_have_no_digits_that_computing_left_behind(tmp_path: Path) -> None:
    mast = fixed("mast", origin='xyz="0.010267499999999999 0.30000000000000004 1.23456789012345"')
    assert "[0.0102675, 0.3, 1.23456789012345]" in imported(f"{HEAD}{mast}</robot>", tmp_path)


def test_no_sensors_leaves_frames_frames(tmp_path: Path) -> None:
    assert "sensors" not in data(imported(d435(tmp_path, name="d435i"), tmp_path, "--no-sensors"))


def test_a_xacro_file_is_expanded_with_arguments(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf.xacro"
    arg = '<xacro:arg name="high" default="1"/>'
    text = (
        f'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{arg}<link'
        ' name="base_link"/>'
    )
    mast = fixed("mast", origin='xyz="0 0 $(arg high)"')
    file.write_text(f"{text}{mast}</robot>")
    out = tmp_path / "robot.yaml"
    assert main(["import", str(file), "high:=0.5", "-o", str(out)]) == 0
    assert data(out.read_text("utf-8"))["frames"]["mast"]["xyz"] == [0, 0, 0.5]
    assert main(["import", str(file), "hgh:=0.5", "-o", str(out), "--force"]) == 1
    (tmp_path / "plain.urdf").write_text(f"{HEAD}</robot>")
    assert main(["import", str(tmp_path / "plain.urdf"), "high:=0.5"]) == 1


def test_a_source_with_errors_is_refused_entirely_unless_that_is_wanted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "r.urdf", tmp_path / "robot.yaml"
    file.write_text(
        moving(LIMIT)
        .replace('xyz="', "")
        .replace("<limit", '<origin xyz="1 2"/><axis xyz="0 0 0"/><limit')
    )
    assert main(["import", str(file), "-o", str(out)]) == 1
    assert not out.exists()
    output = capsys.readouterr().err
    assert output.count("error[TF721]") == 2
    assert "--keep-going" in output
    assert main(["import", str(file), "-o", str(out), "--keep-going"]) == 1
    assert re.search("# TF721 .* shoulder ", out.read_text("utf-8"))


def test_a_file_that_is_there_is_not_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "r.urdf", tmp_path / "robot.yaml"
    file.write_text(f"{HEAD}</robot>")
    out.write_text("mine")
    assert main(["import", str(file), "-o", str(out)]) == 2
    assert out.read_text("utf-8") == "mine"
    assert "--force" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ["a.yaml"],
        ["r.urdf", "a:=b"],
        ["r.urdf", "--robot", "R2"],
        ["r.urdf", "--package", "a"],
        ["none.urdf"],
    ],
    ids=" ".join,
)
def test_wrong_use_is_one_sentence(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", *words]) == 2
    output = capsys.readouterr()
    assert output.err
    assert not output.out
    assert "Traceback" not in output.err
