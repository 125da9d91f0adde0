"""What ``import`` takes from somebody else's robot: the robot, the sensors known in it, and what could not be taken."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tfcompose.geometry import Quaternion, Vector
    from tfcompose.model import Edge, Robot

#: A section of the robot file and the name of an entry in it; of the whole file both are empty.
Entry = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Recognised:
    """A sensor that a preset describes: ``mount`` is its edge, ``inside`` the edges to the frames that it brings.

    ``own_xyz`` and ``own_turn`` are those of its frames whose position, or rotation, is not the preset's to the last
    digit. ``body`` is the frame on which the preset has a body, empty without one; ``driven`` says that the preset
    starts a driver.
    """

    name: str
    preset: str
    mount: Edge
    inside: tuple[Edge, ...]
    options: dict[str, Any] = field(default_factory=dict)
    own_xyz: frozenset[str] = frozenset()
    own_turn: frozenset[str] = frozenset()
    body: str = ""
    driven: bool = False


@dataclass(frozen=True, slots=True)
class Imported:
    """A robot on its way into a robot file.

    ``notes`` says of each entry what of it is left out, and why. ``rpy`` has the angles (rad) by which rotations are
    written in the source; ``packages`` are folders of packages, as the robot file is to name them; ``rules`` are the
    levels of findings that the source gives reason for. ``source`` is what people call the file.
    """

    robot: Robot
    source: str
    sensors: tuple[Recognised, ...] = ()
    notes: dict[Entry, tuple[str, ...]] = field(default_factory=dict)
    rpy: dict[Quaternion, Vector] = field(default_factory=dict)
    packages: dict[str, str] = field(default_factory=dict)
    rules: dict[str, str] = field(default_factory=dict)
