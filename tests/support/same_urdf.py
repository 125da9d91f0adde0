"""Whether two URDFs describe the same robot.

Read with the standard library, poses computed with scipy.
"""

import os
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

FAR = 1e-12
#: An emitted tensor has 12 significant digits.
TENSOR = 1e-11
#: The shapes of URDF; simulators have others of their own.
FORMS = ("box", "cylinder", "sphere", "mesh")


def same(source: str, source_folder: Path, built: str, built_folder: Path) -> list[str]:
    """Return in what the two differ; the folders are those that their relative paths begin in."""
    documents = ((source, source_folder), (built, built_folder))
    source_robot, built_robot = (
        _robot(_resolve_files(ET.fromstring(text), folder))  # noqa: S314 (our own)
        for text, folder in documents
    )
    return [
        difference
        for kind in source_robot
        for difference in _differ(kind, source_robot[kind], built_robot[kind])
    ]


def _resolve_files(root: Any, folder: Path) -> Any:
    for element in (*root.iter("mesh"), *root.iter("texture")):
        name = element.get("filename", "")
        if name and "://" not in name:
            element.set("filename", os.path.normpath(folder / name))
    return root


def _robot(root: Any) -> dict[str, Any]:
    colours = _colours(root)
    links = {element.get("name"): element for element in root.findall("link")}
    joints = [element for element in root.findall("joint") if element.find("parent") is not None]
    return {
        "links": dict.fromkeys(links, ""),
        "edges": {joint.find("child").get("link"): _joint(joint) for joint in joints},
        "inertials": {name: _inertial(link) for name, link in links.items() if _mass(link)},
        "visuals": {name: _shapes(link, "visual", colours) for name, link in links.items()},
        "collisions": {name: _shapes(link, "collision", colours) for name, link in links.items()},
        "blocks": _blocks(root),
    }


