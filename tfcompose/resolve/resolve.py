"""From what the user wrote to a robot in which every name, pose and owner is decided."""

from __future__ import annotations

import posixpath
from dataclasses import field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, did_you_mean, finding
from tfcompose.frozen import dataclass
from tfcompose.model import Edge, Process, Robot
from tfcompose.plan import GuardPolicy
from tfcompose.resolve.bodies import Bodies, with_colours
from tfcompose.resolve.built_in import built_in
from tfcompose.resolve.edges import Drafts
from tfcompose.resolve.filling import Filler
from tfcompose.resolve.isolation import isolate, settings_of
from tfcompose.resolve.nodes import has_claims
from tfcompose.resolve.packages import Packages
from tfcompose.resolve.poses import Solver
from tfcompose.resolve.presets import sensor_of
from tfcompose.resolve.processes import idle_rates, name_clashes, unknown_names, user_process
from tfcompose.resolve.sensors import add_sensor
from tfcompose.resolve.simulated import with_positions
from tfcompose.resolve.whole import Whole
from tfcompose.resolve.written import as_written

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.load import Source
    from tfcompose.resolve.library import Library
    from tfcompose.resolve.packages import Disk
    from tfcompose.resolve.part import Joined
    from tfcompose.resolve.parts import Parts
    from tfcompose.validate import Validated
    from tfcompose.validate.spec import RobotSpec


@dataclass(frozen=True, slots=True)
class Resolved:
    """The robot, right or wrong, and what was found while resolving it."""

    robot: Robot
    found: tuple[Diagnostic, ...]
    whole: Whole = field(default_factory=Whole)


def resolve(
    validated: Validated,
    library: Library,
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
    holder: Parts | None = None,
) -> Resolved:
    """Return the robot with presets expanded, parts joined, poses solved and owners given.

    ``read`` gives the text of a calibration or a part; without ``disk`` no mesh and no package is looked for.
    ``holder`` is what resolves the robot as a part.
    """
    spec, source = validated.spec, validated.source
    found: list[Diagnostic] = []
    broken = set(validated.broken)
    processes = _processes(spec, source, found)
    named = {name: (folder, source.at(("packages", name))) for name, folder in spec.packages.items()}
    packages = Packages(disk, named)
    joined: list[Joined] = []
    whole = Whole()
    if spec.parts:  # few robots have any, and what joins them is loaded only then
        files = (source.file,)
        parts = holder or import_module("tfcompose.resolve.parts").Parts(library, read, disk, resolve, files, whole)
        joined = parts.join(spec, source, settings_of(spec.ros).frame_prefix, packages)
        found += parts.found
        broken |= {*parts.missing, *(entry for part in joined for entry in part.robot.broken)}
    everybody = [*processes, *(process for part in joined for process in part.robot.processes)]
    bodies = Bodies(source, packages)
    drafts = Drafts(spec, source, frozenset(p.name for p in everybody if p.kind == "simulate"), bodies)
    drafts.add_frames()
    drafts.add_links()
    drafts.add_joints()
    presets = _with_path(library, spec, source, found)
    for name, said in spec.sensors.items():
        sensor, refused = sensor_of(name, said, presets, source)
        found += refused
        if sensor:
            add_sensor(drafts, sensor)
        else:
            broken.add(("sensors", name))
    for part in [part for part in joined if not drafts.add_part(part)]:
        joined.remove(part)
        broken |= {("parts", name) for name in (*part.robot.frames, *(p.name for p in part.robot.processes))}
    measured = drafts.edges
    if _has_calibrations(spec):  # few robots do, and what reads them is loaded only then
        calibrated = import_module("tfcompose.resolve.calibration").calibrated
        measured, refused = calibrated(drafts.edges, drafts.frames, spec, source, read)
        found += refused
    solver = Solver(measured, drafts.frames)
    edges = solver.solve()
    processes = [with_positions(process, spec, edges, source, found) for process in (*processes, *drafts.drivers)]
    everybody = [*processes, *(process for part in joined for process in part.robot.processes)]
    known = frozenset(name for _, name in broken) | {process.name for process in everybody}
    missing = tuple(name for section, name in broken if section == "parts")
    found += [
        *drafts.found,
        *bodies.found,
        *solver.found,
        *name_clashes(everybody, spec, source),
        *idle_rates(spec, source),
        *unknown_names(processes, source, known, missing),
    ]
    found = [one for one in found if not (one.code == "TF404" and broken)]  # an edge on the way may have been refused
    edges = _with_rates(edges, everybody)
    robot = Robot(
        name=spec.robot,
        file=source.file,
        frames=drafts.frames,
        edges=edges,
        links=with_colours(drafts.links),
        processes=tuple(everybody),
        base=None,
        ros=settings_of(spec.ros),
        guard=_guard(spec, joined),
        sensors=tuple(drafts.sensors),
        claims=tuple(one for part in joined for one in part.robot.claims),
        as_written=as_written(validated.data, source) + tuple(one for part in joined for one in part.robot.as_written),
        unused={name: source.at_key(("vars", name)) for name in validated.unused},
        written=_written(source, joined),
        broken=frozenset(broken),
        parts=tuple(alone for part in joined for alone in part.robot.parts),
        hardware=tuple(one for part in joined if not part.said.namespace for one in part.robot.hardware),
        blocks=tuple(one for part in joined if not part.said.namespace for one in part.robot.blocks),
    )
    if any(isinstance(node.params.get("file"), (str, list)) for process in processes for node in process.nodes):
        robot, refused = import_module("tfcompose.resolve.param_files").with_param_files(robot, source, read)
        found += refused
    return Resolved(_completed(robot, spec, source, disk, found), tuple(found), whole)


