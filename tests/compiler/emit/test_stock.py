"""``state_publisher: stock``.

Robot_state_publisher gets what is ours below base, and everybody else keeps theirs.
"""

import json
import xml.etree.ElementTree as ET
from typing import Any

import pytest
import yaml

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit

ROBOT = """tfcompose: 1
robot: r
ros: {state_publisher: stock, namespace: rover, isolate: topics%s}
links:
  base_link: {visual: {box: [1, 1, 1]}, inertial: {mass: 3}}
  wheel: {visual: {sphere: {radius: 0.1}, material: {name: it}}, inertial: {mass: 1}}
  lens: {visual: {sphere: {radius: 0.1}, material: {name: it, rgba: [1, 1, 1, 1]}}}
joints: {wheel_joint: {type: continuous, parent: base_link, child: wheel, axis: [0, 1, 0]}}
frames:
  map: {}
  dock: {parent: map, xyz: [3, 0, 0]}
  odom: {parent: map, owner: slam, rate: 10 Hz}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  mast: {parent: base_link, xyz: [0, 0, 1]}
  lens: {parent: mast, owner: camera, static: true}
  glass: {parent: lens, xyz: [0.1, 0, 0]}
processes:
  drive: {external: true}
  slam: {external: true}
  camera: {external: true}
  joints: {env: {A: b}, params: {ignore_timestamp: true}}
xml: {note: "<gazebo><a>it's: a \\"quote\\" # no comment \\u00e9</a></gazebo>"}
"""


def compiled(more: str = "") -> Compiled:
    return compile_robot(ROBOT % more, "r.yaml", library())


def built(more: str = "") -> tuple[dict[str, Any], dict[str, str]]:
    compilation = compiled(more)
    assert not compilation.findings, compilation.findings
    assert compilation.robot
    files = {file.path: file.text for file in emit(compilation.robot)}
    return json.loads(files["plan.json"]), files


def test_the_stock_publisher_owns_edges_below_base_and_static_the_rest() -> None:
    plan, _ = built()
    owners = {(edge["parent"], edge["child"]): edge["owner"] for edge in plan["edges"]}
    assert owners == {
        ("map", "dock"): "static",
        ("map", "odom"): "slam",
        ("odom", "base_link"): "drive",
        ("base_link", "wheel"): "joints",
        ("base_link", "mast"): "joints",
        ("mast", "lens"): "camera",
        ("lens", "glass"): "joints",
    }
    (joints,) = (process for process in plan["processes"] if process["name"] == "joints")
    words = joints["argv"]
    assert words[0] == "${executable:robot_state_publisher/robot_state_publisher}"
    assert joints["nodes"] == ["/rover/robot_state_publisher"]
    assert {edge["node"] for edge in plan["edges"] if edge["owner"] == "joints"} == {
        "/rover/robot_state_publisher"
    }
    remaps = {words[index + 1] for index, word in enumerate(words) if word == "-r"}
    assert {"robot_description:=~/robot_description", "/tf:=/rover/tf", "__ns:=/rover"} <= remaps
    assert not any("<robot" in word for word in words)
    assert joints["env"] == {"A": "b"}
    assert "static" in {process["name"] for process in plan["processes"]}


def test_its_parameters_hold_robot_urdf_word_for_word_and_the_prefix() -> None:
    _, files = built(", frame_prefix: r1/")
    (node, params), *rest = yaml.safe_load(files["params/joints.yaml"]).items()
    assert (node, rest) == ("/rover/robot_state_publisher", [])
    assert params["ros__parameters"] == {
        "publish_frequency": 1000.0,
        "ignore_timestamp": True,
        "frame_prefix": "r1/",
        "robot_description": files["robot.state_publisher.urdf"],
    }
    assert "frame_prefix" not in built()[1]["params/joints.yaml"]


