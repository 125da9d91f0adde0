"""Text at a human width: the limits of style that no linter of the project checks."""

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.house import PACKAGE, ROOT, nodes_of

#: One worker parses all files, once.
pytestmark = pytest.mark.xdist_group("sources")

WIDTH = 99
_PRAGMA = re.compile(r"  # (?:noqa|type): .*")
MOST_POSITIONAL = 5
Nodes = tuple[ast.AST, ...]
Comprehension = ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp


def parts_of(comprehension: Comprehension) -> Iterator[ast.expr]:
    """Yield what a comprehension evaluates for each item: all but the first iterable."""
    if isinstance(comprehension, ast.DictComp):
        yield comprehension.key
        yield comprehension.value
    else:
        yield comprehension.elt
    for index, generator in enumerate(comprehension.generators):
        yield from generator.ifs
        if index:
            yield generator.iter


def ternaries_in_comprehensions(nodes: Nodes) -> Iterator[int]:
    for node in nodes:
        if isinstance(node, Comprehension):
            parts = list(parts_of(node))
            if any(isinstance(inner, ast.IfExp) for part in parts for inner in ast.walk(part)):
                yield node.lineno


def comprehensions_as_control_flow(nodes: Nodes) -> Iterator[int]:
    """Yield lines where a comprehension runs for its effects, or adds what it names on the way."""
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, Comprehension):
            yield node.lineno
        elif isinstance(node, ast.AugAssign) and isinstance(node.value, Comprehension):
            names = [inner for inner in ast.walk(node.value) if isinstance(inner, ast.NamedExpr)]
            yield from [node.lineno for _ in names[:1]]


def ternaries_in_unions(nodes: Nodes) -> Iterator[int]:
    """Yield lines with two terms ``| (… if … else {})`` in one union."""
    for node in nodes:
        if not isinstance(node, ast.expr):
            continue
        terms: list[ast.expr] = []
        left: ast.expr = node
        while isinstance(left, ast.BinOp) and isinstance(left.op, ast.BitOr):
            terms.append(left.right)
            left = left.left
        if sum(isinstance(term, ast.IfExp) for term in terms) > 1:
            yield node.lineno


def constructors_with_many_positional_arguments(nodes: Nodes) -> Iterator[int]:
    for node in nodes:
        if not isinstance(node, ast.Call) or len(node.args) <= MOST_POSITIONAL:
            continue
        name = ast.unparse(node.func).rpartition(".")[2]
        if name[:1].isupper() and not name.isupper():
            yield node.lineno


def values_smuggled_through_arguments(nodes: Nodes) -> Iterator[int]:
    """Yield lines that give a command's parsed ``arguments`` an attribute.

    A value that is made of the attribute itself, as where a default is filled in, is none.
    """
    for node in nodes:
        if not isinstance(node, ast.Assign):
            continue
        for target in map(ast.unparse, node.targets):
            if target.startswith("arguments.") and target not in ast.unparse(node.value):
                yield node.lineno


CHECKS: tuple[Callable[[Nodes], Iterator[int]], ...] = (
    ternaries_in_comprehensions,
    comprehensions_as_control_flow,
    ternaries_in_unions,
    constructors_with_many_positional_arguments,
    values_smuggled_through_arguments,
)
#: Calls of other people's constructors, which take nothing by name.
ALLOWED = {"tfcompose/tf/ros/node.py: constructors_with_many_positional_arguments"}


def lines_of(file: Path, check: Callable[[Nodes], Iterator[int]]) -> list[str]:
    name = file.relative_to(ROOT).as_posix()
    if f"{name}: {check.__name__}" in ALLOWED:
        return []
    return [f"{name}:{line}" for line in check(nodes_of(file))]


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_package_says_things_openly(check: Callable[[Nodes], Iterator[int]]) -> None:
    assert not [line for file in sorted(PACKAGE.rglob("*.py")) for line in lines_of(file, check)]


@pytest.mark.parametrize(
    ("check", "code"),
    [
        (ternaries_in_comprehensions, "[a if b else c for b in d]"),
        (comprehensions_as_control_flow, "found += [x for y in z if (x := y.x)]"),
        (comprehensions_as_control_flow, "[print(x) for x in y]"),
        (ternaries_in_unions, "a | (b if c else {}) | (d if e else {})"),
        (constructors_with_many_positional_arguments, "Pose(1, 2, 3, 4, 5, 6)"),
        (values_smuggled_through_arguments, "arguments.is_one = True"),
    ],
)
def test_each_check_finds_what_it_is_about(
    check: Callable[[Nodes], Iterator[int]], code: str
) -> None:
    assert list(check(tuple(ast.walk(ast.parse(code)))))


def test_no_line_of_the_package_is_wider_than_a_page() -> None:
    """Not even one that ruff is told to leave alone; what linters are told may stand behind it."""
    assert not [
        f"{file.relative_to(ROOT)}:{number}"
        for file in sorted(PACKAGE.rglob("*.py"))
        for number, line in enumerate(file.read_text("utf-8").splitlines(), 1)
        if len(_PRAGMA.sub("", line)) > WIDTH
    ]


#: How many characters a test's name has at most: a name is a claim, not a paragraph.
LONGEST_TEST_NAME = 70


def test_no_name_of_a_test_is_longer_than_a_claim() -> None:
    assert not [
        f"{file.relative_to(ROOT)}:{node.lineno}: {node.name}"
        for file in sorted((ROOT / "tests").rglob("test_*.py"))
        for node in nodes_of(file)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and node.name.startswith("test_")
        and len(node.name) > LONGEST_TEST_NAME
    ]


#: How many statements each wing has at most. A commit that raises one says why.
MOST_STATEMENTS = {
    "foundation": 1_900,
    "model": 2_050,
    "spec": 5_410,
    "compiler": 10_925,
    "tf": 5_950,
    "guard": 4_553,
    "launcher": 4_225,
    "cli": 6_200,
    "tools": 19_870,
}


def statements_of(wing: str) -> int:
    files = (PACKAGE / wing).rglob("*.py")
    return sum(isinstance(node, ast.stmt) for file in files for node in nodes_of(file))


@pytest.mark.parametrize("wing", MOST_STATEMENTS)
def test_a_wing_does_not_grow_unnoticed(wing: str) -> None:
    assert statements_of(wing) <= MOST_STATEMENTS[wing]
