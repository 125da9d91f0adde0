"""Analysis of arguments: the possible values of each argument, and its effects."""

from __future__ import annotations

import math
from itertools import combinations as subsets
from itertools import product
from typing import TYPE_CHECKING

from pydantic import ValidationError

from tfcompose.spec.language.args import ArgSpec, BuildInputs, full
from tfcompose.spec.language.expressions import Value, constant, evaluate, insertable_text, parse
from tfcompose.spec.language.variables import Variables, unused_variables

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.spec.load import Source

#: Values of arguments by name, in the form of the command line.
Combination = dict[str, str]

MOST = 256
#: The index of an argument, and a value.
_Choice = tuple[int, str]


def combinations(
    alternatives: Mapping[str, Sequence[str]], first: Combination
) -> list[Combination]:
    """Return the combinations to check, with ``first`` before all others."""
    names = list(alternatives)
    if math.prod(map(len, alternatives.values())) <= MOST:
        rows = list(product(*alternatives.values()))
    else:
        rows = _pairwise([alternatives[name] for name in names])
    assignments = [dict(zip(names, row, strict=True)) for row in rows]
    return [first, *(combination for combination in assignments if combination != first)][:MOST]


def _pairwise(values: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """Return at most ``MOST`` rows that contain each pair of values of two arguments.

    A greedy search finds the rows.
    """
    missing = {
        frozenset(((i, a), (j, b))): None
        for i, j in subsets(range(len(values)), 2)
        for a, b in product(values[i], values[j])
    }
    rows: list[tuple[str, ...]] = []
    while missing and len(rows) < MOST:
        chosen: dict[int, str] = dict(next(iter(missing)))
        for index, option in enumerate(values):
            if index not in chosen:
                chosen[index] = max(
                    option, key=lambda value: _new_pairs((index, value), chosen, missing)
                )
        for pair in subsets(sorted(chosen.items()), 2):
            missing.pop(frozenset(pair), None)
        rows.append(tuple(chosen[index] for index in range(len(values))))
    return rows


def _new_pairs(
    choice: _Choice, chosen: dict[int, str], missing: Mapping[frozenset[_Choice], None]
) -> int:
    return sum(frozenset((choice, partner)) in missing for partner in chosen.items())


def alternatives_of(
    source: Source, inputs: BuildInputs, profiles: Source
) -> tuple[dict[str, tuple[str, ...]], dict[str, str]]:
    """Return the possible values of used arguments that have no value yet, and their defaults.

    Both are by name, in the form of the command line. ``profiles`` is the file with its profiles,
    which may also use the arguments.
    """
    idle = {
        name
        for section, name in unused_variables(source.data, profiles.data.get("profiles"))
        if section == "args"
    }
    variables = Variables(source, inputs)
    alternatives: dict[str, tuple[str, ...]] = {}
    for name, raw in source.mapping("args").items():
        if raw is None or name in idle or name in inputs.args:
            continue
        try:
            alternatives[name] = ArgSpec.model_validate(full(raw)).alternatives
        except ValidationError:
            continue  # validation of the file rejects it
    with_choices = {name: texts for name, texts in alternatives.items() if texts}
    return with_choices, {
        name: _first(variables.args[name], texts) for name, texts in with_choices.items()
    }


def _first(value: Value | None, texts: tuple[str, ...]) -> str:
    """Return the text for the value; if there is none, the first text."""
    return next(
        (text for text in texts if value is not None and text == insertable_text(value)), texts[0]
    )


def values_that_satisfy(
    expression: str, specs: Mapping[str, ArgSpec], values: Combination
) -> Iterator[Combination]:
    """Yield values of the arguments in an expression that make the expression true.

    If ``values`` do so, they come first. For an argument without choices, the constants in the
    expression are tried.
    """
    operands = parse(expression).operands.values()
    names = [operand.removeprefix("args.") for operand in operands if operand.startswith("args.")]
    constants = [text for operand in operands if (text := constant(operand)) is not None]
    first = {name: values[name] for name in names if name in specs}
    alternatives = {
        name: list(dict.fromkeys((value, *_values_around(specs[name], constants))))
        for name, value in first.items()
    }
    for combination in combinations(alternatives, first):
        try:
            scope = {
                f"args.{name}": specs[name].value(value) for name, value in combination.items()
            }
            if evaluate(expression, scope.__getitem__) is True:
                yield combination
        except ValueError:
            continue


def _values_around(spec: ArgSpec, constants: Sequence[str]) -> Iterator[str]:
    """Yield possible values of an argument: its alternatives, and values near the constants."""
    yield from spec.alternatives
    if not spec.choices:
        yield from constants
    if spec.kind == "int":
        numbers = [int(text) for text in constants if text.isdigit()]
        yield from (str(number + step) for number in numbers for step in (1, -1))
        yield from (str(step - number) for number in numbers for step in (0, 1, -1))
