"""Print the tree with kinds, owners and poses, or the published tree.

Print each frame with the kind, owner, rate and pose of its edge. With --live or --bag, print the
published tree: each frame with the kind, publishing node, rate and age of its edge. With FILE,
also print the owner, and mark each frame as expected, unexpected or missing. Disconnected trees
are printed one after another.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from tfcompose.cli.options import (
    DEFAULT_FILE,
    add_bag,
    add_for,
    add_format,
    add_namespace,
    add_variant,
    settle_duration,
)
from tfcompose.cli.terminal import is_coloured, printable, table_width
from tfcompose.compiler.render.text import PLAIN, RED, YELLOW

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator, Sequence

    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.model.robot import Robot
    from tfcompose.tf.live.edges import Branch, Tree

    Topics = tuple[str, str]

#: The column with remarks about a published frame.
REMARK = 5


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "file", nargs="?", metavar="FILE", help="default: robot.yaml, or none with --live or --bag"
    )
    add_variant(parser)
    parser.add_argument("--live", action="store_true", help="print the tree that is published now")
    add_bag(parser, "print the tree of a recording")
    add_for(parser, "with --live: observe for S seconds; default: 3")
    add_namespace(parser, "use /NS/tf and /NS/tf_static, without FILE")
    add_format(parser)


def run(arguments: Namespace) -> int:
    """Print the tree. Return the exit code of ``build``.

    For a published tree, return 1 if there is no tree, 2 if a bag cannot be read.
    """
    settle_duration(arguments, 3.0, is_live=arguments.live)
    if arguments.live or arguments.bag:
        _print_published(arguments)
        return 0
    from tfcompose.cli.compiling import compile_or_exit
    from tfcompose.compiler.render.tree import tree

    robot = compile_or_exit(arguments.file or DEFAULT_FILE, arguments).with_final_names()
    columns = table_width(sys.stdout)
    text = (
        _fit_to_terminal(tree(robot, columns and columns - 1))
        if arguments.format == "text"
        else _planned_json(robot)
    )
    sys.stdout.write(text)
    return 0


def _fit_to_terminal(text: str) -> str:
    """Return the text with each line shortened to the width of the terminal.

    For a file or a pipe, return the text unchanged.
    """
    from tfcompose.cli.tables import shorten

    columns = table_width(sys.stdout)
    if columns is None:
        return text
    return "".join(f"{shorten(line, columns - 1, at_end=True)}\n" for line in text.splitlines())


def _planned_json(robot: Robot) -> str:
    """Return a line of JSON in the format of --live.

    The line contains the trees with their roots, and the robot file's data about edges.
    """
    from tfcompose.compiler.emit.plan import plan_of
    from tfcompose.tf.live.edges import forest

    trees = [
        _tree_object(
            tree,
            [
                _planned_edge(branch.planned)
                for branch in tree.branches
                if branch.planned is not None
            ],
        )
        for tree in forest((), {edge.child: edge for edge in plan_of(robot).edges})
    ]
    return json.dumps({"robot": robot.name, "trees": trees}, ensure_ascii=False) + "\n"


def _tree_object(tree: Tree, edges: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "root": None if tree.loop else tree.branches[0].frame,
        "loop": list(tree.loop),
        "edges": edges,
    }


def _planned_edge(edge: PlanEdge) -> dict[str, Any]:
    return {
        "parent": edge.parent,
        "child": edge.child,
        "kind": edge.kind,
        "owner": edge.owner,
        "node": edge.node,
        "rate": edge.rate,
        "xyz": list(edge.pose.xyz) if edge.pose_known else None,
        "quat_xyzw": list(edge.pose.quat_xyzw) if edge.pose_known else None,
    }


def _print_published(arguments: Namespace) -> None:
    from tfcompose.cli.edge_table import not_kept
    from tfcompose.cli.live import observe_for
    from tfcompose.model.plan.topics import parts_of
    from tfcompose.tf.live.edges import forest

    plan, observers = observe_for("tfcompose_tree", arguments)
    parts = parts_of(plan) if plan else {}
    for pair, observer in observers.items():
        planned = {edge.child: edge for edge in parts[pair].edges} if pair in parts else None
        trees = forest(observer.edges(observer.until_ns), planned)
        if arguments.format == "json":
            sys.stdout.write(_published_json(pair, trees, plan=plan))
        else:
            heading = f"on {pair[0]} and {pair[1]}:\n" if len(observers) > 1 else ""
            more = f"\n{not_kept(observer)}\n" if observer.beyond else ""
            sys.stdout.write(heading + _draw_trees(trees, plan=plan) + more)


def _draw_trees(trees: list[Tree], *, plan: Plan | None) -> str:
    from tfcompose.cli.tables import Table

    table = Table(right=frozenset({3, 4}), spare=(1, 4), colour=_colour)
    branches = [branch for tree in trees for branch in tree.branches]
    rows = [_row(branch, plan=plan) for branch in branches]
    columns = table_width(sys.stdout)
    lines = iter(table.lines(rows, columns, coloured=is_coloured(sys.stdout)))
    if columns is not None and any(len(line) >= columns for line in table.lines(rows, columns)):
        lines = iter(_wrap_rows(branches, rows, columns - 1))
    parts = []
    for tree in trees:
        loop = (
            [f"a loop, which breaks tf2 lookups: {printable(' → '.join(tree.loop))}"]
            if tree.loop
            else []
        )
        parts.append("\n".join([*loop, *(next(lines) for _ in tree.branches)]))
    head = [f"{len(trees)} disconnected trees:"] if len(trees) > 1 else []
    return "\n\n".join([*head, *parts]) + "\n"


def _wrap_rows(
    branches: Sequence[Branch], rows: Sequence[tuple[str, ...]], columns: int
) -> Iterator[str]:
    """Yield the rows as lines without columns. A long row continues on the next line."""
    from tfcompose.cli.tables import shorten
    from tfcompose.compiler.render.tree import wrap_rows

    drawing = [
        (
            branch.indent,
            row[0].removeprefix(branch.indent),
            [fact for fact in row[1:] if fact not in {"", "static"}],
        )
        for branch, row in zip(branches, rows, strict=True)
    ]
    for row, lines in zip(rows, wrap_rows(drawing, columns), strict=True):
        shortened = [shorten(line, columns, at_end=True) for line in lines]
        if is_coloured(sys.stdout) and (colour := _colour(REMARK, row[REMARK])):
            shortened[-1] = shortened[-1].replace(row[REMARK], f"{colour}{row[REMARK]}{PLAIN}")
        yield "\n".join(shortened)


def _colour(column: int, text: str) -> str:
    if column != REMARK or text in {"", "expected", "allowed"}:
        return ""
    return YELLOW if text.startswith("also ") else RED


def _row(branch: Branch, *, plan: Plan | None) -> tuple[str, ...]:
    """Return the columns: frame, kind, node, rate, age, and remarks."""
    from tfcompose.cli.edge_table import duration

    name = branch.indent + printable(branch.frame)
    if not branch.observed:
        planned = branch.planned
        if planned is None:
            return (name, "", "", "", "", "")
        return (name, planned.kind, "", "", "", f"missing: owner {planned.owner} ({planned.node})")
    observed = branch.observed[0]
    rivals = [
        f"also {printable(rival.name)} from {printable(rival.publisher) or 'unknown'}"
        for rival in branch.observed[1:]
    ]
    remarks = [_status(branch, plan)] if plan else []
    rate = (
        ""
        if observed.stream.static
        else f"{observed.timing.rate:.1f} Hz"
        if observed.timing.rate is not None
        else "–"
    )
    age = "" if observed.data_age_s is None else duration(observed.data_age_s)
    kind = "static" if observed.stream.static else "dynamic"
    return (
        name,
        kind,
        printable(_owner(branch, plan)) or "–",
        rate,
        age,
        "; ".join([*remarks, *rivals]),
    )


def _owner(branch: Branch, plan: Plan | None) -> str:
    """Return the frame's publisher: the owner with its node, or another node."""
    from tfcompose.guard.verdict.ownership import may_be_owners, relays_of

    planned, observed = branch.planned, branch.observed[0]
    if (
        plan is None
        or planned is None
        or not may_be_owners(planned, observed.nodes, relays_of(plan))
    ):
        return observed.publisher
    through = "" if planned.node in observed.nodes else "through "
    return f"{planned.owner} ({through}{observed.publisher})"


