"""Findings of one file for ``lint``: a robot file in its variants, or a URDF or xacro file."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace
from itertools import combinations as subsets
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.cli.robot_search import language_of
from tfcompose.cli.terminal import warn
from tfcompose.foundation.findings import Finding, Note
from tfcompose.foundation.hooks import run_hook
from tfcompose.foundation.reading import is_folder, names_in
from tfcompose.foundation.tool import FileToCheck

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from tfcompose.compiler.compile import Compiled
    from tfcompose.compiler.resolve import Disk, Library
    from tfcompose.foundation.findings import Span
    from tfcompose.spec.language import BuildInputs
    from tfcompose.spec.language.arguments import Combination
    from tfcompose.spec.load import Source

#: Time limit in seconds for the combinations of a file's arguments. The first combination is
#: always checked.
JUDGE_FOR_S = 60.0


class _LintFiles(NamedTuple):
    """Access to the files of a robot file, and the environment variables for its arguments."""

    read: Callable[[str], str]
    presets: Library
    #: Returns the compiler's access to files, for a robot file and its includes.
    disk_of: Callable[[Source], Disk]
    environment_of: Callable[[Source], Mapping[str, str]]
    is_folder: Callable[[str], bool]


@dataclass(frozen=True, slots=True)
class Linter:
    """Lints files with the command line's options."""

    arguments: Namespace
    presets: Library
    #: Environment variables that the arguments of untrusted robot files may read.
    environment: Mapping[str, str]
    #: Whether the command names a single file. Then an argument that the file does not declare is
    #: an error.
    has_one_file: bool
    #: Called with each folder of overlays before it is listed.
    on_folder: Callable[[str], object] = lambda _: None

    def lint(self, file: str, read: Callable[[str], str]) -> list[Finding]:
        """Return the findings of a robot file, or of a file in the language of a tool."""
        language = language_of(file)
        if language is None:
            return self.lint_robot(file, read)
        files = self._files_of(file, read)
        options = self.arguments
        request = FileToCheck(file, files.read, options.trust, options.untrusted)
        findings = run_hook(language.check, language.name, None, request)
        return [findings] if isinstance(findings, Finding) else findings

    def lint_robot(self, file: str, read: Callable[[str], str]) -> list[Finding]:
        """Return the findings of a robot file, sorted by place.

        The file is compiled for each combination of its arguments' values, with the requested
        profiles. Without requested profiles and overlays, it is also compiled with each of its
        profiles, and with each robot's overlay.
        """
        from tfcompose.cli.compiling import inputs_of, overlays_of
        from tfcompose.foundation.findings import RejectedError
        from tfcompose.spec.language import overlay_folder, with_includes
        from tfcompose.spec.load import load

        files = self._files_of(file, read)
        try:
            source = with_includes(load(files.read(file), file), files.read)
            if folder := overlay_folder(source):
                self.on_folder(folder)
            overlays = overlays_of(self.arguments, source, files.read)
        except RejectedError as error:
            return list(error.findings)
        inputs = replace(inputs_of(self.arguments), environment=files.environment_of(source))
        if not self.has_one_file:  # an argument may belong to another of the files
            names = inputs.args.keys() & source.mapping("args").keys()
            inputs = replace(inputs, args={name: inputs.args[name] for name in names})
        variants = _Variants(source, overlays, inputs, files, files.disk_of(source))
        requested = self.arguments.profiles
        findings, judged = variants.in_combinations(requested)
        if not requested and not overlays:
            findings += variants.with_each_variant(findings, judged)
        return sorted(findings, key=lambda finding: finding.sort_key)

    def lint_urdf(self, file: str, read: Callable[[str], str]) -> list[Finding]:
        """Return the findings of a URDF or xacro file."""
        from tfcompose.cli.compiling import disk
        from tfcompose.compiler.urdf.lint import lint_urdf
        from tfcompose.compiler.urdf.packages import Packages

        if self.arguments.untrusted:
            from tfcompose.cli.untrusted import UntrustedFiles

            files = UntrustedFiles(file, read).disk()
        else:
            files = disk(trusts_files=self.arguments.trust)
        packages = Packages(files, advice="source the workspace's setup file")
        return lint_urdf(file, packages, self.arguments.arg_values)

    def _files_of(self, file: str, read: Callable[[str], str]) -> _LintFiles:
        """Return access to all files of this machine; with --untrusted, to the robot's tree."""
        if not self.arguments.untrusted:
            from tfcompose.cli.compiling import disk

            files = disk(trusts_files=self.arguments.trust, sources=[file])
            return _LintFiles(read, self.presets, lambda _: files, lambda _: os.environ, is_folder)
        from tfcompose.cli.untrusted import UntrustedFiles, declared_variables

        untrusted = UntrustedFiles(file, read)
        for overlay in self.arguments.overlays:
            untrusted.reach.add_tree(overlay)
        return _LintFiles(
            untrusted.read,
            untrusted.library(),
            untrusted.disk_for,
            lambda source: declared_variables(source, self.environment),
            untrusted.is_folder,
        )


