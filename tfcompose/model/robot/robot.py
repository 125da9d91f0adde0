"""A robot, its parts and sensors, and the numbers as they were written."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import slip_of
from tfcompose.foundation.tree import below, children_of
from tfcompose.model.plan import EdgePattern, GuardPolicy, RosSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from tfcompose.foundation.findings import Note, Span
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.plan import ParameterValue
    from tfcompose.model.robot.body import Link
    from tfcompose.model.robot.edge import Edge
    from tfcompose.model.robot.hardware import Block, Hardware
    from tfcompose.model.robot.optics import Optics
    from tfcompose.model.robot.process import Claim, Host, Process

#: How names of optical frames end: REP-103's suffix, the spelling of newer ZED wrappers, a link's,
#: and a short one.
OPTICAL_ENDINGS = ("_optical_frame", "_frame_optical", "_optical_link", "_optical")


def is_optical(frame: str) -> bool:
    """Return whether the frame's name says that z is its viewing direction."""
    return frame.endswith(OPTICAL_ENDINGS)


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor as the rules see it: the frames that it brings, and its driver.

    ``driver`` is the name of the driver's process, empty without one; ``switch`` holds the
    parameters that keep the driver from publishing frames (None: there are none), ``publishes``
    says that it may, ``by_default`` that it does where no parameter says so. ``claims`` are the
    edges outside the sensor that it publishes by default and does not own, each with the
    parameters that keep it from that. ``serial_option`` is the preset's option for a serial
    number, empty where it has none. ``optics`` says what each of its streams sees, as far as that
    is known.
    """

    name: str
    preset: str
    kind: str
    span: Span
    mount: str
    frames: tuple[str, ...] = ()
    driver_frames: tuple[str, ...] = ()
    driver: str = ""
    switch: dict[str, Any] | None = None
    publishes: bool = False
    claims: dict[str, dict[str, Any]] = field(default_factory=dict)
    by_default: bool = True
    serial_option: str = ""
    serial: str | None = None
    tf_at: Span | None = None
    optics: tuple[Optics, ...] = ()


@dataclass(frozen=True, slots=True)
class Zone:
    """A box that sensors have to see: its middle and lengths in ``frame``, in metres.

    ``by`` names kinds of streams, or sensors, of which one has to see it; ``least`` is the part
    that must be seen.
    """

    name: str
    span: Span
    frame: str
    center: Vector
    size: Vector
    by: tuple[str, ...] = ()
    least: float = 1.0


@dataclass(frozen=True, slots=True)
class SourceNumbers:
    """The numbers of a pose or limit as in the source file, in SI, with their places.

    ``path`` leads to the value (``sensors``, ``camera``, ``rpy``); ``with_unit`` says of each
    number whether it stands there with a unit, and ``locate`` where the number of an index stands.
    ``in_part`` is the entry's name in the whole robot where the file is that of a part. ``steps``
    are the keys or indices of the numbers, as far as they are known.
    """

    path: tuple[str | int, ...]
    numbers: tuple[float, ...]
    with_unit: tuple[bool, ...]
    locate: Callable[[int], Span] = field(compare=False, repr=False)
    in_part: str = ""
    steps: tuple[str | int, ...] = ()

    @property
    def key(self) -> str:
        """The value's key: ``xyz``, ``rpy``, ``look``, …."""
        return str(self.path[-1])

    @property
    def entry(self) -> str:
        """The name in its file of the frame, link, joint, sensor or process of the value."""
        return str(self.path[1])

    @property
    def name(self) -> str:
        """The entry's name in the robot."""
        return self.in_part or self.entry


@dataclass(frozen=True, slots=True)
class Section:
    """A tool's section of the robot file.

    What it says, as its model has it, and where that stands. ``planned`` is the same as JSON, None
    where the plan does not have it.
    """

    name: str
    value: Any
    locate: Callable[[tuple[str | int, ...]], Span] = field(compare=False, repr=False)
    planned: Any = None

    def span_of(self, *path: str | int) -> Span:
        """Return the place of a value in the section, or of the nearest around it."""
        return self.locate((self.name, *path))


@dataclass(frozen=True, slots=True)
class Part:
    """A part that is a robot beside others, with its own publishers and description.

    ``robot`` has the names of the part's own file; in the robot that holds it, frames and joints
    have ``prefix`` too.
    """

    name: str
    prefix: str
    robot: Robot


def may_be_refused(name: str, broken: frozenset[tuple[str, str]], known: Iterable[str]) -> bool:
    """Return whether a refused entry (section, name) would have brought a name.

    A part without a prefix may have brought any name; one that is a letter off the ``known`` ones
    is wrong still.
    """
    if ("parts", "") in broken:
        known = tuple(known)
        return name in known or slip_of(name, known) is None
    names, beginnings = _names_refused_entries(broken)
    return name in names or name.startswith(beginnings)


def advise_left_out(conditions: Mapping[tuple[str, str], str], name: str) -> str:
    """Return advice about a name whose entry a condition removes; empty otherwise."""
    for entry, condition in conditions.items():
        names, beginnings = _names_refused_entries(frozenset({entry}))
        if name in names or name.startswith(beginnings):
            return (
                f"{entry[1]} is left out by its when: {condition}; give this entry the same when"
            )
    return ""


