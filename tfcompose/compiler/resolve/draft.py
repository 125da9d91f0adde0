"""A robot during resolution: the file's contents, and the results of the passes so far.

A pass is a function of one draft that yields findings. It reads the results of earlier passes and
fills in its own. A helper that also returns a value does both: ``value = yield from helper(…)``.
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
    """Data collected from all parts of a robot and their parts."""

    count: int = 0
    #: The comments in the parts' files that silence findings.
    allows: list[Allow] = field(default_factory=list)
    #: A note for each use of a file as a part, by file. It names the part.
    notes: dict[str, list[Note]] = field(default_factory=dict)
    #: The sources of the robot files among the parts.
    sources: list[Source] = field(default_factory=list)


@dataclass(slots=True)
class Draft:
    """One robot during resolution."""

    validated: Validated
    library: Library
    #: Return the text of a file. None: no file can be read.
    read: Callable[[str], str] | None
    #: None: meshes and packages are not looked up.
    disk: Disk | None
    #: Collected by the outermost robot from its parts and their parts.
    collected: Collected
    #: The robot that includes this one as a part.
    holder: Draft | None = None
    #: Search paths of packages for its files.
    packages: Packages = field(init=False)
    #: The entries (section, name) that were refused, and names that parts would have brought.
    broken: set[tuple[str, str]] = field(init=False)
    #: The processes that this file adds, without those of parts.
    processes: list[Process] = field(default_factory=list)
    joined: list[Joined] = field(default_factory=list)
    frames: dict[str, Span] = field(default_factory=dict)
    joints: dict[str, Span] = field(default_factory=dict)
    #: Poses are as written until ``solve_poses`` has run.
    edges: list[Edge] = field(default_factory=list)
    #: The keys of the edges that this file writes, by index.
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
        """The user's file, with the places of its values."""
        return self.validated.spec

    @property
    def files(self) -> tuple[str, ...]:
        """The files of the robots that include this one, outermost first, then its own."""
        above = self.holder.files if self.holder else ()
        return (*above, self.spec.spans.file)

    @property
    def all_processes(self) -> list[Process]:
        """The processes of the robot and of its parts."""
        of_parts = (process for part in self.joined for process in part.robot.processes)
        return [*self.processes, *of_parts]

    @property
    def process_names(self) -> frozenset[str]:
        """The names of all processes."""
        return frozenset(process.name for process in self.all_processes)
