"""Plots of results, as PNG and SVG. Only this module loads matplotlib."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from tests.benchmarks.benchmark import TFCOMPOSE
from tests.benchmarks.summary import quantity, ratios, summary

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from tests.benchmarks.record import Result, RowResult

#: The same bytes for the same results.
_STYLE: Any = {"svg.hashsalt": "tfcompose", "svg.fonttype": "none", "font.size": 9}
_COLOURS = ("#1f6fb4", "#7f7f7f", "#b0b0b0", "#c9a227", "#5f9e6e")


def plot(results: Mapping[str, Result], folder: Path) -> list[Path]:
    """Write ``ratios``, and a plot of the samples for each benchmark; return the files."""
    with mpl.rc_context(_STYLE):
        figures = {name: _samples(result) for name, result in results.items()}
        if overview := _ratios(results):
            figures["ratios"] = overview
        files = []
        for name, figure in figures.items():
            for kind, options in (("svg", {"metadata": {"Date": None}}), ("png", {"dpi": 150})):
                files.append(folder / f"{name}.{kind}")
                figure.savefig(files[-1], **options)
    return files


def _ratios(results: Mapping[str, Result]) -> Figure | None:
    """Draw the ratio of tfcompose to each peer, on a logarithmic scale, with its spread."""
    bars = [
        (f"{name}: {row.title}, to {peer}", summary(ratios(row.samples[TFCOMPOSE.name], values)))
        for name, result in results.items()
        for row in result.rows.values()
        for peer, values in row.samples.items()
        if peer != TFCOMPOSE.name and all(values)
    ]
    if not bars:
        return None
    figure = Figure(figsize=(9, 1 + 0.4 * len(bars)), layout="constrained")
    axes: Any = figure.subplots()
    for position, (_, ratio) in enumerate(reversed(bars)):
        axes.plot([ratio.low, ratio.high], [position, position], color=_COLOURS[1], linewidth=2)
        axes.plot([ratio.median], [position], "o", color=_COLOURS[0])
    axes.axvline(1, color="black", linewidth=0.8)
    axes.set_xscale("log")
    low, high = min(bar.low for _, bar in bars), max(bar.high for _, bar in bars)
    axes.set_xlim(min(0.5, 0.8 * low), max(2, 1.25 * high))
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(-0.7, len(bars) - 0.3)
    axes.set_yticks(range(len(bars)), [_label(title) for title, _ in reversed(bars)], fontsize=7)
    axes.set_xlabel("tfcompose / peer; less is better")
    axes.grid(axis="x", alpha=0.3)
    return figure


def _samples(result: Result) -> Figure:
    """Draw each row's samples by contender, with their medians."""
    rows = list(result.rows.values())
    heights = [0.5 + 0.3 * len(row.samples) for row in rows]
    figure = Figure(figsize=(9, 0.5 + sum(heights)), layout="constrained")
    figure.suptitle(_plain(result.about), fontsize=9)
    grid: Any = figure.subplots(len(rows), 1, squeeze=False, height_ratios=heights)
    for axes, row in zip(grid[:, 0], rows, strict=True):
        _row(axes, row)
    return figure


def _row(axes: Any, row: RowResult) -> None:
    for position, (values, colour) in enumerate(
        zip(reversed(row.samples.values()), _COLOURS[len(row.samples) - 1 :: -1], strict=True)
    ):
        of = summary(values)
        axes.plot(values, [position] * len(values), "|", color=colour, markersize=9, alpha=0.5)
        axes.plot([of.median], [position], "o", color=colour)
        axes.annotate(
            quantity(of.median, row.unit),
            (of.median, position),
            xytext=(0, 6),
            textcoords="offset points",
            ha="center",
            fontsize=7,
        )
    axes.set_yticks(range(len(row.samples)), [_plain(name) for name in reversed(row.samples)])
    axes.set_ylim(-0.6, len(row.samples) - 0.2)
    axes.set_xlim(left=0)
    axes.set_title(f"{_plain(row.title)} [{row.unit}]", fontsize=8, loc="left")
    axes.grid(axis="x", alpha=0.3)


def _label(text: str) -> str:
    return textwrap.fill(_plain(text), 60)


def _plain(text: str) -> str:
    return text.replace("`", "").replace("$", r"\$")
