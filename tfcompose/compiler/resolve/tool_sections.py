"""Hooks of tools whose sections a robot file has.

The processes that they add, and what they check.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.processes import added, says_how
from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.tool import load
from tfcompose.model.robot import Section
from tfcompose.spec.language.tool_keys import keys_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.tool import Key
    from tfcompose.model.robot import Process, Robot
    from tfcompose.spec.language.robot import RobotSpec


@dataclass(frozen=True, slots=True)
class ToolSection:
    """A tool's section of a robot file, as the tool's hooks get it.

    ``value`` is what it says, validated by the key's model; ``spec`` is the whole file with its
    spans. ``read`` returns the text of a file or raises RejectedError; None where no file
    can be read.
    """

    key: Key
    value: Any
    spec: RobotSpec
    read: Callable[[str], str] | None

    def at(self, *path: str | int) -> Span:
        """Return the place of a value in the section, or of the nearest around it."""
        return self.spec.at((self.key.name, *path))

    def at_key(self, *path: str | int) -> Span:
        """Return the place of a key in the section, or of the nearest around it."""
        return self.spec.at_key((self.key.name, *path))


def sections_of(spec: RobotSpec, read: Callable[[str], str] | None) -> list[ToolSection]:
    """Return the sections of tools that a robot file has, without those that were refused."""
    values = {key: getattr(spec, key.name, None) for key in keys_in(spec.model_fields_set)}
    return [
        ToolSection(key, value, spec, read) for key, value in values.items() if value is not None
    ]


def as_sections(sections: Iterable[ToolSection]) -> dict[str, Section]:
    """Return the sections as rules find them in ``Robot.sections``."""
    return {
        section.key.name: Section(section.key.name, section.value, section.spec.at)
        for section in sections
    }


def processes_of(sections: Iterable[ToolSection], found: list[Finding]) -> list[Process]:
    """Return the processes that tools add, with their keys from ``processes``.

    One whose name has an entry that says how it runs is not added: the entry takes its place.
    """
    processes = []
    for section in sections:
        for process in _hook(section, section.key.processes, found):
            declared = section.spec.processes.get(process.name)
            if says_how(declared):
                continue
            if declared is not None:
                at = section.spec.at_key(("processes", process.name))
                process = replace(process, at=at)  # noqa: PLW2901 (the place of its own entry)
            processes.append(added(process, declared, section.spec))
    return processes


def check_sections(sections: Iterable[ToolSection], robot: Robot) -> list[Finding]:
    """Return what tools find in their sections, of the robot and of files that they name."""
    findings: list[Finding] = []
    for section in sections:
        findings += _hook(section, section.key.check, findings, robot)
    return findings


def _hook(section: ToolSection, reference: str, found: list[Finding], *more: Any) -> list[Any]:
    """Return what a tool's function returns.

    Nothing where it has none, and a finding where it crashes.
    """
    if not reference:
        return []
    try:
        return list(load(reference)(section, *more))
    except Exception as error:  # noqa: BLE001 (a tool's fault must not hide the others' findings)
        message = f"{reference} of {section.key.name} crashed: {type(error).__name__}: {error}"
        advice = "this is a bug in the tool: please report it"
        found.append(finding("TF903", message, section.at_key(), help=advice))
        return []
