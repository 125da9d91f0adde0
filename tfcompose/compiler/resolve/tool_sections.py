"""Hooks of tools that have sections in a robot file: additional processes and checks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.processes import add_process, says_how
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.hooks import run_hook
from tfcompose.model.robot import Section
from tfcompose.spec.language.tool_keys import data_for_plan, keys_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.compiler.resolve.draft import Draft, Finds
    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.tool import Key
    from tfcompose.spec.language.robot import RobotSpec


@dataclass(frozen=True, slots=True)
class ToolSection:
    """A tool's section of a robot file, as the hooks of the tool receive it."""

    key: Key
    #: The section's value, validated with the key's model.
    value: Any
    #: The complete robot file with its spans.
    spec: RobotSpec
    #: Returns the text of a file or raises RejectedError. None if files cannot be read.
    read: Callable[[str], str] | None

    def span_of(self, *path: str | int) -> Span:
        """Return the span of a value in the section, or of the nearest enclosing value."""
        return self.spec.span_of((self.key.name, *path))

    def key_span(self, *path: str | int) -> Span:
        """Return the span of a key in the section, or of the nearest enclosing key."""
        return self.spec.key_span((self.key.name, *path))


def sections_of(draft: Draft) -> list[ToolSection]:
    """Return the sections of tools in a robot file, without rejected sections.

    Sections in the file of a part have no effect.
    """
    spec = draft.spec
    keys = keys_in(spec.model_fields_set) if draft.holder is None else []
    sections = [ToolSection(key, getattr(spec, key.name, None), spec, draft.read) for key in keys]
    return [section for section in sections if section.value is not None]


def as_sections(draft: Draft) -> dict[str, Section]:
    """Return the sections in the form of ``Robot.sections``, for rules."""
    return {
        section.key.name: Section(
            section.key.name,
            section.value,
            section.spec.span_of,
            planned=data_for_plan(section.key, section.value),
        )
        for section in sections_of(draft)
    }


def add_sections(draft: Draft) -> Iterator[Finding]:
    """Add the processes of tools, with the keys under their names in ``processes``.

    If such an entry defines how its process runs, that process replaces the tool's.
    """
    for section in sections_of(draft):
        processes = yield from _hook(section, section.key.processes)
        for process in processes:
            declared = draft.spec.processes.get(process.name)
            if says_how(declared):
                continue
            if declared is not None:
                span = draft.spec.key_span(("processes", process.name))
                process = replace(process, span=span)  # noqa: PLW2901 (the place of its own entry)
            draft.processes.append(add_process(process, declared, draft.spec))


def check_sections(draft: Draft) -> Iterator[Finding]:
    """Yield the findings of tools about their sections and the files named there."""
    for section in sections_of(draft):
        findings = yield from _hook(section, section.key.check, draft.robot)
        yield from findings


def _hook(section: ToolSection, reference: str, *more: Any) -> Finds[list[Any]]:
    """Return the result of a tool's function.

    Empty if the tool has no such function. If the function crashes, that is a finding.
    """
    if not reference:
        return []
    values = run_hook(reference, section.key.name, section.key_span(), section, *more)
    if isinstance(values, Finding):
        yield values
        return []
    return values
