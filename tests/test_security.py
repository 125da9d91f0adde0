"""SECURITY.md claims nothing that no test shows.

Each line of its tables names one that is there.
"""

import ast
import re
from pathlib import Path

import pytest

from tests.support.house import ROOT

TEXT = (ROOT / "SECURITY.md").read_text("utf-8")
#: A line of a table: what is defended, and the test.
ROWS = [
    (claim.strip(), cell.strip())
    for claim, cell in re.findall(r"^\| (.+?) \| (.+?) \|$", TEXT, re.MULTILINE)
    if claim != "defended"
]


def names_of_tests(file: Path) -> set[str]:
    """Return the names of the tests in a file."""
    tree = ast.parse(file.read_text("utf-8"))
    return {
        node.name
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


@pytest.mark.parametrize(("claim", "cell"), ROWS)
def test_a_defended_line_names_a_test_that_is_there(claim: str, cell: str) -> None:
    assert claim.endswith(".")
    named = re.fullmatch(r"`(tests/[\w/]+\.py)::(test_\w+)`", cell)
    assert named, f"{claim} names no test"
    assert named[2] in names_of_tests(ROOT / named[1])


def test_each_adversary_has_what_is_defended_and_what_is_not() -> None:
    sections = re.split(r"^## ", TEXT, flags=re.MULTILINE)[1:]
    *adversaries, reporting = sections
    assert reporting.startswith("Reporting")
    assert len(ROWS) > 10
    for section in adversaries:
        assert section.count("| defended |") == section.count("Not defended:") == 1, section
