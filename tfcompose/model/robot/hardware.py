"""Hardware of ros2_control, and elements that the URDF keeps verbatim."""

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
    """An interface of ros2_control, with its parameters as texts."""

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
    """A hardware component of ros2_control: the plugin and what it drives."""

    name: str
    plugin: str
    type: str
    span: Span
    params: dict[str, str] = field(default_factory=dict)
    components: tuple[HardwareComponent, ...] = ()
    rw_rate: int | None = None
    is_async: bool | None = None


#: What has a name of its own in a raw block.
_NAMED = re.compile(
    r"""<(?:transmission|actuator|ros2_control|sensor|gpio)\b[^>]*?\bname\s*=\s*["']([^"']+)"""
)
#: All that stands between quotes, or between two tags.
_HELD = re.compile(r"""(=\s*")([^<"]*)(?=")|(=\s*')([^<']*)(?=')|(>)([^<>]*)(?=<)""")

#: Both, since a value may stand in either.
_QUOTES = {'"': "&quot;", "'": "&#x27;"}


@dataclass(frozen=True, slots=True)
class Block:
    """Elements that stand in the URDF as the user wrote them."""

    name: str
    span: Span
    text: str
    #: Their spans, in order, if known.
    places: tuple[Span, ...] = field(default=(), compare=False)

    def own_names(self) -> list[str]:
        """Return the names of its elements that must be unique in the robot."""
        return _NAMED.findall(self.text)

    def rename(self, names: Mapping[str, str]) -> Block:
        """Return the block with other names.

        Of what an attribute or an element holds, if that is a name alone.
        """

        def other(match: re.Match[str]) -> str:
            before, held = (part for part in match.groups() if part is not None)
            name = held.strip()
            again = names.get(html.unescape(name))
            return (
                match[0] if again is None else before + held.replace(name, escape(again, _QUOTES))
            )

        return replace(self, text=_HELD.sub(other, self.text))
