"""Text that is not YAML: the place of the fault, and what to write instead.

The parser points at the place where it stops, which is often a line below the fault, and reports
what its grammar expected. Each diagnosis recognises a typing error by its place and the
surrounding lines.
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
    """Return the finding for a character that is forbidden in YAML."""
    hit = yaml.reader.Reader.NON_PRINTABLE.search(text)  # the C parser's position counts bytes
    position = hit.start() if hit else error.position
    line, column = text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)
    return finding(
        "TF002", "a character that YAML does not allow", Span(file, line, column, line, column + 1)
    )


def no_syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> list[Finding]:
    """Return the findings for text that the parser rejects, with the place where the fault began.

    If expressions lack quotes, there is a finding for each, because the parser stops at the first.
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
        if any(span.span and span.span.line == fault.position[0] + 1 for span in bare):
            return bare
    diagnosis = next(
        (explained for diagnose in _DIAGNOSES if (explained := diagnose(fault))), None
    )
    line, column = diagnosis.position if diagnosis else fault.position
    span = Span(file, line + 1, column + 1, line + 1, column + 2)
    notes = []
    if fault.began and fault.began[0] != line and (diagnosis is None or diagnosis.has_beginning):
        first, left = fault.began
        notes = [Note("it began here", Span(file, first + 1, left + 1, first + 1, left + 2))]
    if diagnosis is None:
        return [finding("TF002", message, span, notes=notes)]
    return [finding("TF002", diagnosis.message, span, help=diagnosis.help, notes=notes)]


def no_yaml(text: str, file: str) -> Finding:
    """Return the finding for XML where YAML is expected, which is usually a URDF."""
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


#: Tokens of a line of YAML that matter for brackets and expressions: a comment, a quoted text, a
#: bracket, the end of a value, an unquoted value with an expression, any other value.
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
#: Arithmetic around expressions, with the expressions taken out.
_ARITHMETIC = re.compile(r"[-+*/().\d\s]*")


def bare_expressions(text: str, file: str) -> Iterator[Finding]:
    """Yield findings about expressions inside [ ] or { } that lack quotes.

    The edit puts the complete value into quotes, and moves arithmetic into the braces.
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
    """Return a value with its arithmetic moved into the braces of its expression."""
    rest = _EXPRESSION.sub("", value)
    if not rest or not _ARITHMETIC.fullmatch(rest):
        return value
    inner = _EXPRESSION.sub(lambda match: _operand(match[0][2:-1].strip()), value)
    return f"${{{inner}}}"


def _operand(expression: str) -> str:
    """Return an expression as an operand of a product. A sum gets brackets."""
    is_sum = re.search(r"[^\s*/(+-]\s*[-+]", expression)
    return f"({expression})" if is_sum else expression


@dataclass(frozen=True, slots=True)
class _Fault:
    """The parser's message, with the places where it stopped and where its current item began."""

    lines: list[str]
    position: tuple[int, int]
    began: tuple[int, int] | None
    message: str

    def line(self, number: int) -> str:
        return self.lines[number] if 0 <= number < len(self.lines) else ""

    @property
    def stopped(self) -> str:
        """The line where the parser stopped."""
        return self.line(self.position[0])

    def above(self) -> int:
        """Return the number of the nearest previous line that is not blank or a comment, or -1."""
        number = self.position[0] - 1
        while number >= 0 and not self.lines[number].split("#")[0].strip():
            number -= 1
        return number


@dataclass(frozen=True, slots=True)
class _Diagnosis:
    position: tuple[int, int]
    message: str
    help: str
    has_beginning: bool = False


#: A correct line with key and value; the key may be quoted.
_PAIR = re.compile(r"""\s*(?:- )?(?:[\w/.${}-]+|"[^"]*"|'[^']*'):\s+[^\s#]""")
_LONE_WORD = re.compile(r"( *)([\w/.-]+)\s*(?:#.*)?")
_WORDS = re.compile(r"( *)(?:- )?([\w/.-]+)\s+([^\s:#][^:]*)")
_GLUED_PAIR = re.compile(r"( *)(?:- )?([A-Za-z_]\w*):([^\s/].*)")
_EXPRESSION = re.compile(r"\$\{[^{}\"']*\}")
_CLOSING = {"{": "}", "[": "]"}
#: Quoted texts, comments and expressions, whose brackets do not count; and brackets.
_TOKEN = re.compile(r"""\"(?:[^"\\]|\\.)*\"|'[^']*'|(?<![^\s])#[^\n]*|\$\{[^{}\n]*\}|[][{}]""")


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _tab(fault: _Fault) -> _Diagnosis | None:
    if "\t" not in fault.stopped[: _indent(fault.stopped)]:
        return None
    return _Diagnosis(
        fault.position,
        "a tab in the indentation",
        "indent with spaces; YAML does not allow tabs there",
    )


def _key_without_colon(fault: _Fault) -> _Diagnosis | None:
    """A key without a colon."""
    if (
        not fault.began
        or "expected ':'" not in fault.message
        or fault.began[0] >= len(fault.lines)
    ):
        return None
    return _no_colon(fault.lines[fault.began[0]], fault.began)


