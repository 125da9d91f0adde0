"""The commands and their options. Nothing but the standard library is loaded until a command runs."""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module

from tfcompose import __version__

DEFAULT_FILE = "robot.yaml"


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit code: 0 clean, 1 findings or a failed process, 2 wrong use."""
    arguments = parser().parse_args(argv)
    try:
        code: int = import_module(f"tfcompose.cli.{arguments.command}").run(arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nobody reads: not worth a traceback at exit
        return 141
    return code


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    top = argparse.ArgumentParser(
        prog="tfcompose",
        description="One YAML file says which frames a robot has and who publishes each TF edge. "
        "tfcompose checks it, builds it, starts it, and names whoever publishes an edge that is not theirs.",
    )
    top.add_argument("--version", action="version", version=f"tfcompose {__version__}")
    commands = top.add_subparsers(dest="command", metavar="COMMAND", required=True)
    _lint(commands)
    _build(commands)
    _up(commands)
    _echo(commands)
    _tree(commands)
    _pose(commands)
    _schema(commands)
    return top


Commands = argparse._SubParsersAction  # noqa: SLF001 (argparse has no public name for what add_subparsers returns)


def _lint(commands: Commands[argparse.ArgumentParser]) -> None:
    text = "Find everything that is wrong with robot files. Each is checked alone and with each of its profiles."
    lint = commands.add_parser(
        "lint", help="find everything that is wrong; starts nothing, needs no ROS", description=text
    )
    lint.add_argument("files", nargs="*", metavar="FILE", default=[DEFAULT_FILE], help="default: robot.yaml")
    _profile(lint, "check this combination only")
    lint.add_argument("--format", choices=("text", "json"), default="text", help="default: text")
    lint.add_argument(
        "--fail-on", choices=("error", "warning"), default="error", help="what makes the exit code 1; default: error"
    )


def _build(commands: Commands[argparse.ArgumentParser]) -> None:
    text = "Write plan.json, robot.urdf, robot.full.urdf and tree.txt: all of them, or nothing."
    build = commands.add_parser("build", help="write the URDF and the plan", description=text)
    _file(build)
    _profile(build, "lay this profile over the file")
    build.add_argument("-o", "--output", metavar="DIR", help="default: build/ROBOT")


def _up(commands: Commands[argparse.ArgumentParser]) -> None:
    text = (
        "Build a robot and start it, or start a built plan. Ctrl-C, SIGTERM and SIGHUP end everything. "
        "An edge that somebody publishes already is refused, with that node's name."
    )
    up = commands.add_parser("up", help="start the robot, or a built plan", description=text)
    up.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE|PLAN", help="default: robot.yaml")
    _profile(up, "lay this profile over the file")
    up.add_argument("-o", "--output", metavar="DIR", help="where to build; default: build/ROBOT")
    up.add_argument("--guard", choices=("off", "watch"), help="default: what the robot says")
    up.add_argument(
        "--settle",
        type=_seconds,
        metavar="S",
        help="how long to look for other publishers before the start; default: 1",
    )
    up.add_argument(
        "--for", dest="duration", type=_seconds, metavar="S",
        help="end after S seconds; exit 1 if the tree was not complete or the guard found an error",
    )  # fmt: skip


def _echo(commands: Commands[argparse.ArgumentParser]) -> None:
    text = "Print the pose of B in A from the live tree: position in metres, quaternion x y z w, roll pitch yaw."
    echo = commands.add_parser("echo", help="the live pose of B in A", description=text)
    echo.add_argument("a", metavar="A", help="the frame in which the pose is given")
    echo.add_argument("b", metavar="B", help="the frame whose pose it is")
    echo.add_argument("--once", action="store_true", help="print one pose and end")
    echo.add_argument(
        "--timeout", type=_seconds, default=5.0, metavar="S",
        help="give up when there is no pose for S seconds, and say why; default: 5",
    )  # fmt: skip
    echo.add_argument("--rate", type=_seconds, default=1.0, metavar="HZ", help="poses a second; default: 1")
    echo.add_argument("--namespace", default="", metavar="NS", help="read NS/tf and NS/tf_static")
    echo.add_argument(
        "--format", choices=("text", "json"), default="text", help="json: one object a line; default: text"
    )


def _tree(commands: Commands[argparse.ArgumentParser]) -> None:
    tree = commands.add_parser(
        "tree", help="the tree with kinds, owners and poses", description="Print the tree: each frame with the kind, "
        "owner, rate and pose of its edge.",
    )  # fmt: skip
    _file(tree)
    _profile(tree, "lay this profile over the file")


def _pose(commands: Commands[argparse.ArgumentParser]) -> None:
    text = "Print the pose of B in A from the spec alone. What moves is taken where its joint is at 0."
    pose = commands.add_parser("pose", help="the pose of B in A, from the spec alone", description=text)
    pose.add_argument("file", metavar="FILE")
    pose.add_argument("a", metavar="A", help="the frame in which the pose is given")
    pose.add_argument("b", metavar="B", help="the frame whose pose it is")
    _profile(pose, "lay this profile over the file")
    pose.add_argument("--format", choices=("text", "json"), default="text", help="default: text")


def _schema(commands: Commands[argparse.ArgumentParser]) -> None:
    text = "Print the JSON Schema that editors and CI use."
    schema = commands.add_parser("schema", help="the JSON Schema of the language", description=text)
    schema.add_argument("language", nargs="?", choices=("robot", "preset"), default="robot", help="default: robot")


def _file(command: argparse.ArgumentParser) -> None:
    command.add_argument("file", nargs="?", default=DEFAULT_FILE, metavar="FILE", help="default: robot.yaml")


def _profile(command: argparse.ArgumentParser, text: str) -> None:
    command.add_argument(
        "-p", "--profile", action="append", default=[], metavar="NAME", dest="profiles", help=f"{text}; repeatable"
    )


def _seconds(text: str) -> float:
    value = float(text)
    if not 0 < value < 1e9:  # noqa: PLR2004 (thirty years)
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value