def _differ(kind: str, expected: Any, actual: Any) -> list[str]:
    if not isinstance(expected, dict):
        return [] if expected == actual else [f"{kind}: {expected} is {actual}"]
    differences = [f"{kind}: {name} is missing" for name in expected if name not in actual]
    differences += [f"{kind}: {name} is new" for name in actual if name not in expected]
    for name in expected:
        if name in actual and not _equal(expected[name], actual[name]):
            differences.append(f"{kind}: {name}: {expected[name]} is {actual[name]}")
    return differences


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return set(a) == set(b) and all(_equal(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(_equal, a, b))
    if isinstance(a, np.ndarray):
        return bool(np.allclose(a, b, rtol=0, atol=FAR * max(1.0, float(np.abs(a).max()))))
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= TENSOR * max(abs(a), abs(b)) or abs(a - b) < FAR
    return bool(a == b)


def _numbers(element: Any, key: str, default: str) -> list[float]:
    return [
        float(word) for word in (default if element is None else element.get(key, default)).split()
    ]


def _pose(element: Any) -> Any:
    origin = element.find("origin")
    matrix = np.eye(4)
    matrix[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    matrix[:3, :3] = Rotation.from_euler("xyz", _numbers(origin, "rpy", "0 0 0")).as_matrix()
    return matrix


def _mass(link: Any) -> float:
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else float(mass.get("value"))


def _inertial(link: Any) -> Any:
    inertial = link.find("inertial")
    tensor = inertial.find("inertia")
    return {
        "pose": _pose(inertial),
        "mass": _mass(link),
        **{key: float(tensor.get(key, "0")) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")},
    }


def _colours(root: Any) -> dict[str, Any]:
    materials: dict[str, Any] = {}
    for output in [*root.findall("material"), *root.findall("link/visual/material")]:
        if len(output):
            materials.setdefault(output.get("name", ""), output)
    return materials


def _shapes(link: Any, tag: str, colours: dict[str, Any]) -> list[Any]:
    shapes = []
    for element in link.findall(tag):
        for form in element.find("geometry"):
            if form.tag not in FORMS or 0 in _sizes(form):
                continue
            output = {
                key: value if key == "filename" else [float(word) for word in value.split()]
                for key, value in form.attrib.items()
            }
            output["scale"] = output.get("scale", [1.0, 1.0, 1.0])
            shapes.append(
                {
                    "form": form.tag,
                    "pose": _pose(element),
                    "colour": _colour(element, tag, colours),
                    **output,
                }
            )
    return shapes


def _sizes(form: Any) -> list[float]:
    """Return the lengths of a shape; one without any is no body."""
    return [
        float(word) for key in ("size", "radius", "length") for word in form.get(key, "").split()
    ]


def _colour(shape: Any, tag: str, colours: dict[str, Any]) -> Any:
    output = shape.find("material") if tag == "visual" else None
    if output is None:
        return None
    output = output if len(output) else colours.get(output.get("name", ""))
    if output is None:
        return None
    colour, texture = output.find("color"), output.find("texture")
    rgba = (
        None
        if colour is None
        else [min(max(part, 0), 1) for part in _numbers(colour, "rgba", "0.5 0.5 0.5 1")]
    )
    return [rgba, None if texture is None else texture.get("filename") or None]


def _joint(joint: Any) -> dict[str, Any]:
    kind = joint.get("type")
    output = {
        "parent": joint.find("parent").get("link"),
        "type": kind,
        "pose": _pose(joint),
        "name": joint.get("name"),
    }
    if kind in {"fixed", "floating"}:
        return output
    axis = np.array(_numbers(joint.find("axis"), "xyz", "1 0 0"))
    output["axis"] = axis / np.linalg.norm(axis)
    for tag, values in _motion(kind, joint.find("limit") is not None).items():
        element = joint.find(tag)
        if element is not None or tag == "limit":
            attributes = {} if element is None else element.attrib
            output[tag] = {
                key: float(attributes[key]) if key in attributes else usual
                for key, usual in values.items()
            }
    mimic = joint.find("mimic")
    if mimic is not None:
        output["mimic"] = [
            mimic.get("joint"),
            float(mimic.get("multiplier", "1")),
            float(mimic.get("offset", "0")),
        ]
    return output


def _motion(kind: str, limited: bool) -> dict[str, dict[str, float | None]]:  # noqa: FBT001 (here only)
    """Return what may stand in a joint, each with what it is where nothing is said."""
    end = (
        0.0 if kind in {"revolute", "prismatic"} else None
    )  # of these URDF takes 0 for what is not said
    ends: dict[str, float | None] = {"lower": end, "upper": end, "effort": 0.0, "velocity": 0.0}
    has_limit = limited or end is not None  # URDF requires one of these
    return {
        "limit": ends if has_limit else {},
        "dynamics": {"damping": 0.0, "friction": 0.0},
        "calibration": {"rising": None, "falling": None},
        "safety_controller": {
            "soft_lower_limit": 0.0,
            "soft_upper_limit": 0.0,
            "k_position": 0.0,
            "k_velocity": 0.0,
        },
    }


def _blocks(root: Any) -> list[Any]:
    """Return the elements next to links and joints, except those about missing ones."""
    joints = {element.get("name") for element in root.findall("joint")}
    names = {element.get("name") for element in root.findall("link")} | joints
    blocks = []
    for element in root:
        idle = element.tag == "gazebo" and element.get("reference", next(iter(names))) not in names
        idle |= element.tag == "transmission" and any(
            inner.get("name") not in joints for inner in element.findall("joint")
        )
        if (
            isinstance(element.tag, str)
            and element.tag not in {"link", "joint", "material"}
            and not idle
        ):
            blocks.append(_tree(element))
    return sorted(blocks)


def _tree(element: Any) -> str:
    inside = "".join(_tree(child) for child in element if isinstance(child.tag, str))
    text = " ".join((element.text or "").split())
    return f"<{element.tag} {sorted(element.attrib.items())}>{text}{inside}"
