"""A URDF, a xacro file or a macro as a part: whole, under a prefix, where the holder puts it."""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yourdfpy
from scipy.spatial.transform import Rotation

from tests.support.findings import words
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.plan.file import read_plan

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="grey"><color rgba="0.5 0.25 0.125 1"/></material>
  <link name="world"/>
  <link name="base">
    <visual><origin xyz="0 0 0.1"/><geometry><mesh filename="package://arm/base.stl" scale="2 2 2"/></geometry>
      <material name="grey"/></visual>
    <collision><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision>
    <inertial><origin xyz="0 0 0.05"/><mass value="2"/>
      <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0.001" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="upper"/> <link name="finger"/> <link name="tip"/>
  <joint name="fix" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 1"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 0 2"/>
    <limit lower="-3" upper="3" effort="10" velocity="1"/><dynamics damping="0.5" friction="0.25"/>
    <safety_controller soft_lower_limit="-2" soft_upper_limit="2" k_position="4" k_velocity="8"/></joint>
  <joint name="follow" type="prismatic"><parent link="upper"/><child link="finger"/><axis xyz="0 1 0"/>
    <mimic joint="shoulder" multiplier="-0.5" offset="0.125"/>
    <limit lower="-3" upper="3" effort="10" velocity="1"/></joint>
  <joint name="end" type="fixed"><parent link="finger"/><child link="tip"/><origin xyz="0.5 0 0"/></joint>
  <transmission name="drive"><type>transmission_interface/SimpleTransmission</type>
    <joint name="shoulder"><hardwareInterface>x</hardwareInterface></joint><actuator name="motor"/></transmission>
  <gazebo reference="upper"><mu1>0.5</mu1></gazebo>
  <gazebo><plugin filename="a.so" name="p"/></gazebo>
</robot>
"""  # noqa: E501 (a text as its reader has it)

XACRO = """<robot name="slide" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="reach" default="0.5"/>
  <xacro:include filename="$(find arm)/sizes.xacro"/>
  <link name="base"/> <link name="tool"/>
  <joint name="reach" type="fixed"><parent link="base"/><child link="tool"/>
    <origin xyz="$(arg reach) 0 ${height}"/></joint>
</robot>
"""

MACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="mast" params="name parent_link tall:=false *origin">
    <link name="${name}_mast"/>
    <joint name="${name}_mast_joint" type="fixed"><parent link="${parent_link}"/><child link="${name}_mast"/>
      <xacro:insert_block name="origin"/></joint>
    <xacro:if value="${tall}"><link name="${name}_top"/>
      <joint name="${name}_top_joint" type="fixed"><parent link="${name}_mast"/><child link="${name}_top"/>
      <origin xyz="0 0 ${height}"/></joint></xacro:if>
  </xacro:macro>
</robot>
"""  # noqa: E501 (a text as its reader has it)

POLE = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="pole" params="name parent:=base_link xyz:='-1 0 -0' rpy:='0 0 0' *origin">
    <link name="${name}"/>
    <joint name="${name}_joint" type="fixed"><parent link="${parent}"/><child link="${name}"/>
      <xacro:insert_block name="origin"/></joint>
  </xacro:macro>
  <xacro:macro name="leaning" params="name parent">
    <link name="${name}"/>
    <joint name="${name}_joint" type="fixed"><parent link="${parent}"/><child link="${name}"/>
      <origin xyz="0 0 1"/></joint>
  </xacro:macro>
