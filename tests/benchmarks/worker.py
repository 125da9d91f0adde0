"""The process that measures one benchmark: what an earlier one imported or opened is not in it.

``python -m tests.benchmarks.worker NAME [--quick]`` prints the result as JSON, and progress on
standard error. It ends itself and what it started when its standard input is closed.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from datetime import datetime, timezone

from tests.benchmarks.benchmark import Benchmark, measure
from tests.benchmarks.record import Result, RowResult, machine, to_json
from tests.benchmarks.suite import benchmark_of


def result_of(
    benchmark: Benchmark, samples: dict[str, dict[str, list[float]]], load: float
) -> Result:
    """Return what was measured, with the machine, the day, and the load of a minute before."""
    contenders = benchmark.contenders
    installed = {
        contender.name: contender.version() for contender in contenders if not contender.missing()
    }
    return Result(
        about=benchmark.about,
        command=f"python -m tests.benchmarks --only {benchmark.name}",
        date=datetime.now(timezone.utc).date().isoformat(),
        load=(round(load, 2), round(os.getloadavg()[0], 2)),
        machine=machine(),
        versions={name: version for name, version in installed.items() if version},
        missing={
            contender.name: contender.missing() for contender in contenders if contender.missing()
        },
        rows={
            name: RowResult(row.title, row.unit, samples[name])
            for name, row in benchmark.rows.items()
            if samples[name]  # a trial may leave a large robot out
        },
    )


def main(name: str, *options: str) -> int:
    """Measure, and print the result; exit code 130 where it was interrupted."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it
    threading.Thread(target=_interrupt_at_end_of_input, daemon=True).start()
    load = os.getloadavg()[0]
    benchmark = benchmark_of(name)

    def progress(text: str) -> None:
        sys.stderr.write(f"{name}: {text}\n")

    try:
        samples = measure(benchmark, is_quick="--quick" in options, progress=progress)
    except KeyboardInterrupt:
        return 130
    json.dump(to_json(result_of(benchmark, samples, load)), sys.stdout)
    return 0


def _interrupt_at_end_of_input() -> None:
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGINT)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
