"""All steps from the text of a robot file to the built files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from tfcompose.compiler.check import RULES, add_replaced_notes, check, rules_of_tools, silence
from tfcompose.compiler.resolve import Disk, Library, resolve
from tfcompose.foundation.catalogue import can_be_allowed, code_of
from tfcompose.foundation.findings import Allow, Finding, RejectedError, without_duplicates
from tfcompose.spec.language import (
    BuildInputs,
    compose,
    levels_of,
    profiles_in,
    validate,
    with_includes,
)
from tfcompose.spec.load import Source, load

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from tfcompose.model.robot import Robot


NOTHING = BuildInputs()


@dataclass(frozen=True, slots=True)
class Compiled:
    """A robot and all findings about it."""

    #: None if the text has errors that prevent a robot.
    robot: Robot | None
    findings: tuple[Finding, ...]
    #: All comments that silence findings.
    allows: tuple[Allow, ...] = ()
    #: The comments in ``allows`` that silenced a finding, each with the finding's code.
    used: frozenset[tuple[Allow, str]] = frozenset()
    #: The robot's source with overlays merged, followed by the sources of robot files that are
    #: parts.
    sources: tuple[Source, ...] = ()

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that prevent a build."""
        return tuple(finding for finding in self.findings if finding.severity == "error")


def compile_robot(  # noqa: PLR0913 (text, and what is merged over it)
    text: str,
    file: str,
    library: Library,
    profiles: Sequence[str] = (),
    *,
    overlays: Sequence[Source] = (),
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
    inputs: BuildInputs = NOTHING,
) -> Compiled:
    """Return the robot with profiles and overlays merged, and all findings sorted by place.

    ``read`` returns the text of an included file or a calibration. Without ``read`` no other file
    can be read. ``disk`` tells which files and packages exist. Without ``disk`` meshes are not
    looked up. ``inputs`` holds the values of the robot's arguments and the environment, which is
    empty by default.
    """
    try:
        source = load(text, file)
        source = with_includes(source, read) if read else source
    except RejectedError as error:
        return Compiled(None, error.findings)
    return compile_source(source, library, profiles, overlays, read, disk, inputs)


def compile_source(  # noqa: PLR0913, PLR0917 (as above)
    source: Source,
    library: Library,
    profiles: Sequence[str] = (),
    overlays: Sequence[Source] = (),
    read: Callable[[str], str] | None = None,
    disk: Disk | None = None,
    inputs: BuildInputs = NOTHING,
) -> Compiled:
    """Compile a loaded text with its includes; otherwise like ``compile_robot``."""
    try:
        validated = validate(
            compose(source, profiles, overlays, inputs, read), profiles_in(source), inputs
        )
    except RejectedError as error:
        return Compiled(None, error.findings)
    draft, unresolved = resolve(validated, library, read, disk)
    source, parts, robot = validated.source, draft.collected, draft.robot
    rules = {
        name: (level, source.key_span(("rules", name)))
        for name, level in levels_of(validated, robot.limits)
    }
    codes = {code_of(name) for name, (level, _) in rules.items() if level == "off"}
    off = {code for code in codes if code and can_be_allowed(code)}
    findings = without_duplicates([*validated.findings, *unresolved, *_check_robot(robot, off)])
    sources = (source, *parts.sources)
    kept, used = silence(
        add_replaced_notes(findings, sources), rules, (*source.allows, *parts.allows)
    )
    ordered = tuple(sorted(kept, key=lambda entry: entry.sort_key))
    return Compiled(robot, ordered, source.allows, frozenset(used), sources)


def _check_robot(robot: Robot, off: Collection[str]) -> list[Finding]:
    """Return the findings of all rules, including rules of the tools that the robot uses.

    Rules whose codes are ``off`` do not run.
    """
    of_tools, findings = rules_of_tools(robot)
    return [
        *(
            entry
            for rules in (RULES.values(), of_tools)
            for entry in check(robot, [rule for rule in rules if rule.code not in off])
        ),
        *findings,
    ]