</robot>
"""

HEAD = """
tfcompose: 1
robot: cell
packages: {arm: third/arm}
links: {table: {visual: {box: [1, 1, 0.1]}}}
parts:
"""


@pytest.fixture
def cell(tmp_path: Path) -> Any:
    """Compile these parts on a table, beside the package arm."""
    package = tmp_path / "third" / "arm"
    package.mkdir(parents=True)
    bare = XACRO.replace("$(arg reach)", "$(arg side)")
    texts = {
        "bare.xacro": bare,
        "arm.urdf": ARM,
        "slide.xacro": XACRO,
        "mast.xacro": MACRO,
        "pole.xacro": POLE,
        "base.stl": "",
    }
    sizes = (
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="height"'
        ' value="0.25"/></robot>'
    )
    for name, text in (texts | {"sizes.xacro": sizes}).items():
        (package / name).write_text(text, encoding="utf-8")
    file = tmp_path / "cell.yaml"

    def compiled(*parts: str) -> Compiled:
        text = HEAD + "".join(f"  {part}\n" for part in parts)
        return compile_robot(text, str(file), library(), read=read_text, disk=disk())

    return compiled


def sound(compiled: Compiled) -> Any:
    assert not compiled.findings, [
        (str(finding.span), finding.message) for finding in compiled.findings
    ]
    return compiled.robot


def files(compiled: Compiled) -> dict[str, str]:
    return {file.path: file.text for file in emit(sound(compiled))}


LEFT = (
    "left: {urdf: third/arm/arm.urdf, prefix: left_, root: base, parent: table, xyz: [0, 0.5, 0],"
    " rpy: [0, 0, 1]}"
)
RIGHT = (
    'right: {urdf: "$(find arm)/arm.urdf", prefix: right_, root: base, parent: table, xyz: [0,'
    " -0.5, 0]}"
)


def test_an_urdf_is_taken_twice_with_everything_in_it_renamed(cell: Any) -> None:
    text = files(cell(LEFT, RIGHT))["robot.urdf"]
    root = ET.fromstring(text)  # noqa: S314 (our own text)
    for kind in ("link", "joint", "transmission"):
        names = [element.get("name") for element in root.findall(kind)]
        assert len(names) == len(set(names))
    assert [element.get("joint") for element in root.iter("mimic")] == [
        "left_shoulder",
        "right_shoulder",
    ]
    assert [element.get("reference") for element in root.findall("gazebo")] == [
        "left_upper",
        None,
        "right_upper",
    ]
    assert [element.find("joint").get("name") for element in root.findall("transmission")] == [  # type: ignore[union-attr]
        "left_shoulder",
        "right_shoulder",
    ]
    assert {element.get("name") for element in root.iter("actuator")} == {
        "left_motor",
        "right_motor",
    }
    assert {element.get("name") for element in root.iter("material")} == {
        "left_grey",
        "right_grey",
    }


def test_a_shape_with_tabs_is_kept_though_urdf_readers_may_fail_on_it(
    cell: Any, tmp_path: Path
) -> None:
    (tmp_path / "plate.urdf").write_text(
        '<robot name="p"><link name="flat"><visual><geometry><box'
        ' size="1\n\t2\t3"/></geometry></visual></link></robot>'
    )
    text = files(cell("plate: {urdf: plate.urdf, parent: table}"))["robot.urdf"]
    assert '<box size="1 2 3"/>' in text


def test_a_joint_that_is_there_already_is_refused_as_a_frame_is(cell: Any, tmp_path: Path) -> None:
    """Of two joints with one name, joint states move both, and readers of the URDF refuse it."""
    text = (
        '<robot name="r"><link name="{0}_a"/><link name="{0}_b"/><joint name="j"'
        ' type="{1}"><parent link="{0}_a"/>'
    )
    for name, kind in (("one", "fixed"), ("two", "continuous")):
        full = text.format(name, kind) + f'<child link="{name}_b"/></joint></robot>'
        (tmp_path / f"{name}.urdf").write_text(full, encoding="utf-8")
    first, two = "one: {urdf: one.urdf, parent: table}", "two: {urdf: two.urdf, parent: table}"
    (finding,) = cell(first, two).findings
    assert finding.code == "TF505"
    assert {"two", "j"} <= words(finding)
    assert [note.span.file.rpartition("/")[2] for note in finding.notes if note.span] == [
        "one.urdf",
        "two.urdf",
    ]
    assert "prefix: two/" in finding.help
    assert sound(cell(first, two.replace("parent", "prefix: t_, parent")))


def test_what_is_about_links_and_joints_that_are_removed_is_removed_too(
    cell: Any, tmp_path: Path
) -> None:
    control = """<ros2_control name="{}" type="system"><hardware><plugin>a/B</plugin></hardware>{}</ros2_control>"""  # noqa: E501 (a text as its reader has it)
    joint = '<joint name="{}"><command_interface name="position"/></joint>'
    both = control.format("both", joint.format("shoulder") + joint.format("roll"))
    cart = """<link name="cart"/><joint name="roll" type="continuous"><parent link="world"/><child link="cart"/></joint>
    <gazebo reference="cart"><a/></gazebo><gazebo reference="roll"><a/></gazebo><gazebo reference="nobody"><a/></gazebo>
    <transmission name="wheel"><joint name="roll"/><actuator name="w"/></transmission>"""  # noqa: E501 (a text as its reader has it)
    text = ARM.replace(
        "</robot>", f"{cart}{both}{control.format('one', joint.format('roll'))}</robot>"
    )
    (tmp_path / "third/arm/arm.urdf").write_text(text, encoding="utf-8")
    root = ET.fromstring(files(cell(LEFT))["robot.urdf"])  # noqa: S314 (our own text)
    assert [element.get("reference") for element in root.findall("gazebo")] == [
        "left_upper",
        None,
        "nobody",
    ]
    assert [element.get("name") for element in root.findall("transmission")] == ["left_drive"]
    assert [element.get("name") for element in root.findall("ros2_control")] == ["left_both"]
    assert [element.get("name") for element in root.findall("ros2_control/joint")] == [
        "left_shoulder"
    ]


def test_foreign_names_with_other_characters_are_renamed_everywhere(
    cell: Any, tmp_path: Path
) -> None:
    text = ARM.replace('"upper"', '"upper &amp; &lt;arm&gt;"').replace(
        '"shoulder"', '"shoulder-joint 1.0"'
    )
    (tmp_path / "third/arm/arm.urdf").write_text(text, encoding="utf-8")
    root = ET.fromstring(files(cell(LEFT))["robot.urdf"])  # noqa: S314 (our own text)
    assert root.find("link[@name='left_upper & <arm>']") is not None
    assert [element.get("reference") for element in root.findall("gazebo")] == [
        "left_upper & <arm>",
        None,
    ]
    (joint,) = (element.get("name") for element in root.findall("transmission/joint"))
    assert joint == root.find("joint/mimic").get("joint") == "left_shoulder-joint 1.0"  # type: ignore[union-attr]


def test_a_block_of_a_macro_is_a_pose_as_everywhere(cell: Any) -> None:
    pose = "{xyz: [10 cm, 0, 2], look: {down: 30 deg}}"
    params = f"{{name: front, parent_link: table, origin: {pose}}}"
    robot = sound(cell(f"mast: {{xacro: third/arm/mast.xacro, macro: mast, params: {params}}}"))
    mast_pose = robot.parent_edge("front_mast").pose
    assert mast_pose.xyz == (0.1, 0, 2)
    assert mast_pose.rpy == pytest.approx((0, np.pi / 6, 0), abs=1e-15)


def test_a_macro_takes_its_parent_and_its_origin_from_the_part(cell: Any) -> None:
    """Also one whose parent parameter has another name, and defaults with spaces."""
    pose = "parent: table, xyz: [10 cm, 0, 2], look: {down: 30 deg}"
    robot = sound(
        cell(
            f"mast: {{xacro: third/arm/mast.xacro, macro: mast, {pose}, params: {{name: front}}}}"
        )
    )
    edge = robot.parent_edge("front_mast")
    assert (edge.parent, edge.pose.xyz, edge.joint_name) == (
        "table",
        (0.1, 0, 2),
        "front_mast_joint",
    )
    assert edge.pose.rpy == pytest.approx((0, np.pi / 6, 0), abs=1e-15)
    prefixed = sound(
        cell(
            f"mast: {{xacro: third/arm/mast.xacro, macro: mast, prefix: l_, {pose}, params:"
            " {name: a}}",
            f"other: {{xacro: third/arm/pole.xacro, macro: pole, {pose}, joint: pole_fix, params:"
            " {name: b}}",
        )
    )
    assert prefixed.parent_edge("l_a_mast").joint_name == "l_a_mast_joint"
    assert prefixed.parent_edge("b").joint_name == "pole_fix"
    assert prefixed.parent_edge("b").pose.xyz == (0.1, 0, 2)


def test_a_macro_not_simply_fixed_to_its_parent_gets_the_parent_by_hand(cell: Any) -> None:
    part = "other: {xacro: third/arm/pole.xacro, macro: leaning, parent: table, params: {name: b}}"
    (finding,) = cell(part).errors
    assert (finding.code, finding.span.line) == ("TF313", 7)
    by_hand = (
        "other: {xacro: third/arm/pole.xacro, macro: leaning, params: {name: b, parent: table}}"
    )
    assert sound(cell(by_hand)).parent_edge("b").pose.xyz == (0, 0, 1)


def test_xacro_finds_a_package_of_the_robot_with_relative_paths(
    cell: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert cell  # writes the package
    manifest = tmp_path / "third/arm/package.xml"
    manifest.write_text("<package><name>arm</name></package>", "utf-8")
    (tmp_path / "robots").mkdir()
    text = (
        HEAD.replace("third/arm", "../third/arm")
        + '  slide: {xacro: "$(find arm)/slide.xacro", parent: table}\n'
    )
    (tmp_path / "robots/cell.yaml").write_text(text, "utf-8")
    monkeypatch.chdir(tmp_path)
    compiled = compile_robot(text, "robots/cell.yaml", library(), read=read_text, disk=disk())
    assert sound(compiled).parent_edge("tool").pose.xyz == (0.5, 0, 0.25)


@pytest.mark.parametrize(
    ("find", "code", "message"),
    [
        ("$(find amr)/sizes.xacro", "TF724", "amr"),
        ("$(find arm)/none.xacro", "TF018", "none.xacro"),
        ("$(find arm)/base.stl", "TF018", "base.stl"),
    ],
)
def test_what_xacro_cannot_find_is_reported_once(
    cell: Any, tmp_path: Path, find: str, code: str, message: str
) -> None:
    slide = tmp_path / "third/arm/slide.xacro"
    slide.write_text(XACRO.replace("$(find arm)/sizes.xacro", find), "utf-8")
    (finding,) = cell("slide: {xacro: third/arm/slide.xacro, parent: table}").errors
    assert (finding.code, finding.message.count(message), finding.message.count("Error")) == (
        code,
        1,
        0,
    )
    assert finding.span.file.endswith("cell.yaml")


def test_a_part_emptied_by_a_refused_part_reports_nothing(
    tmp_path: Path,
) -> None:
    (tmp_path / "inner.yaml").write_text(
        "tfcompose: 1\nrobot: inner\nparts: {a: {urdf: gone.urdf}}\n", "utf-8"
    )
    for more in ("", ", root: tool"):
        part = f"m: {{spec: inner.yaml, prefix: m_, parent: base_link{more}}}"
        text = f"tfcompose: 1\nrobot: r\nlinks: {{base_link: {{}}}}\nparts: {{{part}}}\n"
        findings = compile_robot(
            text, str(tmp_path / "r.yaml"), library(), read=read_text, disk=disk()
        ).findings
        assert [finding.code for finding in findings] == ["TF001"], more


def test_an_error_of_xacro_in_a_macro_of_another_file_is_found_there(
    cell: Any, tmp_path: Path
) -> None:
    (tmp_path / "third/arm/mast.xacro").write_text(
        MACRO.replace("${height}", "${hight + 1}"), "utf-8"
    )
    call = (
        '<xacro:include filename="mast.xacro"/><xacro:mast name="a" parent_link="w"'
        ' tall="1"><origin/></xacro:mast>'
    )
    outer = (
        '<robot name="o" xmlns:xacro="http://www.ros.org/wiki/xacro"><link'
        f' name="w"/>{call}</robot>'
    )
    (tmp_path / "third/arm/outer.xacro").write_text(outer, "utf-8")
    (finding,) = cell("o: {xacro: third/arm/outer.xacro, parent: table}").findings
    assert "'hight'" in finding.message
    assert [note.span and note.span.file.endswith("mast.xacro") for note in finding.notes] == [
        True,
        True,
        False,
    ]
    assert [note.message.rpartition(" ")[2] for note in finding.notes[1:]] == ["mast", "o"]
    line = MACRO.splitlines()[finding.notes[0].span.line - 1]
    assert line[finding.notes[0].span.column - 1 :].startswith("${height}")


def test_a_foreign_floating_joint_is_reported_where_it_can_have_an_owner(
    cell: Any, tmp_path: Path
) -> None:
    (tmp_path / "third/arm/arm.urdf").write_text(
        ARM.replace('name="end" type="fixed"', 'name="end" type="floating"')
    )
    (finding,) = cell(LEFT).findings
    assert (finding.code, "tfcompose import" in finding.help) == ("TF715", True)


def test_each_number_of_the_urdf_is_still_there(cell: Any) -> None:
    root = ET.fromstring(files(cell(LEFT))["robot.urdf"])  # noqa: S314 (our own text)
    joint = next(
        element for element in root.findall("joint") if element.get("name") == "left_shoulder"
    )
    output = {child.tag: child.attrib for child in joint}
    assert output["limit"] == {"lower": "-3", "upper": "3", "effort": "10", "velocity": "1"}
    assert output["dynamics"] == {"damping": "0.5", "friction": "0.25"}
    assert output["axis"] == {"xyz": "0 0 1"}
    assert [float(value) for value in output["safety_controller"].values()] == [-2, 2, 4, 8]
    base = next(element for element in root.findall("link") if element.get("name") == "left_base")
    mesh, colour = next(base.iter("mesh")), next(base.iter("color"))
    assert (mesh.get("filename"), mesh.get("scale")) == ("package://arm/base.stl", "2 2 2")
    assert colour.get("rgba") == "0.5 0.25 0.125 1"
    assert next(base.iter("mass")).get("value") == "2"
    assert next(base.iter("inertia")).get("ixy") == "0.001"
    assert next(base.iter("cylinder")).attrib == {"radius": "0.1", "length": "0.2"}


def test_every_frame_is_where_an_independent_reader_of_the_urdf_has_it(
    cell: Any, tmp_path: Path
) -> None:
    full = tmp_path / "whole.urdf"
    full.write_text(files(cell(LEFT))["robot.urdf"], encoding="utf-8")
    load = {"load_meshes": False, "build_scene_graph": True}
    mine, theirs = (
        yourdfpy.URDF.load(str(full), **load),
        yourdfpy.URDF.load(str(tmp_path / "third/arm/arm.urdf"), **load),
    )
    for q in (0.0, 0.7):
        mine.update_cfg({"left_shoulder": q})
        theirs.update_cfg({"shoulder": q})
        got = mine.get_transform("left_tip", "left_base")
        assert got == pytest.approx(theirs.get_transform("tip", "base"), abs=1e-9)


def test_moving_joints_go_to_joints_and_fixed_ones_to_static_once_renamed(
    cell: Any,
) -> None:
    plan = read_plan(files(cell(LEFT))["plan.json"], "plan.json")
    owners = {
        edge.child: (edge.owner, edge.joint.name if edge.joint else "") for edge in plan.edges
    }
    assert owners == {
        "left_base": ("static", ""),
        "left_upper": ("joints", "left_shoulder"),
        "left_finger": ("joints", "left_follow"),
        "left_tip": ("static", ""),
    }


def test_a_frame_of_the_urdf_is_placed(cell: Any) -> None:
    edge = sound(
        cell(LEFT.replace("root: base", "place: left_base").replace("left_,", "left_,"))
    ).parent_edge("left_world")
    rotation = Rotation.from_euler("xyz", [0, 0, 1])
    assert edge.pose.xyz == pytest.approx(
        rotation.apply([0, 0, -1]) + np.array([0, 0.5, 0]), abs=1e-12
    )


def test_an_urdf_can_be_a_robot_of_its_own(cell: Any) -> None:
    out = files(
        cell("left: {urdf: third/arm/arm.urdf, prefix: left_, parent: table, namespace: left}")
    )
    plan = read_plan(out["plan.json"], "plan.json")
    assert plan.process("left/joints").nodes == ("/left/tfcompose_joints",)
    assert {edge.joint.name for edge in plan.edges if edge.joint} == {"shoulder", "follow"}
    assert '<link name="upper"/>' in out["left/robot.urdf"]


def test_xacro_expands_with_arguments_and_the_robots_own_packages(cell: Any) -> None:
    robot = sound(
        cell(
            "slide: {xacro: package://arm/slide.xacro, args: {reach: 0.75}, parent: table,"
            " prefix: s_}"
        )
    )
    assert robot.parent_edge("s_tool").pose.xyz == (0.75, 0, 0.25)


def test_a_macro_hangs_itself_on_the_holders_frame(cell: Any) -> None:
    robot = sound(
        cell(
            "mast: {xacro: third/arm/mast.xacro, include: third/arm/sizes.xacro, macro: mast,"
            " prefix: m_, params: {name: front, parent_link: table, tall: true, origin: {xyz: [1,"
            " 2, 3], rpy: [0, 0, 0.5]}}}",
            "other: {xacro: third/arm/mast.xacro, macro: mast, "
            "params: {name: rear, parent_link: m_front_top, origin: '<origin xyz=\"4 5 6\"/>'}}",
        )
    )
    mast = robot.parent_edge("m_front_mast")
    assert (mast.parent, mast.pose.xyz) == ("table", (1, 2, 3))
    assert robot.parent_edge("m_front_top").pose.xyz == (0, 0, 0.25)
    assert robot.parent_edge("rear_mast").parent == "m_front_top"
    assert robot.parent_edge("rear_mast").pose.xyz == (4, 5, 6)


@pytest.mark.parametrize("prefix", ["", "prefix: arm_, "])
def test_what_hangs_on_a_part_that_was_refused_says_nothing_of_its_own(
    cell: Any, prefix: str
) -> None:
    """A name that is one letter off the robot's own is wrong all the same."""
    name = "arm_finger" if prefix else "finger"
    result = cell(
        f"arm: {{urdf: package://ur/arm.urdf, {prefix}parent: table}}",
        "other: {urdf: third/arm/arm.urdf, prefix: other_, root: base, parent: table, relative_to:"
        " NAME}".replace("NAME", name),
        f"third: {{urdf: third/arm/arm.urdf, prefix: third_, root: base, parent: {name}}}\nframes:"
        f" {{on: {{parent: {name}}}, off: {{parent: tabel}}}}\nxml: {{g: '<gazebo"
        f' reference="{name}"/>\'}}\nros2_control: {{hw: {{plugin: a/B, joints: {{{name}:'
        f" {{state: {{position: {{}}}}}}}}}}}}\nbase: {name}",
    )
    assert [finding.code for finding in result.findings] == ["TF724", "TF203"]
    assert "ur" in result.findings[0].message.split()
    assert result.findings[1].message.split()[-1] == "tabel"