def _no_colon(line: str, position: tuple[int, int]) -> _Diagnosis:
    """Return the diagnosis of a line without a colon: a key alone, or a key and its value."""
    pair = _WORDS.fullmatch(line)
    if pair:
        return _Diagnosis(
            position, f"{pair[2]} has no colon", f"write {pair[2]}: {pair[3].strip()}"
        )
    text = line.split(" #", maxsplit=1)[0].strip()
    return _Diagnosis(position, f"{text} has no colon", f"write {text}:")


def _is_late(fault: _Fault) -> bool:
    """Return whether the parser read the line above as a value that continues here."""
    return "mapping values are not allowed" in fault.message or "parsing a block" in fault.message


def _word_above(fault: _Fault) -> _Diagnosis | None:
    """A single word above a line that is indented further."""
    above = fault.above()
    match = _LONE_WORD.fullmatch(fault.line(above)) if _is_late(fault) and above >= 0 else None
    if not match or not fault.stopped or len(match[1]) >= _indent(fault.stopped):
        return None
    return _no_colon(fault.line(above), (above, len(match[1])))


def _pair_above(fault: _Fault) -> _Diagnosis | None:
    """A key and a value in the line above without a colon, or without a space after it."""
    if "mapping values are not allowed" not in fault.message:
        return None
    above = fault.above()
    while above > 0 and fault.line(above - 1).strip() and _WORDS.fullmatch(fault.line(above - 1)):
        above -= 1  # the first of several such lines
    line = fault.line(above)
    glued = _GLUED_PAIR.fullmatch(line)
    if glued:
        message = f"a space after the colon of {glued[2]} is missing"
        return _Diagnosis((above, len(glued[1])), message, f"write {glued[2]}: {glued[3]}")
    pair = _WORDS.fullmatch(line)
    return _no_colon(line, (above, len(pair[1]))) if pair else None


def _two_in_a_line(fault: _Fault) -> _Diagnosis | None:
    """Two keys on a line: ``frames: mast: {}``."""
    line, column = fault.stopped, fault.position[1]
    if "mapping values are not allowed" not in fault.message or not (
        pair := _PAIR.match(line[:column])
    ):
        return None
    outer, _, inner = line[:column].partition(":")
    key = inner.strip()
    if " " in key:
        advice = f"put the value in quotes, if {key}: belongs to it"
        return _Diagnosis(fault.position, "a second colon in the value", advice)
    advice = f"{key}: belongs in the next line, indented more than {outer.strip()}"
    return _Diagnosis(
        (fault.position[0], pair.end() - 1),
        f"{key} is a key in the line of another, {outer.strip()}",
        advice,
    )


def _below_a_value(fault: _Fault) -> _Diagnosis | None:
    """A line that is indented further than the key and value above it."""
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
        (fault.position[0], indent),
        message,
        f"begin it in column {left + 1}, as line {above + 1} does",
    )


def _between_levels(fault: _Fault) -> _Diagnosis | None:
    """A line whose indentation matches no level."""
    if (
        not fault.began
        or "parsing a block" not in fault.message
        or _indent(fault.stopped) != fault.position[1]
    ):
        return None
    line, left = fault.began
    if fault.position[1] == left:
        return None
    message = f"indented by {plural(fault.position[1], 'space')}, and what it belongs to by {left}"
    advice = f"begin it in column {left + 1}, as line {line + 1} does"
    return _Diagnosis(fault.position, message, advice, has_beginning=True)


def _comment(fault: _Fault) -> _Diagnosis | None:
    """A comment in the style of C."""
    rest = fault.stopped[fault.position[1] :]
    if not rest.startswith(("//", "/*")):
        return None
    return _Diagnosis(
        fault.position,
        f"a comment begins with #, not {rest[:2]}",
        f"write # {rest[2:].strip(' */')}",
    )


def _open_bracket(fault: _Fault) -> _Diagnosis | None:
    """A bracket that is not closed, or is closed by a bracket of the other kind."""
    if not fault.began or "parsing a flow" not in fault.message:
        return None
    line, column = fault.began
    bracket = fault.line(line)[column : column + 1]
    if bracket not in _CLOSING:
        return None
    closes = fault.stopped[fault.position[1] : fault.position[1] + 1]
    if closes in _CLOSING.values() and closes != _CLOSING[bracket]:
        message = f"{bracket} is closed by {closes}"
        return _Diagnosis(
            fault.position, message, f"write {_CLOSING[bracket]} before it", has_beginning=True
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
    """Return whether the bracket at a column of the first line is never closed."""
    depth = 0
    for token in _TOKEN.finditer("\n".join([lines[0][column:], *lines[1:]])):
        depth += (token[0] in _CLOSING) - (token[0] in _CLOSING.values())
        if not depth:
            return False
    return True


#: Diagnoses in the order in which to try them. The first match is used.
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