@dataclass(frozen=True, slots=True)
class _Variants:
    """A robot file with its variants: profiles, overlays and arguments."""

    source: Source
    overlays: Sequence[Source]
    inputs: BuildInputs
    files: _LintFiles
    disk: Disk

    def in_combinations(self, profiles: Sequence[str]) -> tuple[list[Finding], list[Compiled]]:
        """Return findings and compiled robots for all combinations of argument values."""
        if not self.source.has(("args",)) and not self.overlays:
            alone = self._compile(self.inputs, profiles)
            return list(alone.findings), [alone]
        from tfcompose.foundation.findings import RejectedError, Span
        from tfcompose.spec.language import ArgValue, compose
        from tfcompose.spec.language.arguments import alternatives_of, combinations

        try:
            laid_over = compose(self.source, profiles, self.overlays, self.inputs, self.files.read)
            alternatives, first = alternatives_of(laid_over, self.inputs, self.source)
        except RejectedError as error:
            return list(error.findings), []
        judged = []
        begin = time.monotonic()
        every = combinations(alternatives, first)
        for index, values in enumerate(every):
            if time.monotonic() - begin > JUDGE_FOR_S:
                warn(
                    f"{self.source.file}: checked {index} of {len(every)} combinations of its args"
                    f" in {JUDGE_FOR_S:g} s and skipped the others"
                )
                break
            args = dict(self.inputs.args)
            for name, value in values.items():
                args[name] = ArgValue(value, Span(f"{name}:={value}"))
            judged.append((values, self._compile(replace(self.inputs, args=args), profiles)))
        findings = merge_findings([(values, compiled.findings) for values, compiled in judged])
        return findings, [compiled for _, compiled in judged]

    def with_each_variant(
        self, findings: Sequence[Finding], judged: Sequence[Compiled]
    ) -> list[Finding]:
        """Return the additional findings of each profile, and of each robot's overlay.

        The result also includes findings about unused allow comments.
        """
        from tfcompose.compiler.check import unused_allows
        from tfcompose.foundation.findings import RejectedError
        from tfcompose.spec.language import overlay_files

        identities = {_identity(finding) for finding in findings}
        # A profile can move a finding to another place by changing another key of the entry.
        messages = {_judgement(finding) for finding in findings} - {None}
        more: list[Finding] = []
        variants = list(judged)
        try:
            files = overlay_files(self.source, self._names_in)
        except RejectedError as error:
            files, more = [], list(error.findings)
        for option, variant in self._each_variant(files):
            variants.append(variant)
            note = Note(f"with {option}")
            new = [
                finding
                for finding in variant.findings
                if _identity(finding) not in identities and _judgement(finding) not in messages
            ]
            more += [replace(finding, notes=(*finding.notes, note)) for finding in new]
            identities |= {_identity(finding) for finding in new}
            messages |= {_judgement(finding) for finding in new} - {None}
        if all(variant.robot is not None for variant in variants):
            # If a variant did not compile, a comment may be about a finding that was not detected.
            used = {pair for variant in variants for pair in variant.used}
            more += unused_allows(self.source.allows, used)
        return more

    def _each_variant(self, files: Sequence[str]) -> Iterator[tuple[str, Compiled]]:
        """Yield the robot with each profile, then with each robot's overlay.

        The first item is the option that selects the variant. ``files`` are the names in the
        folder of the overlays.
        """
        from tfcompose.compiler.compile import Compiled
        from tfcompose.foundation.findings import RejectedError
        from tfcompose.spec.language import (
            find_overlay,
            load_robot_overlay,
            profiles_in,
            robots_with_overlay,
        )

        for profile, inside in profiles_in(self.source).items():
            if "when" not in inside or not self.source.has(("args",)):
                yield f"--profile {profile}", self._compile(self.inputs, [profile])
        for robot in robots_with_overlay(files):
            path = find_overlay(self.source, robot, files)
            try:
                overlays = [load_robot_overlay(path, self.files.read)]
            except RejectedError as error:
                yield f"--robot {robot}", Compiled(None, error.findings)
            else:
                yield f"--robot {robot}", self._compile(self.inputs, [], overlays)

    def _names_in(self, folder: str) -> list[str] | None:
        return names_in(folder) if self.files.is_folder(folder) else None

    def _compile(
        self, inputs: BuildInputs, profiles: Sequence[str], more: Sequence[Source] = ()
    ) -> Compiled:
        from tfcompose.compiler.compile import compile_source

        read, presets = self.files.read, self.files.presets
        return compile_source(
            self.source, presets, profiles, (*more, *self.overlays), read, self.disk, inputs
        )


