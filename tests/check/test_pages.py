"""Every code has a page, and every rule's page is its docstring."""

import inspect

import pytest

from tfcompose.check import RULES
from tfcompose.check.pages import PAGES, code_of, page
from tfcompose.diagnostic import CODES


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