def test_bad_hardware_of_a_part_is_reported_at_its_line_with_every_use(
    cell: Any, tmp_path: Path
) -> None:
    joint = '\n    <joint name="shoulder"><command_interface name="position"/></joint>'
    control = (
        '<ros2_control name="hw"'
        f' type="system"><hardware><plugin>a/B</plugin></hardware>{joint}</ros2_control>'
    )
    file = tmp_path / "third/arm/arm.urdf"
    file.write_text(ARM.replace("</robot>", f"{control}</robot>"), encoding="utf-8")
    mine = "{shoulder: {command: {position: {}}}}".replace("shoulder", "left_shoulder")
    (finding,) = cell(
        LEFT, f"{RIGHT}\nros2_control: {{mine: {{plugin: a/B, joints: {mine}}}}}"
    ).findings
    assert finding.code == "TF717"
    assert finding.span
    assert (
        file.read_text(encoding="utf-8")
        .splitlines()[finding.span.line - 1][finding.span.column - 1 :]
        .startswith('<joint name="shoulder"')
    )
    assert [note.message for note in finding.notes][1:] == [
        "as the part left",
        "as the part right",
    ]
    (full,) = cell(
        f"{LEFT.replace('root: base, ', '')}\nros2_control: {{mine: {{plugin: a/B, joints:"
        f" {mine}}}}}"
    ).findings
    assert (full.code, full.span) == ("TF717", finding.span)


