"""Explain a code, or the chain between two frames.

Explain a code (TF301) or a rule's name: the problem, its effect and its fix. Or show the chain
between two frames of FILE: each edge with its owner and pose, the location of each value, and of
the value it replaced.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

from tfcompose.cli.options import DEFAULT_FILE, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping, Sequence

    from tfcompose.foundation.geometry import Offset
    from tfcompose.model.robot import Calibration, Edge, Joint, Robot
    from tfcompose.spec.load import Source


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    from tfcompose.foundation.catalogue import FAMILIES

    parser.add_argument(
        "what",
        nargs="*",
        metavar="CODE|[FILE] A B",
        help="a code, a rule's name, or two frames of FILE, by default robot.yaml",
    )
    parser.add_argument(
        "--table",
        nargs="?",
        const="all",
        choices=("all", *FAMILIES),
        help="print all codes, or those of one family, as a Markdown table",
    )
    add_variant(parser)


def run(arguments: Namespace) -> int:
    """Print the page or the chain. Return 0, 1 if a frame does not exist, 2 for wrong use."""
    match arguments.what:
        case [] if arguments.table:
            from tfcompose.cli.documentation import code_table

            sys.stdout.write(code_table(None if arguments.table == "all" else arguments.table))
        case [code]:
            _explain_code(code)
        case [a, b] if not a.endswith((".yaml", ".yml")):
            _explain_frames(DEFAULT_FILE, a, b, arguments)
        case [file, a, b]:
            _explain_frames(file, a, b, arguments)
        case _:
            fail("explain takes a code, or [FILE] A B", UNREADABLE)
    return 0


def _explain_frames(file: str, a: str, b: str, arguments: Namespace) -> None:
    from tfcompose.cli.compiling import compile_without_errors

    robot, compiled = compile_without_errors(file, arguments)
    _explain_chain(robot, compiled.sources, a, b)


def _explain_code(text: str) -> None:
    from tfcompose.foundation.catalogue import CATALOGUE, absent_code, code_of, similar_words
    from tfcompose.foundation.findings import did_you_mean

    code = code_of(text)
    if code is None:
        advice = did_you_mean(text, similar_words(text), "lint prints codes: TF301")
        fail(absent_code(text) or f"unknown code {text}; {advice}", UNREADABLE)
    sys.stdout.write(f"{code} {CATALOGUE[code].name}\n\n{CATALOGUE.page(code)}\n")


def _explain_chain(robot: Robot, sources: Sequence[Source], a: str, b: str) -> None:
    from tfcompose.cli.compiling import edges_between

    rising, falling = edges_between(robot, a, b)
    adjusted = _adjustments(robot)
    lines = [f"pose of {b} in {a}\n"]
    lines += [f"  up    {_line(edge, sources, adjusted)}" for edge in rising]
    lines += [f"  down  {_line(edge, sources, adjusted)}" for edge in reversed(falling)]
    sys.stdout.write("".join(lines))


def _line(edge: Edge, sources: Sequence[Source], adjusted: Mapping[str, Offset]) -> str:
    from tfcompose.compiler.provenance import values_of
    from tfcompose.compiler.render.tree import edge_facts

    facts = edge_facts(edge)
    inside = f" (inside {edge.sensor})" if edge.sensor and not edge.declared else ""
    measured = f"          {_explain_calibration(edge.calibration)}\n" if edge.calibration else ""
    if edge.joint and edge.joint.zero_offset:
        measured = f"          {_explain_offset(edge.joint)}\n"
    values = "".join(f"          {line}\n" for line in values_of(edge, sources))
    place = f"          {edge.span}{inside}\n" if inside or not values else ""
    if edge.child in adjusted:
        text = f"adjusted by {adjusted[edge.child].text} on the running robot (tfcompose nudge)"
        measured += f"          {text}\n"
    return f"{edge.name}\n          {facts}\n{measured}{place}{values}"


def _adjustments(robot: Robot) -> dict[str, Offset]:
    """Return how far edges are adjusted on the running robot, by child in the robot file."""
    from tfcompose.cli.runs import adjusted_edges

    frames = {robot.final(edge.child): edge.child for edge in robot.edges}
    return {
        frames[edge.child]: edge.adjustment
        for edge in adjusted_edges(robot.name)
        if edge.adjustment and edge.child in frames
    }


def _explain_offset(joint: Joint) -> str:
    """Return the offset of the joint's zero, and the limits that follow from it."""
    limit, ends = joint.limit, ""
    if limit and limit.lower is not None and limit.upper is not None:
        ends = f"; it reports {joint.in_unit(limit.lower)} to {joint.in_unit(limit.upper)}"
    return f"offset {joint.zero_offset_text} of the zero of the joint {joint.name}{ends}"


def _explain_calibration(calibration: Calibration) -> str:
    if calibration.nominal is None:
        return f"{calibration.name}; no nominal pose is given"
    metres, radians = calibration.off(calibration.pose)
    mm, deg = round(metres * 1000, 3), round(math.degrees(radians), 3)
    return f"{calibration.name}, {mm:.3g} mm and {deg:.2g} deg from nominal"