def _completed(robot: Robot, spec: RobotSpec, source: Source, disk: Disk | None, found: list[Diagnostic]) -> Robot:
    """Return the robot with what stands beside links and joints, its base, and its processes' topics and publishers."""
    if spec.ros2_control or spec.xml:
        robot, refused = _with_blocks(robot, spec, source)
        found += refused
    robot = replace(robot, base=_base(robot, spec, source, found))
    if spec.ros.state_publisher == "stock":
        robot, refused = import_module("tfcompose.resolve.stock").with_stock(robot)
        found += refused
    robot, refused = isolate(robot, spec.ros, source, disk)
    found += refused
    if has_claims(spec):  # what knows them is loaded only then
        robot, refused = import_module("tfcompose.resolve.claims").settled(robot, spec, source)
        found += refused
    filler = Filler(robot, source, disk)
    found += [one for process in robot.processes for one in filler.needless(process)]
    return robot


def _with_blocks(robot: Robot, spec: RobotSpec, source: Source) -> tuple[Robot, list[Diagnostic]]:
    """Return the robot with its hardware and raw blocks; what reads XML is loaded only here."""
    work = import_module("tfcompose.resolve.blocks")
    moving = [edge.joint.name for edge in robot.edges if edge.joint]
    hardware = work.hardware_of(spec.ros2_control, source)
    frames = [frame for frame in robot.frames if frame in robot.links or robot.parent_edge(frame)]
    joints = [edge.joint_name for edge in robot.edges if edge.joint_name]
    blocks, found = work.blocks_of(spec.xml, source, frames, joints)
    known = {*moving, *(name for section, name in robot.broken if section == "joints")}
    found += work.unknown_joints(hardware, known)
    return replace(robot, hardware=(*hardware, *robot.hardware), blocks=(*blocks, *robot.blocks)), found


def _with_path(library: Library, spec: RobotSpec, source: Source, found: list[Diagnostic]) -> Library:
    """Return the library with the user's folders before its own; a folder is relative to the file that names it."""
    if not spec.preset_path:
        return library
    places = [source.at(("preset_path", index)).file for index in range(len(spec.preset_path))]
    homes = ["" if file.startswith("--") else posixpath.dirname(file) for file in places]
    folders = [posixpath.join(home, folder) for home, folder in zip(homes, spec.preset_path, strict=True)]
    for index, folder in enumerate(folders):
        if not library.shelves.is_folder(folder):
            found.append(finding("TF001", f"preset_path: no folder {folder}", source.at(("preset_path", index))))
    return library.over(folders)


def _has_calibrations(spec: RobotSpec) -> bool:
    entries = (*spec.frames.values(), *spec.links.values(), *spec.sensors.values(), *spec.parts.values())
    return bool(spec.calibrations) or any(entry.calibration for entry in entries)


def _processes(spec: RobotSpec, source: Source, found: list[Diagnostic]) -> list[Process]:
    processes = built_in(spec, source)
    for name, said in spec.processes.items():
        process, refused = user_process(name, said, spec, source)
        found += refused
        if process:
            processes.append(process)
    return processes


def _written(source: Source, joined: list[Joined]) -> dict[str, Any]:
    """Return what the robot was made from, with what its parts were made from."""
    return source.data | ({"in parts": {part.name: part.robot.written for part in joined}} if joined else {})


def _guard(spec: RobotSpec, joined: list[Joined]) -> GuardPolicy:
    guard = spec.guard
    allow = tuple((edge.parent, edge.child) for edge in guard.allow)
    allow += tuple(pattern for part in joined for pattern in part.robot.guard.allow if pattern not in allow)
    return GuardPolicy(
        mode="off" if guard.mode == "off" else "strict" if guard.mode == "strict" else "watch",
        unknown_edges="ignore"
        if guard.unknown_edges == "ignore"
        else "error"
        if guard.unknown_edges == "error"
        else "warn",
        on_violation="stop"
        if guard.on_violation == "stop"
        else "stop-offender"
        if guard.on_violation == "stop-offender"
        else "report",
        allow=allow,
    )


def _with_rates(edges: tuple[Edge, ...], processes: list[Process]) -> tuple[Edge, ...]:
    """Give moving edges without a rate their process's: that of ``joints``, or of the stand-in."""
    rates = {process.name: process.simulate.rate if process.simulate else process.rate for process in processes[::-1]}
    return tuple(
        edge if edge.rate is not None or edge.kind == "static" or rates.get(edge.owner) is None
        else replace(edge, rate=rates[edge.owner])
        for edge in edges
    )  # fmt: skip


def _base(robot: Robot, spec: RobotSpec, source: Source, found: list[Diagnostic]) -> str | None:
    """Return where the URDF begins: as said; base_link, or a fixed base_footprint above it; else the only root."""
    if spec.base is not None:
        if spec.base in robot.frames:
            return spec.base
        advice = did_you_mean(spec.base, robot.frames)
        found.append(finding("TF203", f"no frame {spec.base}", source.at(("base",)), help=advice))
        return None
    if "base_link" in robot.frames:
        above = robot.parent_edge("base_link")
        if above and above.kind == "static" and above.parent == "base_footprint":
            return "base_footprint"
        return "base_link"
    roots = robot.roots()
    return roots[0] if len(roots) == 1 else None
