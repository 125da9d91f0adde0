"""What is switched off, or allowed, is out of the way; what is left can be built."""

from pathlib import Path

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.check import Rule
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.foundation.catalogue import can_be_allowed
from tfcompose.foundation.findings import Finding
from tfcompose.model.plan.file import read_plan

SPECS = sorted((Path(__file__).parent / "specs").glob("*.yaml"))
PRESETS = library()


@pytest.mark.parametrize("spec", SPECS, ids=lambda file: file.stem)
def test_with_all_rules_off_that_can_be_off_a_robot_is_built_or_refused(spec: Path) -> None:
    text = spec.read_text("utf-8")
    codes = sorted(
        {
            finding.code
            for finding in compile_robot(text, spec.name, PRESETS).findings
            if can_be_allowed(finding.code)
        }
    )
    if "\nrules:" in text or not codes:
        return
    rules = ", ".join(f"{code}: off" for code in codes)
    made = compile_robot(f"{text}\nrules: {{{rules}}}\n", spec.name, PRESETS)
    assert not {finding.code for finding in made.findings} & set(codes)
    if made.robot and not made.errors:
        (plan,) = [file.text for file in emit(made.robot) if file.path == "plan.json"]
        assert read_plan(plan, "plan.json").robot == made.robot.name


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("frames: {a: {parent: b}, b: {parent: a}}", "TF202"),
        ("links: {a: {parent: a}}", "TF202"),
        ("frames: {a: {}, b: {parent: c}}", "TF203"),
        ("frames: {a: {}, b: {parent: a, owner: nobody}}", "TF302"),
    ],
)
def test_what_leaves_nothing_to_build_always_counts(text: str, code: str) -> None:
    text = (
        f"tfcompose: 1\nrobot: r\nrules: {{{code}: off}}\n{text}  # tfcompose: allow {code}"
        " because I say so\n"
    )
    severities = {
        finding.code: finding.severity
        for finding in compile_robot(text, "r.yaml", PRESETS).findings
    }
    assert (severities[code], severities["TF017"]) == ("error", "error")


@pytest.mark.parametrize(
    "entry",
    [
        "TF641: {limit: 10 %}",
        "view_blocked: {limit: 10 %}",
        "TF641: {limit: 10 %, severity: error}",
    ],
)
def test_a_limit_alone_switches_nothing_off(entry: str) -> None:
    wall = "wall: {parent: base_link, xyz: [0.3, 0, 0.3], collision: {box: [0.02, 0.15, 0.4]}}"
    camera = "{preset: realsense/d455, parent: base_link, xyz: [0.1, 0, 0.3], driver: none}"
    text = (
        f"tfcompose: 1\nrobot: r\nlinks: {{base_link: {{}}, {wall}}}\nsensors: {{eye: {camera}}}\n"
    )
    assert compile_robot(text, "r.yaml", PRESETS).findings == ()
    (finding,) = compile_robot(f"{text}rules: {{{entry}}}\n", "r.yaml", PRESETS).findings
    assert (finding.code, finding.severity) == (
        "TF641",
        "error" if "error" in entry else "warning",
    )


def test_a_rule_that_is_off_does_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    requested: list[str] = []

    def check(_: object, rules: list[Rule]) -> list[Finding]:
        requested.extend(finding.code for finding in rules)
        return []

    monkeypatch.setattr("tfcompose.compiler.compile.check", check)
    compile_robot("tfcompose: 1\nrobot: r\nrules: {view_blocked: off}\n", "r.yaml", PRESETS)
    assert "TF640" in requested
    assert "TF641" not in requested
