"""The command ``tfcompose``: commands of the core, parsing of options, and the exit code.

The parser imports the modules of all core commands. So these modules import little at the top, and
a command imports further modules when it runs. ``tool_commands`` finds other commands.
"""

from __future__ import annotations

import errno
import gc
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose import __version__
from tfcompose.cli import tool_commands
from tfcompose.cli.command_parser import CommandModule, Parser, command_parser
from tfcompose.cli.commands import (
    build,
    completion,
    diff,
    doctor,
    down,
    echo,
    events,
    explain,
    graph,
    guard,
    init,
    lint,
    logs,
    manual,
    monitor,
    pose,
    presets,
    ps,
    schema,
    steering,
    tree,
    up,
    verify,
    wait,
)
from tfcompose.cli.terminal import INTERRUPTED, OUTPUT_CLOSED, UNREADABLE
from tfcompose.foundation.signals import RememberedInterrupt, take_interrupt

if TYPE_CHECKING:
    from typing import TextIO


#: The core's commands grouped by purpose, in the order of the help.
GROUPS: dict[str, dict[str, CommandModule]] = {
    "Write": {"init": init, "presets": presets, "schema": schema},
    "Check": {
        "lint": lint,
        "build": build,
        "diff": diff,
        "pose": pose,
        "explain": explain,
        "tree": tree,
        "graph": graph,
    },
    "Run": {
        "up": up,
        "guard": guard,
        "down": down,
        "ps": ps,
        "logs": logs,
        "events": events,
        "restart": steering.RESTART,
        "stop": steering.STOP,
        "start": steering.START,
        "wait": wait,
    },
    "Look": {"doctor": doctor, "monitor": monitor, "echo": echo, "verify": verify},
    "Ship": {},
    "Help": {"help": manual, "completion": completion},
}
COMMANDS: dict[str, CommandModule] = {
    name: command for group in GROUPS.values() for name, command in group.items()
}


def all_groups() -> dict[str, dict[str, CommandModule]]:
    """Return the commands of the core and of all installed tools by group."""
    groups = {title: dict(commands) for title, commands in GROUPS.items()}
    helps = groups.pop("Help")
    for tool_command in tool_commands.all_commands():
        named = tool_command.command
        groups.setdefault(named.group, {})[named.name] = tool_command
    return {title: commands for title, commands in groups.items() if commands} | {"Help": helps}


def all_commands() -> dict[str, CommandModule]:
    """Return the commands of the core and of all installed tools by name."""
    return {name: command for group in all_groups().values() for name, command in group.items()}


