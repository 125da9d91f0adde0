"""What ``build`` emits, read by somebody else, is the robot that was written.

Frames, edges, poses, bodies, owners.

The specs are generated. What they mean is computed here with scipy from the numbers that are
written; yourdfpy reads the URDF, the plan is read as plain JSON.
"""

import io
import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
import yourdfpy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit

PRESETS = library()
lengths = st.floats(-100, 100).map(lambda x: round(x, 9))
angles = st.floats(-7, 7).map(lambda x: round(x, 9))
vectors = st.tuples(lengths, lengths, lengths).map(list)
axes = st.tuples(*[st.integers(-9, 9)] * 3).filter(any).map(list)


@dataclass
class Wanted:
    """An edge as it must be found: its pose as a 4×4 matrix."""

    parent: str
    child: str
    matrix: Any
    owner: str
    kind: str
    joint: str = "fixed"
    more: dict[str, Any] = field(default_factory=dict)


@st.composite
def rotations(draw: st.DrawFn) -> tuple[dict[str, Any], Rotation]:
    """Return a rotation as it is written, and what it means."""
    kind = draw(st.sampled_from(["none", "rpy", "degrees", "quat_xyzw", "axis_angle", "matrix"]))
    rpy = draw(st.tuples(angles, angles | st.sampled_from([np.pi / 2, -np.pi / 2]), angles))
    turned = Rotation.from_euler("xyz", rpy)
    if kind == "rpy":
        return {"rpy": [float(angle) for angle in rpy]}, turned
    if kind == "degrees":
        full = [round(float(np.degrees(angle)), 3) for angle in rpy]
        return {"rpy": [f"{angle!r} deg" for angle in full]}, Rotation.from_euler(
            "xyz", full, degrees=True
        )
    if kind == "quat_xyzw":
        return {"quat_xyzw": [float(part) for part in turned.as_quat()]}, turned
    if kind == "matrix":
        return {"matrix": [[float(part) for part in row] for row in turned.as_matrix()]}, turned
    if kind == "axis_angle":
        axis, angle = draw(axes), draw(angles)
        return {"axis_angle": {"axis": axis, "angle": angle}}, Rotation.from_rotvec(
            np.array(axis) / np.linalg.norm(axis) * angle
        )
    return {}, Rotation.identity()


@st.composite
def poses(draw: st.DrawFn) -> tuple[dict[str, Any], Any]:
    source_text, turned = draw(rotations())
    xyz = draw(vectors)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turned.as_matrix(), xyz
    return {"xyz": xyz, **source_text}, matrix