def test_a_block_that_names_nothing_of_its_part_stands_once(cell: Any) -> None:
    """Two plugins of a simulator would start two controller managers of one name."""
    texts = [block.text for block in sound(cell(LEFT, RIGHT)).blocks]
    assert [text for text in texts if "plugin" in text] == [
        '<gazebo><plugin filename="a.so" name="p"/></gazebo>'
    ]
    assert len([text for text in texts if "<gazebo reference=" in text]) == 2


def test_warnings_about_somebody_elses_file_are_left_to_its_own_lint(
    cell: Any, tmp_path: Path
) -> None:
    file = tmp_path / "third/arm/arm.urdf"
    file.write_text(ARM.replace('ixx="0.02" iyy="0.02"', 'ixx="9" iyy="9"'), encoding="utf-8")
    assert cell(LEFT).findings == ()
    file.write_text(ARM.replace('parent link="finger"', 'parent link="fingr"'), encoding="utf-8")
    (finding,) = cell(LEFT.replace("root: base, ", "")).errors
    assert (finding.code, finding.span.file) == ("TF203", str(file))
    assert finding.notes[-1].message == "as the part left"


@pytest.mark.parametrize(
    ("part", "code", "message", "advice", "place"),
    [
        (
            "a: {urdf: package://amr/arm.urdf, parent: table}",
            "TF724",
            "amr",
            "did you mean arm?",
            "cell.yaml",
        ),
        (
            "a: {xacro: third/arm/mast.xacro, parent: table}",
            "TF206",
            "has no links",
            "macro: mast",
            "cell.yaml",
        ),
        (
            "a: {urdf: third/arm/slide.xacro, parent: table}",
            "TF106",
            "a xacro file",
            "xacro: instead",
            "cell.yaml",
        ),
        (
            "a: {spec: third/arm/arm.urdf, parent: table}",
            "TF106",
            "a urdf file",
            "urdf: instead of spec:",
            "cell.yaml",
        ),
        (
            "a: {xacro: cell.yaml, parent: table}",
            "TF106",
            "a robot file",
            "spec: instead of xacro:",
            "cell.yaml",
        ),
        ("a: {urdf: none.urdf, parent: table}", "TF001", "cannot be read", "", "none.urdf"),
        (
            "a: {xacro: third/arm/slide.xacro, args: {rech: 1}, parent: table}",
            "TF106",
            "rech",
            "mean reach?",
            "cell.yaml",
        ),
        (
            "a: {xacro: third/arm/mast.xacro, macro: mst, parent: table}",
            "TF018",
            "xacro:mst",
            "mast",
            "cell.yaml",
        ),
        (
            "a: {xacro: third/arm/mast.xacro, macro: mast, params: {b: 1}}",
            "TF018",
            "parameter",
            "name parent_link tall:=false *origin",
            "cell.yaml",
        ),
        (
            'a: {xacro: third/arm/mast.xacro, macro: mast, params: {origin: "<origin>"}}',
            "TF018",
            "block origin: ",
            "",
            "cell.yaml",
        ),
        (
            "a: {xacro: third/arm/mast.xacro, macro: mast, params: {origin: {xzy: 1}}}",
            "TF101",
            "xzy",
            "xyz",
            "cell.yaml",
        ),
        (
            "a: {xacro: third/arm/bare.xacro, parent: table}",
            "TF106",
            "side",
            "args: {side: …}",
            "cell.yaml",
        ),
        (
            "a: {urdf: third/arm/arm.urdf, prefix: /x, parent: table}",
            "TF501",
            "'/x'",
            "left_",
            "cell.yaml",
        ),
        (
            "a: {urdf: third/arm/arm.urdf, prefix: a b, parent: table}",
            "TF501",
            "'a b'",
            "left_",
            "cell.yaml",
        ),
        (
            "a: {urdf: third/arm/arm.urdf, root: bse, parent: table}",
            "TF203",
            "bse",
            "base",
            "cell.yaml",
        ),
        (
            "a: {urdf: third/arm/arm.urdf, vars: {b: 1}, parent: table}",
            "TF107",
            "vars",
            "",
            "cell.yaml",
        ),
        (
            "a: {urdf: third/arm/arm.urdf, xacro: b, parent: table}",
            "TF107",
            "exclude",
            "",
            "cell.yaml",
        ),
        (
            "a: {xacro: third/arm/slide.xacro, params: {b: 1}, parent: table}",
            "TF102",
            "without a macro",
            "",
            "cell.yaml",
        ),
        ("a: {parent: table}", "TF102", "", "spec", "cell.yaml"),
    ],
)
def test_what_cannot_be_a_part_is_reported_with_its_place(  # noqa: PLR0913, PLR0917 (what is said, in its parts)
    cell: Any, part: str, code: str, message: str, advice: str, place: str
) -> None:
    errors = cell(part).errors
    assert [finding.code for finding in errors] == [code], [finding.message for finding in errors]
    assert message in errors[0].message
    assert " object at 0x" not in errors[0].message
    assert advice in errors[0].help
    assert errors[0].span.file.endswith(place)


