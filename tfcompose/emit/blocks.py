"""What stands beside links and joints in a URDF: ros2_control's hardware, and the user's own blocks."""

from __future__ import annotations

from textwrap import dedent, indent
from typing import TYPE_CHECKING

from tfcompose.emit.markup import escaped, quoted

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.model import Block, Component, Hardware, Interface

#: What ros2_control reads as attributes of an interface, and not as parameters.
_ATTRIBUTES = ("data_type", "size")


def block_lines(several: Iterable[Hardware], blocks: Iterable[Block]) -> list[str]:
    """Return the elements, line by line; a raw block is as it was written, but for what it is indented by."""
    lines = [line for hardware in several for line in _hardware(hardware)]
    return lines + [indent(dedent(block.text).strip("\n"), "  ") for block in blocks]


def _hardware(hardware: Hardware) -> list[str]:
    more = "" if hardware.rw_rate is None else f' rw_rate="{hardware.rw_rate}"'
    more += "" if hardware.is_async is None else f' is_async="{str(hardware.is_async).lower()}"'
    return [
        f'  <ros2_control name={quoted(hardware.name)} type="{hardware.type}"{more}>',
        "    <hardware>",
        f"      <plugin>{escaped(hardware.plugin)}</plugin>",
        *_params(hardware.params, "      "),
        "    </hardware>",
        *(line for component in hardware.components for line in _component(component)),
        "  </ros2_control>",
    ]


def _component(component: Component) -> list[str]:
    inside = [
        *(line for one in component.command for line in _interface("command_interface", one)),
        *(line for one in component.state for line in _interface("state_interface", one)),
        *_params(component.params, "      "),
    ]
    head = f"    <{component.kind} name={quoted(component.name)}"
    return [f"{head}>", *inside, f"    </{component.kind}>"] if inside else [f"{head}/>"]


def _interface(tag: str, interface: Interface) -> list[str]:
    attributes = {key: interface.params[key] for key in _ATTRIBUTES if key in interface.params}
    more = "".join(f" {key}={quoted(value)}" for key, value in attributes.items())
    head = f"      <{tag} name={quoted(interface.name)}{more}"
    params = {key: value for key, value in interface.params.items() if key not in _ATTRIBUTES}
    return [f"{head}>", *_params(params, "        "), f"      </{tag}>"] if params else [f"{head}/>"]


def _params(params: dict[str, str], before: str) -> list[str]:
    return [f"{before}<param name={quoted(name)}>{escaped(value)}</param>" for name, value in params.items()]
