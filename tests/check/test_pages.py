"""Every code has a page, and every rule's page is its docstring."""

import inspect
from pathlib import Path

import pytest

from tfcompose.check import RULES, code_of
from tfcompose.check.pages import PAGES, page, rule_table
from tfcompose.cli.compiling import library
from tfcompose.codes import CODES
from tfcompose.compile import compile_robot


@pytest.mark.parametrize("code", CODES)
def test_each_code_has_a_page_whose_first_line_is_a_sentence(code: str) -> None:
    first, _, rest = page(code).partition("\n")
    assert first.endswith("."), first
    assert len(first) < 110
    assert not rest or rest.startswith("\n"), "an empty line follows the first"


def test_a_page_stands_in_one_place() -> None:
    assert not {rule.code for rule in RULES} & set(PAGES)
    assert {rule.code for rule in RULES} | set(PAGES) == set(CODES)
    assert page("TF201") == inspect.getdoc(next(rule.check for rule in RULES if rule.code == "TF201"))


def test_a_code_is_found_by_its_name_too() -> None:
    assert code_of("two_parents") == code_of("tf201") == "TF201"
    assert code_of("three_parents") is None


def test_a_robot_sets_how_much_its_findings_matter() -> None:
    spec = Path(__file__).parent / "specs" / "levels.yaml"
    found = compile_robot(spec.read_text("utf-8"), spec.name, library()).found
    assert {one.severity for one in found if one.code == "TF401"} == {"warning"}
    assert {one.severity for one in found if one.code == "TF101"} == {"error"}


def test_the_table_of_rules_in_the_readme_is_the_one_that_explain_prints() -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
    _, _, rest = readme.partition("<!-- rules -->\n")
    shown, mark, _ = rest.partition("<!-- /rules -->")
    assert mark
    assert shown == rule_table(), "python -m tfcompose explain --table"


@pytest.mark.parametrize("spec", sorted((Path(__file__).parent / "specs").glob("*.yaml")), ids=lambda path: path.stem)
def test_a_finding_of_a_rule_is_at_most_as_severe_as_the_table_says(spec: Path) -> None:
    warnings = {rule.code for rule in RULES if rule.severity == "warning"}
    found = compile_robot(spec.read_text("utf-8"), spec.name, library()).found
    assert not [one for one in found if one.severity == "error" and one.code in warnings]
