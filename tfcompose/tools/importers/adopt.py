"""Write a robot file for a robot that keeps its launch files.

Every process in it is external: `guard FILE`, or <tfcompose_guard file="…"/> in a launch file,
watches the tree and starts nothing. With --status, list each fixed edge that tfcompose could
publish instead, with the line of the launch file to remove and the line of the robot file to
write. The tree is the same after each of these edits.
"""

from __future__ import annotations

import posixpath
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import UNREADABLE, fail, reject
from tfcompose.tools.importers import command

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.load import Source
    from tfcompose.tools.importers.draft import ImportDraft

_LAUNCH_ENDINGS = (".py", ".xml", ".launch", ".yaml", ".yml")
#: Keys of a started process that an external process keeps.
_KEPT = ("node", "namespace")


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments: those of ``import``, and --status."""
    command.arguments(parser)
    parser.add_argument(
        "--status",
        metavar="ROBOT",
        help="list the edges of this robot file that could be handed over; FILE: its launch file",
    )


def run(arguments: Namespace) -> int:
    """Adopt, or print what can be handed over; exit code as for ``import``."""
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
        SystemExit: after saying that it is no launch file.
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
    """Print each fixed edge of an external owner, with the edits that hand it over."""
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
    external = {process.name for process in robot.processes if process.kind == "external"}
    edges = [edge for edge in robot.edges if edge.kind == "static" and edge.owner in external]
    counts = {owner: sum(e.owner == owner for e in robot.edges) for owner in external}
    nodes = {process.name: process.node for process in robot.processes}
    parts: set[str] = set()
    for edge in edges:
        section, name = map(str, edge.entry[:2])
        if section == "parts" and name in parts:
            continue
        parts |= {name} if section == "parts" else set()
        started = publishers.get(name if section == "parts" else edge.child)
        yield from _edits(edge, source, started, nodes[edge.owner])
        if counts[edge.owner] == 1 or section == "parts":
            at = source.key_span(("processes", edge.owner))
            yield f"  remove  {at}: {edge.owner}, which owns no other edge"
            if len(source.mapping("processes")) == 1:
                emptied = source.key_span(("processes",))
                yield f"  remove  {emptied}: processes, which is empty then"


def _edits(edge: Edge, source: Source, started: Span | None, node: str) -> Iterator[str]:
    from tfcompose.foundation.yaml_text import flow

    section, name = edge.entry[:2]
    keys: dict[str, Any] = dict(source.mapping(section, name))
    kept = {key: value for key, value in keys.items() if key not in {"owner", "static"}}
    what = f"the part {name}" if section == "parts" else f"{edge.parent} → {edge.child}"
    yield f"{what}: published by {node}"
    where = f"{started.file}:{started.line}" if started else "in the launch file"
    yield f"  remove  {where}: the start of {node}"
    yield f"  write   {source.key_span((section, name))}: {name}: {flow(kept)}"