def _status(branch: Branch, plan: Plan) -> str:
    from tfcompose.guard.verdict.ownership import code_of, may_be_owners, relays_of

    planned, observed = branch.planned, branch.observed[0] if branch.observed else None
    if observed is None:
        return "missing"
    if planned is None:
        allowed = plan.allows_undeclared(observed.stream.parent, observed.stream.child)
        return "allowed" if allowed else "unexpected"
    owner = not observed.nodes or may_be_owners(planned, observed.nodes, relays_of(plan))
    code = code_of(
        planned,
        observed.stream.parent,
        static=observed.stream.static,
        owner=owner,
        sure=len(observed.nodes) < 2,  # noqa: PLR2004
    )
    match code:
        case "TF802":
            return f"expected in {planned.parent}"
        case "TF801":
            return f"expected from {planned.node}"
        case "TF809":
            return f"expected on {plan.process(planned.owner).topics[planned.kind == 'static']}"
        case _:
            return "expected"


def _published_json(pair: Topics, trees: list[Tree], *, plan: Plan | None) -> str:
    data = {
        "topics": list(pair),
        "trees": [
            _tree_object(
                tree,
                [
                    _edge_object(branch, plan)
                    for branch in tree.branches
                    if branch.parent is not None
                ],
            )
            for tree in trees
        ],
    }
    return json.dumps(data, ensure_ascii=False) + "\n"


def _edge_object(branch: Branch, plan: Plan | None) -> dict[str, Any]:
    from tfcompose.cli.edge_table import object_of

    status = (
        {"status": _status(branch, plan), "owner": branch.planned and branch.planned.owner}
        if plan
        else {}
    )
    return {
        "parent": branch.parent,
        "child": branch.frame,
        **status,
        "seen": [object_of(observed) for observed in branch.observed],
    }
