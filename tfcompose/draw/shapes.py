"""What a drawing is made of; lengths in px, from the top left corner, y down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

Point = tuple[float, float]


@dataclass(slots=True)
class Box:
    """A rectangle with rounded corners."""

    x: float
    y: float
    width: float
    height: float
    radius: float
    look: str


@dataclass(slots=True)
class Curve:
    """A cubic curve, by its four points; ``about`` is what it says of itself where a format can."""

    points: tuple[Point, Point, Point, Point]
    look: str
    about: str = ""

    @property
    def straight(self) -> bool:
        """Whether it is a level line from left to right."""
        return self.points[0][1] == self.points[1][1] == self.points[2][1] == self.points[3][1]


def level(start: Point, end: Point) -> tuple[Point, Point, Point, Point]:
    """Return the curve that leaves and arrives horizontally."""
    bend = (start[0] + end[0]) / 2
    return start, (bend, start[1]), (bend, end[1]), end


def hanging(start: Point, end: Point) -> tuple[Point, Point, Point, Point]:
    """Return the curve that leaves and arrives from below, and hangs the deeper the farther it goes."""
    sag = 26.0 + 0.08 * (abs(end[0] - start[0]) + abs(end[1] - start[1]))
    return start, (start[0], start[1] + sag), (end[0], end[1] + sag), end


@dataclass(slots=True)
class Text:
    """A line of text: where it begins, or its middle is, on its base line, and how wide it may become."""

    x: float
    y: float
    text: str
    look: str
    width: float
    middle: bool = False


Shape = Union[Box, Curve, Text]  # noqa: UP007 (evaluated when it is loaded, by Python 3.10 too)


@dataclass(frozen=True, slots=True)
class Drawing:
    """Shapes, those in front last, and the size of the paper."""

    title: str
    width: float
    height: float
    shapes: tuple[Shape, ...]
