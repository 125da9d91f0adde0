"""Text that is not YAML: where the fault stands, and what to write instead.

The parser points at the place where it cannot go on, which is often a line below the fault, and
says what it expected in the grammar's words. Each diagnosis knows one slip of the pen by its place
and the lines around it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import yaml

from tfcompose.foundation.findings import Edit, Finding, Note, Span, finding
from tfcompose.foundation.text import plural

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


def no_character(error: yaml.reader.ReaderError, text: str, file: str) -> Finding:
    """Return the finding for a character that must not stand in YAML."""
    hit = yaml.reader.Reader.NON_PRINTABLE.search(text)  # the C parser's position counts bytes
    position = hit.start() if hit else error.position
    line, column = text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)
    return finding(
        "TF002", "a character that YAML does not allow", Span(file, line, column, line, column + 1)
    )


def no_syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> list[Finding]:
    """Return the finding for text that the parser refuses, with where it began.

    Where an expression lacks its quotes, each other one in the text that does has a finding too:
    the parser stops at the first.
    """
    mark, began = error.problem_mark or error.context_mark, error.context_mark
    lines = text.splitlines()
    message = ", ".join(filter(None, (error.context, error.problem)))
    fault = _Fault(
        lines,
        (mark.line, mark.column) if mark else (0, 0),
        (began.line, began.column) if began else None,
        message,
    )
    if "parsing a flow" in message and "${" in fault.stopped:
        bare = list(bare_expressions(text, file))
        if any(span.span and span.span.line == fault.at[0] + 1 for span in bare):
            return bare
    diagnosis = next((found for known in _DIAGNOSES if (found := known(fault))), None)
    line, column = diagnosis.at if diagnosis else fault.at
    span = Span(file, line + 1, column + 1, line + 1, column + 2)
    notes = []
    if fault.began and fault.began[0] != line and (diagnosis is None or diagnosis.has_beginning):
        first, left = fault.began
        notes = [Note("it began here", Span(file, first + 1, left + 1, first + 1, left + 2))]
    if diagnosis is None:
        return [finding("TF002", message, span, notes=notes)]
    return [finding("TF002", diagnosis.message, span, help=diagnosis.help, notes=notes)]


def no_yaml(text: str, file: str) -> Finding:
    """Return the finding for XML where YAML is expected: most often a URDF as a robot file."""
    is_xacro = "ros.org/wiki/xacro" in text
    key = "xacro" if is_xacro else "urdf"
    advice = (
        f"tfcompose import {file} -o robot.yaml; or take it as a part: parts: {{NAME: {{{key}:"
        f" {file}}}}}"
    )
    return finding(
        "TF002",
        "this is XML, and YAML is expected",
        Span(file),
        help=advice if "<robot" in text else "",
    )


#: What may stand in a line of YAML, as far as brackets and expressions go: a comment, a text in
#: quotes, a bracket, the end of a value, a value without quotes that holds an expression, another.
_TOKENS = re.compile(
    r"""
    (?P<comment> (?:(?<=\s)|^)\#.* )
    | (?P<quoted> "(?:\\.|[^"\\])*" | '(?:''|[^'])*' )
    | (?P<bare>
        (?: [^\s,\[\]{}"'\#$] | \$(?!\{) )*
        (?: \$\{[^{}"']*\} [^\s,\[\]{}"'$]* (?: \s*[-+*/]\s*(?=[\d$.]) )? )+
        [\d.]*
      )
    | (?P<open> [\[{] ) | (?P<close> [\]}] )
    | (?P<other> [^\s\[\]{}"'\#$]+ | . )
    """,
    re.MULTILINE | re.VERBOSE,
)
#: What is arithmetic around an expression, with the expressions taken out.
_ARITHMETIC = re.compile(r"[-+*/().\d\s]*")


def bare_expressions(text: str, file: str) -> Iterator[Finding]:
    """Find expressions inside [ ] or { } that lack their quotes.

    The edit puts the whole value into one pair of quotes, and arithmetic into the braces.
    """
    depth, line, begin = 0, 1, 0
    for token in _TOKENS.finditer(text):
        line += text.count("\n", begin, token.start())
        begin = token.start()
        if token.lastgroup == "open":
            depth += 1
        elif token.lastgroup == "close":
            depth = max(0, depth - 1)
        if token.lastgroup != "bare" or not depth:
            continue
        value = token[0].rstrip()
        column = begin - text.rfind("\n", 0, begin)
        span = Span(file, line, column, line, column + len(value))
        quoted = f'"{_in_braces(value)}"'
        yield finding(
            "TF002",
            f"{value} needs quotes inside [ ] or {{ }}",
            span,
            help=f"write {quoted}",
            edits=[Edit(span, quoted)],
        )


def _in_braces(value: str) -> str:
    """Return a value whose arithmetic is inside of the braces of its expression."""
    rest = _EXPRESSION.sub("", value)
    if not rest or not _ARITHMETIC.fullmatch(rest):
        return value
    inner = _EXPRESSION.sub(lambda match: _operand(match[0][2:-1].strip()), value)
    return f"${{{inner}}}"


def _operand(expression: str) -> str:
    """Return an expression as an operand of a product: a sum needs brackets."""
    is_sum = re.search(r"[^\s*/(+-]\s*[-+]", expression)
    return f"({expression})" if is_sum else expression


@dataclass(frozen=True, slots=True)
class _Fault:
    """The parser's message: line and column of its stop and of what it was reading."""

    lines: list[str]
    at: tuple[int, int]
    began: tuple[int, int] | None
    message: str

    def line(self, number: int) -> str:
        return self.lines[number] if 0 <= number < len(self.lines) else ""

    @property
    def stopped(self) -> str:
        """The line where the parser stopped."""
        return self.line(self.at[0])

    def above(self) -> int:
        """Return the number of the nearest line above with anything but a comment, or -1."""
        number = self.at[0] - 1
        while number >= 0 and not self.lines[number].split("#")[0].strip():
            number -= 1
        return number


@dataclass(frozen=True, slots=True)
class _Diagnosis:
    at: tuple[int, int]
    message: str
    help: str
    has_beginning: bool = False


#: Key and value in a line, as they should be; with a key in quotes too.
_PAIR = re.compile(r"""\s*(?:- )?(?:[\w/.${}-]+|"[^"]*"|'[^']*'):\s+[^\s#]""")
_LONE_WORD = re.compile(r"( *)([\w/.-]+)\s*(?:#.*)?")
_WORDS = re.compile(r"( *)(?:- )?([\w/.-]+)\s+([^\s:#][^:]*)")
_GLUED_PAIR = re.compile(r"( *)(?:- )?([A-Za-z_]\w*):([^\s/].*)")
_EXPRESSION = re.compile(r"\$\{[^{}\"']*\}")
_CLOSING = {"{": "}", "[": "]"}
#: Texts in quotes, comments and expressions, in which brackets are none; and brackets.
_TOKEN = re.compile(r"""\"(?:[^"\\]|\\.)*\"|'[^']*'|(?<![^\s])#[^\n]*|\$\{[^{}\n]*\}|[][{}]""")


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _tab(fault: _Fault) -> _Diagnosis | None:
    if "\t" not in fault.stopped[: _indent(fault.stopped)]:
        return None
    return _Diagnosis(
        fault.at, "a tab in the indentation", "indent with spaces; YAML does not allow tabs there"
    )


def _key_without_colon(fault: _Fault) -> _Diagnosis | None:
    """A key that the parser still waits for the colon of."""
    if (
        not fault.began
        or "expected ':'" not in fault.message
        or fault.began[0] >= len(fault.lines)
    ):
        return None
    return _no_colon(fault.lines[fault.began[0]], fault.began)


def _no_colon(line: str, at: tuple[int, int]) -> _Diagnosis:
    """Return the diagnosis of a line without a colon: a key alone, or a key and its value."""
    pair = _WORDS.fullmatch(line)
    if pair:
        return _Diagnosis(at, f"{pair[2]} has no colon", f"write {pair[2]}: {pair[3].strip()}")
    text = line.split(" #", maxsplit=1)[0].strip()
    return _Diagnosis(at, f"{text} has no colon", f"write {text}:")


def _is_late(fault: _Fault) -> bool:
    """Return whether the parser took the line above for a value that goes on here."""
    return "mapping values are not allowed" in fault.message or "parsing a block" in fault.message


def _word_above(fault: _Fault) -> _Diagnosis | None:
    """A lone word above a line that is indented more."""
    above = fault.above()
    match = _LONE_WORD.fullmatch(fault.line(above)) if _is_late(fault) and above >= 0 else None
    if not match or not fault.stopped or len(match[1]) >= _indent(fault.stopped):
        return None
    return _no_colon(fault.line(above), (above, len(match[1])))


def _pair_above(fault: _Fault) -> _Diagnosis | None:
    """A key and a value above without a colon, or without a space behind it."""
    if "mapping values are not allowed" not in fault.message:
        return None
    above = fault.above()
    while above > 0 and fault.line(above - 1).strip() and _WORDS.fullmatch(fault.line(above - 1)):
        above -= 1  # the first of several lines in a row
    line = fault.line(above)
    glued = _GLUED_PAIR.fullmatch(line)
    if glued:
        message = f"a space after the colon of {glued[2]} is missing"
        return _Diagnosis((above, len(glued[1])), message, f"write {glued[2]}: {glued[3]}")
    pair = _WORDS.fullmatch(line)
    return _no_colon(line, (above, len(pair[1]))) if pair else None


def _two_in_a_line(fault: _Fault) -> _Diagnosis | None:
    """Two keys in one line: ``frames: mast: {}``."""
    line, column = fault.stopped, fault.at[1]
    if "mapping values are not allowed" not in fault.message or not (
        pair := _PAIR.match(line[:column])
    ):
        return None
    outer, _, inner = line[:column].partition(":")
    key = inner.strip()
    if " " in key:
        advice = f"put the value in quotes, if {key}: belongs to it"
        return _Diagnosis(fault.at, "a second colon in the value", advice)
    advice = f"{key}: belongs in the next line, indented more than {outer.strip()}"
    return _Diagnosis(
        (fault.at[0], pair.end() - 1),
        f"{key} is a key in the line of another, {outer.strip()}",
        advice,
    )


def _below_a_value(fault: _Fault) -> _Diagnosis | None:
    """A line that is indented more than the key and value above it."""
    above, indent = fault.above(), _indent(fault.stopped)
    if "mapping values are not allowed" not in fault.message or above < 0:
        return None
    left = _indent(fault.line(above))
    if not _PAIR.match(fault.line(above)) or indent <= left:
        return None
    message = (
        f"indented by {plural(indent, 'space')}, below a line with a value that is indented by"
        f" {left}"
    )
    return _Diagnosis(
        (fault.at[0], indent), message, f"begin it in column {left + 1}, as line {above + 1} does"
    )


def _between_levels(fault: _Fault) -> _Diagnosis | None:
    """A line that is indented neither as the mapping that it belongs to nor more."""
    if (
        not fault.began
        or "parsing a block" not in fault.message
        or _indent(fault.stopped) != fault.at[1]
    ):
        return None
    line, left = fault.began
    if fault.at[1] == left:
        return None
    message = f"indented by {plural(fault.at[1], 'space')}, and what it belongs to by {left}"
    advice = f"begin it in column {left + 1}, as line {line + 1} does"
    return _Diagnosis(fault.at, message, advice, has_beginning=True)


def _comment(fault: _Fault) -> _Diagnosis | None:
    """A comment as in C."""
    rest = fault.stopped[fault.at[1] :]
    if not rest.startswith(("//", "/*")):
        return None
    return _Diagnosis(
        fault.at, f"a comment begins with #, not {rest[:2]}", f"write # {rest[2:].strip(' */')}"
    )


def _open_bracket(fault: _Fault) -> _Diagnosis | None:
    """A bracket that is closed nowhere, or by one of the other kind."""
    if not fault.began or "parsing a flow" not in fault.message:
        return None
    line, column = fault.began
    bracket = fault.line(line)[column : column + 1]
    if bracket not in _CLOSING:
        return None
    closes = fault.stopped[fault.at[1] : fault.at[1] + 1]
    if closes in _CLOSING.values() and closes != _CLOSING[bracket]:
        message = f"{bracket} is closed by {closes}"
        return _Diagnosis(
            fault.at, message, f"write {_CLOSING[bracket]} before it", has_beginning=True
        )
    if not _is_left_open(fault.lines[line:], column):
        return None
    return _Diagnosis(
        fault.began, f"{bracket} is not closed", f"close it with {_CLOSING[bracket]}"
    )


def _open_quote(fault: _Fault) -> _Diagnosis | None:
    if not fault.began or "scanning a quoted scalar" not in fault.message:
        return None
    quote = fault.line(fault.began[0])[fault.began[1] : fault.began[1] + 1]
    if "end of stream" not in fault.message or not quote:
        return None
    return _Diagnosis(fault.began, f"{quote} is not closed", f"close the string with {quote}")


def _is_left_open(lines: list[str], column: int) -> bool:
    """Return whether there is a bracket at a column of the first line that is closed nowhere."""
    depth = 0
    for token in _TOKEN.finditer("\n".join([lines[0][column:], *lines[1:]])):
        depth += (token[0] in _CLOSING) - (token[0] in _CLOSING.values())
        if not depth:
            return False
    return True


#: In the order in which they are tried: the first that knows the fault names it.
_DIAGNOSES: tuple[Callable[[_Fault], _Diagnosis | None], ...] = (
    _tab,
    _key_without_colon,
    _comment,
    _two_in_a_line,
    _word_above,
    _pair_above,
    _below_a_value,
    _between_levels,
    _open_bracket,
    _open_quote,
)
