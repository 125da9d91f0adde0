"""Import of the commands in a shell script, or in lines copied from a terminal.

The reader splits words as a POSIX shell does. It replaces variables that the script sets to plain
texts. It does not evaluate anything that needs a shell, such as ``$(…)`` and arithmetic; the
import reports these parts.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.tools.importers.command_lines import BEFORE
from tfcompose.tools.importers.executables import add_program
from tfcompose.tools.importers.program import Program
from tfcompose.tools.importers.robot_settings import is_setting, one_clock, one_namespace
from tfcompose.tools.importers.static_transforms import PROGRAM

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model.files import Target
    from tfcompose.tools.importers.draft import ImportDraft

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ASSIGNMENT = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)=(.*)", re.DOTALL)
#: Commands that prepare a shell or print a text, but start no process of a robot.
_OF_SHELL = frozenset(
    {
        "source",
        ".",
        "set",
        "echo",
        "printf",
        "wait",
        "trap",
        "exit",
        "true",
        ":",
        "shopt",
        "alias",
        "clear",
        "unset",
        "ls",
        "cat",
        "less",
        "head",
        "tail",
        "grep",
        "find",
        "pwd",
        "which",
        "man",
        "date",
        "history",
        "tfcompose",
    }
)
#: Commands that change files or end processes. Only the user knows if the robot needs them.
_ONCE = frozenset(
    {"mkdir", "cp", "mv", "rm", "ln", "touch", "chmod", "chown", "kill", "pkill", "killall", "git"}
)
#: Text before a command in a terminal: a prompt, ``me@host:~$``, and the number and the time of
#: ``history``.
_PROMPT = re.compile(r"[$%>]|[^\s@=]+@[^\s=]*[$#%>]")
_NUMBER = re.compile(r"\d+\*?")
_TIME = re.compile(r"\d{1,4}[-/.]\d\d?[-/.]\d{1,4}|\d\d?:\d\d(:\d\d)?")
#: Words that show that a line is about ROS.
_OF_ROS = re.compile(
    r"\b(ros2|rosrun|roslaunch|static_transform_publisher|robot_state_publisher|roscore)\b"
)
#: Terminals, which start another program. The robot file starts only that program, because its
#: output goes to its log.
_TERMINALS = frozenset(
    {
        "xterm",
        "gnome-terminal",
        "x-terminal-emulator",
        "konsole",
        "terminator",
        "xfce4-terminal",
        "lxterminal",
    }
)
_SHELLS = frozenset({"bash", "sh", "zsh", "dash"})
#: Programs that start another program with other settings. They become ``prefix``.
_PREFIXES = frozenset(
    {
        "nice",
        "ionice",
        "taskset",
        "chrt",
        "gdb",
        "valgrind",
        "strace",
        "perf",
        "timeout",
        "numactl",
    }
)
#: Last commands of a shell that keep its terminal open.
_STAYS_OPEN = frozenset({("exec", "bash"), ("bash",), ("read",), ("exec", "$SHELL"), ("$SHELL",)})
_CONTROL = frozenset(
    {
        "if",
        "then",
        "else",
        "elif",
        "fi",
        "for",
        "while",
        "until",
        "do",
        "done",
        "case",
        "esac",
        "function",
        "{",
        "}",
        "(",
        ")",
        "select",
        "cd",
        "sleep",
        "eval",
        "return",
        "local",
        "break",
        "continue",
        "((",
        "[[",
        "[",
        "test",
    }
)
#: Words that end a block of a script.
_ENDS = frozenset({"fi", "done", "esac", "}", ")"})
#: Words of control flow that a command follows.
_LEADING = frozenset({"then", "else", "do", "{", "(", "!"})


@dataclass(frozen=True, slots=True)
class ShellCommand:
    """A simple command of a script."""

    #: The words of the command, without quotes.
    words: tuple[str, ...]
    #: The command as it is in the script.
    text: str
    line: int
    #: Parts of the command that only a shell can evaluate.
    unknown: tuple[str, ...] = ()
    #: Whether the command is part of a pipe.
    piped: bool = False


class _ShellReader:
    """Splits a text into commands."""

    def __init__(self, text: str) -> None:
        self.text = text.replace("\r\n", "\n")
        self.offset, self.line = 0, 1
        self.variables: dict[str, str] = {}

    def commands(self) -> Iterator[ShellCommand]:
        """Yield the commands in order.

        A command has the values that its variables have at its line.
        """
        piped = False
        while self.offset < len(self.text):
            begin, line = self.offset, self.line
            argv, unknown, ended = self._words()
            body = " ".join(self.text[begin : self.offset].rstrip(";&|\n ").split())
            is_piped = piped or ended == "|"
            piped = ended == "|"
            if argv:
                line += self.text[begin : self.offset].count(
                    "\n", 0, _first_word(self.text[begin : self.offset])
                )
                yield ShellCommand(
                    tuple(argv), body.replace("\\ ", ""), line, tuple(unknown), is_piped
                )

    def _words(self) -> tuple[list[str], list[str], str]:
        """Return a command's words, their parts that need a shell, and the command's end mark."""
        argv: list[str] = []
        unknown: list[str] = []
        token: str | None = None
        while self.offset < len(self.text):
            char = self.text[self.offset]
            if char == "\\" and self.text[self.offset + 1 : self.offset + 2] == "\n":
                self._step(2)
            elif char in " \t":
                argv += [token] if token is not None else []
                token = None
                self._step()
            elif char == "#" and token is None:
                end = self.text.find("\n", self.offset)
                self._step((end if end >= 0 else len(self.text)) - self.offset)
            elif char in "\n;&|" and not self._is_redirection():
                self._step()
                double = (
                    self.offset < len(self.text)
                    and self.text[self.offset] == char
                    and char in "&|;"
                )
                self._step(1 if double else 0)
                return (
                    [*argv, *([token] if token is not None else [])],
                    unknown,
                    "||" if double else char,
                )
            elif char in "()" and token is None:
                self._step()
                argv.append(char)
            else:
                token = (token or "") + self._piece(unknown)
        return [*argv, *([token] if token is not None else [])], unknown, ""

    def _is_redirection(self) -> bool:
        """Return whether the next ``&`` belongs to ``2>&1`` or ``&>``."""
        before, behind = (
            self.text[self.offset - 1 : self.offset],
            self.text[self.offset + 1 : self.offset + 2],
        )
        return self.text[self.offset] == "&" and (before in {">", "<"} or behind == ">")

    def _piece(self, unknown: list[str]) -> str:
        """Return the next piece of a word: a quoted text, a variable, or a character."""
        char = self.text[self.offset]
        if char == "'":
            end = self.text.find("'", self.offset + 1)
            end = end if end >= 0 else len(self.text)
            piece = self.text[self.offset + 1 : end]
            self._step(end + 1 - self.offset)
            return piece
        if char == '"':
            self._step()
            pieces = []
            while self.offset < len(self.text) and self.text[self.offset] != '"':
                if self.text[self.offset] == "\\" and self.text[
                    self.offset + 1 : self.offset + 2
                ] in {
                    '"',
                    "\\",
                    "$",
                    "`",
                    "\n",
                }:
                    escaped = self.text[self.offset + 1]
                    pieces.append("" if escaped == "\n" else escaped)
                    self._step(2)
                elif self.text[self.offset] in "$`":
                    pieces.append(self._expansion(unknown))
                else:
                    pieces.append(self.text[self.offset])
                    self._step()
            self._step()
            return "".join(pieces)
        if char == "\\":
            piece = self.text[self.offset + 1 : self.offset + 2]
            self._step(2)
            return piece
        if char in "$`":
            return self._expansion(unknown)
        self._step()
        return char

    def _expansion(self, unknown: list[str]) -> str:
        rest = self.text[self.offset :]
        if rest[0] == "`":
            end = rest.find("`", 1)
            return self._unknown(end + 1 if end > 0 else len(rest), unknown)
        if rest.startswith("$("):
            return self._unknown(_closing(rest), unknown)
        braced = re.match(r"\$\{([A-Za-z_][A-Za-z0-9_]*)(?::?-([^}${]*))?\}", rest)
        plain = re.match(r"\$([A-Za-z_][A-Za-z0-9_]*|[0-9@*#?$!])", rest)
        match = braced or plain
        if match is None:
            if rest.startswith("${"):
                end = rest.find("}")
                return self._unknown(end + 1 if end > 0 else len(rest), unknown)
            self._step()
            return "$"
        value = self.variables.get(match[1], braced[2] if braced else None)
        if value is None:
            return self._unknown(match.end(), unknown)
        self._step(match.end())
        return value

    def _unknown(self, length: int, unknown: list[str]) -> str:
        piece = self.text[self.offset : self.offset + length]
        self._step(length)
        unknown.append(piece)
        return piece

    def _step(self, count: int = 1) -> None:
        self.line += self.text.count("\n", self.offset, self.offset + count)
        self.offset += count


def _first_word(text: str) -> int:
    """Return the index of the first word after blank lines and comments."""
    match = re.match(r"(?:\s|#[^\n]*\n|\\\n)*", text)
    return match.end() if match else 0


def _closing(text: str) -> int:
    """Return the length of the ``$(…)`` with which a text begins."""
    depth = 0
    for index, char in enumerate(text):
        depth += (char == "(") - (char == ")")
        if char == ")" and depth == 0:
            return index + 1
    return len(text)


@dataclass(slots=True)
class _Script:
    draft: ImportDraft
    target: Target
    file: str
    environment: dict[str, str] = field(default_factory=dict)

    def add(self, text: str) -> None:
        reader = _ShellReader(text)
        for command in reader.commands():
            self._command(command, reader.variables)

    def _todo(self, command: ShellCommand, why: str) -> None:
        self.draft.todo(
            f"{command.text}: {why}" if why else command.text, Span(self.file, command.line)
        )

    def _command(self, command: ShellCommand, variables: dict[str, str]) -> None:
        argv = _without_prompt(list(command.words))
        while argv and argv[0] in _LEADING:
            argv.pop(0)
        if argv[:1] == ["export"]:
            self._export(command, argv[1:], variables)
            return
        variables_set, argv = _assignments(argv)
        if argv[:1] == ["env"]:
            more, argv = _assignments(argv[1:])
            variables_set |= more
        if not argv:
            self._assign(variables_set, command, variables)
        elif argv[0] in _CONTROL:
            if argv[0] not in _ENDS:
                self._todo(command, "only a shell can do that")
        elif argv[0] in _ONCE:
            self._todo(command, f"{argv[0]} runs once, and starts nothing")
        elif argv[0] not in _OF_SHELL:
            self._start(command, argv, variables_set)

    def _start(
        self, command: ShellCommand, argv: list[str], variables_set: dict[str, str]
    ) -> None:
        if tuple(argv) in _STAYS_OPEN:
            return
        if command.unknown:
            self._todo(command, f"only a shell knows {', '.join(dict.fromkeys(command.unknown))}")
        elif command.piped:
            self._todo(command, "a pipe")
        elif program := _without_redirections(argv):
            self._add(command, program, variables_set)
        else:
            self._todo(command, "it opens files, and starts nothing")

    def _add(self, command: ShellCommand, argv: list[str], variables_set: dict[str, str]) -> None:
        """Add the program of a command, also in a shell, in a terminal or after a prefix."""
        if argv[0] in _TERMINALS | _SHELLS and "-c" in argv[:-1]:
            text = argv[argv.index("-c") + 1]
            if _OF_ROS.search(text):
                for inner in _ShellReader(text).commands():
                    self._command(replace(inner, line=command.line), {})
                return
        begin = _program_at(argv)
        before, rest = argv[:begin], argv[begin:]
        while before and before[0] in BEFORE:
            before.pop(0)
        if before and before[0] in _TERMINALS:
            before = []
        starts_publisher = (
            not begin and argv[0] not in {"ros2", "rosrun"} and PROGRAM in " ".join(argv[1:])
        )
        if starts_publisher or (before and before[0] not in _PREFIXES):
            self._todo(command, f"it is unknown what {argv[0]} starts")
            return
        keys = {"prefix": before} if before else {}
        env = {
            name: value
            for name, value in self.environment.items()
            if not is_setting(self.draft, name, value)
        }
        program = Program(
            Span(self.file, command.line), argv=tuple(rest), env=env | variables_set, keys=keys
        )
        add_program(self.draft, program, self.target)

    def _assign(
        self, variables_set: dict[str, str], command: ShellCommand, variables: dict[str, str]
    ) -> None:
        for name, value in variables_set.items():
            if command.unknown:
                variables.pop(name, None)
            else:
                variables[name] = value

    def _export(self, command: ShellCommand, argv: list[str], variables: dict[str, str]) -> None:
        for argument in argv:
            match = _ASSIGNMENT.fullmatch(argument)
            if match and not command.unknown:
                variables[match[1]] = self.environment[match[1]] = match[2]
            elif match:
                self._todo(command, "only a shell knows the value")
            elif _NAME.fullmatch(argument) and argument in variables:
                self.environment[argument] = variables[argument]


def _without_prompt(argv: list[str]) -> list[str]:
    """Return the command without what a terminal or ``history`` prints before it."""
    if len(argv) > 1 and _NUMBER.fullmatch(argv[0]):
        argv = argv[1:]
        while len(argv) > 1 and _TIME.fullmatch(argv[0]):
            argv = argv[1:]
    while argv and _PROMPT.fullmatch(argv[0]):
        argv = argv[1:]
    return argv


def _program_at(argv: list[str]) -> int:
    """Return the index at which the ROS program of a command begins; 0 for other commands."""
    for index, argument in enumerate(argv):
        if argument in {"rosrun", "roslaunch"} or (
            argument == "ros2" and argv[index + 1 : index + 2] in (["run"], ["launch"])
        ):
            return index
        if posixpath.basename(argument) == PROGRAM:
            return index if "/" in argument or index == 0 else 0
    return 0


def _assignments(argv: list[str]) -> tuple[dict[str, str], list[str]]:
    """Split a command into the variables that it sets and the command itself."""
    variables_set: dict[str, str] = {}
    for index, argument in enumerate(argv):
        match = _ASSIGNMENT.fullmatch(argument)
        if match is None:
            return variables_set, argv[index:]
        variables_set[match[1]] = match[2]
    return variables_set, []


def _without_redirections(argv: list[str]) -> list[str]:
    """Return the words without ``> file``, ``2>&1`` and ``< file``."""
    kept = []
    rest = iter(argv)
    for argument in rest:
        if re.fullmatch(r"[0-9&]*(>>?|<)&?[^\s]*", argument):
            if re.fullmatch(r"[0-9&]*(>>?|<)&?", argument):
                next(rest, None)
        else:
            kept.append(argument)
    return kept


def add_script(draft: ImportDraft, text: str, file: str, target: Target) -> None:
    """Add the programs that a script starts to the draft.

    Raises:
        RejectedError: if neither the name nor the first line is that of a script, and no line is
        about ROS.
    """
    if not (
        file.endswith((".sh", ".bash"))
        or text.startswith("#!")
        or not text.strip()
        or _OF_ROS.search(text)
    ):
        advice = "commands of a terminal: ros2 run …, ros2 launch …, static_transform_publisher …"
        raise RejectedError(
            [
                finding(
                    "TF002", "not a shell script, or without ROS commands", Span(file), help=advice
                )
            ]
        )
    _Script(draft, target, file).add(text)
    one_clock(draft)
    one_namespace(draft)
