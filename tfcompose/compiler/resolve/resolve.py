"""From what the user wrote to a robot in which every name, pose and owner is decided.

What only some robots have is loaded for those: parts, calibrations,
parameter files, raw URDF, claims, and a stock robot_state_publisher.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial, reduce
from operator import or_
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.bodies import Bodies, with_colours
from tfcompose.compiler.resolve.containers import (
    component_findings,
    component_process,
    container_process,
)
from tfcompose.compiler.resolve.edges import Drafts, source_numbers
from tfcompose.compiler.resolve.hosts import hosts_of, with_host_place
from tfcompose.compiler.resolve.isolation import isolate, settings_of
from tfcompose.compiler.resolve.middleware import (
    is_own_router,
    own_router,
    with_router,
    wrong_middleware,
)
from tfcompose.compiler.resolve.poses import Solver
from tfcompose.compiler.resolve.presets import sensor_of
from tfcompose.compiler.resolve.processes import (
    built_in,
    built_in_keys,
    has_claims,
    idle_keys,
    name_clashes,
    unknown_names,
    unnamed_nodes,
    unreached,
    user_process,
    with_positions,
)
from tfcompose.compiler.resolve.resolved import Collected, Resolved
from tfcompose.compiler.resolve.rules import limits_of, zones_of
from tfcompose.compiler.resolve.sensors import add_sensor
from tfcompose.compiler.resolve.tool_sections import (
    ToolSection,
    as_sections,
    check_sections,
    processes_of,
    sections_of,
)
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.findings import Finding, did_you_mean, finding
from tfcompose.model.robot import Edge, Process, Robot, may_be_refused
from tfcompose.spec.load import path_named

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.compiler.resolve.part import Joined
    from tfcompose.compiler.resolve.parts import Parts
    from tfcompose.compiler.resolve.poses import Draft
    from tfcompose.compiler.resolve.presets import Library
    from tfcompose.compiler.urdf.packages import Disk
    from tfcompose.model.plan import GuardPolicy
    from tfcompose.model.robot.hardware import Block
    from tfcompose.spec.language import Validated
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path, Source


def resolve(
    validated: Validated,
    library: Library,
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
    holder: Parts | None = None,
) -> Resolved:
    """Return the robot with presets expanded, parts joined, poses solved and owners given.

    ``read`` gives the text of a calibration or a part; without ``disk`` no mesh and no package is
    looked for. ``holder`` is what resolves the robot as a part.
    """
    return _Work(validated, library, read, disk, holder).resolved()


@dataclass(slots=True)
class _Work:
    """A robot while it is resolved: what was found, and which entries were refused already."""

    validated: Validated
    library: Library
    read: Callable[[str], str] | None
    disk: Disk | None
    holder: Parts | None
    found: list[Finding] = field(default_factory=list)
    of_parts: list[Finding] = field(default_factory=list)
    broken: set[tuple[str, str]] = field(default_factory=set)
    collected: Collected = field(default_factory=Collected)
    joined: list[Joined] = field(default_factory=list)
    sections: list[ToolSection] = field(default_factory=list)

    @property
    def spec(self) -> RobotSpec:
        return self.validated.spec

    @property
    def source(self) -> Source:
        return self.validated.source

    def resolved(self) -> Resolved:
        """Return the robot and what was found; each step knows what the ones before it refused."""
        self.broken.update(self.validated.broken)
        if self.holder is None:
            self.sections = sections_of(self.spec, self.read)
        of_tools = processes_of(self.sections, self.found)
        own = _processes(self.validated, self.found, of_tools, is_part=self.holder is not None)
        started = {process.name for process in own}
        self.broken |= {("processes", name) for name in self.spec.processes if name not in started}
        packages = self._packages()
        self._join_parts(packages)
        bodies = Bodies(self.spec, packages)
        simulated = frozenset(one.name for one in self._everybody(own) if one.kind == "simulate")
        drafts = Drafts(self.validated, simulated, bodies)
        self._draft(drafts)
        names = (*drafts.frames, *(process.name for process in self._everybody(own)))
        excuses = partial(may_be_refused, broken=frozenset(self.broken), known=names)
        solver = Solver(
            self._measured(drafts),
            drafts.frames,
            self.validated.broken,
            excuses,
            self.validated.conditions,
        )
        edges = solver.solve()
        own = [with_host_place(process, self.spec) for process in (*own, *drafts.drivers)]
        self.found += [*drafts.found, *bodies.found, *solver.found, *self._wrong_names(own)]
        self.found += unnamed_nodes(edges, own, self.spec, self.broken)
        robot = self._take(
            with_positions(self._robot(drafts, edges, self._everybody(own)), self.spec)
        )
        if any(node.params for process in own for node in process.ros_nodes):
            from tfcompose.compiler.resolve.param_files import with_param_files

            own_names = frozenset(one.name for one in own)
            robot = self._take(with_param_files(robot, own_names, self.spec, self.read, packages))
        if self.spec.ros2_control or self.spec.xml:
            from tfcompose.compiler.resolve.blocks import with_blocks

            robot = self._take(with_blocks(robot, self.spec))
        robot = replace(robot, base=self._base(robot))
        if self.spec.ros.state_publisher == "stock":
            from tfcompose.compiler.resolve.stock import with_stock

            robot = self._take(with_stock(robot))
        robot = self._take(isolate(robot, self.spec, self.disk))
        if has_claims(self.spec):
            from tfcompose.compiler.resolve.claims import settled

            robot = self._take(settled(robot, self.spec))
        self.found += [one for process in robot.processes for one in unreached(process, self.spec)]
        self.found += self._wrong_components(robot)
        if self.holder is None:
            self.found += wrong_middleware(robot, self.spec)
            self.found += check_sections(self.sections, robot)
            robot = with_router(robot)
        return Resolved(robot, (*self.of_parts, *self.found), self.collected)

    def _wrong_components(self, robot: Robot) -> Iterator[Finding]:
        for process in robot.processes:
            section: Path = ("processes", process.name)
            path = (
                section
                if process.name in self.spec.processes
                else ("sensors", process.name, "driver")
            )
            yield from component_findings(path, process, self.validated)

    def _take(self, done: tuple[Robot, list[Finding]]) -> Robot:
        robot, found = done
        self.found += found
        return robot

    def _packages(self) -> Packages:
        places = {
            name: (folder, self.spec.at(("packages", name)))
            for name, folder in self.spec.packages.items()
        }
        return Packages(self.disk, places)

    def _join_parts(self, packages: Packages) -> None:
        """Resolve the parts, and note what was refused in them."""
        if not self.spec.parts:
            return
        from tfcompose.compiler.resolve.parts import Parts

        files, environment = (self.spec.spans.file,), self.validated.given.environment
        parts = self.holder or Parts(
            self.library,
            self.read,
            self.disk,
            resolve=resolve,
            environment=environment,
            files=files,
            collected=self.collected,
        )
        self.joined = parts.join(self.validated, settings_of(self.spec.ros).frame_prefix, packages)
        self.of_parts = parts.found
        self.broken |= {
            *parts.missing,
            *(entry for part in self.joined for entry in part.robot.broken),
        }

    def _everybody(self, own: list[Process]) -> list[Process]:
        return [*own, *(process for part in self.joined for process in part.robot.processes)]

    def _draft(self, drafts: Drafts) -> None:
        """Take what every section says, and forget the entries that cannot be taken."""
        drafts.add_frames()
        drafts.add_links()
        drafts.add_joints()
        presets = self._presets()
        for name, declared in self.spec.sensors.items():
            sensor, refused = sensor_of(name, declared, presets, self.spec)
            self.found += refused
            if sensor:
                add_sensor(drafts, sensor)
            else:
                self.broken.add(("sensors", name))
        for part in [part for part in self.joined if not drafts.add_part(part)]:
            self.joined.remove(part)
            names = (*part.robot.frames, *(process.name for process in part.robot.processes))
            self.broken |= {("parts", name) for name in names}

    def _presets(self) -> Library:
        """Return the library with the user's folders before its own."""
        if not self.spec.preset_path:
            return self.library
        places = [
            self.spec.at(("preset_path", index)) for index in range(len(self.spec.preset_path))
        ]
        folders = [
            path_named(folder, at)
            for folder, at in zip(self.spec.preset_path, places, strict=True)
        ]
        self.found += [
            finding(
                "TF001",
                f"preset_path: no folder {folder}",
                at,
                help="make it; it holds VENDOR/MODEL.yaml",
            )
            for folder, at in zip(folders, places, strict=True)
            if not self.library.storage.is_folder(folder)
        ]
        return self.library.over(folders)

    def _measured(self, drafts: Drafts) -> list[Draft]:
        """Return the edges with the poses of calibrations."""
        if not _has_calibrations(self.spec):
            return drafts.edges
        from tfcompose.compiler.resolve.calibration import calibrated

        measured, refused = calibrated(drafts.edges, drafts.frames, self.spec, self.read)
        self.found += refused
        return measured

    def _base(self, robot: Robot) -> str | None:
        """Return where the URDF begins: as said; base_link, or a fixed base_footprint above it.

        Else the only root.
        """
        base = self.spec.base
        if base is not None:
            if base in robot.frames:
                return base
            if not robot.excuses(base):
                advice = did_you_mean(base, robot.frames)
                self.found.append(
                    finding("TF203", f"unknown frame {base}", self.spec.at(("base",)), help=advice)
                )
            return None
        if "base_link" in robot.frames:
            above = robot.parent_edge("base_link")
            if above and above.kind == "static" and above.parent == "base_footprint":
                return "base_footprint"
            return "base_link"
        roots = robot.roots()
        return roots[0] if len(roots) == 1 else None

    def _limits(self) -> dict[str, float]:
        limits, refused = limits_of(self.spec)
        self.found += refused
        return limits

    def _wrong_names(self, own: list[Process]) -> list[Finding]:
        everybody = self._everybody(own)
        return [
            *name_clashes(everybody, self.spec),
            *idle_keys(self.spec),
            *unknown_names(
                own, self.spec, frozenset(process.name for process in everybody), self.broken
            ),
        ]

    def _robot(self, drafts: Drafts, edges: tuple[Edge, ...], everybody: list[Process]) -> Robot:
        parts = [part.robot for part in self.joined]
        in_tree = [part.robot for part in self.joined if not part.declared.is_alone]
        numbers = source_numbers(self.spec)
        return Robot(
            name=self.spec.robot,
            file=self.spec.spans.file,
            frames=drafts.frames,
            edges=_with_rates(edges, everybody),
            links=with_colours(drafts.links),
            processes=tuple(everybody),
            base=None,
            ros=settings_of(self.spec.ros),
            guard=_guard(self.spec.guard, parts),
            sensors=tuple(drafts.sensors),
            claims=tuple(one for part in parts for one in part.claims),
            source_numbers=numbers + tuple(one for part in parts for one in part.source_numbers),
            unused={path: self.spec.at_key(path) for path in self.validated.unused},
            args=self.validated.args,
            environment=reduce(
                or_, (part.environment for part in parts), self.validated.environment
            ),
            source_data=_source_data(self.validated, self.joined),
            broken=frozenset(self.broken),
            parts=tuple(alone for part in parts for alone in part.parts),
            mounted={part.name: part.root for part in self.joined if part.root is not None},
            hardware=tuple(one for part in in_tree for one in part.hardware),
            blocks=_blocks(in_tree),
            foreign=frozenset(file for part in parts for file in part.foreign),
            refused=tuple(
                at
                for entry in sorted(self.validated.broken)
                if (at := self.spec.spans.exactly_at(entry))
            ),
            part_notes=self.collected.notes,
            is_variant=self.spec.spans.is_variant,
            zones=zones_of(self.spec) + tuple(zone for part in in_tree for zone in part.zones),
            limits=self._limits(),
            conditions=self.validated.conditions,
            hosts=reduce(or_, (part.hosts for part in parts[::-1]), {}) | hosts_of(self.spec),
            sections=as_sections(self.sections),
        )


