"""What is expected of a running tree: the plan of a robot file, or a plan that was built."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.observe.census import topics_below
from tfcompose.ros.topics import parts_of

if TYPE_CHECKING:
    from argparse import Namespace

    from tfcompose.findings import Span
    from tfcompose.plan import Plan

    Topics = tuple[str, str]

PLAN = "plan.json"
BOTH = "--live looks at the running tree and --bag at a recording: give one of them"


def expected(file: str, arguments: Namespace) -> tuple[Plan, dict[str, Span]] | int:
    """Return the plan of a robot file, a plan.json or a folder with one, and where edges stand in the robot's file.

    Places are by child; a built plan has none. What cannot be read is said, and the exit code returned.
    """
    path = Path(file)
    if path.is_dir() and (path / PLAN).is_file():
        path /= PLAN
    if path.suffix == ".json":
        terminal = import_module("tfcompose.cli.terminal")
        if arguments.profiles or arguments.overlays or arguments.settings:
            terminal.complain("a built plan takes no --profile, --overlay and --set: those are for building it")
            return 2
        plan: Plan | int = import_module("tfcompose.cli.built_plan").plan_in(path)
        return plan if isinstance(plan, int) else (plan, {})
    robot = import_module("tfcompose.cli.compiling").robot_or_code(file, arguments)
    if isinstance(robot, int):
        return robot
    final = robot.with_final_names()
    return import_module("tfcompose.emit.plan").plan_of(final), {edge.child: edge.at for edge in final.edges}


def where_to_look(arguments: Namespace) -> tuple[Plan | None, list[Topics]] | int:
    """Return the plan of FILE, if one is given, and the topics (moving, fixed) to look at: its own, or --namespace's.

    What cannot be read, or cannot be asked for together, is said, and the exit code returned.
    """
    if arguments.live and arguments.bag:
        import_module("tfcompose.cli.terminal").complain(BOTH)
        return 2
    if arguments.file is None:
        return None, [topics_below(arguments.namespace)]
    known = expected(arguments.file, arguments)
    if isinstance(known, int):
        return known
    plan = known[0]
    return plan, list(parts_of(plan)) or [topics_below(plan.ros.namespace)]
