"""What stands beside links and joints.

Hardware as ros2_control reads it, raw blocks as they were written.
"""

import xml.etree.ElementTree as ET

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit

HEAD = """tfcompose: 1
robot: r
links: {base_link: {}, wheel: {}}
joints: {wheel_joint: {type: continuous, parent: base_link, child: wheel}}
"""


def urdfs(text: str) -> list[ET.Element]:
    compiled = compile_robot(HEAD + text, "r.yaml", library())
    assert not compiled.errors, compiled.errors
    assert compiled.robot
    files = {file.path: file.text for file in emit(compiled.robot)}
    return [ET.fromstring(files[name]) for name in ("robot.urdf", "robot.state_publisher.urdf")]  # noqa: S314 (we wrote it)


HARDWARE = """
ros2_control:
  base:
    plugin: mock_components/GenericSystem
    rw_rate: 100
    is_async: true
    params: {device: "/dev/tty & co", loop: true, gain: 0.50, count: 3, "a<b": "${2 * 3}"}
    joints:
      wheel_joint:
        command: {velocity: {min: -1, max: 1}}
        state: [position, velocity]
        params: {encoder: 4096}
    sensors: {force: {state: [force.x], params: {frame_id: wheel}}}
    gpios: {lamp: {command: {digital: {data_type: bool, size: 4, initial_value: false}}}}
"""

EXPECTED = """<ros2_control name="base" type="system" rw_rate="100" is_async="true">
<hardware><plugin>mock_components/GenericSystem</plugin><param name="device">/dev/tty &amp; co</param>
<param name="loop">true</param><param name="gain">0.5</param><param name="count">3</param>
<param name="a&lt;b">6</param></hardware>
<joint name="wheel_joint"><command_interface name="velocity"><param name="min">-1</param><param name="max">1</param>
</command_interface><state_interface name="position"/><state_interface name="velocity"/>
<param name="encoder">4096</param></joint>
<sensor name="force"><state_interface name="force.x"/><param name="frame_id">wheel</param></sensor>
<gpio name="lamp"><command_interface name="digital" data_type="bool" size="4">
<param name="initial_value">false</param></command_interface></gpio></ros2_control>"""  # noqa: E501 (a text as its reader has it)


def test_a_rate_of_zero_is_that_of_all_as_ros2_control_reads_it() -> None:
    """Source: ros2_control's component_parser, which takes 0 for the controller manager's rate."""
    for tree in urdfs(HARDWARE.replace("rw_rate: 100", "rw_rate: 0")):
        assert [element.get("rw_rate") for element in tree.iter("ros2_control")] == ["0"]


def same(first: ET.Element, second: ET.Element) -> bool:
    texts = [(element.text or "").strip() for element in (first, second)]
    return (first.tag, first.attrib, texts[0], len(first)) == (
        second.tag,
        second.attrib,
        texts[1],
        len(second),
    ) and all(same(*pair) for pair in zip(first, second, strict=True))


def test_hardware_is_emitted_as_ros2_control_reads_it() -> None:
    for urdf in urdfs(HARDWARE):
        (control,) = urdf.findall("ros2_control")
        assert same(control, ET.fromstring(EXPECTED)), ET.tostring(control)  # noqa: S314 (as above)


def test_known_joints_are_named_in_file_order_and_not_all_of_a_hundred() -> None:
    names = [f"j{number}" for number in range(100)]
    joints = "".join(
        f"  {name}: {{type: continuous, parent: base_link, child: {name}_link}}\n"
        for name in names
    )
    links = "".join(f"  {name}_link: {{}}\n" for name in names)
    control = "ros2_control: {h: {plugin: a/B, joints: {gripper: {state: [position]}}}}\n"
    text = f"tfcompose: 1\nrobot: r\nlinks:\n  base_link: {{}}\n{links}joints:\n{joints}{control}"
    (finding,) = compile_robot(text, "r.yaml", library()).errors
    assert finding.help.endswith(" j0, j1, j2, j3, j4, j5, j6, j7 and 92 more")


def test_a_raw_block_is_emitted_as_it_stands_in_both_files() -> None:
    block = '<gazebo reference="wheel">\n  <mu1>1.2</mu1> <!-- worn: 0.9 -->\n</gazebo>\n<gazebo/>'
    text = "vars: {mu: 1.2}\nxml:\n  wheels: |\n" + "\n".join(
        f"      {line}" for line in block.replace("1.2", "${mu}").splitlines()
    )
    for urdf in urdfs(text):
        assert [element.get("reference") for element in urdf.findall("gazebo")] == ["wheel", None]
        assert urdf.findtext("gazebo/mu1") == "1.2"
    compiled = compile_robot(HEAD + text, "r.yaml", library())
    assert compiled.robot
    full = next(file.text for file in emit(compiled.robot) if file.path == "robot.urdf")
    assert "<!-- worn: 0.9 -->" in full