def _blocks(parts: list[Robot]) -> tuple[Block, ...]:
    """Return the parts' raw blocks, and once what names nothing of its part.

    The plugin of a simulator.
    """
    blocks: list[Block] = []
    for part in parts:
        there = {block.text for block in blocks}
        blocks += [block for block in part.blocks if block.text not in there]
    return tuple(blocks)


def _has_calibrations(spec: RobotSpec) -> bool:
    entries = (
        *spec.frames.values(),
        *spec.links.values(),
        *spec.sensors.values(),
        *spec.parts.values(),
    )
    return bool(spec.calibrations) or any(entry.calibration for entry in entries)


def _processes(
    validated: Validated, found: list[Finding], of_tools: list[Process], *, is_part: bool
) -> list[Process]:
    processes = built_in(validated.spec)
    spec = validated.spec
    processes += [] if is_part else own_router(spec)
    processes += of_tools
    processes += [
        container_process(name, declared, validated) for name, declared in spec.containers.items()
    ]
    names = {process.name for process in of_tools}
    for name, declared in spec.processes.items():
        if is_own_router(name, declared, spec) or name in names:
            found += built_in_keys(name, declared, validated.spec)
            continue
        process, refused = user_process(name, declared, validated)
        found += refused
        if process and process.kind == "component":
            process = component_process(process, declared, spec)
        if process:
            processes.append(process)
    return processes


def _source_data(validated: Validated, joined: list[Joined]) -> dict[str, Any]:
    """Return what the robot was made from, with what its parts were made from."""
    parts = {part.name: part.robot.source_data for part in joined}
    return validated.source_data | ({"in parts": parts} if parts else {})


def _guard(declared: GuardPolicy, parts: list[Robot]) -> GuardPolicy:
    """Return the policy with what the parts allow."""
    more = (
        pattern for part in parts for pattern in part.guard.allow if pattern not in declared.allow
    )
    return replace(declared, allow=(*declared.allow, *more))


def _with_rates(edges: tuple[Edge, ...], processes: list[Process]) -> tuple[Edge, ...]:
    """Give moving edges without a rate their process's: that of ``joints``, or of the stand-in."""
    rates = {}
    for process in reversed(processes):
        rates[process.name] = process.simulate.rate if process.simulate else process.rate
    rated = []
    for edge in edges:
        has_none = edge.rate is None and edge.kind != "static"
        rate = rates.get(edge.owner) if has_none else edge.rate
        rated.append(replace(edge, rate=rate))
    return tuple(rated)
