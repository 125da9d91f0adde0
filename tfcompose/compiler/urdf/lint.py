"""Lint of a URDF or xacro file that tfcompose did not write, with spans in that file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.check import RULES, apply, check, unused_allows
from tfcompose.compiler.urdf.blocks import with_hardware
from tfcompose.compiler.urdf.convert import Converted, robot_of
from tfcompose.compiler.urdf.read import read_expansion, read_xml
from tfcompose.compiler.urdf.xacro import macros_in
from tfcompose.foundation.findings import Finding, RejectedError, Span, finding
from tfcompose.spec.load import allows_in_xml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from tfcompose.compiler.urdf.packages import Packages
    from tfcompose.compiler.urdf.read import Element
    from tfcompose.compiler.urdf.xacro import Expansion
    from tfcompose.foundation.findings import Allow
    from tfcompose.model.robot import Robot

_RULES = tuple(rule for rule in RULES.values() if rule.of_urdf)


def lint_urdf(
    file: str, packages: Packages, arguments: Mapping[str, str] | None = None
) -> list[Finding]:
    """Return the findings about the file, sorted by place.

    A xacro file is expanded. Findings have the places where the elements are written.
    """
    try:
        document = read_urdf(file, packages, arguments)
    except RejectedError as error:
        return list(error.findings)
    return document.findings()


@dataclass(frozen=True, slots=True)
class Document:
    """A URDF with its elements and the robot they describe."""

    root: Element
    converted: Converted
    #: Comments in the file and its includes that allow findings.
    allows: tuple[Allow, ...]

    @property
    def robot(self) -> Robot:
        """The robot that the document describes."""
        return self.converted.robot

    def findings(self) -> list[Finding]:
        """Return the findings by place, without findings that comments in the file allow."""
        roots = self.robot.roots()
        robot = replace(with_hardware(self.robot), base=roots[0] if len(roots) == 1 else None)
        unique = dict.fromkeys([*self.converted.findings, *check(robot, _RULES)])
        kept, used = apply(unique, self.allows)
        return sorted([*kept, *unused_allows(self.allows, used)], key=lambda entry: entry.sort_key)


def read_urdf(
    file: str, packages: Packages, arguments: Mapping[str, str] | None = None
) -> Document:
    """Return the document of a URDF or xacro file.

    A file counts as xacro by its name or content, and is expanded with the arguments.

    Raises:
        RejectedError: if the file cannot be read or is not a URDF, or if a URDF gets arguments.
        ValueError: if ``packages`` has no disk.
    """
    disk = packages.disk
    if disk is None:
        raise ValueError("packages without a disk")
    raw = disk.read(file)
    is_xacro = file.endswith(".xacro") or "<xacro:" in raw
    if arguments and not is_xacro:
        advice = "only xacro files take arguments"
        raise RejectedError(
            [
                finding(
                    "TF106", f"unknown argument {next(iter(arguments))}", Span(file), help=advice
                )
            ]
        )
    if is_xacro:
        expansion = disk.expand(file, packages, arguments or {}, None)
        root, files = read_expansion(expansion, file, disk.read), expansion.files
        allows = tuple(_kept_allows(expansion, disk.read))
    else:
        root, files, allows = read_xml(raw, file), (), allows_in_xml(raw, file)
    converted = robot_of(root, file, packages.asset, files)
    macros = list(macros_in(raw)) if is_xacro and not converted.robot.frames else []
    if macros:
        advice = f"a part can call one: parts: {{NAME: {{xacro: {file}, macro: {macros[0]}, …}}}}"
        message = f"{file} defines macros but no links: {', '.join(macros)}"
        raise RejectedError([finding("TF206", message, Span(file), help=advice)])
    return Document(root, converted, allows)


def _kept_allows(expansion: Expansion, read: Callable[[str], str]) -> Iterator[Allow]:
    """Yield the comments that allow findings, without comments in code that xacro left out."""
    for number in dict.fromkeys(file for file, _, _ in expansion.comments):
        begins = {
            (line, column + 1) for file, line, column in expansion.comments if file == number
        }
        for allow in allows_in_xml(read(expansion.files[number]), expansion.files[number]):
            if (allow.span.line, allow.span.column) in begins:
                yield allow
