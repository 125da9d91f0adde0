"""ros2_control in a URDF: as the section of a robot file, where nothing of it is lost by that."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Span
from tfcompose.load.urdf import load_xml
from tfcompose.model import Component, Hardware, Interface

if TYPE_CHECKING:
    from tfcompose.load.urdf import Element
    from tfcompose.model import Block, Robot

#: What stands before a block while it is read.
_ROUND = "<robot>"
_TYPES = ("system", "actuator", "sensor")
_KINDS = ("joint", "sensor", "gpio")
_SIDES = {"command_interface": "command", "state_interface": "state"}


class _MisfitError(Exception):
    """The section has no place for something in the element."""


def with_hardware(robot: Robot) -> Robot:
    """Return the robot of a URDF with its ros2_control blocks as hardware, where nothing is lost by that."""
    hardware: dict[str, Hardware] = {}
    blocks = []
    for block in robot.blocks:
        said = None
        if block.text.startswith("<ros2_control"):
            (element,) = load_xml(f"{_ROUND}{block.text}</robot>", robot.file, with_text=True).children
            said = _hardware_of(element, block)
        if said and said.name and said.name not in hardware:
            hardware[said.name] = said
        else:
            blocks.append(block)
    return replace(robot, hardware=tuple(hardware.values()), blocks=tuple(blocks))


def _hardware_of(element: Element, block: Block) -> Hardware | None:
    """Return the component that the element describes, or None where the section has no place for all of it."""
    try:
        return _hardware(element, block.at)
    except (_MisfitError, ValueError):
        return None


def _hardware(element: Element, at: Span) -> Hardware:
    said = _only(element, "name", "type", "rw_rate", "is_async", tags=("hardware", *_KINDS))
    inner = element.first("hardware")
    if inner is None or len(element.all("hardware")) != 1 or said.get("type") not in _TYPES:
        raise _MisfitError
    _only(inner, tags=("plugin", "param"))
    if len(inner.all("plugin")) != 1 or said.get("is_async") not in {None, "true", "false"}:
        raise _MisfitError
    plugin = inner.all("plugin")[0]
    components = [
        replace(_component(one), at=_in_document(one.at, at)) for one in element.children if one.tag in _KINDS
    ]
    if len({(one.kind, one.name) for one in components}) != len(components):
        raise _MisfitError
    _only(plugin)
    return Hardware(
        said.get("name", ""),
        plugin.text.strip(),
        said["type"],
        at,
        _params(inner),
        tuple(components),
        int(said["rw_rate"]) if "rw_rate" in said else None,
        said["is_async"] == "true" if "is_async" in said else None,
    )


def _in_document(place: Span, block: Span) -> Span:
    """Return the place in the document of one in the block that begins there, and was read within ``_ROUND``."""
    lines, columns = block.line - 1, block.column - 1 - len(_ROUND) if place.line == 1 else 0
    begin, end = (place.line + lines, place.column + columns), (place.end_line + lines, place.end_column + columns)
    return Span(block.file, *begin, *end)


def _component(element: Element) -> Component:
    said = _only(element, "name", tags=("param", *_SIDES))
    command, state = (tuple(_interface(one) for one in element.all(tag)) for tag in _SIDES)
    for side in (command, state):
        if len({one.name for one in side}) != len(side):
            raise _MisfitError
    return Component(element.tag, said.get("name", ""), element.at, command, state, _params(element))


def _interface(element: Element) -> Interface:
    said = _only(element, "name", "data_type", "size", tags=("param",))
    if "name" not in said:
        raise _MisfitError
    more = {key: value for key, value in said.items() if key != "name"}
    params = _params(element)
    if set(params) & {"data_type", "size"}:
        raise _MisfitError
    return Interface(said["name"], more | params)


def _params(element: Element) -> dict[str, str]:
    found: dict[str, str] = {}
    for one in element.all("param"):
        name = _only(one, "name").get("name")
        if name is None or name in found:
            raise _MisfitError
        found[name] = one.text.strip()
    return found


def _only(element: Element, *attributes: str, tags: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the element's attributes, if it has no others and no other elements in it."""
    if set(element.attributes) - set(attributes) or {child.tag for child in element.children} - set(tags):
        raise _MisfitError
    return element.attributes