@lru_cache(maxsize=8)  # a robot's names are looked up in the same entries
def _names_refused_entries(
    broken: frozenset[tuple[str, str]],
) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return the names that refused entries would have brought, and prefixes of more."""
    beginnings = [f"{entry}_" for section, entry in broken if section == "sensors"]
    beginnings += [entry for section, entry in broken if section == "parts"]
    return frozenset(entry for _, entry in broken), tuple(beginnings)


@dataclass(frozen=True, slots=True)
class Robot:
    """One robot, resolved.

    ``frames`` holds every frame that was declared, with its place; ``base`` is where the URDF
    begins, or None where the tree has no single root; ``sensors`` are those with a known preset,
    ``source_numbers`` the numbers of poses and limits before they became poses, ``unused`` the
    paths of variables and arguments that nothing uses; ``args`` and ``environment`` are the values
    that it was built with; ``source_data`` is the plain data that the robot was made from,
    profiles laid over it; ``broken`` holds the entries (section, name) that were refused already,
    of a part how its names begin; ``refused`` is where the refused entries of the file are.
    ``parts`` are those that are robots of their own, ``mounted`` the root frame of each part by
    its name, ``part_notes`` what to add to findings in a part's file. ``foreign`` are files of
    other tools, in which nothing can be fixed here. A robot that ``is_variant`` is a file's with
    profiles or overlays merged over it. ``zones`` are those that sensors have to see, ``limits``
    what the file sets instead of the limits of codes, ``conditions`` those of the entries that
    they leave out, by (section, name). ``hosts`` are the computers that it may run on, its parts'
    among them; empty: not declared. ``sections`` are those of tools, by name.
    """

    name: str
    file: str
    frames: dict[str, Span]
    edges: tuple[Edge, ...]
    links: dict[str, Link]
    processes: tuple[Process, ...]
    base: str | None
    ros: RosSettings = field(default_factory=RosSettings)
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    sensors: tuple[MountedSensor, ...] = ()
    source_numbers: tuple[SourceNumbers, ...] = field(default=(), compare=False, repr=False)
    unused: dict[tuple[str, str], Span] = field(default_factory=dict, compare=False)
    args: dict[str, ParameterValue] = field(default_factory=dict, compare=False)
    environment: dict[str, str] = field(default_factory=dict, compare=False)
    source_data: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)
    broken: frozenset[tuple[str, str]] = frozenset()
    claims: tuple[Claim, ...] = ()
    parts: tuple[Part, ...] = ()
    mounted: dict[str, str] = field(default_factory=dict, compare=False)
    hardware: tuple[Hardware, ...] = ()
    blocks: tuple[Block, ...] = ()
    foreign: frozenset[str] = field(default=frozenset(), compare=False)
    refused: tuple[Span, ...] = field(default=(), compare=False)
    part_notes: dict[str, list[Note]] = field(default_factory=dict, compare=False)
    is_variant: bool = field(default=False, compare=False)
    zones: tuple[Zone, ...] = ()
    limits: dict[str, float] = field(default_factory=dict, compare=False)
    conditions: dict[tuple[str, str], str] = field(default_factory=dict, compare=False)
    hosts: dict[str, Host] = field(default_factory=dict)
    sections: dict[str, Section] = field(default_factory=dict, compare=False, repr=False)

    def final(self, frame: str) -> str:
        """Return the frame's name on the live tree: with the prefix, unless it is shared."""
        return frame if frame in self.ros.shared_frames else f"{self.ros.frame_prefix}{frame}"

    def with_final_names(self) -> Robot:
        """Return the robot with every frame named as on the live tree.

        URDF keeps plain names; RViz adds the prefix.
        """
        if not self.ros.frame_prefix:
            return self
        final = self.final
        finals = {name: final(name) for name in self.frames}
        allow = tuple(
            EdgePattern(*(finals.get(name, name) for name in (pattern.parent, pattern.child)))
            for pattern in self.guard.allow
        )
        return replace(
            self,
            frames={final(frame): span for frame, span in self.frames.items()},
            edges=tuple(
                replace(
                    edge,
                    parent=final(edge.parent),
                    child=final(edge.child),
                    switched=tuple(final(parent) for parent in edge.switched),
                )
                for edge in self.edges
            ),
            base=self.base and final(self.base),
            claims=tuple(
                replace(claim, parent=final(claim.parent), child=final(claim.child))
                for claim in self.claims
            ),
            guard=replace(self.guard, allow=allow),
        )

    def excuses(self, name: str) -> bool:
        """Return whether a frame, process or joint may be missing because of a refused entry."""
        return may_be_refused(
            name, self.broken, chain(self.frames, (process.name for process in self.processes))
        )

    def is_foreign(self, span: Span | None) -> bool:
        """Return whether the place is in a URDF, or what xacro made.

        Advice speaks of XML there.
        """
        return span is not None and span.file in self.foreign

    def parent_edge(self, child: str) -> Edge | None:
        """Return the first edge whose child is the frame, or None for a root."""
        return next((edge for edge in self.edges if edge.child == child), None)

    def roots(self) -> list[str]:
        """Return the declared frames that are no edge's child, in declaration order."""
        children = {edge.child for edge in self.edges}
        return [frame for frame in self.frames if frame not in children]

    def children(self) -> dict[str, list[Edge]]:
        """Return the edges of each parent, in the order of declaration."""
        table: dict[str, list[Edge]] = {}
        for edge in self.edges:
            table.setdefault(edge.parent, []).append(edge)
        return table

    def described_frames(self) -> set[str]:
        """Return the frames that a URDF can hold.

        The base, and what is below it over edges of known pose.
        """
        known = [(edge.parent, edge.child) for edge in self.edges if edge.pose_known]
        return below(children_of(known), self.base) if self.base is not None else set()

    def below(self, frame: str) -> set[str]:
        """Return the frame and every frame that hangs below it, over edges of any owner."""
        return below(children_of((edge.parent, edge.child) for edge in self.edges), frame)