def test_its_frequency_is_a_double_even_if_the_file_has_an_integer() -> None:
    text = (
        "tfcompose: 1\nrobot: r\nros: {state_publisher: stock}\nlinks: {base_link: {}, a: {parent:"
        " base_link}}\n"
    )
    compilation = compile_robot(
        f"{text}processes: {{joints: {{params: {{publish_frequency: 50}}}}}}\n",
        "r.yaml",
        library(),
    )
    assert compilation.robot
    (params,) = (
        file.text for file in emit(compilation.robot) if file.path == "params/joints.yaml"
    )
    assert (
        type(
            yaml.safe_load(params)["/robot_state_publisher"]["ros__parameters"][
                "publish_frequency"
            ]
        )
        is float
    )


def test_robot_urdf_is_one_tree_with_a_massless_root_and_floating_edges() -> None:
    _, files = built()
    stock, full = (
        ET.fromstring(files[name])  # noqa: S314 (ours)
        for name in ("robot.state_publisher.urdf", "robot.urdf")
    )
    kinds = {
        str(end.get("link")): joint.get("type")
        for joint in stock.iter("joint")
        for end in joint.findall("child")
    }
    assert kinds == {"wheel": "continuous", "mast": "fixed", "lens": "floating", "glass": "fixed"}
    links = {str(link.get("name")) for link in stock.findall("link")}
    assert links - set(kinds) == {"base_link"}
    assert [
        link.get("name") for link in stock.findall("link") if link.find("inertial") is not None
    ] == ["wheel"]
    heavy = [
        link.get("name") for link in full.findall("link") if link.find("inertial") is not None
    ]
    assert heavy == ["base_link", "wheel"]


def test_static_sends_the_description_even_where_it_has_no_edge() -> None:
    text = (
        "tfcompose: 1\nrobot: r\nros: {state_publisher: stock}\nlinks: {base_link: {}, a: {parent:"
        " base_link}}\n"
    )
    compilation = compile_robot(text, "r.yaml", library())
    assert compilation.robot
    plan = json.loads(
        next(file.text for file in emit(compilation.robot) if file.path == "plan.json")
    )
    kinds = {process["name"]: process["kind"] for process in plan["processes"]}
    assert kinds == {"static": "static", "joints": "run", "guard": "guard"}


@pytest.mark.parametrize(
    ("more", "code"),
    [(", frame_prefix: r1/, shared_frames: [mast]", "TF316"), ("}\nbase: mast\nvars: {", "TF315")],
)
def test_what_a_stock_publisher_cannot_do_is_reported(more: str, code: str) -> None:
    assert [finding.code for finding in compiled(more).errors] == [code]


FLEET = """tfcompose: 1
robot: fleet
ros: {state_publisher: stock, shared_frames: [map]}
frames: {map: {}}
parts:
  one: {spec: r.yaml, prefix: r1/, namespace: first}
  arm: {spec: arm.yaml, prefix: arm_, parent: map}
"""
ONE = ROBOT.replace("ros: {state_publisher: stock, namespace: rover, isolate: topics%s}\n", "")
ARM = (
    "tfcompose: 1\nrobot: arm\nros: {state_publisher: stock}\nlinks: {foot: {}, hand: {parent:"
    " foot}}\n"
)


def test_only_a_part_that_is_a_robot_has_a_stock_publisher_of_its_own() -> None:
    texts = {"r.yaml": ONE, "arm.yaml": ARM}
    compilation = compile_robot(FLEET, "fleet.yaml", library(), read=texts.__getitem__)
    assert not compilation.errors, compilation.errors
    assert compilation.robot
    files = {file.path: file.text for file in emit(compilation.robot)}
    plan = json.loads(files["plan.json"])
    owners = {edge["child"]: edge["owner"] for edge in plan["edges"]}
    assert (owners["r1/mast"], owners["r1/dock"], owners["r1/lens"]) == (
        "one/joints",
        "one/static",
        "one/camera",
    )
    params = yaml.safe_load(files["params/one/joints.yaml"])["/first/robot_state_publisher"][
        "ros__parameters"
    ]
    assert (params["robot_description"], params["frame_prefix"]) == (
        files["one/robot.state_publisher.urdf"],
        "r1/",
    )
    assert owners["arm_hand"] in {"static", "joints"}
    assert '<child link="arm_hand"/>' in files["robot.state_publisher.urdf"]
