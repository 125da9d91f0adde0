"""Show who publishes each live edge, how often, how evenly and how late.

Print each edge of the running tree, or of a bag, with its publisher's node, rate, jitter (the standard deviation of the
time between messages), longest gap, age of the newest stamp, and delay (arrival minus stamp), over the last 5 to 10 s,
or over everything with --for or --bag. On a terminal the table refreshes in place until Ctrl-C; into a pipe each table
follows the last.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_bag, add_for, add_format, add_namespace, positive
from tfcompose.cli.terminal import UNREADABLE, can_redraw, coloured, fail, table_width

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.cli.tables import LiveLines
    from tfcompose.live.edges import TreeObserver

#: Of the running tree the last 5 to 10 s are told.
WINDOW_S = 5.0


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_for(parser, "print one table of S seconds and exit; default: until Ctrl-C")
    add_bag(parser)
    add_namespace(parser)
    parser.add_argument(
        "--every", type=positive, default=1.0, metavar="S", help="print a table every S seconds; default: 1"
    )
    add_format(parser, text="json: one object per table; default: text")


def run(arguments: Namespace) -> int:
    """Monitor until a signal comes; exit code 1 if no TF came at all, 2 if a bag cannot be read."""
    from tfcompose.cli.live import observe, read_bag
    from tfcompose.cli.tables import LiveLines
    from tfcompose.live.edges import SETTLE_S, TreeObserver
    from tfcompose.plan.topics import topics_below

    if arguments.bag and arguments.duration:
        fail("a recording is always read to its end: leave out --for", UNREADABLE)
    topics = topics_below(arguments.namespace)
    covers_all = arguments.bag or arguments.duration
    observer = TreeObserver(0.0 if covers_all else WINDOW_S, 0.0 if arguments.bag else SETTLE_S)
    if arguments.bag:
        read_bag(arguments.bag, {topics: observer})
        _show(arguments, observer, None, observer.end_ns)
        return 0
    lines = LiveLines(sys.stdout) if arguments.format == "text" and can_redraw(sys.stdout) else None
    show = None if arguments.duration and not lines else partial(_show, arguments, observer, lines)
    observe("tfcompose_monitor", {topics: observer}, duration_s=arguments.duration, every_s=arguments.every, show=show)
    if arguments.duration:
        _show(arguments, observer, lines, time.time_ns())
    return 0


def _show(arguments: Namespace, observer: TreeObserver, live: LiveLines | None, now_ns: int) -> None:
    from tfcompose.cli.edge_table import lines_of, objects_of
    from tfcompose.cli.live import names_of
    from tfcompose.plan.topics import topics_below

    edges = sorted(observer.edges(now_ns), key=lambda state: state.stream.static)  # what moves first
    if arguments.format == "json":
        sys.stdout.write(objects_of(edges, observer, now_ns))
        sys.stdout.flush()
        return
    lines = lines_of(edges, observer, now_ns, table_width(sys.stdout), coloured=coloured(sys.stdout))
    if not observer.heard:
        lines = [f"no TF yet on {names_of([topics_below(arguments.namespace)])}"]
    if live is not None:
        live.draw(lines)
        return
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()
