"""Combinations of arguments that ``lint`` judges, and how it names them."""

from __future__ import annotations

from itertools import combinations as subsets
from itertools import product
from typing import TYPE_CHECKING

import pytest

from tests.support.cli import tfcompose
from tfcompose.cli.linting import merge_findings
from tfcompose.foundation.findings import Span, finding
from tfcompose.spec.language.arguments import MOST, combinations

if TYPE_CHECKING:
    from pathlib import Path


def test_few_combinations_are_all_judged_and_the_defaults_first() -> None:
    every = combinations({"a": ("1", "2"), "b": ("x", "y", "z")}, {"a": "2", "b": "y"})
    assert every[0] == {"a": "2", "b": "y"}
    assert len(every) == len({tuple(choice.items()) for choice in every}) == 6


@pytest.mark.parametrize(("count", "values"), [(9, 2), (30, 2), (6, 5), (4, 9)])
def test_beyond_that_each_two_values_are_together_in_one(count: int, values: int) -> None:
    alternatives = {f"a{i}": tuple(f"v{j}" for j in range(values)) for i in range(count)}
    every = combinations(alternatives, dict.fromkeys(alternatives, "v0"))
    assert len(every) <= MOST < values**count
    for first, second in subsets(alternatives, 2):
        assert {(row[first], row[second]) for row in every} == set(
            product(alternatives[first], alternatives[second])
        )


def test_a_finding_is_named_by_the_fewest_arguments_that_say_where_it_is() -> None:
    every = combinations(
        {"a": ("0", "1"), "b": ("0", "1"), "c": ("0", "1")}, dict.fromkeys("abc", "0")
    )
    always, single, pair, two = (
        finding("TF203", text, Span("r.yaml")) for text in ("x", "a", "b", "c")
    )
    judged = [
        (
            option,
            [always]
            + [single] * (option["a"] == "1")
            + [pair] * (option["a"] == option["b"] == "1")
            + [two] * ("1" in {option["a"], option["b"]}),
        )
        for option in every
    ]
    notes = {
        entry.message: [note.message for note in entry.notes] for entry in merge_findings(judged)
    }
    assert notes["x"] == []
    assert notes["a"] == ["with a:=1"]
    assert notes["b"] == ["with a:=1 b:=1"]
    assert notes["c"][0].startswith(("with a:=1, and in 2 other", "with b:=1, and in 2 other"))


ROBOT = """\
tfcompose: 1
robot: r
args: {sim: false, lidar: {choices: [a, b], default: a}}
links: {base_link: {}}
frames:
  s: {parent: ghost, when: "${args.sim and args.lidar == 'b'}"}
  t: {parent: gone}
"""


def test_lint_and_the_other_commands_take_arguments(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(ROBOT)
    done = tfcompose("lint", file, code=1)
    assert done.stdout.count("note: with sim:=true lidar:=b") == 1
    assert done.stdout.count("TF203") == 2
    assert tfcompose("lint", file, "sim:=false", code=1).stdout.count("TF203") == 1
    file.write_text(ROBOT.replace("  t: {parent: gone}\n", ""))
    tfcompose("tree", file, "lidar:=b")
    words = ("build", "sim:=true", file, "--set", "args.lidar=b", "-o", tmp_path / "out")
    assert "TF203" in tfcompose(*words, code=1).stderr
    assert "TF106" in tfcompose("tree", file, "lidar:=c", code=1).stderr
    listing = tfcompose("up", file, "--show-args").stdout
    assert [line.partition(":=")[0] for line in listing.splitlines()] == ["sim", "lidar"]


def test_lint_judges_an_integer_at_its_bounds_and_its_default(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    rows = "".join(
        f"  at_{n}: {{parent: gone_{n}, when: '${{args.n == {n}}}'}}\n" for n in (0, 2, 3, 9)
    )
    file.write_text(
        "tfcompose: 1\nrobot: r\nargs: {n: {default: 2, min: 0, max: 9}}\nframes:\n "
        f" base_link: {{}}\n{rows}"
    )
    printed = tfcompose("lint", file, code=1).stdout
    assert [n for n in (0, 2, 3, 9) if f"note: with n:={n}" in printed] == [0, 2, 9]
