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
class SensorTopic:
    """A topic that a sensor's driver publishes by default."""

    #: As its driver names it: relative to the namespace, or to the node if it begins with ``~/``.
    name: str
    #: As in the graph: ``sensor_msgs/msg/Imu``.
    type: str
    #: The frame in its headers.
    frame: str


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor as the rules see it: the frames that it brings, and its driver."""

    name: str
    preset: str
    kind: str
    span: Span
    mount: str
    frames: tuple[str, ...] = ()
    driver_frames: tuple[str, ...] = ()
    #: The process of its driver; empty without one.
    driver: str = ""
    #: Parameters that keep the driver from publishing frames; None: there are none.
    switch: dict[str, Any] | None = None
    #: Whether the driver may publish frames.
    publishes: bool = False
    #: Edges outside the sensor that the driver publishes by default and does not own, each with
    #: the parameters that prevent it.
    claims: dict[str, dict[str, Any]] = field(default_factory=dict)
    #: Whether it does so if no parameter says otherwise.
    by_default: bool = True
    #: The preset's option for a serial number; empty if it has none.
    serial_option: str = ""
    serial: str | None = None
    tf_at: Span | None = None
    #: The field of view of each stream, as far as it is known.
    optics: tuple[Optics, ...] = ()
    #: What its driver publishes, as far as the preset knows.
    topics: tuple[SensorTopic, ...] = ()


@dataclass(frozen=True, slots=True)
class Zone:
    """A box that sensors have to see."""

    name: str
    span: Span
    #: The frame of ``center`` and ``size``.
    frame: str
    #: In metres.
    center: Vector
    #: Lengths along the axes, in metres.
    size: Vector
    #: Kinds of streams, or sensors, one of which has to see it.
    by: tuple[str, ...] = ()
    #: The share that must be seen.
    least: float = 1.0


@dataclass(frozen=True, slots=True)
class SourceNumbers:
    """The numbers of a pose or limit from the source file, in SI units, with their spans."""

    #: The path of the value: ``sensors``, ``camera``, ``rpy``.
    path: tuple[str | int, ...]
    numbers: tuple[float, ...]
    #: For each number, whether the file gives a unit.
    with_unit: tuple[bool, ...]
    #: Returns the span of the number with this index.
    locate: Callable[[int], Span] = field(compare=False, repr=False)
    #: The entry's name in the complete robot, if the file is a part's.
    in_part: str = ""
    #: Keys or indices of the numbers, as far as they are known.
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
    """A tool's section of the robot file, as its model has it."""

    name: str
    value: Any
    #: Returns the span of a path in the section.
    locate: Callable[[tuple[str | int, ...]], Span] = field(compare=False, repr=False)
    #: The section as JSON; None: it is not in the plan.
    planned: Any = None

    def span_of(self, *path: str | int) -> Span:
        """Return the place of a value in the section, or of the nearest around it."""
        return self.locate((self.name, *path))


@dataclass(frozen=True, slots=True)
class Part:
    """A part that is a robot beside others, with its own publishers and description."""

    name: str
    #: What the frames and joints of the part begin with in the robot that holds it.
    prefix: str
    #: The part, with the names of its own file.
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
    """One robot, resolved."""

    name: str
    file: str
    #: Every declared frame, with its span.
    frames: dict[str, Span]
    edges: tuple[Edge, ...]
    links: dict[str, Link]
    processes: tuple[Process, ...]
    #: The root of the URDF; None: the tree has no single root.
    base: str | None
    ros: RosSettings = field(default_factory=RosSettings)
    guard: GuardPolicy = field(default_factory=GuardPolicy)
    #: Sensors with a known preset.
    sensors: tuple[MountedSensor, ...] = ()
    #: The numbers of poses and limits before they became poses.
    source_numbers: tuple[SourceNumbers, ...] = field(default=(), compare=False, repr=False)
    #: Variables and arguments that nothing uses, by (section, name).
    unused: dict[tuple[str, str], Span] = field(default_factory=dict, compare=False)
    #: The arguments that it was built with.
    args: dict[str, ParameterValue] = field(default_factory=dict, compare=False)
    #: The environment variables that it was built with.
    environment: dict[str, str] = field(default_factory=dict, compare=False)
    #: The plain data that the robot was made from, with profiles merged.
    source_data: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)
    #: Entries (section, name) that were refused; for a part, the beginning of its names.
    broken: frozenset[tuple[str, str]] = frozenset()
    claims: tuple[Claim, ...] = ()
    #: Parts that are robots of their own.
    parts: tuple[Part, ...] = ()
    #: The root frame of each part, by its name.
    mounted: dict[str, str] = field(default_factory=dict, compare=False)
    hardware: tuple[Hardware, ...] = ()
    blocks: tuple[Block, ...] = ()
    #: Files of other tools, in which nothing can be fixed here.
    foreign: frozenset[str] = field(default=frozenset(), compare=False)
    #: Spans of refused entries of the file.
    refused: tuple[Span, ...] = field(default=(), compare=False)
    #: Notes for findings in a part's file.
    part_notes: dict[str, list[Note]] = field(default_factory=dict, compare=False)
    #: Whether profiles or overlays are merged over the file.
    is_variant: bool = field(default=False, compare=False)
    #: The names of the merged profiles, in order.
    profiles: tuple[str, ...] = field(default=(), compare=False)
    #: Zones that sensors have to see.
    zones: tuple[Zone, ...] = ()
    #: The file's limits of codes, instead of the defaults.
    limits: dict[str, float] = field(default_factory=dict, compare=False)
    #: Conditions that left entries out, by (section, name).
    conditions: dict[tuple[str, str], str] = field(default_factory=dict, compare=False)
    #: The computers that it may run on, including its parts'; empty: not declared.
    hosts: dict[str, Host] = field(default_factory=dict)
    #: Sections of tools, by name.
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
