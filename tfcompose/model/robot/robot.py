"""A robot, its parts and sensors, and the numbers in its files."""

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

#: Endings of names of optical frames: REP-103's suffix, the spelling of newer ZED wrappers, the
#: suffix for a link, and a short suffix.
OPTICAL_ENDINGS = ("_optical_frame", "_frame_optical", "_optical_link", "_optical")


def is_optical(frame: str) -> bool:
    """Return whether the frame's name implies that z is its viewing direction."""
    return frame.endswith(OPTICAL_ENDINGS)


@dataclass(frozen=True, slots=True)
class SensorTopic:
    """A topic that a sensor's driver publishes by default."""

    #: The name that the driver uses: relative to the namespace, or to the node if it begins with
    #: ``~/``.
    name: str
    #: The type as in the ROS graph: ``sensor_msgs/msg/Imu``.
    type: str
    #: The frame in the headers of its messages.
    frame: str


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor as the rules see it: its frames and its driver."""

    name: str
    preset: str
    kind: str
    span: Span
    mount: str
    frames: tuple[str, ...] = ()
    driver_frames: tuple[str, ...] = ()
    #: The process of its driver; empty without one.
    driver: str = ""
    #: Parameters that stop the driver from publishing frames, None if there are none.
    switch: dict[str, Any] | None = None
    #: Whether the driver may publish frames.
    publishes: bool = False
    #: Edges outside the sensor that the driver publishes by default and does not own, with the
    #: parameters that stop it.
    claims: dict[str, dict[str, Any]] = field(default_factory=dict)
    #: Whether the driver publishes frames by default.
    by_default: bool = True
    #: The preset's option for a serial number; empty if it has none.
    serial_option: str = ""
    serial: str | None = None
    tf_at: Span | None = None
    #: The field of view of each stream, if known.
    optics: tuple[Optics, ...] = ()
    #: Topics that its driver publishes, if the preset lists them.
    topics: tuple[SensorTopic, ...] = ()


@dataclass(frozen=True, slots=True)
class Zone:
    """A box that sensors must see."""

    name: str
    span: Span
    #: The frame of ``center`` and ``size``.
    frame: str
    #: Centre in metres.
    center: Vector
    #: Lengths along the axes, in metres.
    size: Vector
    #: Kinds of streams, or sensors, at least one of which must see each point.
    by: tuple[str, ...] = ()
    #: The fraction of the box that must be seen.
    least: float = 1.0


@dataclass(frozen=True, slots=True)
class SourceNumbers:
    """The numbers of a pose or a limit in the source file, in SI units, with their spans."""

    #: The path of the value: ``sensors``, ``camera``, ``rpy``.
    path: tuple[str | int, ...]
    numbers: tuple[float, ...]
    #: Whether each number has a unit in the file.
    with_unit: tuple[bool, ...]
    #: Returns the span of the number with this index.
    locate: Callable[[int], Span] = field(compare=False, repr=False)
    #: The entry's name in the complete robot, if the file belongs to a part.
    in_part: str = ""
    #: Keys or indices of the numbers, if known.
    steps: tuple[str | int, ...] = ()

    @property
    def key(self) -> str:
        """The value's key: ``xyz``, ``rpy``, ``look``, …."""
        return str(self.path[-1])

    @property
    def entry(self) -> str:
        """The name of the entry with the value, in its file.

        A frame, link, joint, sensor or process.
        """
        return str(self.path[1])

    @property
    def name(self) -> str:
        """The entry's name in the robot."""
        return self.in_part or self.entry


@dataclass(frozen=True, slots=True)
class Section:
    """A tool's section of the robot file, validated with its model."""

    name: str
    value: Any
    #: Returns the span of a path in the section.
    locate: Callable[[tuple[str | int, ...]], Span] = field(compare=False, repr=False)
    #: The section as JSON data, None if the plan does not contain it.
    planned: Any = None

    def span_of(self, *path: str | int) -> Span:
        """Return the span of a value in the section, or of the nearest enclosing value."""
        return self.locate((self.name, *path))


@dataclass(frozen=True, slots=True)
class Part:
    """A part that is a separate robot, with its own publishers and description."""

    name: str
    #: Prefix of the part's frames and joints in the including robot.
    prefix: str
    #: The part with the names in its own file.
    robot: Robot


def may_be_refused(name: str, broken: frozenset[tuple[str, str]], declared: Iterable[str]) -> bool:
    """Return whether a rejected entry (section, name) may have defined a name.

    A rejected part without a prefix may have defined any name. But a name that differs by a typing
    error from a declared name is still wrong.
    """
    if ("parts", "") in broken:
        declared = tuple(declared)
        return name in declared or slip_of(name, declared) is None
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


