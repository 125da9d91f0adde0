"""Combinations of the values that a robot's arguments can have.

Which ones are judged, and in which ones a finding is.

Up to ``MOST`` they are all judged; beyond it so many that each two values of any two arguments are
together in one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations as subsets
from itertools import product
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, Span

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
    return [first, *(one for one in found if one != first)][:MOST]


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


#: What makes findings of several combinations the same one.
Key = tuple[str, str, Span | None]


def merged(judged: Sequence[tuple[Combination, Sequence[Finding]]]) -> list[Finding]:
    """Return each finding once, with a note if only some combinations have it."""
    where: dict[Key, list[int]] = {}
    firsts: dict[Key, Finding] = {}
    for index, (_, findings) in enumerate(judged):
        for finding in findings:
            key = (finding.code, finding.message, finding.span)
            firsts.setdefault(key, finding)
            if where.setdefault(key, [])[-1:] != [index]:
                where[key].append(index)
    every = [combination for combination, _ in judged]
    for key, indices in where.items():
        if len(indices) < len(judged):
            note = Note(_named(every, indices))
            firsts[key] = replace(firsts[key], notes=(*firsts[key].notes, note))
    return list(firsts.values())


def _named(every: Sequence[Combination], where: Sequence[int]) -> str:
    """Return in which combinations something is, by the fewest arguments that say so."""
    inside = set(where)
    first = every[where[0]]
    best, covered = dict(first), 1
    for size in (2, 1):
        for names in subsets(first, size):
            matching = {
                i for i, one in enumerate(every) if all(one[name] == first[name] for name in names)
            }
            if matching <= inside and len(matching) >= covered:
                best, covered = {name: first[name] for name in names}, len(matching)
    words = " ".join(f"{name}:={value}" for name, value in best.items())
    others = len(inside) - covered
    more = f", and in {others} other combination{'s' * (others > 1)} of args" if others else ""
    return f"with {words}{more}"