def test_one_block_needs_no_name_and_keeps_its_lines() -> None:
    for urdf in urdfs("xml: |\n  <gazebo reference='wheel'/>\n"):
        assert [element.get("reference") for element in urdf.findall("gazebo")] == ["wheel"]
    compiled = compile_robot(
        HEAD + "xml: |\n  <gazebo/>\n  <gazebo reference='x'/>\n", "r.yaml", library()
    )
    assert [
        (finding.code, finding.span and (finding.span.line, finding.span.column))
        for finding in compiled.errors
    ] == [("TF203", (7, 22))]


def test_an_overlay_takes_hardware_and_blocks_away() -> None:
    text = (
        HARDWARE
        + "xml: {a: <gazebo/>}\nprofiles: {bare: {ros2_control: {base: null}, xml: {a: null}}}\n"
    )
    compiled = compile_robot(HEAD + text, "r.yaml", library(), ["bare"])
    assert not compiled.errors
    assert compiled.robot
    assert (compiled.robot.hardware, compiled.robot.blocks) == ((), ())


@pytest.mark.parametrize(
    ("source_text", "place"),
    [
        ("|\n    <gazebo reference='x'/>\n", (7, 24)),
        ("|\n\n    <gazebo\n     reference='x'/>\n", (9, 17)),
        (">\n    <gazebo reference='x'/>\n", (7, 24)),
        ("<gazebo reference='x'/>\n", (6, 11)),
        ("\"<gazebo reference='x'/>\\n<gazebo/>\"\n", (6, 11)),
    ],
)
def test_a_finding_in_a_block_has_the_line_of_the_robot_file(
    source_text: str, place: tuple[int, int]
) -> None:
    compiled = compile_robot(HEAD + f"xml:\n  wheels: {source_text}", "r.yaml", library())
    (finding,) = compiled.errors
    assert finding.span
    assert (finding.code, finding.span.line, finding.span.column) == ("TF203", *place)


def test_a_block_cannot_bring_entities_or_end_the_robot() -> None:
    for evil in ("</robot><robot>", "<!DOCTYPE a [<!ENTITY b 'c'>]>", "]]>", "<a", "&nope;"):
        compiled = compile_robot(HEAD + f"xml:\n  a: |\n    {evil}\n", "r.yaml", library())
        assert {finding.code for finding in compiled.errors} <= {"TF018", "TF719"}, evil
        assert compiled.errors, evil


def test_two_parts_of_a_kind_have_hardware_blocks_and_colours_of_their_own() -> None:
    arm = """tfcompose: 1
robot: arm
links: {foot: {}, hand: {visual: {sphere: {radius: 1}, material: {name: paint, rgba: [%s, 0, 0, 1]}}}}
joints: {wrist: {type: continuous, axis: [0, 0, 1], parent: foot, child: hand}, lid: {type: floating, parent: foot, child: a, owner: x}}
frames: {a: {}}
ros2_control: {motors: {plugin: x/Y, joints: {wrist: {command: [effort]}}}}
xml: {g: '<gazebo reference="hand"><frame>foot</frame><word>footed</word></gazebo>'}
processes: {x: {external: true}}
"""  # noqa: E501 (a text as its reader has it)
    texts = {"red.yaml": arm % 1, "dark.yaml": arm % 0.2}
    holder = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\nparts:\n" + "".join(
        f"  {side}: {{spec: {file}, prefix: {side}_, parent: base_link}}\n"
        for side, file in (("left", "red.yaml"), ("right", "dark.yaml"))
    )
    compiled = compile_robot(holder, "r.yaml", library(), read=texts.__getitem__)
    assert not compiled.findings, compiled.findings
    assert compiled.robot
    urdf = ET.fromstring(next(f.text for f in emit(compiled.robot) if f.path == "robot.urdf"))  # noqa: S314 (ours)
    names = [element.get("name") for element in urdf.findall("ros2_control")]
    assert names == ["left_motors", "right_motors"]
    assert [element.get("name") for element in urdf.findall("ros2_control/joint")] == [
        "left_wrist",
        "right_wrist",
    ]
    assert [element.get("reference") for element in urdf.findall("gazebo")] == [
        "left_hand",
        "right_hand",
    ]
    assert [element.findtext("frame") for element in urdf.findall("gazebo")] == [
        "left_foot",
        "right_foot",
    ]
    assert {element.findtext("word") for element in urdf.findall("gazebo")} == {"footed"}
    assert {element.get("name") for element in urdf.iter("material")} == {
        "left_paint",
        "right_paint",
    }
    kinds = {str(element.get("name")): element.get("type") for element in urdf.findall("joint")}
    assert kinds["left_lid"] == kinds["right_lid"] == "floating"


def test_a_prefix_is_declared_by_any_element_around_it() -> None:
    inner = '<gazebo><a xmlns:x="u"><x:b x:c="1"/></a></gazebo>'
    assert not compile_robot(HEAD + f"xml:\n  a: '{inner}'\n", "r.yaml", library()).errors
    neighbour = '<gazebo><a xmlns:x="u"/><x:b/></gazebo>'
    (finding,) = compile_robot(HEAD + f"xml:\n  a: '{neighbour}'\n", "r.yaml", library()).errors
    assert finding.code == "TF719"
