"""Arrangement of a picture: to the right, down, or in columns.

In columns, the frames above the first branching frame form a row at the top. The subtrees below
that frame follow in columns. One line runs along the top of all columns and down the left side of
each, so that no edge crosses a box. Each subtree keeps its shape. The subtrees fill the first
column from top to bottom, then the next column.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from tfcompose.compiler.draw.layout import INDENT, PAD, ROW_GAP, Layout, Trunk, layout

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.compiler.draw.graph import Forest, Graph
    from tfcompose.compiler.draw.layout import Area, FrameBox

Direction = Literal["auto", "right", "down", "columns"]

WIDEST, WIDEST_RATIO = (
    1600.0,
    3.0,
)  # a wider picture is drawn downwards; the second is a limit on width / height
TALLEST, TALLEST_RATIO = (
    900.0,
    1.5,
)  # a taller picture is drawn in columns; the second is a limit on height / width
MOST_COLUMNS = 8
COLUMN_GAP = 24.0
FROM_LINE = 22.0  # from the line on the left of a column to its frames


def arrange(graph: Graph, forest: Forest, direction: Direction = "auto") -> Layout:
    """Return the position of each frame and group, with the top left corner at (0, 0).

    ``auto`` draws to the right unless the picture would be too wide or too tall.
    """
    if direction == "down":
        return layout(graph, forest, is_down=True)
    flat = layout(graph, forest, is_down=False)
    if direction == "auto" and flat.width > max(WIDEST, WIDEST_RATIO * flat.height):
        return layout(graph, forest, is_down=True)
    is_too_tall = direction == "auto" and flat.height > max(TALLEST, TALLEST_RATIO * flat.width)
    return in_columns(forest, flat) if direction == "columns" or is_too_tall else flat


@dataclass(frozen=True, slots=True)
class _Block:
    """A subtree: its frames and areas, and its bounds in the picture drawn to the right."""

    frames: tuple[str, ...]
    areas: tuple[Area, ...]
    left: float
    top: float
    right: float
    bottom: float

    @property
    def height(self) -> float:
        """The height of the block, including the gap to the next block."""
        return self.bottom - self.top + ROW_GAP


def in_columns(forest: Forest, flat: Layout) -> Layout:
    """Return the layout ``flat`` in the fewest columns that make it no taller than wide.

    ``flat`` is returned unchanged if it has several roots or no branches, or if a group begins
    above the branching frame.
    """
    stem = _stem(forest)
    children = forest.children[stem[-1]] if stem else []
    if len(children) < 2 or any(area.frame in stem for area in flat.areas):  # noqa: PLR2004 (it does not branch)
        return flat
    blocks = [_block(forest, flat, child) for child in children]
    result = flat
    for count in range(2, min(MOST_COLUMNS, len(blocks)) + 1):
        result = _place_blocks(forest, flat, stem, _split(blocks, count))
        if result.height <= result.width:
            break
    return result


def _stem(forest: Forest) -> list[str]:
    """Return the frames from the only root to the first frame with several children.

    Empty if there are several roots.
    """
    roots = [frame for frame in forest.order if frame not in forest.up]
    if len(roots) != 1 or forest.extra:
        return []
    stem = roots
    while len(forest.children[stem[-1]]) == 1:
        stem = [*stem, forest.children[stem[-1]][0]]
    return stem


def _block(forest: Forest, flat: Layout, child: str) -> _Block:
    frames, waiting = [], [child]
    while waiting:
        frames.append(waiting.pop())
        waiting += forest.children[frames[-1]]
    inside = frozenset(frames)
    places = [flat.places[frame] for frame in frames]
    areas = tuple(area for area in flat.areas if area.frame in inside)
    return _Block(
        tuple(frames),
        areas,
        min([box.x for box in places] + [area.x for area in areas]),
        min([2 * box.y - box.bottom for box in places] + [area.top for area in areas]),
        max([box.right for box in places] + [area.right for area in areas]),
        max([box.bottom for box in places] + [area.bottom for area in areas]),
    )


def _split(blocks: Sequence[_Block], count: int) -> list[list[_Block]]:
    """Return the blocks in order, in at most ``count`` columns of minimal height."""
    low, high = max(block.height for block in blocks), sum(block.height for block in blocks)
    while high - low > 1:
        middle = (low + high) / 2
        low, high = (
            (low, middle) if len(_fill_columns(blocks, middle)) <= count else (middle, high)
        )
    return _fill_columns(blocks, high)


def _fill_columns(blocks: Sequence[_Block], height: float) -> list[list[_Block]]:
    columns: list[list[_Block]] = [[]]
    filled = 0.0
    for block in blocks:
        if columns[-1] and filled + block.height > height:
            columns.append([])
            filled = 0.0
        columns[-1].append(block)
        filled += block.height
    return columns


def _place_blocks(
    forest: Forest, flat: Layout, stem: Sequence[str], columns: Sequence[Sequence[_Block]]
) -> Layout:
    places: dict[str, FrameBox] = {}
    areas: list[Area] = []
    middle = max(flat.places[frame].height for frame in stem) / 2
    for frame in stem:
        places[frame] = replace(flat.places[frame], y=middle)
    line = 2 * middle + PAD + ROW_GAP
    lines: dict[str, float] = {}
    x, width, height = INDENT / 2, places[stem[-1]].right, line
    for column in columns:
        y = line + ROW_GAP
        left = min(block.left for block in column)
        shift = x + FROM_LINE - left
        for block in column:
            lines[block.frames[0]] = x
            fall = y - block.top
            for frame in block.frames:
                box = flat.places[frame]
                places[frame] = replace(box, x=box.x + shift, y=box.y + fall)
            areas += (
                replace(
                    area,
                    x=area.x + shift,
                    right=area.right + shift,
                    top=area.top + fall,
                    bottom=area.bottom + fall,
                )
                for area in block.areas
            )
            y += block.height
        height = max(height, y - ROW_GAP)
        right = max(block.right for block in column) + shift
        width = max(width, right)
        x = right + COLUMN_GAP
    ordered = {frame: places[frame] for frame in forest.order}
    return Layout(ordered, tuple(areas), width, height, trunk=Trunk(stem[-1], line, lines))
