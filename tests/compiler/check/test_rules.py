"""Marked specs: the set of lines and codes must match exactly."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.findings import words, words_of
from tfcompose.cli.compiling import library
from tfcompose.cli.compiling import moments as measured
from tfcompose.cli.reading import read_text
from tfcompose.compiler.check import RULES, check, unused_allows
from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.resolve import Disk
from tfcompose.compiler.urdf.inertia import Moments
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Finding, Span, finding
from tfcompose.foundation.geometry import Vector
from tfcompose.model.robot import Robot

SPECS = sorted((Path(__file__).parent / "specs").glob("*.yaml"))
MARK = re.compile(r"# expect(?:-with (?P<profile>\w+))?: (?P<codes>TF\d{3}(?: TF\d{3})*)$")

#: Codes that no line of a robot file can provoke; each has a test of its own elsewhere.
NOT_OF_A_LINE = {"TF001", "TF002", "TF008", "TF009", "TF015", "TF016", "TF606", "TF607", "TF903"}
#: Codes of a URDF that somebody else wrote: tests/compiler/urdf/test_lint.py.
NOT_OF_A_LINE |= {"TF720", "TF721", "TF722"}
#: Of a command line: tests/compiler/urdf/test_mesh.py.
NOT_OF_A_LINE |= {"TF726"}
#: Of what xacro may not do: tests/compiler/urdf/test_confined_xacro.py.
NOT_OF_A_LINE |= {"TF021", "TF022"}
#: Of the folder of overlays: tests/cli/test_robot_overlays.py.
NOT_OF_A_LINE |= {"TF023"}
#: Of what is measured: tests/tools/prove.
NOT_OF_A_LINE |= {"TF650", "TF651", "TF652", "TF653", "TF654"}
#: Of adjusted mounts: tests/tools/adjust.
NOT_OF_A_LINE |= {f"TF{number}" for number in range(660, 669)}
#: Of what is imported: tests/tools/importers/test_shell.py.
NOT_OF_A_LINE |= {"TF020"}
#: Codes of the running robot, of its plan and of its surroundings.
OF_THE_FILE = {"TF812", "TF813", "TF818", "TF847", "TF848", "TF851", "TF857", "TF858"}
LIVE = {code for code in CATALOGUE if code.startswith(("TF8", "TF9"))} - OF_THE_FILE


def marks(text: str) -> dict[str | None, set[tuple[int, str]]]:
    """Return the expected (line, code), by the profile that they need."""
    expected: dict[str | None, set[tuple[int, str]]] = {None: set()}
    for number, line in enumerate(text.splitlines(), 1):
        match = MARK.search(line)
        if match:
            expected.setdefault(match["profile"], set()).update(
                (number, code) for code in match["codes"].split()
            )
    return expected


def compiled(spec: Path, *profiles: str) -> Compiled:
    def read(name: str) -> str:
        return read_text(str(spec.parent / name))

    files = Disk(
        read,
        lambda name: (spec.parent / name).is_file(),
        lambda name: (spec.parent / name).is_dir(),
    )
    return compile_robot(
        spec.read_text("utf-8"),
        spec.name,
        library(),
        profiles,
        read=read,
        disk=replace(files, moments=moments),
    )


def moments(name: str, scale: Vector) -> Moments:
    return measured(str(SPECS[0].parent / name), scale)


def places(findings: tuple[Finding, ...]) -> set[tuple[int, str]]:
    return {(entry.span.line, entry.code) for entry in findings if entry.span}


@pytest.mark.parametrize("spec", SPECS, ids=lambda file: file.stem)
def test_each_marked_line_gives_its_finding_and_no_other_line_gives_one(spec: Path) -> None:
    expected = marks(spec.read_text("utf-8"))
    bare = compiled(spec)
    assert places((*bare.findings, *unused_allows(bare.allows, set(bare.used)))) == expected.pop(
        None
    )
    for profile, more in expected.items():
        assert profile
        alone = {(entry.code, entry.message) for entry in compiled(spec).findings}
        added = [
            entry
            for entry in compiled(spec, profile).findings
            if (entry.code, entry.message) not in alone
        ]
        assert places(tuple(added)) == more


@pytest.mark.parametrize("code", sorted(set(CATALOGUE) - NOT_OF_A_LINE - LIVE))
def test_each_code_that_a_robot_file_can_provoke_has_a_marked_line(code: str) -> None:
    marked = {
        code
        for spec in SPECS
        for line_marks in marks(spec.read_text("utf-8")).values()
        for _, code in line_marks
    }
    assert code in marked


CONFLICTS = {
    "TF003": "tree.yaml",
    "TF201": "tree.yaml",
    "TF202": "tree.yaml",
    "TF204": "tree.yaml",
    "TF205": "tree.yaml",
    "TF209": "tree.yaml",
    "TF301": "owners.yaml",
    "TF502": "names.yaml",
    "TF702": "bodies.yaml",
    "TF107": "poses.yaml",
    "TF812": "owners.yaml",
} | {"TF003": "text.yaml"}


@pytest.mark.parametrize(("code", "spec"), CONFLICTS.items())
def test_a_conflict_shows_its_other_place_too(code: str, spec: str) -> None:
    of_code = [entry for entry in compiled(SPECS[0].parent / spec).findings if entry.code == code]
    with_note = [
        entry
        for entry in of_code
        if any(note.span and note.span != entry.span for note in entry.notes)
    ]
    assert with_note
    alone = [entry for entry in of_code if entry not in with_note]
    assert all("self" in entry.message for entry in alone), "only a frame on itself has one place"


@pytest.mark.parametrize("spec", SPECS, ids=lambda file: file.stem)
def test_a_message_is_one_line_and_its_place_lies_in_the_file(spec: Path) -> None:
    lines = spec.read_text("utf-8").splitlines()
    for entry in compiled(spec).findings:
        assert entry.message
        assert "\n" not in entry.message + entry.help
        span = entry.span
        assert span
        assert span.file == spec.name
        assert 1 <= span.line <= len(lines)
        assert 1 <= span.column <= len(lines[span.line - 1]) + 1
        assert (span.end_line, span.end_column) >= (span.line, span.column)


def test_findings_come_in_the_order_of_the_file() -> None:
    findings = compiled(SPECS[0].parent / "everything.yaml").findings
    positions = [(entry.span.line, entry.span.column) for entry in findings if entry.span]
    assert positions == sorted(positions)


@pytest.mark.parametrize(
    ("spec", "wrong", "right"),
    [
        ("owners", "base_drvie", "base_drive"),
        ("values", "gaurd", "guard"),
        ("values", "mst", "mast"),
    ],
)
def test_the_nearest_known_name_is_the_advice(spec: str, wrong: str, right: str) -> None:
    findings = compiled(SPECS[0].parent / f"{spec}.yaml").findings
    assert any(wrong in words(entry) and right in words_of(entry.help) for entry in findings)


@pytest.mark.parametrize(
    ("of_first", "of_second", "advice"), [(0, 0, "-0.9"), (0.25, 0, "-0.9"), (0.25, 0.1, "-1.1")]
)
def test_the_advice_for_chained_joints_keeps_the_motion_of_the_last(
    of_first: float, of_second: float, advice: str
) -> None:
    joint = "{{type: continuous, parent: base_link, child: {}{}}}"
    joints = {
        "a": f", offset: {of_first}",
        "b": f", offset: {of_second}, mimic: {{joint: a, multiplier: 2, offset: 0.5}}",
        "c": ", mimic: {joint: b, multiplier: -2, offset: 0.1}",
    }
    lines = [f"  {name}: {joint.format(name, more)}" for name, more in joints.items()]
    links = "links: {base_link: {}, a: {}, b: {}, c: {}}\njoints:\n"
    text = f"tfcompose: 1\nrobot: r\n{links}" + "\n".join(lines)
    findings = compile_robot(text, "r.yaml", library()).findings
    (chain,) = [entry for entry in findings if entry.code == "TF708"]
    assert f"{{joint: a, multiplier: -4, offset: {advice}}}" in chain.help


def test_a_rule_that_crashes_is_a_finding_and_the_others_go_on() -> None:
    @rule("TF201")
    def two_parents(robot: Robot) -> Iterator[Finding]:
        yield finding("TF201", robot.name, None)
        raise RuntimeError(robot.name)

    robot = compiled(SPECS[0].parent / "no_frames.yaml").robot
    assert robot
    findings = check(robot, [two_parents, *RULES.values()])
    assert {entry.code for entry in findings} == {"TF903", "TF206"}
    assert next(entry for entry in findings if entry.code == "TF903").span == Span(
        "no_frames.yaml"
    )
