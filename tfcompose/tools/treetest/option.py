"""Option ``--tests`` of ``init``: write the cases that a robot file implies."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_bag, add_trust
from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace


def arguments(parser: ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "--tests",
        metavar="FILE",
        help=(
            "write the cases that this robot file implies, for tfcompose test, into"
            " FILE.test.yaml: edges, owners, rates, joints, poses, second publishers"
        ),
    )
    parser.add_argument(
        "-p",
        "--profile",
        action="append",
        default=[],
        metavar="NAME",
        dest="profiles",
        help="with --tests: apply this profile; repeatable",
    )
    add_bag(parser, "with --tests: replay this recording instead of starting the robot")
    add_trust(parser)


def run(command: str, arguments: Namespace) -> int | None:
    """Write the test file; exit code 2 where that fails. None without ``--tests``."""
    del command
    if arguments.tests is None:
        if arguments.bag or arguments.profiles:
            fail("--bag and --profile go with --tests FILE", UNREADABLE)
        return None
    if arguments.tests == "-" and not arguments.output:
        fail("--tests - has no name for the test file: -o FILE names it", UNREADABLE)
    if arguments.name or arguments.schema or arguments.list:
        fail("--tests writes no robot file: leave out --name, --schema and --list", UNREADABLE)
    from tfcompose.cli.compiling import compile_or_exit
    from tfcompose.cli.live import recording_day
    from tfcompose.cli.templates import print_next
    from tfcompose.compiler.emit.plan import plan_of
    from tfcompose.tools.treetest.implied import implied_suite

    arguments.overlays, arguments.settings, arguments.arg_values = [], [], {}
    robot = compile_or_exit(arguments.tests, arguments, recording_day(arguments.bag))
    output = Path(arguments.output or _default_output(arguments.tests))
    source: dict[str, object] = {}
    if arguments.bag:
        source["bag"] = _relative(arguments.bag, output)
    if arguments.profiles:
        profiles = arguments.profiles
        source["profile"] = profiles[0] if len(profiles) == 1 else profiles
    plan = plan_of(robot.with_final_names())
    text = implied_suite(plan, _relative(arguments.tests, output), source)
    try:
        with output.open("x", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
    except FileExistsError:
        fail(f"nothing was written: {output} exists; -o FILE names another", UNREADABLE)
    except OSError as error:
        fail(f"{output} cannot be written: {error.strerror}", UNREADABLE)
    print(f"wrote {output}")
    print_next({shlex.join(["tfcompose", "test", str(output)]): "run the cases"})
    return 0


def _default_output(robot_file: str) -> str:
    """Return ROBOT.test.yaml next to ROBOT.yaml or ROBOT.tfc.yaml."""
    path = Path(robot_file)
    stem = path.name.removesuffix(path.suffix).removesuffix(".tfc")
    return str(path.with_name(f"{stem}.test.yaml"))


def _relative(path: str, output: Path) -> str:
    """Return a path relative to the folder of the test file; an absolute one stays absolute."""
    return path if Path(path).is_absolute() else os.path.relpath(path, output.parent)
