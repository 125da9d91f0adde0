"""The commands, and how their options are read.

The list of commands is a table, so that ``--help`` costs little more than starting Python; a command's module, and all
that it needs, is loaded when the command is used.
"""

from __future__ import annotations

import atexit
import errno
import gc
import os
import sys
from importlib import import_module

from tfcompose import __version__

TYPE_CHECKING = False  # as type checkers know it, without loading typing
if TYPE_CHECKING:
    from argparse import ArgumentParser, HelpFormatter
    from typing import TextIO

#: Each command is the module of its name in ``commands`` (or of one in ``_MODULES``), with ``arguments`` and ``run``.
COMMANDS = {
    "lint": "find everything that is wrong; starts nothing, needs no ROS",
    "build": "write the URDF and the plan: all of it, or nothing",
    "export": "the plan for systemd, docker compose or ros2 launch",
    "up": "start the robot, or a built plan, and guard its TF tree",
    "ps": "the processes of running robots: state, pid, time, restarts, use, edges",
    "logs": "what the processes of a robot wrote, also after it has ended",
    "events": "what happens in a running robot",
    "restart": "restart one process of a running robot",
    "stop": "stop one process of a running robot",
    "start": "start one process that was stopped, or has ended",
    "wait": "wait until a running robot has ended, or is ready",
    "down": "stop a running robot",
    "echo": "the live pose of B in A",
    "doctor": "what is wrong with the running tree, and what to do",
    "monitor": "who publishes each live edge, how often, how evenly and how late",
    "graph": "the tree as a picture: SVG, PDF, PNG, DOT or Mermaid",
    "verify": "what a robot file says, against what is published, live or in a bag",
    "tree": "the tree with kinds, owners and poses; --live: as it is published",
    "pose": "the pose of B in A, from the spec alone",
    "explain": "a code's page, or the chain between two frames",
    "diff": "what moved or changed owner between two robots",
    "presets": "the sensors and nodes that are known; one of them in full",
    "schema": "the language as JSON Schema for editors, or with `--reference` as Markdown for people",
    "import": "a robot file from a URDF or xacro file",
}
#: A module cannot have the name of every command: ``import`` is a word of Python's own.
_MODULES = {"import": "importing"}


#: Commands that run until somebody ends them.
LASTING = frozenset({"up", "echo", "monitor", "verify"})

#: The exit code of a command whose output nobody reads any more: what a shell says of a program ended by SIGPIPE.
UNREAD = 141
#: That of one that was ended by Ctrl-C before it had begun what it is for.
INTERRUPTED = 130


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit code: 0 clean, 1 findings or a failed process, 2 wrong use."""
    _opened()
    _steady(sys.stdout, sys.stderr)
    try:
        code = _main(sys.argv[1:] if argv is None else argv)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return _unwritten()
    except OSError as error:
        if error.errno == errno.ENOENT and not _is_somewhere():
            sys.stderr.write("tfcompose: the folder that this is typed in was removed; cd to one that is there\n")
            return 2
        if error.errno != errno.ENOSPC:
            raise
        _unwritten()
        sys.stderr.write(f"tfcompose: the output cannot be written: {error.strerror}\n")
        return 2
    return code


def _is_somewhere() -> bool:
    """Return whether the current folder is there."""
    try:
        os.getcwd()  # noqa: PTH109 (pathlib is loaded where it is needed)
    except FileNotFoundError:
        return False
    return True


def _main(words: list[str]) -> int:
    command = words[0] if words else ""
    if command in {"-h", "--help", "help"}:
        sys.stdout.write(help_text())
        return 0
    if command == "--version":
        sys.stdout.write(f"tfcompose {__version__}\n")
        return 0
    return _run(command, words[1:]) if command in COMMANDS else _no_command(command)


def _opened() -> None:
    """Give a process that was started with closed streams (``>&-``) some that lead nowhere: Python has None there."""
    for fd, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is not None:
            continue
        nowhere = os.open(os.devnull, os.O_RDWR)
        if nowhere != fd:
            os.dup2(nowhere, fd)
            os.close(nowhere)
        setattr(sys, name, os.fdopen(fd, mode, closefd=False))


def _steady(*streams: TextIO | None) -> None:
    """Let a terminal that lacks a character, or a file name that is no text, show as an escape, not as a traceback."""
    for stream in streams:
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure:
            reconfigure(errors="backslashreplace")


def help_text() -> str:
    """Return what ``tfcompose --help`` prints."""
    width = max(map(len, COMMANDS))
    rows = "".join(f"  {name:<{width}}  {text}\n" for name, text in COMMANDS.items())
    return (
        "usage: tfcompose COMMAND [OPTION …]\n\n"
        "One YAML file says which frames a robot has and who publishes each TF edge.\n"
        "tfcompose checks it, builds it, starts it, and names whoever publishes an edge\n"
        "that is not theirs.\n\n"
        f"commands:\n{rows}\n"
        "options:\n  --version  print the version\n  --help     this text; after a command: its options\n"
    )


def _no_command(command: str) -> int:
    if not command:
        sys.stderr.write(help_text())
        return 2
    near = import_module("difflib").get_close_matches(command, COMMANDS, 1)
    advice = f"did you mean {near[0]}?" if near else "tfcompose --help lists them"
    kind = "option" if command.startswith("-") else "command"
    sys.stderr.write(f"tfcompose: there is no {kind} {command}; {advice}\n")
    return 2


def _run(command: str, words: list[str]) -> int:
    # Looking for circles of garbage costs a fifth of a large build: nobody looks before it is over, and rarely later.
    gc.set_threshold(200_000, 50, 1000)
    if command not in LASTING:
        gc.disable()
        atexit.unregister(gc.freeze)
        atexit.register(gc.freeze)  # nor does the interpreter when it ends
    interrupt = import_module("tfcompose.interrupt")
    try:
        with interrupt.Remembered():
            code = _run_command(command, words)
        return INTERRUPTED if interrupt.taken() else code
    finally:
        gc.enable()


def _run_command(command: str, words: list[str]) -> int:
    module = import_module(f"tfcompose.cli.commands.{_MODULES.get(command, command)}")
    parser = parser_of(command)
    if not {"-h", "--help"}.isdisjoint(words):  # argparse would say nothing of a reader that is gone
        sys.stdout.write(parser.format_help())
        return 0
    try:
        arguments = parser.parse_args(words)
    except SystemExit as end:  # after wrong use
        return end.code if isinstance(end.code, int) else 2
    code: int = module.run(arguments)
    return code


def _unwritten() -> int:
    """Return the exit code for output that nobody reads; what is still held back goes nowhere, without a traceback."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return UNREAD


def parser_of(command: str) -> ArgumentParser:
    """Return the parser of one command."""
    argparse = import_module("argparse")
    module = import_module(f"tfcompose.cli.commands.{_MODULES.get(command, command)}")
    width = _width()

    def formatter(prog: str) -> HelpFormatter:
        made: HelpFormatter = argparse.HelpFormatter(prog, width=width)
        return made

    parser: ArgumentParser = argparse.ArgumentParser(
        prog=f"tfcompose {command}", description=(module.__doc__ or "").partition("\n\n")[2], formatter_class=formatter,
        allow_abbrev=False,
    )  # fmt: skip
    module.arguments(parser)
    return parser


def _width() -> int:
    """Return the terminal's width, without what the standard library loads to find it out."""
    try:
        return min(100, os.get_terminal_size().columns - 2)
    except OSError:
        return 78
