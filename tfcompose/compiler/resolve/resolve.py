"""Resolution of a robot file into a robot with final names, poses and owners.

``PASSES`` lists the steps in order. Passes import a module on demand if only some robots need it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.bodies import with_colours
from tfcompose.compiler.resolve.claims import settle_claims
from tfcompose.compiler.resolve.containers import (
    check_components,
    component_process,
    container_process,
)
from tfcompose.compiler.resolve.draft import Collected, Draft
from tfcompose.compiler.resolve.edges import add_frames, add_joints, add_links, source_numbers
from tfcompose.compiler.resolve.hosts import hosts_of, with_host_place
from tfcompose.compiler.resolve.isolation import isolate, settings_of
from tfcompose.compiler.resolve.middleware import is_own_router, own_router, use_middleware
from tfcompose.compiler.resolve.param_files import read_param_files
from tfcompose.compiler.resolve.poses import solve_poses
from tfcompose.compiler.resolve.processes import (
    built_in_processes,
    check_arguments,
    check_built_in_keys,
    check_keys,
    check_launch_nodes,
    check_names,
    check_waits,
    set_positions,
    user_process,
)
from tfcompose.compiler.resolve.rules import limits_of, zones_of
from tfcompose.compiler.resolve.sensors import add_sensors
from tfcompose.compiler.resolve.stock import use_stock_publisher
from tfcompose.compiler.resolve.texts import check_texts
from tfcompose.compiler.resolve.tool_sections import (
    add_sections,
    as_sections,
    check_sections,
)
from tfcompose.compiler.resolve.zeros import correct_parts
from tfcompose.foundation.findings import Finding, did_you_mean, finding
from tfcompose.model.robot import Edge, Process, Robot
from tfcompose.spec.language.pose import MountKeys

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from tfcompose.compiler.resolve.draft import Pass
    from tfcompose.compiler.resolve.presets import Library
    from tfcompose.compiler.urdf.packages import Disk
    from tfcompose.model.plan import GuardPolicy
    from tfcompose.model.robot.hardware import Block
    from tfcompose.spec.language import Validated


def resolve(
    validated: Validated,
    library: Library,
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
    holder: Draft | None = None,
) -> tuple[Draft, list[Finding]]:
    """Return the draft with the resolved robot, valid or not, and the findings.

    Resolution expands presets, joins parts, solves poses and assigns owners. ``read`` returns the
    text of a calibration or a part. Without ``disk``, meshes and packages are not looked up.
    ``holder`` is the robot that includes this one.
    """
    collected = holder.collected if holder else Collected()
    draft = Draft(validated, library, read, disk, collected=collected, holder=holder)
    findings: list[Finding] = []
    for run in PASSES:
        findings += run(draft)
    return draft, findings


def add_processes(draft: Draft) -> Iterator[Finding]:
    """Add tfcompose's own processes, processes of tools, containers, and the user's processes."""
    spec = draft.spec
    draft.processes += [*built_in_processes(spec), *([] if draft.holder else own_router(spec))]
    yield from add_sections(draft)
    added = draft.process_names
    for name, container in spec.containers.items():
        draft.processes.append(container_process(name, container, spec))
    for name, declared in spec.processes.items():
        if name in added or is_own_router(name, declared, spec):
            yield from check_built_in_keys(name, declared, spec)
            continue
        process = yield from user_process(name, declared, draft.validated)
        if process and process.kind == "component":
            process = component_process(process, declared, spec)
        if process:
            draft.processes.append(process)
    started = draft.process_names
    draft.broken |= {("processes", name) for name in spec.processes if name not in started}


def join_parts(draft: Draft) -> Iterator[Finding]:
    """Resolve the parts, and record their rejected entries."""
    if draft.spec.parts:
        from tfcompose.compiler.resolve.parts import join

        yield from join(draft, resolve)


def add_parts(draft: Draft) -> Iterator[Finding]:
    """Add the frames, edges, bodies and sensors of the parts."""
    if draft.joined:
        from tfcompose.compiler.resolve.parts import take

        yield from take(draft)


def measure_mounts(draft: Draft) -> Iterator[Finding]:
    """Assign the poses of calibrations to edges."""
    mounts = (keys for keys in draft.keys.values() if isinstance(keys, MountKeys))
    if draft.spec.calibrations or any(keys.calibration for keys in mounts):
        from tfcompose.compiler.resolve.calibration import measure

        yield from measure(draft)


def assemble(draft: Draft) -> Iterator[Finding]:
    """Build the robot from the results of the earlier passes."""
    spec, validated = draft.spec, draft.validated
    limits = yield from limits_of(spec)
    parts = [part.robot for part in draft.joined]
    in_tree = [part.robot for part in draft.joined if not part.declared.is_alone]
    draft.processes = [with_host_place(process, spec) for process in draft.processes]
    processes = draft.all_processes
    draft.robot = Robot(
        name=spec.robot,
        file=spec.spans.file,
        frames=draft.frames,
        edges=_with_rates(draft.edges, processes),
        links=with_colours(draft.links),
        processes=tuple(processes),
        base=None,
        ros=settings_of(spec.ros),
        guard=_guard(spec.guard, parts),
        sensors=tuple(draft.sensors),
        claims=tuple(claim for part in parts for claim in part.claims),
        source_numbers=(
            *source_numbers(spec),
            *(numbers for part in parts for numbers in part.source_numbers),
        ),
        unused={path: spec.key_span(path) for path in validated.unused},
        args=validated.args,
        environment=reduce(or_, (part.environment for part in parts), validated.environment),
        source_data=_source_data(draft),
        broken=frozenset(draft.broken),
        parts=tuple(alone for part in parts for alone in part.parts),
        mounted={part.name: part.root for part in draft.joined if part.root is not None},
        hardware=tuple(hardware for part in in_tree for hardware in part.hardware),
        blocks=_blocks(in_tree),
        foreign=frozenset(file for part in parts for file in part.foreign),
        refused=tuple(
            span for entry in sorted(validated.broken) if (span := spec.spans.exact_span(entry))
        ),
        part_notes=draft.collected.notes,
        is_variant=spec.spans.is_variant,
        profiles=spec.spans.profiles,
        overlays=spec.spans.overlays,
        zones=(*zones_of(spec), *(zone for part in in_tree for zone in part.zones)),
        limits=limits,
        conditions=validated.conditions,
        hosts=reduce(or_, (part.hosts for part in parts[::-1]), {}) | hosts_of(spec),
        sections=as_sections(draft),
    )


def add_blocks(draft: Draft) -> Iterator[Finding]:
    """Add the hardware of ros2_control, and raw URDF."""
    if draft.spec.ros2_control or draft.spec.xml:
        from tfcompose.compiler.resolve.blocks import take_blocks

        yield from take_blocks(draft)


def find_base(draft: Draft) -> Iterator[Finding]:
    """Find the root of the URDF.

    This is ``base`` in the file; otherwise base_link, or a fixed base_footprint above it;
    otherwise the only root.
    """
    robot, base = draft.robot, draft.spec.base
    if base is None:
        base = _usual_base(robot)
    elif base not in robot.frames:
        yield from _unknown_frame(draft, "base", base)
        base = None
    draft.robot = replace(robot, base=base)


def find_ground(draft: Draft) -> Iterator[Finding]:
    """Find the frame on the floor: as written, or base_footprint (REP-120)."""
    robot, ground = draft.robot, draft.spec.ground
    if ground is not None and ground not in robot.frames:
        yield from _unknown_frame(draft, "ground", ground)
    usual = ground or "base_footprint"
    draft.robot = replace(robot, ground=usual if usual in robot.frames else None)


def _unknown_frame(draft: Draft, key: str, frame: str) -> Iterator[Finding]:
    if not draft.robot.tolerates(frame):
        advice, span = did_you_mean(frame, draft.robot.frames), draft.spec.span_of((key,))
        yield finding("TF203", f"unknown frame {frame}", span, help=advice)


def _usual_base(robot: Robot) -> str | None:
    if "base_link" in robot.frames:
        above = robot.parent_edge("base_link")
        if above and above.kind == "static" and above.parent == "base_footprint":
            return "base_footprint"
        return "base_link"
    roots = robot.roots()
    return roots[0] if len(roots) == 1 else None


#: The passes in order. Each pass reads the results of earlier passes from the draft.
PASSES: tuple[Pass, ...] = (
    add_processes,
    join_parts,
    add_frames,
    add_links,
    add_joints,
    add_sensors,
    add_parts,
    correct_parts,
    measure_mounts,
    solve_poses,
    check_texts,
    check_keys,
    check_names,
    check_waits,
    check_launch_nodes,
    assemble,
    set_positions,
    read_param_files,
    add_blocks,
    find_base,
    find_ground,
    use_stock_publisher,
    isolate,
    settle_claims,
    check_arguments,
    check_components,
    check_sections,
    use_middleware,
)


def _blocks(parts: list[Robot]) -> tuple[Block, ...]:
    """Return the raw blocks of the parts, with equal blocks only once.

    Two parts have equal blocks if the blocks name nothing of the part, such as a simulator's
    plugin.
    """
    blocks: list[Block] = []
    for part in parts:
        texts = {block.text for block in blocks}
        blocks += [block for block in part.blocks if block.text not in texts]
    return tuple(blocks)


def _source_data(draft: Draft) -> dict[str, Any]:
    """Return the source data of the robot and of its parts."""
    parts = {part.name: part.robot.source_data for part in draft.joined}
    return draft.validated.source_data | ({"in parts": parts} if parts else {})


def _guard(declared: GuardPolicy, parts: list[Robot]) -> GuardPolicy:
    """Return the policy, extended by the policies of the parts."""
    more = (
        pattern for part in parts for pattern in part.guard.allow if pattern not in declared.allow
    )
    return replace(declared, allow=(*declared.allow, *more))


def _with_rates(edges: list[Edge], processes: list[Process]) -> tuple[Edge, ...]:
    """Set the rate of moving edges without a declared rate to their owner's rate."""
    rates = {}
    for process in reversed(processes):
        rates[process.name] = process.simulate.rate if process.simulate else process.rate
    rated = []
    for edge in edges:
        if edge.rate is None and edge.kind != "static":
            edge = replace(edge, rate=rates.get(edge.owner))  # noqa: PLW2901 (the same edge)
        rated.append(edge)
    return tuple(rated)