@lru_cache(maxsize=8)  # lookups of a robot's names use the same entries
def _names_refused_entries(
    broken: frozenset[tuple[str, str]],
) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return the names that rejected entries would have defined, and prefixes of further names."""
    beginnings = [f"{entry}_" for section, entry in broken if section == "sensors"]
    beginnings += [entry for section, entry in broken if section == "parts"]
    return frozenset(entry for _, entry in broken), tuple(beginnings)


@dataclass(frozen=True, slots=True)
class Robot:
    """A resolved robot."""

    name: str
    file: str
    #: Every declared frame, with its span.
    frames: dict[str, Span]
    edges: tuple[Edge, ...]
    links: dict[str, Link]
    processes: tuple[Process, ...]
    #: The root of the URDF, None if the tree has no single root.
    base: str | None
    #: The frame on the floor; None: no frame is declared there.
    ground: str | None = None
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
    #: Rejected entries, as (section, name); for a rejected part, the prefix of its names.
    broken: frozenset[tuple[str, str]] = frozenset()
    claims: tuple[Claim, ...] = ()
    #: Parts that are separate robots.
    parts: tuple[Part, ...] = ()
    #: The root frame of each part, by its name.
    mounted: dict[str, str] = field(default_factory=dict, compare=False)
    hardware: tuple[Hardware, ...] = ()
    blocks: tuple[Block, ...] = ()
    #: Files of other tools, for which tfcompose offers no edits.
    foreign: frozenset[str] = field(default=frozenset(), compare=False)
    #: Spans of refused entries of the file.
    refused: tuple[Span, ...] = field(default=(), compare=False)
    #: Notes for findings in a part's file.
    part_notes: dict[str, list[Note]] = field(default_factory=dict, compare=False)
    #: Whether profiles or overlays are merged over the file.
    is_variant: bool = field(default=False, compare=False)
    #: The names of the merged profiles, in order.
    profiles: tuple[str, ...] = field(default=(), compare=False)
    #: The merged overlays' files, and settings as ``--set PATH=VALUE``, in order.
    overlays: tuple[str, ...] = field(default=(), compare=False)
    #: Zones that sensors must see.
    zones: tuple[Zone, ...] = ()
    #: Limits of codes that the file sets instead of the defaults.
    limits: dict[str, float] = field(default_factory=dict, compare=False)
    #: Conditions that removed entries, by (section, name).
    conditions: dict[tuple[str, str], str] = field(default_factory=dict, compare=False)
    #: Computers that may run the robot and its parts; empty if not declared.
    hosts: dict[str, Host] = field(default_factory=dict)
    #: Sections of tools, by name.
    sections: dict[str, Section] = field(default_factory=dict, compare=False, repr=False)

    def final(self, frame: str) -> str:
        """Return the frame's name on /tf: with the prefix, unless the frame is shared."""
        return frame if frame in self.ros.shared_frames else f"{self.ros.frame_prefix}{frame}"

    def with_final_names(self) -> Robot:
        """Return the robot with the frame names as on /tf.

        A URDF has plain names, and RViz adds the prefix.
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
            ground=self.ground and final(self.ground),
            claims=tuple(
                replace(claim, parent=final(claim.parent), child=final(claim.child))
                for claim in self.claims
            ),
            guard=replace(self.guard, allow=allow),
        )

    def tolerates(self, name: str) -> bool:
        """Return whether a frame, process or joint may be missing because of a rejected entry."""
        return may_be_refused(
            name, self.broken, chain(self.frames, (process.name for process in self.processes))
        )

    def is_foreign(self, span: Span | None) -> bool:
        """Return whether the span is in a URDF or in output of xacro.

        Advice about such a place refers to XML.
        """
        return span is not None and span.file in self.foreign

    def parent_edge(self, child: str) -> Edge | None:
        """Return the first edge whose child is the frame, None for a root."""
        return next((edge for edge in self.edges if edge.child == child), None)

    def roots(self) -> list[str]:
        """Return the declared frames that are no child of an edge, in order of declaration."""
        children = {edge.child for edge in self.edges}
        return [frame for frame in self.frames if frame not in children]

    def children(self) -> dict[str, list[Edge]]:
        """Return the edges of each parent, in order of declaration."""
        table: dict[str, list[Edge]] = {}
        for edge in self.edges:
            table.setdefault(edge.parent, []).append(edge)
        return table

    def described_frames(self) -> set[str]:
        """Return the frames that a URDF can contain.

        These are the base, and all frames below it through edges with known poses.
        """
        edges = [(edge.parent, edge.child) for edge in self.edges if edge.pose_known]
        return below(children_of(edges), self.base) if self.base is not None else set()

    def below(self, frame: str) -> set[str]:
        """Return the frame and every frame below it, through edges of any owner."""
        return below(children_of((edge.parent, edge.child) for edge in self.edges), frame)