def joint(draw: Any, name: str, masters: list[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a moving joint's own keys, and what the URDF must say of it."""
    kind = draw(st.sampled_from(["revolute", "continuous", "prismatic"]))
    axis = draw(axes)
    limit = {
        "lower": draw(st.floats(-3, 0)),
        "upper": draw(st.floats(0, 3)),
        "effort": 5.5,
        "velocity": 0.25,
    }
    source_text: dict[str, Any] = {"type": kind, "axis": axis} | (
        {} if kind == "continuous" else {"limit": limit}
    )
    more = {
        "name": name,
        "axis": np.array(axis) / np.linalg.norm(axis),
        "limit": source_text.get("limit"),
        "mimic": None,
    }
    if masters and draw(st.integers(0, 1)):
        more["mimic"] = {
            "joint": draw(st.sampled_from(masters)),
            "multiplier": draw(lengths),
            "offset": draw(lengths),
        }
        source_text["mimic"] = more["mimic"]
    return source_text, more


@st.composite
def robots(draw: st.DrawFn) -> tuple[dict[str, Any], list[Wanted]]:
    """Return a spec and the edges that it means."""
    spec: dict[str, Any] = {
        "tfcompose": 1,
        "robot": "r",
        "links": {"base_link": {}},
        "joints": {},
        "frames": {},
    }
    spec |= {"sensors": {}, "processes": {"drive": {"external": True}}, "guard": {"mode": "off"}}
    names, expected, masters = (
        ["base_link"],
        [],
        [],
    )  # type: tuple[list[str], list[Wanted], list[str]]
    if draw(st.booleans()):
        pose, matrix = draw(poses())
        spec["frames"] |= {
            "odom": {},
            "base_link": {"parent": "odom", "owner": "drive", "rate": "50 Hz"} | pose,
        }
        expected.append(Wanted("odom", "base_link", matrix, "drive", "dynamic"))
    for index in range(draw(st.integers(0, 10))):
        parent, (pose, matrix) = draw(st.sampled_from(names)), draw(poses())
        kind = draw(
            st.sampled_from(
                ["frames", "links", "joints", "fixed", "sensors", "foreign", "foreign_fixed"]
            )
        )
        name, output = f"{kind}_{index}", {"parent": parent} | pose
        edge = Wanted(parent, name, matrix, "static", "static")
        if kind in {"frames", "links"}:
            spec[kind][name] = output
        elif kind == "foreign":
            spec["frames"][name] = output | {"owner": "drive", "rate": "5 Hz"}
            edge.owner, edge.kind, edge.joint = "drive", "dynamic", "floating"
        elif kind == "foreign_fixed":
            spec["frames"][name] = output | {"owner": "drive", "static": True}
            edge.owner = "drive"
        elif kind == "sensors":
            spec["sensors"][name] = output | {"preset": "generic/imu", "driver": "none"}
            edge.child = f"{name}_link"
        else:
            spec["links"][name] = {}
            joint_keys: dict[str, Any] = {"type": "fixed"}
            if kind == "joints":
                joint_keys, edge.more = joint(draw, f"j{index}", masters)
                edge.owner, edge.kind, edge.joint = "joints", "joint", joint_keys["type"]
                masters += [] if edge.more["mimic"] else [f"j{index}"]
            spec["joints"][f"j{index}"] = output | joint_keys | {"child": name}
        names.append(edge.child)
        expected.append(edge)
    return spec, expected


def built(spec: dict[str, Any]) -> dict[str, str]:
    compiled = compile_robot(json.dumps(spec), "r.yaml", PRESETS)
    assert compiled.robot
    assert not compiled.errors
    return {file.path: file.text for file in emit(compiled.robot)}


def matrix_of(edge: dict[str, Any]) -> Any:
    matrix = np.eye(4)
    xyz, quat_xyzw = edge["pose"]
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_quat(quat_xyzw).as_matrix(), xyz
    return matrix


@given(robots())
@settings(max_examples=40, deadline=None)
def test_the_urdf_keeps_pose_type_and_limits_of_every_edge_below_base(
    example: tuple[Any, list[Wanted]],
) -> None:
    spec, expected = example
    read = yourdfpy.URDF.load(
        io.StringIO(built(spec)["robot.urdf"]), build_scene_graph=False, load_meshes=False
    )
    joints = {joint.child: joint for joint in read.robot.joints}
    below = {edge.child: edge for edge in expected if edge.child != "base_link"}
    assert set(read.link_map) == {"base_link", *below}
    assert set(joints) == set(below)
    assert len(read.robot.joints) == len(read.joint_map) == len(below)
    for child, edge in below.items():
        read_joint = joints[child]
        assert (read_joint.parent, read_joint.type) == (edge.parent, edge.joint)
        origin = np.eye(4) if read_joint.origin is None else read_joint.origin
        assert origin == pytest.approx(edge.matrix, abs=1e-9)
        if edge.more:
            assert read_joint.name == edge.more["name"]
            assert read_joint.axis == pytest.approx(edge.more["axis"], abs=1e-12)
            limit, mimic = edge.more["limit"], edge.more["mimic"]
            assert limit is None or vars(read_joint.limit) == limit
            assert (read_joint.mimic and vars(read_joint.mimic)) == mimic


@given(robots())
@settings(max_examples=40, deadline=None)
def test_the_plan_holds_every_edge_once_with_its_pose_and_owner(
    example: tuple[Any, list[Wanted]],
) -> None:
    spec, expected = example
    plan = json.loads(built(spec)["plan.json"])
    edges_by_child = {edge["child"]: edge for edge in plan["edges"]}
    assert len(edges_by_child) == len(plan["edges"]) == len(expected)
    for edge in expected:
        observed = edges_by_child[edge.child]
        assert (observed["parent"], observed["owner"], observed["kind"]) == (
            edge.parent,
            edge.owner,
            edge.kind,
        )
        assert matrix_of(observed) == pytest.approx(edge.matrix, abs=1e-9)
    owned = {
        process["name"]: {tuple(pair) for pair in process.get("owns", ())}
        for process in plan["processes"]
    }
    for owner in {edge.owner for edge in expected}:
        assert owned[owner] == {
            (edge.parent, edge.child) for edge in expected if edge.owner == owner
        }


@given(robots())
@settings(max_examples=40, deadline=None)
def test_in_the_urdf_for_a_stock_publisher_only_edges_of_others_float(
    example: tuple[Any, list[Wanted]],
) -> None:
    spec, expected = example
    read = yourdfpy.URDF.load(
        io.StringIO(built(spec)["robot.state_publisher.urdf"]),
        build_scene_graph=False,
        load_meshes=False,
    )
    foreign = {edge.child for edge in expected if edge.owner == "drive"} - {"base_link"}
    assert {joint.child for joint in read.robot.joints if joint.type == "floating"} == foreign
    assert {joint.child for joint in read.robot.joints} == {edge.child for edge in expected} - {
        "base_link"
    }


@given(robots())
@settings(max_examples=40, deadline=None)
def test_a_second_build_is_the_same_byte_for_byte(example: tuple[Any, list[Wanted]]) -> None:
    spec, _ = example
    assert built(spec) == built(json.loads(json.dumps(spec)))
