"""The robot as a macro for other xacro files, and a xacro file that calls the macro.

The macro has a prefix, a parent and an origin. Its body is the robot's URDF with ``${prefix}``
before the name of each link, joint, material and hardware component. Text that xacro would
evaluate is escaped. If two materials share a name, URDF readers use the first colour.
"""

from __future__ import annotations

import keyword
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.write import UrdfWriter, block_lines, quoted
from tfcompose.compiler.urdf.xacro import NAMESPACE
from tfcompose.model.files import AS_IN_SOURCE

if TYPE_CHECKING:
    from tfcompose.model.files import Target
    from tfcompose.model.robot import Asset, Robot

MACRO = "robot.macro.xacro"
_EVALUATED = re.compile(r"(\$+[{(])")
#: Addresses that are not relative to the written file.
_ABSOLUTE = re.compile(r"/|[A-Za-z][A-Za-z0-9+.-]*://")
#: Tags that xacro reserves. A macro cannot have these names.
_TAGS = frozenset(
    {
        "arg",
        "attribute",
        "call",
        "element",
        "if",
        "include",
        "insert_block",
        "macro",
        "property",
        "unless",
    }
)


def macro_name(robot: str) -> str:
    """Return the name of the robot's macro.

    This is the robot's name, with the suffix _robot if xacro or Python reserves the name.
    """
    return f"{robot}_robot" if robot in _TAGS or keyword.iskeyword(robot) else robot


def macro(robot: Robot, target: Target = AS_IN_SOURCE) -> str:
    """Return the file with the robot's macro; ``target`` holds the form of file addresses."""
    name, base = macro_name(robot.name), robot.base or ""
    writer = _MacroWriter(robot, target)
    body = "\n".join([*writer.body(robot)[0], *writer.hardware(robot), *_blocks(robot)])
    more = " meshes:=''" if writer.has_relative_addresses else ""
    help_ = (
        "\n     meshes: what relative addresses of meshes begin with, as file:///…/"
        if more
        else ""
    )
    example = f'<xacro:{name} prefix="left_" parent="tool0" xyz="0 0 0.1" rpy="0 0 0"/>'
    return f"""<?xml version="1.0"?>
<!-- Include this file, then: {example}
     Each may be left out; without a parent, {base} is a root.{help_} -->
<robot {NAMESPACE}>
<xacro:macro name="{name}" params="prefix:='' parent:='' xyz:='0 0 0' rpy:='0 0 0'{more}">
  <xacro:unless value="${{parent == ''}}">
    <joint name="${{parent}}_to_${{prefix}}{base}" type="fixed">
      <parent link="${{parent}}"/>
      <child link="${{prefix}}{base}"/>
      <origin xyz="${{xyz}}" rpy="${{rpy}}"/>
    </joint>
  </xacro:unless>
{body}
</xacro:macro>
</robot>
"""


class _MacroWriter(UrdfWriter):
    """Writes the links, joints and hardware of the macro."""

    def __init__(self, robot: Robot, target: Target) -> None:
        super().__init__(target)
        self.names = frozenset(_names(robot))
        self.has_relative_addresses = False

    def name(self, text: str) -> str:
        return quoted("${prefix}" + _literal(text))

    def value(self, text: str) -> str:
        return quoted(_literal(text))

    def content(self, text: str) -> str:
        return super().content(_literal(text))

    def parameter(self, text: str) -> str:
        """Return the content, with the prefix if it is exactly the name of a link or joint."""
        return ("${prefix}" if text in self.names else "") + self.content(text)

    def address(self, asset: Asset) -> str:
        address = self.target.address(asset)
        if _ABSOLUTE.match(address):
            return self.value(address)
        self.has_relative_addresses = True
        return quoted("${meshes}" + _literal(address))


def _literal(text: str) -> str:
    """Return the text with escapes, so that xacro does not evaluate it."""
    return _EVALUATED.sub(r"$\1", text) if "$" in text else text


def _blocks(robot: Robot) -> list[str]:
    """Return the raw blocks with the prefix before the robot's names."""
    if not robot.blocks:
        return []
    names = [*_names(robot), *(name for block in robot.blocks for name in block.own_names())]
    again = {name: f"${{prefix}}{name}" for name in map(_literal, names)}  # escaped like the text
    return block_lines(
        replace(block, text=_literal(block.text)).rename(again) for block in robot.blocks
    )


def _names(robot: Robot) -> list[str]:
    return [*robot.frames, *(edge.joint_name for edge in robot.edges if edge.joint_name)]


def caller(robot: Robot) -> str:
    """Return the xacro file that describes only this robot.

    It calls the macro, and passes on arguments with the names of the macro's parameters.
    """
    defaults = {"prefix": "", "parent": "", "xyz": "0 0 0", "rpy": "0 0 0"}
    arguments = "\n".join(
        f'  <xacro:arg name="{name}" default="{default}"/>' for name, default in defaults.items()
    )
    attributes = " ".join(f'{name}="$(arg {name})"' for name in defaults)
    return f"""<?xml version="1.0"?>
<!-- The robot alone: xacro robot.urdf.xacro prefix:=left_
     Within another xacro, include {MACRO}, which says how. -->
<robot name={quoted(robot.name)} {NAMESPACE}>
{arguments}
  <xacro:include filename="{MACRO}"/>
  <xacro:{macro_name(robot.name)} {attributes}/>
</robot>
"""