def merge_findings(judged: Sequence[tuple[Combination, Sequence[Finding]]]) -> list[Finding]:
    """Return each finding once.

    A note names the combinations if only some of them have the finding.
    """
    where: dict[_Identity, list[int]] = {}
    firsts: dict[_Identity, Finding] = {}
    for index, (_, findings) in enumerate(judged):
        for finding in findings:
            key = _identity(finding)
            firsts.setdefault(key, finding)
            if where.setdefault(key, [])[-1:] != [index]:
                where[key].append(index)
    every = [combination for combination, _ in judged]
    for key, indices in where.items():
        if len(indices) < len(judged):
            note = Note(_name_combinations(every, indices))
            firsts[key] = replace(firsts[key], notes=(*firsts[key].notes, note))
    return list(firsts.values())


def _name_combinations(every: Sequence[Combination], where: Sequence[int]) -> str:
    """Return a description of the combinations in ``where`` with the fewest arguments."""
    inside = set(where)
    first = every[where[0]]
    best, covered = dict(first), 1
    for size in (2, 1):
        for names in subsets(first, size):
            matching = {
                i
                for i, combination in enumerate(every)
                if all(combination[name] == first[name] for name in names)
            }
            if matching <= inside and len(matching) >= covered:
                best, covered = {name: first[name] for name in names}, len(matching)
    settings = " ".join(f"{name}:={value}" for name, value in best.items())
    uncovered = len(inside) - covered
    more = (
        f", and in {uncovered} other combination{'s' * (uncovered > 1)} of args"
        if uncovered
        else ""
    )
    return f"with {settings}{more}"


#: Findings of several variants are the same if code, message and place are equal.
_Identity = tuple[str, str, "Span | None"]


def _identity(finding: Finding) -> _Identity:
    return finding.code, finding.message, finding.span


def _judgement(finding: Finding) -> tuple[str, str] | None:
    """Return a key for a finding about the robot, None for a finding about text or keys."""
    return (finding.code, finding.message) if finding.code >= "TF2" else None
