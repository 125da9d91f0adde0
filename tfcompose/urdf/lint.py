"""What is wrong with a URDF, or a xacro file, that tfcompose did not write; places are those of that file."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.check import RULES, apply, check, unused_allows
from tfcompose.findings import Finding, RejectedError, Span, finding
from tfcompose.load import allows_in_xml
from tfcompose.urdf.convert import robot_of
from tfcompose.urdf.read import read_xml
from tfcompose.urdf.ros2_control import with_hardware
from tfcompose.urdf.xacro import macros_in

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model import Robot
    from tfcompose.urdf.packages import Disk, Packages
    from tfcompose.urdf.read import Element

_RULES = tuple(rule for rule in RULES.values() if rule.of_urdf)

#: How a rule says that a frame is missing.
_DECLARE = re.compile(r"declare it: (?:frames|links): \{(.+): \{\}\}", re.DOTALL)

#: What to do, in URDF's words, where a rule speaks of YAML. Advice that names a near word is kept.
_HELP = {
    "TF204": "join the trees with a fixed joint",
    "TF206": 'add <link name="base_link"/>',
    "TF209": "remove it, or give it a joint",
    "TF401": 'an optical frame has <origin rpy="-1.5707963267948966 0 -1.5707963267948966"/> in its camera\'s frame',
    "TF704": '<limit lower="-1.57" upper="1.57" effort="10" velocity="1"/>; without an end it is continuous',
    "TF709": 'add <inertial> with <mass value="…"/> and <inertia …/>',
    "TF710": "take the tensor from CAD: in kg m², about the centre of mass",
    "TF711": "give it in kg m², about the centre of mass",
    "TF713": "another name for one of them",
}


def lint_urdf(file: str, packages: Packages, disk: Disk) -> list[Finding]:
    """Return what is wrong with the file, by place. A xacro file is expanded, and places are those of the result."""
    try:
        document = read_urdf(file, packages, disk)
    except RejectedError as error:
        return list(error.findings)
    return document.findings()


@dataclass(frozen=True, slots=True)
class Document:
    """A URDF that was read: its elements, the robot that it describes, and what was found by reading it."""

    name: str
    text: str
    root: Element
    robot: Robot
    found: tuple[Finding, ...]

    def findings(self) -> list[Finding]:
        """Return what is wrong with it, by place, but for what its comments allow."""
        allows = allows_in_xml(self.text, self.name)
        ruled = (_in_words_of_urdf(one) for one in check(with_hardware(self.robot), _RULES))
        kept, used = apply(dict.fromkeys([*self.found, *ruled]), allows)
        return sorted([*kept, *unused_allows(allows, used)], key=lambda one: one.sort_key)


def read_urdf(file: str, packages: Packages, disk: Disk, arguments: Mapping[str, str] | None = None) -> Document:
    """Return what the file holds; a xacro file, by its name or by what is in it, is expanded, with arguments.

    Raises:
        RejectedError: if it cannot be read, or is no URDF; or takes no arguments, and is given some.
    """
    raw = disk.read(file)
    is_xacro = file.endswith(".xacro") or "<xacro:" in raw
    if arguments and not is_xacro:
        advice = "xacro files take arguments"
        raise RejectedError([finding("TF106", f"no argument {next(iter(arguments))}", Span(file), help=advice)])
    name, text = (f"{file} (expanded)", disk.expand(file, packages, arguments or {}, None)) if is_xacro else (file, raw)
    root = read_xml(text, name)
    robot, found = robot_of(root, name, packages.asset)
    macros = list(macros_in(raw)) if is_xacro and not robot.frames else []
    if macros:
        advice = f"a part can call one: parts: {{NAME: {{xacro: {file}, macro: {macros[0]}, …}}}}"
        message = f"{file} defines macros, and no links: {', '.join(macros)}"
        raise RejectedError([finding("TF206", message, Span(file), help=advice)])
    return Document(name, text, root, robot, found)


def _in_words_of_urdf(found: Finding) -> Finding:
    """Return the finding with its advice in URDF's words."""
    if found.help.startswith("did you mean"):
        return found
    declared = _DECLARE.fullmatch(found.help)
    advice = f'add <link name="{declared[1]}"/>' if declared else _HELP.get(found.code, found.help)
    return replace(found, help=advice)
