"""Robots of many links, as a robot file and as calls of a xacro macro."""

from __future__ import annotations

from typing import Literal, NamedTuple

#: Bodies on moving joints with inertia that is computed; boxes with a mass on fixed joints; or
#: such boxes in groups a metre apart, each with a camera.
Kind = Literal["jointed", "plain", "cameras"]
#: Links of a group of boxes with a camera: the boxes, and those of the camera.
GROUP, BOXES = 12, 6
_MACRO = """<robot name="bench" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="segment" params="name parent length angle">
    <link name="${name}">
      <inertial>
        <mass value="1.5"/>
        <inertia ixx="${1.5 / 12 * 0.02}" ixy="0" ixz="0" iyy="${1.5 / 12 * (length * length + 0.01)}" iyz="0"
          izz="${1.5 / 12 * (length * length + 0.01)}"/>
      </inertial>
      <visual><geometry><box size="${length} 0.1 0.1"/></geometry></visual>
      <collision><geometry><box size="${length} 0.1 0.1"/></geometry></collision>
    </link>
    <joint name="${name}_joint" type="revolute">
      <parent link="${parent}"/><child link="${name}"/>
      <origin xyz="${length / 2} 0 0.1" rpy="0 0 ${radians(angle)}"/>
      <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="1"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
"""  # noqa: E501 (a text as its reader has it)


_PLAIN_MACRO = """<robot name="bench" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="segment" params="name parent length xyz:='0.1 0 0.1'">
    <link name="${name}">
      <inertial>
        <mass value="1.5"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
      </inertial>
      <visual><geometry><box size="${length} 0.1 0.1"/></geometry></visual>
      <collision><geometry><box size="${length} 0.1 0.1"/></geometry></collision>
    </link>
    <joint name="${name}_joint" type="fixed">
      <parent link="${parent}"/><child link="${name}"/><origin xyz="${xyz}" rpy="0 0 0"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
"""

#: The links that tfcompose builds of a RealSense D435i with its streams of colour and depth.
_CAMERA_MACRO = """
  <xacro:macro name="frame" params="name parent xyz:='0 0 0' rpy:='0 0 0'">
    <link name="${name}"/>
    <joint name="${name}_joint" type="fixed">
      <parent link="${parent}"/><child link="${name}"/><origin xyz="${xyz}" rpy="${rpy}"/>
    </joint>
  </xacro:macro>
  <xacro:macro name="camera" params="name parent">
    <xacro:frame name="${name}_bottom_screw_frame" parent="${parent}" xyz="0.1 0 0.1"/>
    <link name="${name}_link">
      <inertial>
        <origin xyz="0 -0.0175 0"/><mass value="0.072"/>
        <inertia ixx="5.2e-05" ixy="0" ixz="0" iyy="7.5e-06" iyz="0" izz="5.2e-05"/>
      </inertial>
      <visual><origin xyz="0 -0.0175 0"/><geometry><box size="0.025 0.09 0.025"/></geometry></visual>
      <collision><origin xyz="0 -0.0175 0"/><geometry><box size="0.025 0.09 0.025"/></geometry></collision>
    </link>
    <joint name="${name}_link_joint" type="fixed">
      <parent link="${name}_bottom_screw_frame"/><child link="${name}_link"/>
      <origin xyz="0.0106 0.0175 0.0125"/>
    </joint>
    <xacro:frame name="${name}_depth_frame" parent="${name}_link"/>
    <xacro:frame name="${name}_depth_optical_frame" parent="${name}_depth_frame"
      rpy="${-pi / 2} 0 ${-pi / 2}"/>
    <xacro:frame name="${name}_color_frame" parent="${name}_link" xyz="0 0.015 0"/>
    <xacro:frame name="${name}_color_optical_frame" parent="${name}_color_frame"
      rpy="${-pi / 2} 0 ${-pi / 2}"/>
  </xacro:macro>
"""  # noqa: E501 (a text as its reader has it)


