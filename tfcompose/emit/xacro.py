"""The robot for other people's xacro: a macro with a prefix, a parent and an origin, and a file that calls it.

The macro's body is the robot's URDF with ``${prefix}`` in front of the name of every link, joint, material and piece of
hardware; what xacro would evaluate otherwise is escaped. Of two materials of one name readers take the first colour.
"""

from __future__ import annotations

import re
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.emit.markup import escaped, quoted

if TYPE_CHECKING:
    from tfcompose.model import Robot

MACRO = "robot.macro.xacro"
_NAMESPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
_EVALUATED = re.compile(r"(\$+[{(])")
#: Where the lines of links, joints and hardware hold a name, as they are written here; raw blocks are not among them.
_NAME = re.compile(
    r"\n(?:  <(?:link|joint|ros2_control) name=.|"
    r"    <(?:(?:parent|child) link|mimic joint|(?:joint|sensor|gpio) name)=.|"
    r"      <material name=.)"
)
#: A parameter of hardware, or of what is in it, but not of an interface.
_PARAMETER = re.compile(r"(\n {4}(?:  )?<param name=[^\n]*?>)([^<>\n]*)(?=</param>)")
#: Addresses that begin at the written file.
_RELATIVE = re.compile(r"(<(?:mesh|texture) filename=.)(?!/|[A-Za-z][A-Za-z0-9+.-]*://)")
#: Tags of xacro's own, which no macro can be called.
_TAGS = frozenset(
    {"arg", "attribute", "call", "element", "if", "include", "insert_block", "macro", "property", "unless"}
)


def macro_name(robot: str) -> str:
    """Return what the robot's macro is called: as the robot, unless xacro or Python has the word."""
    is_taken = robot in _TAGS or import_module("keyword").iskeyword(robot)
    return f"{robot}_robot" if is_taken else robot


def macro(robot: Robot, body: list[str]) -> str:
    """Return the file with the robot's macro; ``body`` are its links and joints as URDF has them."""
    name, base = macro_name(robot.name), robot.base or ""
    text = "\n".join(["", *body, *_hardware(robot)])
    text = _EVALUATED.sub(r"$\1", text) if "$" in text else text
    text = _NAME.sub(_with_prefix, text)
    text = _with_parameters(text, robot) if robot.hardware else text
    text = _RELATIVE.sub(r"\1${meshes}", text) if " filename=" in text else text
    text = "\n".join([text, *_blocks(robot)])[1:]
    more = " meshes:=''" if "${meshes}" in text else ""
    told = "\n     meshes: what relative addresses of meshes begin with, as file:///…/" if more else ""
    return f"""<?xml version="1.0"?>
<!-- Include this file, then: <xacro:{name} prefix="left_" parent="tool0" xyz="0 0 0.1" rpy="0 0 0"/>
     Each may be left out; without a parent, {base} is a root.{told} -->
<robot {_NAMESPACE}>
<xacro:macro name="{name}" params="prefix:='' parent:='' xyz:='0 0 0' rpy:='0 0 0'{more}">
  <xacro:unless value="${{parent == ''}}">
    <joint name="${{parent}}_to_${{prefix}}{base}" type="fixed">
      <parent link="${{parent}}"/>
      <child link="${{prefix}}{base}"/>
      <origin xyz="${{xyz}}" rpy="${{rpy}}"/>
    </joint>
  </xacro:unless>
{text}
</xacro:macro>
</robot>
"""


def _with_prefix(found: re.Match[str]) -> str:
    return f"{found[0]}${{prefix}}"


def _with_parameters(text: str, robot: Robot) -> str:
    """Return the text with the prefix in front of each parameter that is the name of a link or joint, and no more."""
    names = {_EVALUATED.sub(r"$\1", escaped(name)) for name in _names(robot)}

    def other(found: re.Match[str]) -> str:
        return f"{found[1]}${{prefix}}{found[2]}" if found[2] in names else found[0]

    return _PARAMETER.sub(other, text)


def caller(robot: Robot) -> str:
    """Return the file that is the robot alone: the macro, called with arguments of the same names."""
    defaults = {"prefix": "", "parent": "", "xyz": "0 0 0", "rpy": "0 0 0"}
    arguments = "\n".join(f'  <xacro:arg name="{name}" default="{default}"/>' for name, default in defaults.items())
    given = " ".join(f'{name}="$(arg {name})"' for name in defaults)
    return f"""<?xml version="1.0"?>
<!-- The robot alone: xacro robot.urdf.xacro prefix:=left_
     Within another xacro, include {MACRO}, which says how. -->
<robot name={quoted(robot.name)} {_NAMESPACE}>
{arguments}
  <xacro:include filename="{MACRO}"/>
  <xacro:{macro_name(robot.name)} {given}/>
</robot>
"""


def _hardware(robot: Robot) -> list[str]:
    return _block_lines(robot.hardware, ()) if robot.hardware else []


def _blocks(robot: Robot) -> list[str]:
    """Return the raw blocks, in which what is a name of the robot's, and nothing else, gets the prefix."""
    if not robot.blocks:
        return []
    names = _names(robot)
    names += [name for block in robot.blocks for name in block.own_names()]
    names = [_EVALUATED.sub(r"$\1", name) for name in names]  # as they stand in the text below
    again = {name: f"${{prefix}}{name}" for name in names}
    blocks = [replace(block, text=_EVALUATED.sub(r"$\1", block.text)).renamed(again) for block in robot.blocks]
    return _block_lines((), blocks)


def _names(robot: Robot) -> list[str]:
    return [*robot.frames, *(edge.joint_name for edge in robot.edges if edge.joint_name)]


def _block_lines(*given: object) -> list[str]:
    lines: list[str] = import_module("tfcompose.emit.blocks").block_lines(*given)
    return lines
