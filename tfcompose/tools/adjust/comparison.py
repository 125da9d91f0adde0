"""A mount's pose before and after: its numbers, and a drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.cli.tables import Table
from tfcompose.compiler.draw.picture import Curve, Drawing, TextLine
from tfcompose.compiler.draw.style import STYLES, shorten_label, width_of
from tfcompose.foundation.geometry import angle_between, matrix_from_quat
from tfcompose.foundation.numbers import clean_rpy, number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.draw.picture import Point, Shape
    from tfcompose.foundation.geometry import Pose, Vector

#: Lengths of the drawing, in px: a view's side and title, an axis, the change at most, the scale's
#: bar at most.
_SIDE, _HEAD, _AXIS, _CHANGE, _BAR = 290.0, 30.0, 70.0, 90.0, 100.0
_MARGIN, _LINE, _LABEL_GAP = 16.0, 18.0, 9.0
_TABLE = Table(right=frozenset(range(1, 7)))
#: The smallest change that the drawing enlarges, in metres.
_LEAST = 1e-4
#: The colours of x, y and z: vermilion, green and blue.
_COLOURS = (2, 3, 1)
#: Views as the axes of the parent that point right and up, each with its sign.
_VIEWS = (("seen along −z", (1, -1), (0, 1)), ("seen along y", (0, 1), (2, 1)))


@dataclass(frozen=True, slots=True)
class PoseComparison:
    """Two poses of a frame in another one."""

    parent: str
    child: str
    before: Pose
    after: Pose

    @property
    def change(self) -> str:
        """How far the frame moved and rotated, in millimetres and degrees."""
        moved = math.dist(self.before.xyz, self.after.xyz)
        rotated = angle_between(self.before.quat_xyzw, self.after.quat_xyzw)
        return f"moved {_mm(moved)} mm, rotated {_deg(rotated)} deg"

    def table(self) -> list[str]:
        """Return lines with both poses, in millimetres and degrees, and the change."""
        poses = (("before", self.before), ("after", self.after))
        rows = [("", *(f"{axis} mm" for axis in "xyz"), "roll deg", "pitch deg", "yaw deg")]
        rows += [
            (name, *map(_mm, pose.xyz), *map(_deg, clean_rpy(pose.quat_xyzw)))
            for name, pose in poses
        ]
        return [*_TABLE.lines(rows), self.change]

    def drawing(self) -> Drawing:
        """Return two views of the frame's axes in the parent, dashed before and solid after.

        The distance between them is to scale, which a bar shows; the axes have one length.
        """
        title = f"{shorten_label(self.child)} in {shorten_label(self.parent)}"
        base = _MARGIN + 14.0
        shapes: list[Shape] = [
            _text(title, "title", _MARGIN, base),
            _text(f"dashed before, solid after: {self.change}", "name", _MARGIN, base + _LINE),
        ]
        top = base + _LINE + _MARGIN
        for index, (name, right, up) in enumerate(_VIEWS):
            left = _MARGIN + index * _SIDE
            shapes += self._view(name, right, up, (left + _SIDE / 2, top + _HEAD + _SIDE / 2))
        bar_y = top + _HEAD + _SIDE
        shapes += self._bar(_MARGIN, bar_y)
        width = max(2 * _SIDE, *(text.width for text in shapes[:2] if isinstance(text, TextLine)))
        return Drawing(title, width + 2 * _MARGIN, bar_y + 2 * _MARGIN, tuple(shapes))

    @property
    def _scale(self) -> float:
        """Pixels per metre."""
        changes = (abs(a - b) for a, b in zip(self.before.xyz, self.after.xyz, strict=True))
        return _CHANGE / max(_LEAST, *changes)

    def _view(
        self, name: str, right: tuple[int, int], up: tuple[int, int], centre: Point
    ) -> Iterator[Shape]:
        """Yield the axes of both poses around the middle between them."""
        labels = [f"{'−' * (sign < 0)}{'xyz'[axis]}" for axis, sign in (right, up)]
        heading = f"{name} of {shorten_label(self.parent)}: {labels[0]} right, {labels[1]} up"
        yield _text(heading, "label", centre[0] - _SIDE / 2, centre[1] - _SIDE / 2)

        def project(vector: Vector, size: float) -> Point:
            return (
                right[1] * vector[right[0]] * size,
                -up[1] * vector[up[0]] * size,
            )

        middle = [(a + b) / 2 for a, b in zip(self.before.xyz, self.after.xyz, strict=True)]
        for pose, style in ((self.before, "joint"), (self.after, "static")):
            x, y, z = (a - b for a, b in zip(pose.xyz, middle, strict=True))
            offset = project((x, y, z), self._scale)
            origin = (centre[0] + offset[0], centre[1] + offset[1])
            rows = matrix_from_quat(pose.quat_xyzw)
            for axis, colour in enumerate(_COLOURS):
                step = project((rows[0][axis], rows[1][axis], rows[2][axis]), _AXIS)
                end = (origin[0] + step[0], origin[1] + step[1])
                yield Curve((origin, origin, end, end), f"edge{colour} {style}")
                if style == "static" and math.hypot(*step) > _LABEL_GAP:
                    part = 1 + _LABEL_GAP / math.hypot(*step)
                    spot = (origin[0] + part * step[0], origin[1] + part * step[1] + 4.0)
                    label = _text("xyz"[axis], "name", *spot)
                    yield TextLine(*spot, label.text, label.style, label.width, middle=True)

    def _bar(self, x: float, y: float) -> Iterator[Shape]:
        """Yield a bar of a round length, and that length."""
        most = _BAR / self._scale
        power = 10.0 ** math.floor(math.log10(most))
        length = power * max(step for step in (1, 2, 5) if step * power <= most * (1 + 1e-9))
        end = (x + length * self._scale, y)
        yield Curve(((x, y), (x, y), end, end), "sample")
        yield _text(f"{number(round(length * 1e3, 6))} mm", "label", end[0] + 6.0, y + 4.0)


def _text(text: str, style: str, x: float, y: float) -> TextLine:
    font = STYLES[style]
    return TextLine(x, y, text, style, width_of(text, font.size, bold=font.bold))


def _mm(metres: float) -> str:
    return f"{round(metres * 1e3, 2) + 0.0:.2f}"


def _deg(radians: float) -> str:
    return f"{round(math.degrees(radians), 3) + 0.0:.3f}"
