"""Hardware of ros2_control, and elements that the URDF contains verbatim."""

from __future__ import annotations

import html
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.foundation.findings import Span


@dataclass(frozen=True, slots=True)
class Interface:
    """An interface of ros2_control, with its parameters as strings."""

    name: str
    params: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class HardwareComponent:
    """A joint, sensor or gpio of a hardware component."""

    kind: str
    name: str
    span: Span
    command: tuple[Interface, ...] = ()
    state: tuple[Interface, ...] = ()
    params: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Hardware:
    """A hardware component of ros2_control: the plugin, and the components that it drives."""

    name: str
    plugin: str
    type: str
    span: Span
    params: dict[str, str] = field(default_factory=dict)
    components: tuple[HardwareComponent, ...] = ()
    rw_rate: int | None = None
    is_async: bool | None = None


#: Elements in a raw block that have a unique name.
_NAMED = re.compile(
    r"""<(?:transmission|actuator|ros2_control|sensor|gpio)\b[^>]*?\bname\s*=\s*["']([^"']+)"""
)
#: Text in quotes, or between two tags.
_HELD = re.compile(r"""(=\s*")([^<"]*)(?=")|(=\s*')([^<']*)(?=')|(>)([^<>]*)(?=<)""")

#: Escapes for both kinds of quotes, because either may enclose a value.
_QUOTES = {'"': "&quot;", "'": "&#x27;"}


@dataclass(frozen=True, slots=True)
class Block:
    """Elements that the URDF contains exactly as the user wrote them."""

    name: str
    span: Span
    text: str
    #: Spans of the elements, in order, if known.
    places: tuple[Span, ...] = field(default=(), compare=False)

    def own_names(self) -> list[str]:
        """Return names of the block's elements that must be unique in the robot."""
        return _NAMED.findall(self.text)

    def rename(self, names: Mapping[str, str]) -> Block:
        """Return the block with names replaced.

        Only attributes and texts that consist of a name are changed.
        """

        def rename_match(match: re.Match[str]) -> str:
            before, held = (part for part in match.groups() if part is not None)
            name = held.strip()
            again = names.get(html.unescape(name))
            return (
                match[0] if again is None else before + held.replace(name, escape(again, _QUOTES))
            )

        return replace(self, text=_HELD.sub(rename_match, self.text))
