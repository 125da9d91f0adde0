"""``tfcompose explain``: a code's page, or the chain between two frames.

Explain a code (TF301) or a rule's name: what is wrong, why it matters, what to do. Or, with FILE A B, show the chain
from A to B: each edge with its owner and its pose, and where each of its values is written, and over what.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

from tfcompose.catalogue import CATALOGUE, FAMILIES, code_of, codes_and_names
from tfcompose.cli.between import edges_between
from tfcompose.cli.compiling import sources_and_robot
from tfcompose.cli.options import add_variant
from tfcompose.cli.provenance import written_values
from tfcompose.cli.terminal import UNREADABLE, complain
from tfcompose.findings import did_you_mean
from tfcompose.pages import page, table
from tfcompose.render.tree import edge_facts

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Sequence

    from tfcompose.load import Source
    from tfcompose.model import Calibration, Edge, Robot


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "what", nargs="*", metavar="CODE|FILE A B", help="a code, a rule's name, or a file and two frames"
    )
    parser.add_argument(
        "--table",
        nargs="?",
        const="all",
        choices=("all", *FAMILIES),
        help="print a table in Markdown of all codes, or of those of a family",
    )
    add_variant(parser)


def run(arguments: Namespace) -> int:
    """Print the page or the chain; exit code 1 if a frame is not there, 2 for wrong use."""
    words = arguments.what
    if arguments.table and not words:
        sys.stdout.write(table(None if arguments.table == "all" else arguments.table))
        return 0
    if len(words) == 1:
        return _explain_code(words[0])
    if len(words) != 3:  # noqa: PLR2004 (FILE A B)
        complain("explain takes a code, or FILE A B")
        return UNREADABLE
    made = sources_and_robot(words[0], arguments)
    return made if isinstance(made, int) else _explain_chain(*made, words[1], words[2])


def _explain_code(word: str) -> int:
    code = code_of(word)
    if code is None:
        complain(f"no code {word}; {did_you_mean(word, codes_and_names(), 'lint prints codes: TF301')}")
        return UNREADABLE
    sys.stdout.write(f"{code} {CATALOGUE[code].name}\n\n{page(code)}\n")
    return 0


def _explain_chain(sources: Sequence[Source], robot: Robot, a: str, b: str) -> int:
    edges = edges_between(robot, a, b)
    if edges is None:
        return 1
    rising, falling = edges
    lines = [f"pose of {b} in {a}\n"]
    lines += [f"  up    {_line(edge, sources)}" for edge in rising]
    lines += [f"  down  {_line(edge, sources)}" for edge in reversed(falling)]
    sys.stdout.write("".join(lines))
    return 0


def _line(edge: Edge, sources: Sequence[Source]) -> str:
    facts = edge_facts(edge)
    inside = f" (inside {edge.sensor})" if edge.sensor and not edge.given else ""
    measured = f"          {_measured(edge.calibration)}\n" if edge.calibration else ""
    values = "".join(f"          {line}\n" for line in written_values(edge, sources))
    at = f"          {edge.at}{inside}\n" if inside or not values else ""
    return f"{edge.name}\n          {facts}\n{measured}{at}{values}"


def _measured(calibration: Calibration) -> str:
    if calibration.nominal is None:
        return f"{calibration.name}; no nominal pose is given"
    metres, radians = calibration.off(calibration.pose)
    mm, deg = round(metres * 1000, 3), round(math.degrees(radians), 3)
    return f"{calibration.name}, {mm:.3g} mm and {deg:.2g} deg from nominal"
