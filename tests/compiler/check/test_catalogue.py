"""The rules and the catalogue agree: names, pages, and at most the severity of the code."""

from pathlib import Path

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.check import RULES, Rule
from tfcompose.compiler.check import check as checked
from tfcompose.compiler.check.check import by_code
from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.robot import Robot

SPECS = sorted((Path(__file__).parent / "specs").glob("*.yaml"))


def test_a_rule_has_the_name_of_its_code_and_a_page_that_says_what_to_do() -> None:
    for code, its_rule in RULES.items():
        assert its_rule.find.__name__ == CATALOGUE[code].name
        assert "\n\n" in CATALOGUE.page(code), code
        assert not its_rule.find.__doc__, f"{code}: its page is data/codes/{code}.md"


def test_two_rules_of_one_code_are_refused() -> None:
    def two_parents(robot: Robot) -> list[Finding]:
        return [finding("TF201", robot.name, None)]

    again: Rule = rule("TF201")(two_parents)
    assert [
        entry.message for entry in checked(Robot("r", "r.yaml", {}, (), {}, (), None), [again])
    ] == ["r"]
    with pytest.raises(ValueError, match="TF201"):
        by_code([*RULES.values(), again])


def test_a_robot_sets_how_much_its_findings_matter() -> None:
    spec = Path(__file__).parent / "specs" / "levels.yaml"
    findings = compile_robot(spec.read_text("utf-8"), spec.name, library()).findings
    assert {entry.severity for entry in findings if entry.code == "TF401"} == {"warning"}
    assert {entry.severity for entry in findings if entry.code == "TF101"} == {"error"}


def test_a_finding_of_a_rule_is_at_most_as_severe_as_the_catalogue_says() -> None:
    for spec in SPECS:
        if "\nrules:" not in (text := spec.read_text("utf-8")):
            findings = compile_robot(text, spec.name, library()).findings
            assert not [
                entry
                for entry in findings
                if entry.severity == "error" != CATALOGUE[entry.code].severity
            ], spec
