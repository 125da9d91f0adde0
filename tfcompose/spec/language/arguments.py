"""Analysis of arguments: the values that each can have, and what each decides."""

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

#: The values of arguments by name, as the command line gives them.
Combination = dict[str, str]

MOST = 256
#: An argument, by its number, and its value.
_Choice = tuple[int, str]


def combinations(
    alternatives: Mapping[str, Sequence[str]], first: Combination
) -> list[Combination]:
    """Return the combinations that are judged, ``first`` before all others."""
    names = list(alternatives)
    if math.prod(map(len, alternatives.values())) <= MOST:
        rows = list(product(*alternatives.values()))
    else:
        rows = _pairwise([alternatives[name] for name in names])
    found = [dict(zip(names, row, strict=True)) for row in rows]
    return [first, *(combination for combination in found if combination != first)][:MOST]


def _pairwise(values: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """Return rows that hold each pair of values of two arguments, found greedily.

    At most ``MOST``.
    """
    missing = {
        frozenset(((i, a), (j, b))): None
        for i, j in subsets(range(len(values)), 2)
        for a, b in product(values[i], values[j])
    }
    rows: list[tuple[str, ...]] = []
    while missing and len(rows) < MOST:
        chosen: dict[int, str] = dict(next(iter(missing)))
        for index, known in enumerate(values):
            if index not in chosen:
                chosen[index] = max(
                    known, key=lambda value: _new_pairs((index, value), chosen, missing)
                )
        for pair in subsets(sorted(chosen.items()), 2):
            missing.pop(frozenset(pair), None)
        rows.append(tuple(chosen[index] for index in range(len(values))))
    return rows


def _new_pairs(
    choice: _Choice, chosen: dict[int, str], missing: Mapping[frozenset[_Choice], None]
) -> int:
    return sum(frozenset((choice, other)) in missing for other in chosen.items())


def alternatives_of(
    source: Source, inputs: BuildInputs, aside: Source
) -> tuple[dict[str, tuple[str, ...]], dict[str, str]]:
    """Return the possible values of used arguments that have no value yet.

    Both are by name, as the command line gives them. ``aside`` is the file with its profiles,
    which may use them too.
    """
    idle = {
        name
        for section, name in unused_variables(source.data, aside.data.get("profiles"))
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
            continue  # it is refused where the whole is read
    with_choices = {name: texts for name, texts in alternatives.items() if texts}
    return with_choices, {
        name: _first(variables.args[name], texts) for name, texts in with_choices.items()
    }


def _first(value: Value | None, texts: tuple[str, ...]) -> str:
    """Return the word that says the value, or the first of all."""
    return next(
        (text for text in texts if value is not None and text == insertable_text(value)), texts[0]
    )


def values_that_satisfy(
    expression: str, specs: Mapping[str, ArgSpec], values: Combination
) -> Iterator[Combination]:
    """Yield values of the arguments in an expression that make it true.

    ``values`` come first where they do. An argument without choices is tried with the constants
    in the expression.
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
    """Yield values of an argument on both sides of the constants."""
    yield from spec.alternatives
    if not spec.choices:
        yield from constants
    if spec.kind == "int":
        numbers = [int(text) for text in constants if text.isdigit()]
        yield from (str(number + step) for number in numbers for step in (1, -1))
        yield from (str(step - number) for number in numbers for step in (0, 1, -1))
