"""What ros2_control drives, and elements that stand in the URDF as they were written."""

from __future__ import annotations

import re
from dataclasses import field, replace
from typing import TYPE_CHECKING

from tfcompose.frozen import dataclass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.diagnostic import Span


@dataclass(frozen=True, slots=True)
class Interface:
    """An interface of ros2_control, with its parameters as texts."""

    name: str
    params: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Component:
    """A joint, sensor or gpio of a hardware component."""

    kind: str
    name: str
    at: Span
    command: tuple[Interface, ...] = ()
    state: tuple[Interface, ...] = ()
    params: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Hardware:
    """A hardware component of ros2_control: the plugin and what it drives."""

    name: str
    plugin: str
    type: str
    at: Span
    params: dict[str, str] = field(default_factory=dict)
    components: tuple[Component, ...] = ()
    rw_rate: int | None = None
    is_async: bool | None = None


#: All that stands between quotes, or between two tags, but for blanks.
_HELD = re.compile(r"""(=\s*["']\s*|>\s*)([^<>"'\s]+)(?=\s*["'<])""")


@dataclass(frozen=True, slots=True)
class Block:
    """Elements that stand in the URDF as the user wrote them."""

    name: str
    at: Span
    text: str

    def renamed(self, names: Mapping[str, str]) -> Block:
        """Return the block with other names: of what an attribute or an element holds, if that is a name alone."""

        def other(found: re.Match[str]) -> str:
            return found[1] + names.get(found[2], found[2])

        return replace(self, text=_HELD.sub(other, self.text))
