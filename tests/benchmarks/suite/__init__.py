"""The benchmarks: a module each, with a ``BENCHMARK``."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.benchmarks.benchmark import Benchmark

NAMES = tuple(sorted(file.stem for file in Path(__file__).parent.glob("[a-z]*.py")))


def benchmark_of(name: str) -> Benchmark:
    """Return the benchmark of that name."""
    module = import_module(f"{__name__}.{name}")
    benchmark: Benchmark = module.BENCHMARK
    return benchmark
