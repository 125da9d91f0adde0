"""Parser of one command's options; each error suggests a way out."""

from __future__ import annotations

import re
from argparse import SUPPRESS, ArgumentParser, HelpFormatter, Namespace
from functools import partial
from itertools import takewhile
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, Protocol

from tfcompose.cli.terminal import UNREADABLE, fail, size_of

if TYPE_CHECKING:
    from argparse import Action
    from collections.abc import Iterable, Sequence


class ArgumentRow(NamedTuple):
    """An argument of a command in the command's help."""

    #: The longest option, such as ``--profile``, or the name of the value in the parsed arguments.
    name: str
    #: All options with their value, such as ``-p NAME, --profile NAME``.
    form: str
    help: str


class _Formatter(HelpFormatter):
    def row(self, action: Action) -> ArgumentRow:
        """Return an argument's row in the help."""
        name = max(action.option_strings, key=len, default=action.dest)
        return ArgumentRow(name, self._format_action_invocation(action), self._expand_help(action))


class Parser(ArgumentParser):
    """Parser that suggests the nearest option and refers to the help."""

    #: The required arguments as the user types them.
    _required = ""

    def error(self, message: str) -> NoReturn:
        """Print the error and end the command.

        Raises:
            SystemExit: with 2.
        """
        import difflib

        advice = f"{self.prog} --help lists the options"
        if message.startswith("unrecognized arguments"):
            options = [
                token.partition("=")[0] for token in message.split() if token.startswith("-")
            ]
            options_of_command = [
                text for action in self._actions for text in action.option_strings
            ]
            near = [
                match
                for option in options
                for match in difflib.get_close_matches(option, options_of_command, 1)
            ]
            advice = f"did you mean {near[0]}?" if near else advice
        elif message.startswith("the following arguments are required"):
            advice = f"type {self.prog} {self._required}; {advice}"
        fail(f"{self.prog.partition(' ')[2]}: {message}; {advice}", UNREADABLE)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse the command line; ``cameras:=4`` sets an argument of the robot file.

        Arguments of the robot file may be anywhere on the command line.
        """
        argv = list(args or ())
        # argparse takes only plain negative numbers as values; no option begins with a digit.
        self._negative_number_matcher = _NEGATIVE
        required = [action for action in self._actions if action.required]
        self._required = " ".join(  # argparse requires no option beside an argument
            " ".join([*action.option_strings[-1:], str(action.metavar or action.dest)])
            for action in sorted(required, key=lambda action: bool(action.option_strings))
        )
        ros_args: list[str] = []
        takes_args = any(action.dest == "arg_values" for action in self._actions)
        if any(action.dest == "ros_args" for action in self._actions):
            argv, ros_args = split_ros_args(argv)
        settings, rest = self._settings(argv) if takes_args else ([], argv)
        if ros_args:
            namespace = Namespace(**vars(namespace or Namespace()), ros_args=ros_args)
        arguments = super().parse_intermixed_args(rest, namespace)
        if takes_args:
            from tfcompose.cli.options import pairs

            arguments.arg_values = pairs([*settings, *arguments.arg_values], ":=")
        return arguments

    def _settings(self, argv: Sequence[str]) -> tuple[list[str], list[str]]:
        """Return two lists: arguments NAME:=VALUE, and all other arguments.

        An argument NAME:=VALUE that belongs to an option or follows ``--`` is in the second list.
        """
        renaming = {
            option
            for action in self._actions
            if ":=" in str(action.metavar)
            for option in action.option_strings
        }
        settings: list[str] = []
        rest: list[str] = []
        before = ""
        for number, argument in enumerate(argv):
            if argument == "--":
                rest += argv[number:]
                break
            is_setting = _GIVEN.match(argument) and before not in renaming
            (settings if is_setting else rest).append(argument)
            before = argument
        return settings, rest

    def argument_rows(self) -> dict[str, list[ArgumentRow]]:
        """Return the arguments by heading, without ``--help``."""
        formatter = _Formatter(self.prog)
        rows: dict[str, list[ArgumentRow]] = {}
        for action in self._actions:
            if action.help != SUPPRESS and action.dest != "help":
                heading = "Options" if action.option_strings else "Arguments"
                rows.setdefault(heading, []).append(formatter.row(action))
        return rows

    def lacks_option(self, argv: Iterable[str]) -> bool:
        """Return whether an argument is an option that the parser does not have."""
        options = takewhile(lambda argument: argument != "--", argv)
        names = {argument.partition("=")[0] for argument in options if argument.startswith("--")}
        return not names <= self._option_string_actions.keys()


def split_ros_args(argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return two lists: the command line without ROS arguments, and the ROS arguments.

    ROS arguments follow ``--ros-args``, up to the end or ``--``, as in rcl.
    """
    rest: list[str] = []
    ros_args: list[str] = []
    target = rest
    for argument in argv:
        if argument == "--ros-args":
            target = ros_args
        elif argument == "--" and target is ros_args:
            target = rest
        else:
            target.append(argument)
    return rest, ros_args


#: The beginning of a negative number, which may have a unit: -0.5deg.
_NEGATIVE = re.compile(r"-\.?\d")
#: A word that gives an argument of a robot, xacro or launch file its value.
_GIVEN = re.compile(r"[^\s=:-][^\s=:]*:=")


class CommandModule(Protocol):
    """Module of a command, or an object in one.

    The first line of its docstring is its summary in lists, the rest its help.
    """

    __doc__: str | None

    def arguments(self, parser: ArgumentParser, /) -> None:
        """Add the command's arguments."""

    def run(self, arguments: Namespace, /) -> int:
        """Run the command and return the exit code."""


def command_parser(name: str, command: CommandModule, columns: int = 0) -> Parser:
    """Return the parser of a command, without the options that tools add to it.

    The help is ``columns`` wide, at most 100. The default is the terminal's width.
    """
    width = columns or min(100, size_of(1)[0] - 2)
    parser = Parser(
        prog=f"tfcompose {name}",
        description=(command.__doc__ or "").partition("\n\n")[2],
        formatter_class=partial(HelpFormatter, width=width),
        allow_abbrev=False,
    )
    command.arguments(parser)
    return parser
