"""Cases of test files with the plans of their robots, checked before anything runs."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import compile_file
from tfcompose.cli.live import no_rosbags
from tfcompose.cli.reading import read_text
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.findings import RejectedError, did_you_mean, finding
from tfcompose.foundation.reading import is_folder
from tfcompose.spec.load import find_path, load
from tfcompose.tf.bags import BagError, Recording
from tfcompose.tools.treetest import ENDINGS
from tfcompose.tools.treetest.case import Case, variant_of
from tfcompose.tools.treetest.injections import split_pair
from tfcompose.tools.treetest.relayed_plan import find_obstacles
from tfcompose.tools.treetest.spec import SuiteSpec, validate_suite

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from datetime import date

    from tfcompose.foundation.findings import Finding, Span
    from tfcompose.foundation.tool import FileToCheck
    from tfcompose.model.plan import Plan
    from tfcompose.spec.load import Path as SpecPath
    from tfcompose.spec.load import Source
    from tfcompose.tools.treetest.injections import InjectionSpec


def files_in(name: str) -> list[str]:
    """Return the file itself, or the test files below a folder, without hidden folders."""
    if not is_folder(name):
        return [name]
    files: list[str] = []
    for top, folders, names in os.walk(name):
        folders[:] = [folder for folder in sorted(folders) if not folder.startswith(".")]
        files += [str(Path(top, file)) for file in sorted(names) if file.endswith(ENDINGS)]
    return files


@dataclass(slots=True)
class CaseLoader:
    """Reads test files, and compiles each variant of a robot once."""

    #: Whether xacro files may run outside of the sandbox.
    trust: bool
    #: Returns the text of a test file.
    read: Callable[[str], str] = read_text
    _plans: dict[tuple[str, tuple[str, ...], date | None, bool], Plan] = field(
        default_factory=dict
    )

    def load(self, file: str) -> list[Case]:
        """Return the cases of a test file.

        Raises:
            RejectedError: with every finding about it, its robot and its recordings.
        """
        text = self.read(file)
        source = load(text, file, SuiteSpec.BEGIN)
        suite = validate_suite(source)
        cases: list[Case] = []
        findings: list[Finding] = []
        for index in range(len(suite.cases)):
            try:
                cases.append(self._case(suite, index, source, text))
            except RejectedError as error:
                findings += error.findings
        if findings:
            raise RejectedError(dict.fromkeys(findings))
        return cases

    def _case(self, suite: SuiteSpec, index: int, source: Source, text: str) -> Case:
        spec, path = suite.cases[index], ("cases", index)
        bag, day = None, None
        if spec.bag is not None:
            bag, day = _recording(spec.bag, source.span_of((*path, "bag")))
        golden = None
        if spec.expect.like is not None:
            golden, _ = _recording(spec.expect.like, source.span_of((*path, "expect", "like")))
        robot = find_path(suite.robot, source.span_of(("robot",)))
        plan = self._plan(robot, spec.profile, day, starts=bag is None)
        case = Case(
            spec,
            source,
            text,
            path,
            plan=plan,
            robot=robot,
            bag=bag,
            trust=self.trust,
            golden=golden,
        )
        findings = list(check_names(case))
        if findings:
            raise RejectedError(findings)
        return case

    def _plan(
        self, robot: str, profiles: tuple[str, ...], day: date | None, *, starts: bool
    ) -> Plan:
        """Return the plan of a robot file on a day, or the one that ``up`` starts here.

        Raises:
            RejectedError: with the errors of the robot file.
        """
        key = (robot, profiles, day, starts)
        if key not in self._plans:
            arguments = variant_of(profiles, trust=self.trust, starts=starts)
            compiled = compile_file(robot, arguments, day)
            if compiled.robot is None or compiled.errors:
                raise RejectedError(compiled.errors)
            self._plans[key] = plan_of(compiled.robot.with_final_names())
        return self._plans[key]


def check_file(request: FileToCheck) -> list[Finding]:
    """Return what ``test`` would report before it runs a case, for ``lint``.

    The robot and the recordings of an untrusted file are not read.
    """
    try:
        if request.is_untrusted:
            validate_suite(load(request.read(request.file), request.file, SuiteSpec.BEGIN))
        else:
            CaseLoader(request.trust, request.read).load(request.file)
    except RejectedError as error:
        return list(error.findings)
    return []


def _recording(name: str, span: Span) -> tuple[str, date | None]:
    """Return the path of a recording that a test file names, and its day.

    Raises:
        RejectedError: if it cannot be read.
    """
    if missing := no_rosbags():
        raise RejectedError([missing])
    path = find_path(name, span)
    try:
        return path, Recording(path).first_day()
    except BagError as error:
        raise RejectedError([finding("TF907", str(error), span, help=error.help)]) from None


def check_names(case: Case) -> Iterator[Finding]:
    """Yield a finding for each edge, process and frame of a case that its robot does not have."""
    expect, plan = case.spec.expect, case.plan
    pairs = {(edge.parent, edge.child): edge.name for edge in plan.edges}
    frames = [frame for pair in pairs for frame in pair]
    processes = [process.name for process in plan.processes]
    for pair, edge in expect.edges.items():
        at = ("expect", "edges", pair)
        if split_pair(pair) not in pairs:
            reverse = pairs.get(split_pair(pair)[::-1])
            advice = f"the edge is {reverse}" if reverse else did_you_mean(pair, pairs.values())
            yield _unknown(case, case.span(*at), f"edge {pair}", advice)
        if edge.owner is not None and edge.owner not in processes:
            span = case.value_span(*at, "owner")
            advice = did_you_mean(edge.owner, processes)
            yield _unknown(case, span, f"process {edge.owner}", advice)
    named = [
        (frame, case.span("expect", "pose", pair))
        for pair in expect.pose
        for frame in split_pair(pair)
    ]
    for index, lookup in enumerate(expect.lookups):
        entry = ("expect", "lookups", index)
        named.append((lookup.from_, case.value_span(*entry, "from")))
        named.append((lookup.to, case.value_span(*entry, "to")))
    named += [
        (each.rename.frame, case.value_span("inject", index, "rename", "frame"))
        for index, each in enumerate(case.spec.inject)
        if each.rename is not None
    ]
    for frame, span in named:
        if frame not in frames:
            yield _unknown(case, span, f"frame {frame}", did_you_mean(frame, frames))
    for index, injection in enumerate(case.spec.inject):
        yield from _check_injection(case, injection, ("inject", index))


def _check_injection(case: Case, injection: InjectionSpec, at: SpecPath) -> Iterator[Finding]:
    """Yield a finding for each edge, process and joint of an injection that its robot lacks."""
    plan = case.plan
    process = injection.kill or injection.stop
    names = [each.name for each in plan.processes]
    if process is not None and process not in names:
        span = case.value_span(*at, injection.kind or "")
        yield _unknown(case, span, f"process {process}", did_you_mean(process, names))
    joints = [edge.joint.name for edge in plan.edges if edge.joint]
    if injection.joint is not None and injection.joint.name not in joints:
        span = case.value_span(*at, "joint", "name")
        advice = did_you_mean(injection.joint.name, joints)
        yield _unknown(case, span, f"moving joint {injection.joint.name}", advice)
    pair = injection.edge
    if case.bag is None:
        for obstacle, advice in find_obstacles(injection, plan):
            span = case.value_span(*at, injection.kind or "")
            message = f"{injection.kind} cannot be injected: {obstacle}"
            yield finding(
                "TF932", message, span, help=f"{advice}, or inject it into a recording: bag:"
            )
    kinds = {(edge.parent, edge.child): edge.kind for edge in plan.edges}
    if pair is None:
        return
    span = case.value_span(*at, injection.kind or "")
    if split_pair(pair) not in kinds:
        edges = [edge.name for edge in plan.edges]
        yield _unknown(case, span, f"edge {pair}", did_you_mean(pair, edges))
    elif injection.dynamic is not None and kinds[split_pair(pair)] != "static":
        yield _unknown(case, span, f"fixed edge {pair}", f"{pair} is on /tf already")


def _unknown(case: Case, span: Span, thing: str, advice: str) -> Finding:
    message = f"robot {case.plan.robot} has no {thing}"
    return finding("TF930", message, span, help=advice or "tfcompose tree prints all names")
