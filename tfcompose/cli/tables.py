"""Tables of text: unchanged for files and pipes, fitted and coloured for a terminal.

The output into a pipe does not depend on the terminal. On a narrow terminal, the table drops the
least important columns. Names are shortened after their first third, because their ends
distinguish them. An edge's parent is shortened before its child, which identifies the edge. The
package rich is not used, because it would also shorten numbers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.compiler.render.text import PLAIN

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


@dataclass(frozen=True, slots=True)
class Table:
    """Layout of a table's columns, by index from 0."""

    #: Right-aligned columns.
    right: frozenset[int] = frozenset()
    #: Columns to drop, in this order. Dropping ends when shortening the columns in ``least`` is
    #: sufficient.
    spare: tuple[int, ...] = ()
    #: Columns to shorten, in this order, with their minimum width in characters.
    least: Mapping[int, int] = field(default_factory=dict)
    #: Returns the colour of a cell from its column and text, empty for no colour.
    colour: Callable[[int, str], str] | None = None

    def lines(
        self,
        rows: Sequence[Sequence[str]],
        width: int | None = None,
        *,
        coloured: bool = False,
        indent: str = "",
    ) -> list[str]:
        """Return a line for each row, narrower than ``width`` if possible.

        The last column of a terminal stays free.
        """
        widths = {
            column: max(map(len, cells)) for column, cells in enumerate(zip(*rows, strict=True))
        }
        if width is not None:
            self._fit(widths, width - 1 - len(indent))
        colour = self.colour if coloured else None
        return [indent + self._line(row, widths, colour) for row in rows]

    def _fit(self, widths: dict[int, int], width: int) -> None:
        for column in [column for column, wide in widths.items() if not wide]:
            del widths[column]
        least = {
            column: min(wide, self.least.get(column, wide)) for column, wide in widths.items()
        }
        for column in [column for column in self.spare if column in widths]:
            if _excess(least, width) <= 0:
                break
            del widths[column], least[column]
        for column in [column for column in self.least if column in widths]:
            widths[column] = max(widths[column] - max(_excess(widths, width), 0), least[column])

    def _line(
        self, row: Sequence[str], widths: dict[int, int], colour: Callable[[int, str], str] | None
    ) -> str:
        cells, last = [], max(widths)
        for column, width in widths.items():
            text = shorten(row[column], width, at_end=column == last)
            code = colour(column, row[column]) if colour else ""
            blank = " " * (width - len(text))
            coloured = f"{code}{text}{PLAIN}" if code else text
            cells.append(f"{blank}{coloured}" if column in self.right else f"{coloured}{blank}")
        return "  ".join(cells).rstrip()


def _excess(widths: dict[int, int], width: int) -> int:
    """Return the number of characters by which the columns are too wide."""
    return sum(widths.values()) + 2 * (len(widths) - 1) - width


def shorten(text: str, width: int, *, at_end: bool = False) -> str:
    """Return the text in ``width`` characters, with an ellipsis after its first third.

    With ``at_end``, the ellipsis is at the end. For an edge (``parent → child``), the ellipsis is
    after the first third of the parent. If there is no space for that, only the shortened child
    remains.
    """
    if len(text) <= width:
        return text
    parent, arrow, child = text.partition(" → ")
    if arrow and not at_end:
        room = width - len(arrow) - len(child)
        return (
            f"{shorten(parent, room)}{arrow}{child}"
            if room > 0
            else f"→ {shorten(child, width - 2)}"
        )
    head = width - 1 if at_end else (width - 1) // 3
    return f"{text[:head]}…{text[len(text) - (width - 1 - head) :]}"
