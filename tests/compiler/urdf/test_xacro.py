"""The macro, expanded by real xacro.

The robot itself, and as many others of it as somebody asks for.
"""

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xacro
from scipy.spatial.transform import Rotation

from tests.support.random_robot import spec
from tests.support.robots import EVERYTHING
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit

ROBOTS = Path(__file__).parents[3] / "robots"
PRESETS = library()


def files_of(text: str, folder: Path) -> dict[str, str]:
    compiled = compile_robot(
        text, "r.yaml", PRESETS, read=lambda name: (ROBOTS / name).read_text("utf-8")
    )
    assert not compiled.errors, compiled.errors
    assert compiled.robot
    files = {file.path: file.text for file in emit(compiled.robot)}
    for name, content in files.items():
        (folder / name).parent.mkdir(exist_ok=True, parents=True)
        (folder / name).write_text(content, encoding="utf-8")
    return files


def expanded(file: Path, arguments: Mapping[str, str] | None = None) -> ET.Element:
    document: Any = xacro.process_file(str(file), mappings=dict(arguments or {}))
    return ET.fromstring(document.toxml())  # noqa: S314 (we wrote it)


def tree(element: ET.Element) -> tuple[Any, ...]:
    """Return the element as values that compare.

    Tag, attributes, words, and the same of what is in it.
    """
    words = tuple(" ".join(text.split()) for text in (element.text or "", element.tail or ""))
    return (element.tag, sorted(element.attrib.items()), words, [tree(child) for child in element])


def robots() -> list[Any]:
    examples = [
        pytest.param(file.read_text("utf-8"), id=file.stem)
        for file in sorted(ROBOTS.rglob("*.yaml"))
    ]
    family = [pytest.param(json.dumps(spec(seed)), id=f"family_{seed}") for seed in range(3)]
    return [*examples, *family, pytest.param(EVERYTHING, id="everything")]


@pytest.mark.parametrize("text", robots())
def test_by_its_defaults_it_is_the_robot(text: str, tmp_path: Path) -> None:
    files = files_of(text, tmp_path)
    full = ET.fromstring(files["robot.urdf"])  # noqa: S314 (we wrote it)
    assert tree(expanded(tmp_path / "robot.urdf.xacro")) == tree(full)


@pytest.mark.parametrize("text", robots())
def test_a_foreign_xacro_included_twice_gives_two_robots_in_their_places(
    text: str, tmp_path: Path
) -> None:
    files = files_of(text, tmp_path)
    name = files["robot.macro.xacro"].partition('<xacro:macro name="')[2].partition('"')[0]
    meshes = 'meshes="file:///there/"' if "meshes:=" in files["robot.macro.xacro"] else ""
    outer = tmp_path / "outer.urdf.xacro"
    outer.write_text(f"""<robot name="cell" xmlns:xacro="http://www.ros.org/wiki/xacro">
        <xacro:property name="away" value="0.5"/><link name="table"/>
        <xacro:include filename="robot.macro.xacro"/>
        <xacro:{name} prefix="left_" parent="table" xyz="0 ${{away}} 0" rpy="0 0 ${{pi / 2}}" {meshes}/>
        <xacro:{name} prefix="right_" parent="left_{base_of(files)}"/>
        </robot>""")  # noqa: E501 (a text as its reader has it)
    outer_urdf, single = expanded(outer), ET.fromstring(files["robot.urdf"])  # noqa: S314 (as above)
    links = [str(link.get("name")) for link in single.iter("link") if link.get("name")]
    assert [link.get("name") for link in outer_urdf.findall("link")] == [
        "table",
        *(f"{side}_{link}" for side in ("left", "right") for link in links),
    ]
    joints = {joint.get("name"): joint for joint in outer_urdf.findall("joint")}
    assert len(joints) == len(outer_urdf.findall("joint")) == 2 * len(single.findall("joint")) + 2
    (first,) = (
        joint for joint in joints.values() if joint.find("parent[@link='table']") is not None
    )
    origin = first.find("origin")
    assert origin is not None
    assert [float(word) for word in str(origin.get("xyz")).split()] == [0, 0.5, 0]
    turned = Rotation.from_euler("xyz", [float(word) for word in str(origin.get("rpy")).split()])
    assert turned.as_matrix() == pytest.approx(
        np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12
    )
    for joint in joints.values():
        ends = {str(end.get("link")) for tag in ("parent", "child") for end in joint.findall(tag)}
        assert ends <= {link.get("name") for link in outer_urdf.findall("link")}
        mimic = joint.find("mimic")
        assert mimic is None or mimic.get("joint") in joints


def base_of(files: Mapping[str, str]) -> str:
    return str(json.loads(files["plan.json"])["base"]).rpartition("/")[2]


def test_names_in_hardware_and_blocks_get_the_prefix_and_words_do_not(tmp_path: Path) -> None:
    files_of(EVERYTHING, tmp_path)
    urdf = expanded(tmp_path / "robot.urdf.xacro", {"prefix": "left_"})
    (control,) = urdf.findall("ros2_control")
    names = [
        element.get("name")
        for element in (control, *control.findall("joint"), *control.findall("gpio"))
    ]
    assert names == ["left_motors", "left_joint", "left_lamp"]
    assert [element.text for element in control.iter("param")] == [
        "$HOME/$(cwd)",
        "left_hand",
        "joint",
        "left_joint",
    ]
    (gazebo,) = urdf.findall("gazebo")
    assert gazebo.get("reference") == "left_hand"
    assert [
        str(gazebo.findtext(f"plugin/{tag}")).strip() for tag in ("frame", "joint", "text", "cost")
    ] == ["left_base_link", "left_joint", "base_link of joint $(eval 1)", "$5 $$(x)"]
    (drive,) = urdf.findall("transmission")
    assert [element.get("name") for element in drive.iter()] == [
        "left_drive",
        "left_joint",
        "left_motor",
    ]
    assert [mesh.get("filename") for mesh in urdf.iter("mesh")] == [
        "meshes/a.stl",
        "package://x/$(y)/$$(z).stl",
    ]
    assert [element.get("name") for element in urdf.iter("material")] == [
        "left_paint"
    ]  # another robot has another paint


def test_relative_meshes_can_have_another_base_folder(tmp_path: Path) -> None:
    files_of(EVERYTHING, tmp_path)
    outer = tmp_path / "outer.urdf.xacro"
    outer.write_text(
        '<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include'
        ' filename="robot.macro.xacro"/><xacro:class_robot meshes="file:///there/"/></robot>'
    )
    assert next(expanded(outer).iter("mesh")).get("filename") == "file:///there/meshes/a.stl"
