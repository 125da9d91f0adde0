"""The vocabulary of URDF: elements, attributes, shapes, joint types and attribute values.

Unknown words and invalid values become findings. Source: the URDF XML specification of ROS (link,
joint, robot). The contents of transmission, Gazebo and ros2_control blocks are not checked.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, Span, finding, nearest, slip_of
from tfcompose.foundation.geometry import Pose, normalise, quat_from_rpy, rpy_from_quat
from tfcompose.model.robot import FREE, MOVING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.urdf.read import Element
    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.geometry import Quaternion


JOINT_TYPES = (*MOVING, "fixed", *FREE)

#: The attributes and the child elements of each element.
ELEMENTS: dict[str, tuple[str, str]] = {
    "robot": ("name version", "link joint material transmission gazebo ros2_control sensor"),
    "link": ("name type", "inertial visual collision"),
    "inertial": ("", "origin mass inertia"),
    "visual": ("name", "origin geometry material"),
    "collision": ("name", "origin geometry"),
    "geometry": ("", "box cylinder sphere mesh capsule"),
    "material": ("name", "color texture"),
    "joint": (
        "name type",
        "origin parent child axis limit mimic dynamics calibration safety_controller",
    ),
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

#: The components of a tensor, in the order of ``Inertial``.
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

#: Size attributes of each primitive shape, each with its number of values.
SIZES: dict[str, tuple[tuple[str, int], ...]] = {
    "box": (("size", 3),),
    "cylinder": (("radius", 1), ("length", 1)),
    "sphere": (("radius", 1),),
    "capsule": (("radius", 1), ("length", 1)),
}

#: Elements below <robot> that only other programs read.
OPAQUE = frozenset({"transmission", "gazebo", "ros2_control", "sensor"})

#: Elements that xacro has and URDF does not have.
_XACRO = frozenset({"insert_block", "include", "property", "if", "unless", "macro"})
#: A word with at least this similarity to a known word counts as a misspelling.
_MISSPELT = 0.8


def unknown_words(root: Element) -> Iterator[Finding]:
    """Yield a finding for each element and attribute that URDF does not have.

    A misspelling is an error. Any other unknown word may be an extension, so it is a warning.
    Directly below <robot>, unknown elements other than misspellings are accepted.
    """
    waiting = [root]
    while waiting:
        element = waiting.pop()
        attributes, inside = (names.split() for names in ELEMENTS[element.tag])
        for name in element.attributes:
            if name not in attributes and ":" not in name and name != "xmlns":
                yield _unknown(
                    f"attribute {name} of <{element.tag}>", name, attributes, element, name
                )
        for child in element.children:
            if child.tag in _XACRO or child.tag.startswith("xacro:"):
                yield _unexpanded_finding(child)
            elif child.tag in inside:
                waiting += [child] if child.tag not in OPAQUE else []
            elif ":" not in child.tag and (element is not root or nearest(child.tag, inside)):
                yield _unknown(
                    f"element <{child.tag}> in <{element.tag}>", child.tag, inside, child
                )


def _unexpanded_finding(element: Element) -> Finding:
    """Return the finding about an element that xacro should have replaced.

    URDF readers ignore such an element.
    """
    if element.tag in _XACRO:
        message = f"<{element.tag}> is a tag of xacro, not expanded without its prefix"
        return finding("TF720", message, element.span, help=f"<xacro:{element.tag} …>")
    advice = "in a part, use xacro: instead of urdf:"
    return finding("TF720", f"<{element.tag}> was not expanded", element.span, help=advice)


def _unknown(
    what: str, name: str, names: list[str], element: Element, attribute: str = ""
) -> Finding:
    near = nearest(name, names)
    advice = (
        f"did you mean {near}?"
        if near
        else f"allowed here: {', '.join(names)}"
        if names
        else "nothing is allowed here"
    )
    span = element.value_span(attribute) if attribute else element.span
    wrong = near and (slip_of(name, names) or nearest(name, names, _MISSPELT))
    return finding(
        "TF720", f"unknown {what}", span, help=advice, severity="error" if wrong else "warning"
    )


#: Products of three numbers below this limit do not overflow a float.
HUGE = 1e30


@dataclass(slots=True)
class AttributeReader:
    """Reads attributes and collects findings about them."""

    findings: list[Finding] = field(default_factory=list)
    #: Whether quat_xyzw is allowed.
    has_quaternions: bool = False
    #: The number of invalid values. Warnings are not counted, because their values are kept.
    refused: int = 0

    def refuse(
        self, message: str, span: Span, advice: str = "", severity: Severity = "error"
    ) -> None:
        """Add a finding about an invalid value."""
        self.findings.append(finding("TF721", message, span, help=advice, severity=severity))
        self.refused += severity == "error"

    def text(self, element: Element, name: str, example: str) -> str:
        """Return a required attribute; add a finding and return "" if it is missing."""
        value = element.attributes.get(name, "")
        if not value:
            self.refuse(f"<{element.tag}> has no {name}", element.span, f"for example {example}")
        return value

    def numbers(
        self, element: Element | None, name: str, default: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Return an attribute's numbers, as many as ``default`` has.

        If the attribute is missing or invalid, return ``default``.
        """
        if element is None or name not in element.attributes:
            return default
        tokens = element.attributes[name].split()
        try:
            values = tuple(map(float, tokens))
        except ValueError:
            values = ()
        if len(values) != len(default) or not all(map(math.isfinite, values)):
            count = "a number" if len(default) == 1 else f"{len(default)} numbers"
            text = element.attributes[name]
            self.refuse(
                f"{name}={text!r} is not {count}",
                element.value_span(name),
                _advice(text, len(default)),
            )
            return default
        if max(map(abs, values)) > HUGE:
            self.refuse(f"{name} is too large", element.value_span(name))
            return default
        if element.has_broken_values and re.search(r"[\t\r\n]", element.raw_value(name).lstrip()):
            message = f"tab or line break between the numbers of {name}"
            self.refuse(
                message,
                element.value_span(name),
                "use spaces: ROS parsers reject the robot for it",
                "warning",
            )
        return values

    def number(self, element: Element | None, name: str, default: Any = None) -> Any:
        """Return an attribute's number, ``default`` if it is missing, 0 if it is invalid."""
        if element is None or name not in element.attributes:
            return default
        return self.numbers(element, name, (0.0,))[0]

    def read_bound(self, element: Element, name: str) -> float | None:
        """Return an attribute's number that is a limit; None without a limit.

        A finite limit beyond ``HUGE`` is reduced to ``HUGE``, with a warning.
        """
        try:
            value = float(element.attributes.get(name, ""))
        except ValueError:
            value = 0.0
        if not HUGE < abs(value) < math.inf:
            return self.number(element, name)  # type: ignore[no-any-return]  # a number, or None
        used = math.copysign(HUGE, value)
        message = f"{name} is too large: {used:g} is used"
        self.refuse(message, element.value_span(name), "such a limit limits nothing", "warning")
        return used

    def pose(self, parent: Element) -> Pose:
        """Return the pose in the element's <origin>."""
        origin = parent.first("origin")
        x, y, z = self.numbers(origin, "xyz", (0.0, 0.0, 0.0))
        if origin is not None and "quat_xyzw" in origin.attributes:
            return Pose((x, y, z), self._quaternion(origin))
        roll, pitch, yaw = self.numbers(origin, "rpy", (0.0, 0.0, 0.0))
        if max(map(abs, (roll, pitch, yaw))) > 1e9:  # noqa: PLR2004 (no angle has so many turns, and none is left of it)
            self.refuse("rpy is out of range", origin.value_span("rpy") if origin else parent.span)
            return Pose((x, y, z))
        return Pose((x, y, z), normalise(quat_from_rpy(roll, pitch, yaw)))

    def _quaternion(self, origin: Element) -> Quaternion:
        """Return the rotation from a quaternion, which URDF supports since version 1.1."""
        before, span = self.refused, origin.value_span("quat_xyzw")
        x, y, z, w = self.numbers(origin, "quat_xyzw", (0.0, 0.0, 0.0, 1.0))
        if not any((x, y, z, w)):
            self.refuse("the quaternion has no length", span, "no rotation is 0 0 0 1")
        if self.refused > before:
            return (0.0, 0.0, 0.0, 1.0)
        turned = normalise((x, y, z, w))
        angles = " ".join(f"{angle + 0.0:.17g}" for angle in rpy_from_quat(turned))
        if "rpy" in origin.attributes:
            self.refuse(
                "the origin has both rpy and quat_xyzw: parsers reject the robot",
                span,
                "remove one of them",
            )
        elif not self.has_quaternions:
            self.refuse("parsers ignore quat_xyzw", span, f'write rpy="{angles}"')
        return turned


def version_of(root: Element, values: AttributeReader) -> tuple[int, ...]:
    """Return the URDF version that the document declares.

    If parsers of ROS 2 Jazzy reject the version, add a finding.
    """
    text = root.attributes.get("version", "1.0")
    version = tuple(map(int, text.split("."))) if re.fullmatch(r"\d{1,4}\.\d{1,4}", text) else ()
    if version != (1, 0):
        span = root.value_span("version")
        if version:
            message = f"parsers of ROS 2 Jazzy reject version {text}: they support 1.0 only"
            values.refuse(message, span, "remove it, unless something here needs it", "warning")
        else:
            values.refuse(f"invalid version {text!r}", span, 'version="1.0"')
    return version


def _advice(text: str, count: int) -> str:
    """Return advice for a text that does not consist of ``count`` numbers."""
    if "${" in text or "$(" in text:
        return "xacro was not expanded here: use the .xacro file"
    if "," in text:
        return "separate numbers by spaces, not commas"
    return f"write {count} finite numbers, separated by spaces" if count > 1 else ""
