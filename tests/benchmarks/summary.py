"""Statistics of samples, ratios of pairs, and numbers as tables print them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import median, quantiles
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.benchmarks.benchmark import Limit, Statistic, Unit


@dataclass(frozen=True)
class Summary:
    """A median and a spread: the 10th to the 90th percentile, interpolated."""

    median: float
    low: float
    high: float
    count: int


def summary(values: Sequence[float]) -> Summary:
    """Return the median and the spread of one sample or more."""
    deciles = quantiles(values, n=10, method="inclusive") if len(values) > 1 else list(values)
    return Summary(median(values), deciles[0], deciles[-1], len(values))


def ratios(values: Sequence[float], peer: Sequence[float]) -> list[float]:
    """Return, round by round, how many times the peer's value tfcompose's is."""
    pairs = zip(values, peer, strict=False)  # a run that was interrupted has an open round
    return [mine / its for mine, its in pairs if its]


def statistic(values: Sequence[float], name: Statistic) -> float:
    """Return the statistic of that name."""
    if name == "least":
        return min(values)
    if name == "worst":
        return max(values)
    quantiles = summary(values)
    return quantiles.high if name == "p90" else quantiles.median


def bound(limit: Limit, peers: dict[str, list[float]]) -> float:
    """Return the greatest value the limit allows; infinite where its peer was not measured."""
    peer = limit.times or limit.above
    if peer is None:
        return limit.most
    if not peers.get(peer.name):
        return math.inf
    value = statistic(peers[peer.name], limit.statistic)
    return value * limit.most if limit.times else value + limit.most


def number(value: float) -> str:
    """Return a value with two or three digits that count: 0.012, 0.34, 1.23, 12.3, 123."""
    if value == 0:
        return "0"
    digits = max(0, 2 - math.floor(math.log10(abs(value)))) if abs(value) >= 1 else 2
    if abs(value) < 0.1:
        digits = 1 - math.floor(math.log10(abs(value)))
    return f"{value:,.{digits}f}"


def quantity(value: float, unit: Unit | str) -> str:
    """Return a value with its unit."""
    if unit == "findings":
        return f"{value:g}"
    return number(value) if unit == "times" else f"{number(value)} {unit}"


def spread(values: Sequence[float], unit: Unit | str) -> str:
    """Return the median with its unit, and the spread in parentheses where it has one."""
    of = summary(values)
    text = quantity(of.median, unit)
    if of.count == 1 or number(of.low) == number(of.high):
        return text
    return f"{text} ({number(of.low)} to {number(of.high)})"
