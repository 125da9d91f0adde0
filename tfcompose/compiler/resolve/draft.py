"""A robot during resolution: the content of the file, and the results of the passes so far.

A pass is a function of a draft that yields findings. It reads the results of earlier passes and
stores its own results in the draft. A helper that yields findings and also returns a value is
called with ``value = yield from helper(…)``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.compiler.urdf.packages import Packages

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator
    from typing import TypeVar

    from tfcompose.compiler.resolve.part import Joined
    from tfcompose.compiler.resolve.presets import Library
    from tfcompose.compiler.urdf.packages import Disk
    from tfcompose.foundation.findings import Allow, Finding, Note, Span
    from tfcompose.model.robot import Edge, Link, MountedSensor, Process, Robot
    from tfcompose.spec.language import Validated
    from tfcompose.spec.language.pose import EdgeKeys
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Source

    T = TypeVar("T")
    Finds = Generator[Finding, None, T]
    Pass = Callable[["Draft"], Iterator[Finding]]


@dataclass(slots=True)
class Collected:
    """Data from all parts of a robot, and from the parts of these parts."""

    count: int = 0
    #: Comments that silence findings, from the files of parts.
    allows: list[Allow] = field(default_factory=list)
    #: Notes by file. Each note names a part that uses the file.
    notes: dict[str, list[Note]] = field(default_factory=dict)
    #: Sources of the parts that are robot files.
    sources: list[Source] = field(default_factory=list)


@dataclass(slots=True)
class Draft:
    """A robot during resolution."""

    validated: Validated
    library: Library
    #: Returns the text of a file. None if files cannot be read.
    read: Callable[[str], str] | None
    #: None if meshes and packages are not looked up.
    disk: Disk | None
    #: Data that the outermost robot collects from its parts and from their parts.
    collected: Collected
    #: The robot that includes this one as a part.
    holder: Draft | None = None
    #: Search paths for packages in this robot's file addresses.
    packages: Packages = field(init=False)
    #: Rejected entries (section, name), and names that rejected parts would have defined.
    broken: set[tuple[str, str]] = field(init=False)
    #: Processes from this file, without processes of parts.
    processes: list[Process] = field(default_factory=list)
    joined: list[Joined] = field(default_factory=list)
    frames: dict[str, Span] = field(default_factory=dict)
    joints: dict[str, Span] = field(default_factory=dict)
    #: Until ``solve_poses`` has run, poses are those in the file.
    edges: list[Edge] = field(default_factory=list)
    #: The keys of edges from this file, by the edge's index.
    keys: dict[int, EdgeKeys] = field(default_factory=dict)
    links: dict[str, Link] = field(default_factory=dict)
    sensors: list[MountedSensor] = field(default_factory=list)
    #: Set by ``assemble``.
    robot: Robot = field(init=False)

    def __post_init__(self) -> None:
        spec = self.spec
        places = {
            name: (folder, spec.span_of(("packages", name)))
            for name, folder in spec.packages.items()
        }
        self.packages = Packages(self.disk, places)
        self.broken = set(self.validated.broken)

    @property
    def spec(self) -> RobotSpec:
        """The content of the robot file, with the span of each value."""
        return self.validated.spec

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the including robots, outermost first, and this robot's file."""
        above = self.holder.files if self.holder else ()
        return (*above, self.spec.spans.file)

    @property
    def all_processes(self) -> list[Process]:
        """The processes of the robot and its parts."""
        of_parts = (process for part in self.joined for process in part.robot.processes)
        return [*self.processes, *of_parts]

    @property
    def process_names(self) -> frozenset[str]:
        """The names of all processes."""
        return frozenset(process.name for process in self.all_processes)
