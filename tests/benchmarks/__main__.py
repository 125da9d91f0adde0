"""Measure tfcompose and its peers; write a table and plots.

``python -m tests.benchmarks`` measures all that the suite has, each benchmark in a process, and
writes ``table.md``, and plots as PNG and SVG, to ``build/benchmarks``. The exit code is 1 where a
benchmark failed or tfcompose is over a limit. Ctrl-C ends all that was started; benchmarks that
had ended are kept.
"""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark
from tests.benchmarks.record import ROOT, Result, from_json, read, write
from tests.benchmarks.suite import NAMES, benchmark_of
from tests.benchmarks.summary import bound, quantity, statistic
from tests.benchmarks.table import table

#: Seconds a worker gets to end what it started.
WORKER_END_S = 60.0


class FailedError(Exception):
    """Raised when a benchmark gives no result."""


def measured(benchmark: Benchmark, *, is_quick: bool) -> Result:
    """Measure in a process and return the result.

    Raises:
        FailedError: if it fails, or takes too long.
    """
    options = ["--quick"] if is_quick else []
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        worker = subprocess.Popen(
            [sys.executable, "-m", "tests.benchmarks.worker", benchmark.name, *options],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=output,
            start_new_session=True,  # Ctrl-C reaches it by way of its standard input, once
        )
        try:
            worker.wait(benchmark.timeout_s)
        except subprocess.TimeoutExpired:
            raise FailedError(f"no result in {benchmark.timeout_s:g} s") from None
        finally:
            _end(worker)
        if worker.returncode:
            raise FailedError(f"exit code {worker.returncode}")
        output.seek(0)
        return from_json(json.load(output))


def _end(worker: subprocess.Popen[bytes]) -> None:
    """Close the worker's input, at which it ends what it started, and wait for it."""
    assert worker.stdin
    worker.stdin.close()
    with suppress(subprocess.TimeoutExpired):
        worker.wait(WORKER_END_S)
    worker.kill()
    worker.wait()


def over_limits(benchmark: Benchmark, result: Result) -> list[str]:
    """Return a sentence for each limit that tfcompose does not keep."""
    sentences = []
    for name, row_result in result.rows.items():
        row, samples = benchmark.rows[name], row_result.samples
        for limit in row.limits:
            value = statistic(samples[TFCOMPOSE.name], limit.statistic)
            if value > (most := bound(limit, samples)):
                sentences.append(
                    f"{benchmark.name}, {row.title}: {limit.statistic}"
                    f" {quantity(value, row.unit)}, limit {quantity(most, row.unit)}"
                )
    return sentences


def measure_all(
    names: list[str], *, is_quick: bool, is_recorded: bool
) -> tuple[dict[str, Result], list[str]]:
    """Return results by benchmark, and sentences about failures and limits that are not kept."""
    results: dict[str, Result] = {}
    failures: list[str] = []
    for name in names:
        benchmark, began = benchmark_of(name), time.monotonic()
        (contender,) = [contender for contender in benchmark.contenders if contender == TFCOMPOSE]
        if reason := contender.missing():
            _say(f"{name}: left out: {reason}")
            continue
        _say(f"{name}: {benchmark.about}")
        try:
            results[name] = measured(benchmark, is_quick=is_quick)
        except FailedError as error:
            failures.append(f"{name} failed: {error}")
            continue
        except KeyboardInterrupt:
            failures.append(f"{name} was interrupted")
            break
        _say(f"{name}: done in {time.monotonic() - began:.0f} s, load {results[name].load[1]:g}")
        failures += over_limits(benchmark, results[name])
        if is_recorded:
            write({name: results[name]})
    return results, failures


def report(results: dict[str, Result], folder: Path) -> None:
    """Print the table; write it, and plots, to the folder."""
    text = table(results.values())
    sys.stdout.write(text)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "table.md").write_text(text, encoding="utf-8")
    if not find_spec("matplotlib"):
        _say("no plots: pip install 'tfcompose[benchmarks]'")
        return
    from tests.benchmarks.plots import plot  # noqa: PLC0415 (matplotlib, which may not be there)

    plot(results, folder)
    _say(f"wrote table.md, and plots as PNG and SVG, to {folder}")


def overview() -> str:
    """Return the benchmarks with what each measures, and contenders that the machine lacks."""
    lines = []
    for name in NAMES:
        benchmark = benchmark_of(name)
        lines.append(f"{name}: {benchmark.about}")
        for contender in benchmark.contenders:
            reason = contender.missing()
            lines.append(f"    {contender.name}{reason and ': ' + reason}")
    return "\n".join(lines) + "\n"


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser("python -m tests.benchmarks", description=__doc__)
    made.add_argument("--only", action="extend", nargs="+", choices=NAMES, metavar="NAME")
    made.add_argument("--list", action="store_true", help="print the benchmarks and their peers")
    made.add_argument("--output", type=Path, default=ROOT / "build" / "benchmarks")
    kind = made.add_mutually_exclusive_group()
    kind.add_argument("--quick", action="store_true", help="a few runs each: a trial")
    kind.add_argument("--record", action="store_true", help="write the results to record.json")
    kind.add_argument("--recorded", action="store_true", help="measure nothing; print the record")
    return made


def main() -> int:
    """Do what the arguments say; exit code 1 where something failed or is over its limit."""
    arguments = parser().parse_args()
    if arguments.list:
        sys.stdout.write(overview())
        return 0
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # also if ignored until now
        signal.signal(number, signal.default_int_handler)
    names = arguments.only or list(NAMES)
    if arguments.recorded:
        record = read()
        results = {name: record[name] for name in names if name in record}
        failures: list[str] = []
    else:
        results, failures = measure_all(
            names, is_quick=arguments.quick, is_recorded=arguments.record
        )
    if results:
        report(results, arguments.output)
    for failure in failures:
        _say(failure)
    return 1 if failures else 0


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")


if __name__ == "__main__":
    sys.exit(main())
