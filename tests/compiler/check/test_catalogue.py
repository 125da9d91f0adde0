"""The catalogue has every code, with its family, severity and page; what is generated from it is up to date."""

import inspect
import re
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tfcompose.cli.compiling import library
from tfcompose.compiler.check import RULES, Rule
from tfcompose.compiler.check import check as checked
from tfcompose.compiler.check.check import by_code
from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.pages import PAGES, page, table
from tfcompose.foundation.catalogue import CATALOGUE, FAMILIES, Code, code_of
from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.robot import Robot

ROOT = Path(__file__).parents[3]
PACKAGE = ROOT / "tfcompose"
SPECS = sorted((Path(__file__).parent / "specs").glob("*.yaml"))


def test_each_code_has_a_page_whose_first_line_is_a_sentence() -> None:
    for code in CATALOGUE:
        first, _, rest = page(code).partition("\n")
        assert first.endswith("."), code
        assert len(first) < 110, code
        assert not rest or rest.startswith("\n"), f"{code}: an empty line follows the first"
        assert code not in RULES or len(rest.split()) >= 4, (
            f"{code}: why it is wrong, and what to do"
        )


def test_a_page_is_in_one_place() -> None:
    assert not set(RULES) & set(PAGES)
    assert set(RULES) | set(PAGES) == set(CATALOGUE)
    assert page("TF201") == inspect.getdoc(RULES["TF201"].find)


def test_codes_are_in_order_in_families_and_have_one_name_each() -> None:
    assert list(CATALOGUE) == sorted(CATALOGUE)
    assert {code.family for code in CATALOGUE.values()} == set(FAMILIES)
    assert len({code.name for code in CATALOGUE.values()}) == len(CATALOGUE)


def test_every_code_is_used_and_every_code_that_is_used_is_in_the_catalogue() -> None:
    sources = [
        file.read_text("utf-8")
        for file in PACKAGE.rglob("*.py")
        if file.name not in {"catalogue.py", "pages.py"}
    ]
    used = {code for text in sources for code in re.findall(r"\"(TF\d{3})\"", text)}
    assert used == set(CATALOGUE)


def test_a_finding_has_the_name_and_the_severity_of_its_code_unless_it_says_otherwise() -> None:
    one = finding("TF207", "message", None)
    assert (one.name, one.severity) == ("wrong_chain_order", "warning")
    assert finding("TF207", "message", None, severity="error").severity == "error"
    assert finding("TF201", "message", None).severity == "error"


def test_a_rule_of_an_unknown_code_of_another_name_or_of_a_code_that_has_one_is_refused() -> None:
    def two_parents(robot: Robot) -> list[Finding]:
        return [finding("TF201", robot.name, None)]

    with pytest.raises(KeyError):
        rule("TF299")(two_parents)
    with pytest.raises(ValueError, match="cycle"):
        rule("TF202")(two_parents)
    again: Rule = rule("TF201")(two_parents)
    assert [
        one.message for one in checked(Robot("r", "r.yaml", {}, (), {}, (), None), [again])
    ] == ["r"]
    with pytest.raises(ValueError, match="TF201"):
        by_code([*RULES.values(), again])


def test_a_code_is_found_by_its_name_too() -> None:
    assert code_of("two_parents") == code_of("tf201") == "TF201"
    assert code_of("three_parents") is None


def test_a_robot_sets_how_much_its_findings_matter() -> None:
    spec = Path(__file__).parent / "specs" / "levels.yaml"
    found = compile_robot(spec.read_text("utf-8"), spec.name, library()).found
    assert {one.severity for one in found if one.code == "TF401"} == {"warning"}
    assert {one.severity for one in found if one.code == "TF101"} == {"error"}


def test_a_finding_of_a_rule_is_at_most_as_severe_as_the_catalogue_says() -> None:
    for spec in SPECS:
        if "\nrules:" not in (text := spec.read_text("utf-8")):
            found = compile_robot(text, spec.name, library()).found
            assert not [
                one for one in found if one.severity == "error" != CATALOGUE[one.code].severity
            ], spec


def test_a_table_has_the_codes_of_its_family() -> None:
    assert re.findall(r"^\| (TF\d{3}) ", table("names"), re.MULTILINE) == [
        code for code in CATALOGUE if code.startswith("TF5")
    ]
    assert len(table().splitlines()) == len(CATALOGUE) + 2


def test_a_robot_that_cannot_be_built_or_is_not_understood_cannot_be_allowed() -> None:
    assert not Code("TF202", "cycle", "tree", "error", unbuildable=True).can_be_allowed
    assert not CATALOGUE["TF101"].can_be_allowed
    assert CATALOGUE["TF301"].can_be_allowed


def test_the_catalogue_loads_no_rules_and_no_pages() -> None:
    loaded = "[name for name in sys.modules if name.startswith('tfcompose')]"
    program = f"import sys, tfcompose.foundation.findings; print(*{loaded})"
    done = processes.run([sys.executable, "-c", program], check=True, cwd=ROOT)
    modules = {
        "tfcompose",
        *(f"tfcompose.foundation{name}" for name in ("", ".catalogue", ".findings")),
    }
    assert set(done.stdout.split()) == modules
