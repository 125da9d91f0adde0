"""Write a robot file for a robot that keeps its launch files.

Every process in this robot file is external. Start `guard FILE`, or <tfcompose_guard file="…"/> in
a launch file, to watch the tree; the guard starts no process. With --status, list each fixed edge
that tfcompose could publish instead of its node. For each edge, print the line of the launch file
to remove and the line of the robot file to write. The tree is the same after each of these steps.
"""

from __future__ import annotations

import posixpath
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import UNREADABLE, fail, reject
from tfcompose.tools.importers import command

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.load import Source
    from tfcompose.tools.importers.draft import ImportDraft

_LAUNCH_ENDINGS = (".py", ".xml", ".launch", ".yaml", ".yml")
#: Keys of a process that stay when the process becomes external.
_KEPT = ("node", "namespace")


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``import``, and --status."""
    command.arguments(parser)
    parser.add_argument(
        "--status",
        metavar="ROBOT",
        help="list the edges of this robot file that could be handed over; FILE: its launch file",
    )


def run(arguments: Namespace) -> int:
    """Write the robot file or print the status; return the same exit codes as ``import``."""
    from tfcompose.foundation.findings import RejectedError

    try:
        if arguments.status:
            return _print_status(arguments)
        command.check_use(arguments)
        if arguments.live or arguments.bag:
            draft = command.observed_draft(arguments, is_adopted=True)
        else:
            draft = _draft_of_launch_file(arguments)
        return command.finish(draft, arguments)
    except RejectedError as error:
        reject(error.findings)


def _draft_of_launch_file(arguments: Namespace) -> ImportDraft:
    """Return a draft of a launch file in which every process is external.

    Raises:
        SystemExit: after printing that the file is not a launch file.
    """
    from tfcompose.tools.importers.draft import ImportDraft, robot_name

    file = arguments.file
    if not file.endswith(_LAUNCH_ENDINGS):
        fail(f"{file} is not a launch file: adopt takes one, or --live or --bag", UNREADABLE)
    name = posixpath.basename(file)
    robot = arguments.robot or robot_name(name.partition(".")[0])
    draft = ImportDraft(robot, [f"adopted from {name} by tfcompose"], is_adopted=True)
    command.add_launch_file(draft, arguments, file)
    started = draft.sections["processes"]
    for section in ("containers", "processes"):
        for process, keys in list(draft.sections[section].items()):
            kept = {key: value for key, value in keys.items() if key in _KEPT}
            if "nodes" in keys:
                kept["nodes"] = {name: {} for name in keys["nodes"]}
            started[process] = {"external": True, **kept}
            if section == "containers":
                draft.notes["processes", process] = draft.notes.pop((section, process), [])
    draft.sections["containers"] = {}
    return draft


def _print_status(arguments: Namespace) -> int:
    """Print each fixed edge of an external owner, and the edits after which tfcompose owns it."""
    from tfcompose.cli.compiling import disk, library
    from tfcompose.cli.reading import read_text
    from tfcompose.compiler.compile import compile_robot
    from tfcompose.spec.language import with_includes
    from tfcompose.spec.load import load

    file = arguments.status
    text = read_text(file)
    compiled = compile_robot(
        text,
        file,
        library(),
        read=read_text,
        disk=disk(sources=[file], trusts_files=arguments.trust),
    )
    if compiled.robot is None or compiled.errors:
        reject(compiled.findings)
    source = with_includes(load(text, file), read_text)
    publishers = _draft_of_launch_file(arguments).publishers if arguments.file else {}
    lines = list(_status(compiled.robot, source, publishers))
    print("\n".join(lines) if lines else f"{file}: no fixed edge left to hand over")
    return 0


def _status(robot: Robot, source: Source, publishers: Mapping[str, Span | None]) -> Iterator[str]:
    """Yield the edits of each step, then the edges that must stay with their nodes."""
    stays = []
    for process in robot.processes:
        if process.kind != "external":
            continue
        edges = [edge for edge in robot.edges if edge.owner == process.name]
        steps, remaining = _steps(edges, source, publishers)
        kept = steps.pop(_TOGETHER, []) if remaining else []
        if kept:
            stays.append(
                f"{_names(kept)}: stays with {process.node}, which also publishes"
                f" {_names(remaining)}"
            )
        for (_, name), step in steps.items():
            yield from _edits(step, source, publishers.get(name), process.node)
            if len(step) == len(edges):
                yield from _removal(process.name, source)
    yield from stays


#: The step for edges that tfcompose can only take over together, with all edges of their node.
_TOGETHER = ("", "")


def _steps(
    edges: Sequence[Edge], source: Source, publishers: Mapping[str, Span | None]
) -> tuple[dict[tuple[str, str], list[Edge]], list[Edge]]:
    """Return the edges of a process by step, and its other edges.

    In each step, tfcompose takes over some edges. A part is a step. A fixed edge with a separate
    publisher in the launch file is also a step.
    """
    steps: dict[tuple[str, str], list[Edge]] = {}
    remaining = []
    for edge in edges:
        section, name = map(str, edge.entry[:2])
        if source.mapping(section, name).get("owner") != edge.owner:
            remaining.append(edge)  # an edge inside a sensor, published by the driver
        elif section == "parts":
            steps.setdefault((section, name), []).append(edge)
        elif edge.kind == "static":
            step = (section, edge.child) if edge.child in publishers else _TOGETHER
            steps.setdefault(step, []).append(edge)
        else:
            remaining.append(edge)
    return steps, remaining


def _names(edges: Sequence[Edge]) -> str:
    return ", ".join(f"{edge.parent} → {edge.child}" for edge in edges)


def _edits(
    edges: Sequence[Edge], source: Source, started: Span | None, node: str
) -> Iterator[str]:
    """Yield the names of the edges, and the edits in the launch file and the robot file."""
    from tfcompose.foundation.yaml_text import flow

    entries = list(dict.fromkeys(edge.entry[:2] for edge in edges))
    section, name = entries[0]
    what = f"the part {name}" if section == "parts" else _names(edges)
    yield f"{what}: published by {node}"
    if started:
        yield f"  remove  {started.file}:{started.line}: the start of {node}"
    else:
        yield f"  remove  in the launch file: the start of {node}, or its TF if it does more"
    for section, name in entries:
        keys: dict[str, Any] = dict(source.mapping(section, name))
        kept = {key: value for key, value in keys.items() if key not in {"owner", "static"}}
        span, end = source.key_span((section, name)), _last_line(source, (section, name), keys)
        lines = f", to line {end}" if end > span.line else ""
        yield f"  write   {span}{lines}: {name}: {flow(kept)}"


def _last_line(source: Source, path: tuple[str | int, ...], value: Any) -> int:
    """Return the last line of a value.

    The span of a block mapping cannot be used, because it ends at the next key.
    """
    items = value.items() if isinstance(value, dict) else ()
    lines = [_last_line(source, (*path, key), item) for key, item in items]
    return max(lines, default=source.span_of(path).end_line)


def _removal(process: str, source: Source) -> Iterator[str]:
    """Yield the edit that removes a process without edges."""
    span = source.key_span(("processes", process))
    yield f"  remove  {span}: {process}, which owns no other edge"
    if len(source.mapping("processes")) == 1:
        emptied = source.key_span(("processes",))
        yield f"  remove  {emptied}: processes, which is empty then"