def names(links: int) -> list[tuple[str, str, int]]:
    """Return each link with its parent, ten to a branch, and its number."""
    return [(f"l{n}", f"l{n - 1}" if n % 10 else "base_link", n) for n in range(links)]


def xacro_of(kind: Kind, links: int) -> str:
    """Return the robot as calls of macros."""
    if kind == "jointed":
        calls = (
            f'  <xacro:segment name="{name}" parent="{parent}" length="0.{1 + n % 9}"'
            f' angle="{n % 90}"/>\n'
            for name, parent, n in names(links)
        )
        return _MACRO + "".join(calls) + "</robot>\n"
    boxes = "".join(
        f'  <xacro:segment name="{box.name}" parent="{box.parent}" length="{box.length}"'
        f' xyz="{box.x:g} {box.y:g} {box.z:g}"/>\n'
        for box in _boxes(kind, links)
    )
    cameras = "".join(
        f'  <xacro:camera name="c{number}" parent="{parent}"/>\n'
        for number, parent in _cameras(kind, links)
    )
    return _PLAIN_MACRO + _CAMERA_MACRO + boxes + cameras + "</robot>\n"


class _Box(NamedTuple):
    """A box on a fixed joint: its length and position in metres."""

    name: str
    parent: str
    length: float
    x: float = 0.1
    y: float = 0.0
    z: float = 0.1


def _boxes(kind: Kind, links: int) -> list[_Box]:
    if kind == "plain":
        return [_Box(name, parent, (1 + n % 9) / 10) for name, parent, n in names(links)]
    boxes = []
    for group in range(links // GROUP):
        boxes.append(_Box(f"b{group}_0", "base_link", 0.1, group % 10, group // 10))
        boxes += [_Box(f"b{group}_{n}", f"b{group}_{n - 1}", 0.1) for n in range(1, BOXES)]
    return boxes


def _cameras(kind: Kind, links: int) -> list[tuple[int, str]]:
    """Return each camera's number and the box that it is on."""
    if kind != "cameras":
        return []
    return [(group, f"b{group}_{BOXES - 1}") for group in range(links // GROUP)]


def spec_of(kind: Kind, links: int) -> str:
    """Return the same robot as a robot file."""
    if kind == "jointed":
        return _jointed_spec(links)
    boxes = [
        f"  {box.name}: {{parent: {box.parent}, xyz: [{box.x:g}, {box.y:g}, {box.z:g}],"
        f" visual: {{box: [{box.length:g}, 0.1, 0.1]}}, collision: same,"
        " inertial: {mass: 1.5 kg}}"
        for box in _boxes(kind, links)
    ]
    cameras = [
        f"  c{number}: {{preset: realsense/d435i, parent: {parent}, xyz: [0.1, 0, 0.1],"
        " tf: tfcompose}"
        for number, parent in _cameras(kind, links)
    ]
    sensors = ["sensors:"] if cameras else []
    head = ["tfcompose: 1", "robot: bench", "links:", "  base_link: {}"]
    return "\n".join([*head, *boxes, *sensors, *cameras, ""])


def _jointed_spec(links: int) -> str:
    lines = ["tfcompose: 1", "robot: bench", "x-bodies:"]
    lines += [
        f"  - &body{n} {{visual: {{box: [0.{n}, 0.1, 0.1]}}, collision: same, inertial: {{mass:"
        " 1.5 kg}}"
        for n in range(1, 10)
    ]
    lines += [
        "links:",
        "  base_link: {}",
        *(f"  {name}: *body{1 + n % 9}" for name, _, n in names(links)),
        "joints:",
    ]
    lines += [
        f"  {name}_joint: {{type: revolute, parent: {parent}, child: {name}, "
        f'xyz: ["${{0.{1 + n % 9} / 2}}", 0, 0.1], rpy: [0, 0, {n % 90} deg], axis: [0, 0, 1],'
        " limit: "
        + ("&limit {lower: -1, upper: 1, effort: 10, velocity: 1}}" if n == 0 else "*limit }")
        for name, parent, n in names(links)
    ]
    return "\n".join([*lines, ""])
