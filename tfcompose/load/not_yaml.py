"""Text that is not YAML, with its place."""

from __future__ import annotations

import yaml

from tfcompose.findings import Finding, Note, Span, finding


def no_character(error: yaml.reader.ReaderError, text: str, file: str) -> Finding:
    """Return the finding for a character that must not stand in YAML."""
    hit = yaml.reader.Reader.NON_PRINTABLE.search(text)  # the C parser's position counts bytes
    position = hit.start() if hit else error.position
    line, column = text.count("\n", 0, position) + 1, position - text.rfind("\n", 0, position)
    return finding("TF002", "a character that YAML does not allow", Span(file, line, column, line, column + 1))


def no_syntax(error: yaml.MarkedYAMLError, text: str, file: str) -> Finding:
    """Return the finding for text that the parser refuses, with where it began."""
    mark = error.problem_mark or error.context_mark
    line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
    message, advice = ", ".join(filter(None, (error.context, error.problem))), ""
    lines = text.splitlines()
    source_line = lines[line - 1] if line <= len(lines) else ""
    if "\t" in source_line[: len(source_line) - len(source_line.lstrip())]:
        message, advice = "a tab in the indentation", "indent with spaces; YAML does not allow tabs there"
    notes = []
    if error.context_mark and mark and error.context_mark.line != mark.line:
        at = error.context_mark
        notes = [Note("it began here", Span(file, at.line + 1, at.column + 1, at.line + 1, at.column + 2))]
    return finding("TF002", message, Span(file, line, column, line, column + 1), help=advice, notes=notes)


def no_yaml(text: str, file: str) -> Finding:
    """Return the finding for XML where YAML is expected: most often a URDF as a robot file."""
    is_xacro = "ros.org/wiki/xacro" in text
    key = "xacro" if is_xacro else "urdf"
    advice = f"tfcompose import {file} -o robot.yaml; or take it as a part: parts: {{NAME: {{{key}: {file}}}}}"
    return finding("TF002", "this is XML, and YAML is expected", Span(file), help=advice if "<robot" in text else "")