def find_command(name: str) -> CommandModule | None:
    """Return a command of the core, or else of a tool; None if there is no such command."""
    return COMMANDS.get(name) or tool_commands.find(name)


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return the exit code.

    The code is 0 without problems, 1 for findings or a failed process, 2 for wrong use.
    """
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        _escape_what_cannot_be_encoded(stream)
    try:
        code = _main(sys.argv[1:] if argv is None else argv)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        _discard_output()
        return OUTPUT_CLOSED
    except OSError as error:
        if error.errno == errno.ENOENT and not _has_working_folder():
            sys.stderr.write("tfcompose: the current folder was removed; cd to an existing one\n")
            return UNREADABLE
        if error.errno in _OF_A_PATH and error.filename is not None:
            return _refuse_path(error)
        if error.errno != errno.ENOSPC:
            raise
        _discard_output()
        sys.stderr.write(f"tfcompose: the output cannot be written: {error.strerror}\n")
        return UNREADABLE
    return code


#: Errors of the operating system about a path from the user. The command is not at fault.
_OF_A_PATH = frozenset(
    {errno.EACCES, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG, errno.ENOTDIR, errno.EROFS}
)


def _refuse_path(error: OSError) -> int:
    from tfcompose.cli.terminal import print_findings
    from tfcompose.foundation.reading import unreadable

    print_findings(unreadable(os.fsdecode(error.filename), error).findings, sys.stderr)
    return UNREADABLE


def _main(argv: list[str]) -> int:
    if "_ARGCOMPLETE" in os.environ:  # the shell's completion sets this
        from tfcompose.cli.completing import complete

        complete(all_commands())
    command = argv[0] if argv else ""
    if command in {"-h", "--help"} or argv == ["help"]:
        sys.stdout.write(help_text())
        return 0
    if command in {"-V", "--version"}:
        sys.stdout.write(f"tfcompose {__version__}\n")
        return 0
    module = find_command(command) if command else None
    return _unknown(command) if module is None else _run(command, module, argv[1:])


def _run(name: str, command: CommandModule, argv: list[str]) -> int:
    gc.set_threshold(200_000, 50, 1000)  # a large build creates many objects and little garbage
    with RememberedInterrupt():
        try:
            code = _run_command(name, command, argv)
        except BaseException:
            # During imports, Python and pydantic's Rust code turn a Ctrl-C into other errors.
            if take_interrupt():
                return INTERRUPTED
            raise
    return INTERRUPTED if take_interrupt() else code


def _run_command(name: str, command: CommandModule, argv: list[str]) -> int:
    try:
        parser = command_parser(name, command)
        if not {"-h", "--help"}.isdisjoint(argv):  # argparse would ignore that the reader is gone
            tool_commands.add_all_options(name, parser)
            sys.stdout.write(parser.format_help())
            return 0
        options = tool_commands.add_options(name, parser, argv)
        parser.set_defaults(commands=all_commands)  # for commands that describe other commands
        arguments = parser.parse_args(argv)
        if getattr(arguments, "show_args", False):
            from tfcompose.cli.args import show_args

            return show_args(arguments)
        for option in options:
            code = option.run(name, arguments)
            if code is not None:
                return code
        return command.run(arguments)
    except SystemExit as end:  # after an error message
        return end.code if isinstance(end.code, int) else UNREADABLE


def parser_of(name: str, columns: int = 0) -> Parser:
    """Return the parser of a command, with the options that tools add to the command.

    The help is ``columns`` wide. The default is the terminal's width.

    Raises:
        KeyError: if there is no such command.
    """
    command = find_command(name)
    if command is None:
        raise KeyError(name)
    parser = command_parser(name, command, columns)
    tool_commands.add_all_options(name, parser)
    return parser


def help_text() -> str:
    """Return the output of ``tfcompose --help``."""
    from textwrap import fill

    from tfcompose.cli.documentation import topics

    names = fill(", ".join(topics()), 76, initial_indent="  ", subsequent_indent="  ")
    groups = all_groups()
    width = max(len(name) for commands in groups.values() for name in commands)
    sections = (
        f"{title}:\n"
        + "".join(
            f"  {name:<{width}}  {tool_commands.summary_of(command)}\n"
            for name, command in commands.items()
        )
        for title, commands in groups.items()
    )
    tool_commands.report_problems()
    return (
        "usage: tfcompose COMMAND [OPTION …]\n\n"
        "One YAML file says which frames a robot has and who publishes each TF edge.\n"
        "tfcompose checks it, builds it, starts it, and reports any node that\n"
        "publishes an edge it does not own.\n\n"
        + "\n".join(sections)
        + "\noptions:\n  -V, --version  print the version\n"
        "  -h, --help     print this help; after a command: its options\n\n"
        f"topics, for tfcompose help TOPIC:\n{names}\n"
    )


def _unknown(command: str) -> int:
    if not command:
        sys.stderr.write(help_text())
        return UNREADABLE
    import difflib

    from tfcompose.foundation.tool import absent

    tool_commands.report_problems()
    if missing := absent(command, "command"):
        sys.stderr.write(f"tfcompose: {missing}\n")
        return UNREADABLE
    near = difflib.get_close_matches(command, all_commands(), 1, cutoff=0.7)
    advice = tool_commands.instead_of(command) or (
        f"did you mean {near[0]}?" if near else "tfcompose --help lists them"
    )
    kind = "option" if command.startswith("-") else "command"
    sys.stderr.write(f"tfcompose: unknown {kind} {command}; {advice}\n")
    return UNREADABLE


def _open_closed_streams() -> None:
    """Replace standard streams that were closed at the start (``>&-``).

    Python represents a closed stream by None. The replacement discards all output.
    """
    for fd, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is not None:
            continue
        nowhere = os.open(os.devnull, os.O_RDWR)
        if nowhere != fd:
            os.dup2(nowhere, fd)
            os.close(nowhere)
        setattr(sys, name, os.fdopen(fd, mode, closefd=False))


def _escape_what_cannot_be_encoded(stream: TextIO) -> None:
    """Make the stream print escapes for characters that it cannot encode, instead of raising."""
    reconfigure = getattr(stream, "reconfigure", None)
    if reconfigure:
        reconfigure(errors="backslashreplace")


def _discard_output() -> None:
    """Discard buffered output, without a traceback, because the reader is gone."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _has_working_folder() -> bool:
    try:
        Path.cwd()
    except FileNotFoundError:
        return False
    return True
