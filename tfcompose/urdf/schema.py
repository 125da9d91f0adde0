"""The words of URDF: its elements, attributes, shapes and types of joints; and a finding for each word that is none.

Source: the URDF XML specification of ROS (link, joint, robot). What transmissions, Gazebo and ros2_control
blocks hold is not checked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding, nearest, slip_of
from tfcompose.model import FREE, MOVING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.urdf.read import Element

JOINT_TYPES = (*MOVING, "fixed", *FREE)

#: Each element with its attributes and the elements in it.
ELEMENTS: dict[str, tuple[str, str]] = {
    "robot": ("name version", "link joint material transmission gazebo ros2_control sensor"),
    "link": ("name type", "inertial visual collision"),
    "inertial": ("", "origin mass inertia"),
    "visual": ("name", "origin geometry material"),
    "collision": ("name", "origin geometry"),
    "geometry": ("", "box cylinder sphere mesh capsule"),
    "material": ("name", "color texture"),
    "joint": ("name type", "origin parent child axis limit mimic dynamics calibration safety_controller"),
    "origin": ("xyz rpy quat_xyzw", ""),
    "mass": ("value", ""),
    "inertia": ("ixx ixy ixz iyy iyz izz", ""),
    "box": ("size", ""),
    "cylinder": ("radius length", ""),
    "capsule": ("radius length", ""),
    "sphere": ("radius", ""),
    "mesh": ("filename scale", ""),
    "color": ("rgba", ""),
    "texture": ("filename", ""),
    "parent": ("link", ""),
    "child": ("link", ""),
    "axis": ("xyz", ""),
    "limit": ("lower upper effort velocity acceleration jerk deceleration", ""),
    "mimic": ("joint multiplier offset", ""),
    "dynamics": ("damping friction", ""),
    "calibration": ("rising falling reference_position", ""),
    "safety_controller": ("soft_lower_limit soft_upper_limit k_position k_velocity", ""),
}

#: The components of a tensor, in the order in which ``Inertial`` holds them.
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

#: Of each primitive shape the attributes that give its size, each with how many numbers it has.
SIZES: dict[str, tuple[tuple[str, int], ...]] = {
    "box": (("size", 3),),
    "cylinder": (("radius", 1), ("length", 1)),
    "sphere": (("radius", 1),),
    "capsule": (("radius", 1), ("length", 1)),
}

#: Elements next to links, joints and materials that are other programs' business.
OPAQUE = frozenset({"transmission", "gazebo", "ros2_control", "sensor"})

#: Elements of xacro that URDF does not have.
_XACRO = frozenset({"insert_block", "include", "property", "if", "unless", "macro"})
#: A word as near as this to a known one is taken for a misspelling of it.
_MISSPELT = 0.8


def unknown_words(root: Element) -> Iterator[Finding]:
    """Yield a finding for each element and attribute that URDF does not have: an error where a known one is misspelt.

    Others may be somebody's extension, and are warnings; directly below <robot> they are accepted.
    """
    waiting = [root]
    while waiting:
        element = waiting.pop()
        attributes, inside = (words.split() for words in ELEMENTS[element.tag])
        for name in element.attributes:
            if name not in attributes and ":" not in name and name != "xmlns":
                yield _unknown(f"attribute {name} of <{element.tag}>", name, attributes, element, name)
        for child in element.children:
            if child.tag in _XACRO or child.tag.startswith("xacro:"):
                yield _unexpanded(child)
            elif child.tag in inside:
                waiting += [child] if child.tag not in OPAQUE else []
            elif ":" not in child.tag and (element is not root or nearest(child.tag, inside)):
                yield _unknown(f"element <{child.tag}> in <{element.tag}>", child.tag, inside, child)


def _unexpanded(element: Element) -> Finding:
    """Return the finding about an element that xacro should have replaced: readers of URDF ignore it."""
    if element.tag in _XACRO:
        message = f"<{element.tag}> is a tag of xacro, not expanded without its prefix"
        return finding("TF720", message, element.at, help=f"<xacro:{element.tag} …>")
    advice = "in a part, use xacro: instead of urdf:"
    return finding("TF720", f"<{element.tag}> was not expanded", element.at, help=advice)


def _unknown(what: str, word: str, known: list[str], element: Element, attribute: str = "") -> Finding:
    near = nearest(word, known)
    advice = (
        f"did you mean {near}?" if near else f"allowed here: {', '.join(known)}" if known else "nothing is allowed here"
    )
    at = element.at_value(attribute) if attribute else element.at
    wrong = near and (slip_of(word, known) or nearest(word, known, _MISSPELT))
    return finding("TF720", f"unknown {what}", at, help=advice, severity="error" if wrong else "warning")
