"""What is read from a calibration file: poses with names and places, and what cannot be read."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.geometry import Pose
from tfcompose.validate.fields import NUMBER_
from tfcompose.validate.rotation import MATRIX, QUAT_XYZW
from tfcompose.validate.schema import Problems, Type, shown

if TYPE_CHECKING:
    from tfcompose.findings import Span
    from tfcompose.geometry import Quaternion, Vector
    from tfcompose.load import Path, Source

_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_EXACT = 1e-9


@dataclass(frozen=True, slots=True)
class Entry:
    """The pose of ``child`` in ``parent``, by the names of the file; ``what`` is the key that holds it, if it matters.

    A matrix has no names.
    """

    pose: Pose
    at: Span
    parent: str | None = None
    child: str | None = None
    what: str = ""

    @property
    def name(self) -> str:
        """Return the frame's name below ``data``, without a leading slash."""
        """The entry as people read it."""
        return f"{self.parent} → {self.child}" if self.parent else "the matrix"


class RefusedError(Exception):
    """What is being read is wrong, and that has been said."""


@dataclass(slots=True)
class Entries:
    """Collects a file's entries, and what is wrong with those that cannot be read."""

    entries: list[Entry] = field(default_factory=list)
    found: list[Finding] = field(default_factory=list)

    def refuse(self, source: Source, path: Path, message: str, advice: str = "", code: str = "TF610") -> RefusedError:
        """Note what is wrong at the path, and return the error to raise."""
        self.found.append(finding(code, message, source.at(path), help=advice))
        return RefusedError(message)

    def get(self, source: Source, data: Any, path: Path, *steps: str) -> Any:
        """Return what stands below ``data``; each step must be there."""
        for step in steps:
            if not isinstance(data, dict):
                raise self.refuse(source, path, f"{shown(data)} stands where a mapping with {step} is expected")
            if step not in data:
                there = f"there is {', '.join(list(data)[:8])}" if data else ""
                raise self.refuse(source, path, f"{step} is missing", did_you_mean(step, data, there))
            data, path = data[step], (*path, step)
        return data

    def name(self, source: Source, data: Any, path: Path, *steps: str) -> str:
        """Return the frame's name below ``data``, without a leading slash."""
        name = self.get(source, data, path, *steps)
        if not isinstance(name, str) or not name.strip("/"):
            raise self.refuse(source, (*path, *steps), f"{shown(name)} is no frame's name")
        return name.lstrip("/")

    def checked(self, kind: Type, value: Any, source: Source, path: Path, code: str = "") -> Any:
        """Return what the type makes of the value."""
        problems = Problems()
        result = kind.read(value, path, problems)
        for problem in problems.all[:1]:
            raise self.refuse(source, problem.path, problem.message, problem.help, code or "TF610")
        return result

    def number(self, value: Any, source: Source, path: Path) -> float:
        """Return a number; texts such as 0.5 are numbers, expressions are not."""
        if isinstance(value, str) and ("${" in value or "(" in value):
            message = f"{shown(value)} is an expression, and none is computed here"
            raise self.refuse(source, path, message, "write the number; an angle in degrees: !degrees 15")
        if isinstance(value, str) and len(value) > 60:  # noqa: PLR2004 (no number is as long)
            raise self.refuse(source, path, f"{shown(value)} is no number")
        return float(self.checked(NUMBER_, value, source, path))

    def vector(self, source: Source, data: Any, path: Path, keys: tuple[str, ...] = ("x", "y", "z")) -> Any:
        """Return the numbers under the keys."""
        return tuple(self.number(self.get(source, data, path, key), source, (*path, key)) for key in keys)

    def unit(self, values: tuple[float, ...], source: Source, path: Path) -> Quaternion:
        """Return the quaternion x, y, z, w, which must have length 1."""
        quat: Quaternion = self.checked(QUAT_XYZW, list(values), source, path, "TF614")
        return quat

    def add(self, source: Source, path: Path, pose: Pose, names: tuple[str | None, str | None], what: str = "") -> None:
        """Take an entry; ``names`` are its parent and child."""
        span = source.at_key(path) if source.has_key(path) else source.at(path)
        self.entries.append(Entry(pose, span, *names, what))

    def matrix(self, rows: Any, source: Source, path: Path) -> Pose:
        """Return the pose that four rows of four numbers are."""
        lengths = [len(row) if isinstance(row, list) else 0 for row in rows] if isinstance(rows, list) else []
        if lengths != [4, 4, 4, 4]:
            raise self.refuse(source, path, f"{shown(rows)} is no 4×4 matrix", "four rows of four numbers")
        m = [[self.number(v, source, (*path, i, j)) for j, v in enumerate(row)] for i, row in enumerate(rows)]
        if any(abs(a - b) > _EXACT for a, b in zip(m[3], _LAST_ROW, strict=True)):
            transposed = all(abs(m[i][3]) <= _EXACT for i in range(3))
            advice = "it is transposed: the position stands in the last column" if transposed else ""
            message = f"the last row is {' '.join(f'{v:g}' for v in m[3])}, not 0 0 0 1"
            raise self.refuse(source, (*path, 3), message, advice, "TF614")
        xyz: Vector = (m[0][3], m[1][3], m[2][3])
        return Pose(xyz, self.checked(MATRIX, [row[:3] for row in m[:3]], source, path, "TF614"))
