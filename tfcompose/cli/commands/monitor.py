"""Show publisher, rate, jitter and delay of each live edge.

Print each edge of the running tree, or of a bag, with its publisher's node, rate, jitter (the
standard deviation of the time between messages), longest gap, age of the newest stamp, and delay
(arrival minus stamp), over the last 5 to 10 s, or over everything with --for or --bag. On a
terminal the table refreshes in place until Ctrl-C; into a pipe each table follows the last. With
A and B, show only the edges between them, in order, and the net delay: the age of the newest pose
of B in A.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.cli.options import add_bag, add_for, add_format, add_namespace, positive
from tfcompose.cli.terminal import UNREADABLE, can_redraw, fail, is_coloured, table_width, warn

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.cli.screen import LiveLines
    from tfcompose.model.plan.topics import Topics
    from tfcompose.tf.live.edges import TreeObserver

#: The statistics of a running tree cover the last 5 to 10 s.
WINDOW_S = 5.0


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "a", nargs="?", metavar="A", help="with B: only the edges between the frames A and B"
    )
    parser.add_argument("b", nargs="?", metavar="B", help="the frame at the other end")
    add_for(parser, "print one table of S seconds and exit; default: until Ctrl-C")
    add_bag(parser)
    add_namespace(parser)
    parser.add_argument(
        "--every",
        type=positive,
        default=1.0,
        metavar="S",
        help="print a table every S seconds; default: 1",
    )
    add_format(parser, text="json: one object per table; default: text")


def run(arguments: Namespace) -> int:
    """Monitor until a signal arrives.

    Return 0; 1 without TF, or without a chain from A to B; 2 for a bag that cannot be read.
    """
    from tfcompose.cli.live import observe
    from tfcompose.cli.screen import LiveLines
    from tfcompose.model.plan.topics import topics_below
    from tfcompose.tf.live.edges import SETTLE_S, TreeObserver

    if arguments.bag and arguments.duration:
        fail("a recording is always read to its end: leave out --for", UNREADABLE)
    if arguments.a and not arguments.b:
        fail("give two frames, A and B, or none", UNREADABLE)
    frames = [name.removeprefix("/") for name in (arguments.a, arguments.b) if name]
    is_here = not arguments.namespace and not arguments.bag
    topics = topics_below(_namespace_here() if is_here else arguments.namespace)
    covers_all = arguments.bag or arguments.duration
    observer = TreeObserver(0.0 if covers_all else WINDOW_S, 0.0 if arguments.bag else SETTLE_S)
    table = _Table(observer, topics, frames, as_json=arguments.format == "json")
    if arguments.bag:
        observe("tfcompose_monitor", {topics: observer}, bag=arguments.bag)
        return table.show(None)
    lines = (
        LiveLines(sys.stdout) if arguments.format == "text" and can_redraw(sys.stdout) else None
    )
    show = None if arguments.duration and not lines else partial(table.show, lines)
    observe(
        "tfcompose_monitor",
        {topics: observer},
        duration_s=arguments.duration,
        every_s=arguments.every,
        show=show,
    )
    return table.show(lines) if arguments.duration else 0


def _namespace_here() -> str:
    """Return the TF namespace of the robot that runs in this ROS domain.

    The namespace is empty for the global topics.

    Raises:
        SystemExit: if there are several namespaces and none is global, after a message that names
            them.
    """
    from tfcompose.cli.runs import run_of_domain
    from tfcompose.model.plan.topics import GLOBAL, namespace_options, parts_of

    running = run_of_domain()
    pairs = list(parts_of(running[1])) if running else []
    if running is None or not pairs or GLOBAL in pairs:
        return ""
    if len(pairs) > 1:
        fail(
            f"{running[0].name} has several trees:"
            f" {namespace_options(moving for moving, _ in pairs)}",
            UNREADABLE,
        )
    warn(f"{running[0].name} runs here, on {pairs[0][0]}")
    return pairs[0][0].rpartition("/")[0]


class _Table(NamedTuple):
    """The table of edges: all edges of a tree, or the edges between two frames."""

    observer: TreeObserver
    topics: Topics
    frames: list[str]
    as_json: bool

    def show(self, live: LiveLines | None) -> int:
        """Print one table; return 1 if there is no chain between the two frames."""
        from tfcompose.cli.edge_table import chain_line, lines_of, objects_of
        from tfcompose.cli.live import names_of
        from tfcompose.tf.live.chain import chain_between

        now_ns = self.observer.until_ns
        # Moving edges come first.
        edges = sorted(self.observer.edges(now_ns), key=lambda state: state.stream.static)
        chain = chain_between(edges, *self.frames) if self.frames else None
        printed = edges if chain is None else () if isinstance(chain, str) else chain.all_edges
        if self.as_json:
            sys.stdout.write(objects_of(printed, self.observer, now_ns, chain))
            sys.stdout.flush()
            return int(isinstance(chain, str))
        width = table_width(sys.stdout)
        lines = lines_of(printed, self.observer, now_ns, width, coloured=is_coloured(sys.stdout))
        if chain is not None:
            lines[0] = chain_line(chain, *self.frames)
        if not self.observer.received_any:
            lines = [f"no TF yet on {names_of([self.topics])}"]
        if live is not None:
            live.draw(lines)
        else:
            sys.stdout.write("".join(f"{line}\n" for line in lines))
            sys.stdout.flush()
        return int(isinstance(chain, str))
