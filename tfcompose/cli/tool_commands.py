"""Commands and options of tools, for the parser, the help and the completion.

Built-in tools are searched first. Tools of other packages are searched only for an unknown command
or option, and for the help.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.foundation.tool import absent, installed_tools, load, shipped_tools

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterable, Sequence

    from tfcompose.cli.command_parser import CommandModule, Parser
    from tfcompose.foundation.tool import Command, Option, Tool, Toolset


class ToolCommand:
    """A tool's command. Its module is imported when its help or its options are needed."""

    def __init__(self, tool: Tool, command: Command) -> None:
        self.tool = tool
        self.command = command

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        """The help: the module's docstring."""
        text: str | None = self._module().__doc__
        return text

    def arguments(self, parser: ArgumentParser, /) -> None:
        """Add the command's arguments."""
        self._module().arguments(parser)

    def run(self, arguments: Namespace, /) -> int:
        """Run the command and return the exit code."""
        return int(self._module().run(arguments))

    def _module(self) -> Any:
        return _load_module(self.tool, self.command.module)


class ToolOption:
    """Options that a tool adds to a command of the core."""

    def __init__(self, tool: Tool, option: Option) -> None:
        self.tool = tool
        self.option = option

    def arguments(self, parser: ArgumentParser) -> None:
        """Add the options."""
        _load_module(self.tool, self.option.module).arguments(parser)

    def run(self, command: str, arguments: Namespace) -> int | None:
        """Run the command with these options, and return the exit code.

        Return None if the command should run as usual.
        """
        code: int | None = _load_module(self.tool, self.option.module).run(command, arguments)
        return code


def _load_module(tool: Tool, module: str) -> Any:
    """Return a module of a tool.

    Raises:
        SystemExit: after an error message, if the module cannot be imported.
    """
    try:
        return load(module)
    except Exception as error:  # noqa: BLE001 (a foreign package may raise anything)
        from tfcompose.cli.terminal import reject
        from tfcompose.foundation.findings import finding

        message = f"the tool {tool.name} cannot be loaded: {type(error).__name__}: {error}"
        reject(
            [
                finding(
                    "TF921",
                    message,
                    None,
                    help=f"update or uninstall the package that provides {module}",
                )
            ],
            UNREADABLE,
        )


def summary_of(command: CommandModule) -> str:
    """Return a line about the purpose of a command, without a full stop."""
    if isinstance(command, ToolCommand):
        return command.command.summary
    return (command.__doc__ or "").partition("\n")[0].removesuffix(".")


def all_commands() -> list[ToolCommand]:
    """Return the commands of all installed tools."""
    return [ToolCommand(tool, command) for tool, command in installed_tools().commands()]


def find(name: str) -> ToolCommand | None:
    """Return the command of a tool; None if no tool has it."""
    for toolset in (shipped_tools, installed_tools):
        for tool, command in toolset().commands():
            if command.name == name:
                return ToolCommand(tool, command)
    return None


#: Names of commands in other programs, and the corresponding commands of the core.
_SYNONYMS = {
    "check": "lint",
    "create": "init",
    "kill": "down, or tfcompose stop PROCESS",
    "launch": "up",
    "list": "ps",
    "log": "logs",
    "ls": "ps",
    "new": "init",
    "run": "up",
    "status": "ps",
    "top": "ps",
    "validate": "lint",
}


def instead_of(name: str) -> str:
    """Return advice for a command name from another program, empty for other names."""
    of_tools = (pair for _, command in installed_tools().commands() for pair in command.synonyms)
    command = (_SYNONYMS | dict(of_tools)).get(name)
    return f"that is tfcompose {command}" if command else ""


def add_options(name: str, parser: Parser, argv: Sequence[str]) -> list[ToolOption]:
    """If the line has an unknown option, add the options of tools to the command.

    Return the added options.
    """
    added: list[ToolOption] = []
    for toolset in (shipped_tools, installed_tools):
        if not parser.lacks_option(argv):
            break
        added += _add(name, parser, toolset(), added)
    else:
        _refuse_absent(parser, argv)
    return added


def add_all_options(name: str, parser: Parser) -> list[ToolOption]:
    """Add the options of all installed tools to a command. Return the added options."""
    return _add(name, parser, installed_tools(), ())


def _add(
    name: str, parser: Parser, toolset: Toolset, before: Iterable[ToolOption]
) -> list[ToolOption]:
    names = {option.option for option in before}
    added = [
        ToolOption(tool, option)
        for tool in toolset.tools
        for option in tool.options
        if name in option.commands and option not in names
    ]
    for option in added:
        option.arguments(parser)
    return added


def _refuse_absent(parser: Parser, argv: Sequence[str]) -> None:
    """Reject an option of a built-in tool that is not installed.

    Raises:
        SystemExit: after an error message that tells how to install the tool.
    """
    if not parser.lacks_option(argv):
        return
    for argument in argv:
        if missing := absent(argument.partition("=")[0], "option"):
            fail(missing, UNREADABLE)


def report_problems() -> None:
    """Print problems of tools from other packages."""
    problems = installed_tools().problems
    if problems:
        from tfcompose.cli.terminal import print_findings
        from tfcompose.foundation.findings import finding

        findings = [finding(code, message, None, help=help_) for code, message, help_ in problems]
        print_findings(findings, sys.stderr)