def test_a_robots_file_is_named_in_xacro_arguments_and_macro_parameters(
    cell: Any, tmp_path: Path
) -> None:
    (tmp_path / "config").mkdir()
    (tmp_path / "config/arm.yaml").write_text("reach: 0.75\n", "utf-8")
    (tmp_path / "third/arm/loads.xacro").write_text(
        '<robot name="l" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="kit"'
        ' default=""/><xacro:macro name="tool" params="kit prefix"><link'
        ' name="${prefix}_base"/><link name="${prefix}_tool"/><joint name="${prefix}_reach"'
        ' type="fixed"><parent link="${prefix}_base"/><child link="${prefix}_tool"/><origin'
        " xyz=\"${xacro.load_yaml(kit)['reach']} 0 0\"/></joint></xacro:macro><xacro:tool"
        ' kit="$(arg kit)" prefix="p"/></robot>',
        "utf-8",
    )
    part = (
        'a: {xacro: third/arm/loads.xacro, args: {kit: "${file(config/arm.yaml)}"}, parent: table}'
    )
    robot = sound(cell(part))
    assert robot.parent_edge("p_tool").pose.xyz == (0.75, 0, 0)
    (missing,) = cell(part.replace("arm.yaml", "amr.yaml")).errors
    assert (missing.code, missing.span.file.endswith("cell.yaml")) == ("TF019", True)
    (frame,) = cell(part.replace("file(config/arm.yaml)", "frame(table)")).errors
    assert frame.code == "TF105"
