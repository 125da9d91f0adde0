"""The benchmark command: order, pairs, missing peers, limits, tables, plots, interruption."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.benchmarks import pages, record
from tests.benchmarks.__main__ import FailedError, measured, over_limits
from tests.benchmarks.benchmark import TFCOMPOSE, Benchmark, Contender, Limit, Opened, Row, measure
from tests.benchmarks.plots import plot
from tests.benchmarks.suite import NAMES, benchmark_of
from tests.benchmarks.summary import number, quantity, ratios, spread, statistic, summary
from tests.benchmarks.table import table
from tests.benchmarks.worker import result_of
from tests.support import processes
from tests.support.waiting import gone, until

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from tests.benchmarks.benchmark import Sampler, Workspace

PEER = Contender("peer", version=lambda: "1.2")
ABSENT = Contender("absent", missing=lambda: "not installed: pip install absent")


def giving(*values: float, calls: list[str] | None = None, name: str = "") -> Opened:
    """Return a contender whose runs have these values, one after the other."""

    @contextmanager
    def opened(_: Workspace) -> Iterator[Sampler]:
        numbers = count()

        def sample() -> dict[str, float]:
            if calls is not None:
                calls.append(name)
            return {"row": values[next(numbers) % len(values)]}

        yield sample

    return opened


BENCHMARK = Benchmark(
    name="trial",
    about="numbers",
    rows={"row": Row("a quantity", "ms")},
    contenders={TFCOMPOSE: giving(1, 2, 3), PEER: giving(2, 2, 2), ABSENT: giving(0)},
    runs=3,
)


def result(benchmark: Benchmark = BENCHMARK) -> record.Result:
    samples = measure(benchmark, is_quick=False, progress=lambda _: None)
    return result_of(benchmark, samples, 0.5)


def test_contenders_alternate_their_order_and_warm_ups_do_not_count() -> None:
    calls: list[str] = []
    contenders = {
        TFCOMPOSE: giving(9, 1, 2, calls=calls, name="a"),
        PEER: giving(9, 3, 4, calls=calls, name="b"),
    }
    benchmark = replace(BENCHMARK, contenders=contenders, runs=2, warm_ups=1)
    samples = measure(benchmark, is_quick=False, progress=lambda _: None)
    assert "".join(calls) == "baabba"
    assert samples == {"row": {"tfcompose": [1, 2], "peer": [3, 4]}}


def test_a_trial_has_fewer_runs_and_says_so_to_contenders() -> None:
    trials: list[bool] = []

    @contextmanager
    def opened(workspace: Workspace) -> Iterator[Sampler]:
        trials.append(workspace.is_quick)
        yield lambda: {"row": 1.0}

    benchmark = replace(BENCHMARK, contenders={TFCOMPOSE: opened}, quick_runs=1)
    samples = measure(benchmark, is_quick=True, progress=lambda _: None)
    assert (trials, samples["row"]) == ([True], {"tfcompose": [1.0]})


def test_each_contender_has_a_domain_and_a_folder() -> None:
    workspaces: list[tuple[str, Path]] = []

    @contextmanager
    def opened(workspace: Workspace) -> Iterator[Sampler]:
        workspaces.append((workspace.environment["ROS_DOMAIN_ID"], workspace.folder))
        with workspace.entered():
            assert os.environ["ROS_DOMAIN_ID"] == workspaces[-1][0]
        yield lambda: {"row": 1.0}

    before = dict(os.environ)
    measure(
        replace(BENCHMARK, contenders={TFCOMPOSE: opened, PEER: opened}),
        is_quick=True,
        progress=lambda _: None,
    )
    assert (
        len({domain for domain, _ in workspaces}) == len({folder for _, folder in workspaces}) == 2
    )
    assert not any(folder.exists() for _, folder in workspaces)
    assert os.environ == before


def test_a_row_that_the_benchmark_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match="row"):
        measure(replace(BENCHMARK, rows={}), is_quick=True, progress=lambda _: None)


def test_ratios_are_those_of_pairs() -> None:
    assert ratios([1, 2, 3], [2, 2, 2]) == [0.5, 1, 1.5]
    assert ratios([1, 2], [0, 4, 5]) == [0.5]


@pytest.mark.parametrize(
    ("values", "low", "high"), [([5], 5, 5), ([0, 10], 1, 9), (range(11), 1, 9)]
)
def test_the_spread_is_from_the_10th_to_the_90th_percentile(
    values: Sequence[float], low: float, high: float
) -> None:
    assert (summary(values).low, summary(values).high) == (low, high)


def test_statistics_of_limits() -> None:
    values = [0.0, *range(1, 11)]
    assert [statistic(values, name) for name in ("least", "median", "p90", "worst")] == [
        *(0, 5, 9, 10)
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        *((0, "0"), (0.0123, "0.012"), (0.34, "0.34"), (1.234, "1.23"), (12.34, "12.3")),
        *((123.4, "123"), (12_345, "12,345"), (0.0004, "0.00040"), (9.996, "10.00")),
    ],
)
def test_numbers_have_two_or_three_digits(value: float, text: str) -> None:
    assert number(value) == text


def test_a_ratio_has_no_unit_and_a_single_run_no_spread() -> None:
    assert quantity(2, "times") == "2.00"
    assert spread([2, 2], "s") == "2.00 s"
    assert spread([0, 10], "s") == "5.00 s (1.00 to 9.00)"


def test_the_table_has_a_line_per_peer_and_a_reason_for_each_missing_one() -> None:
    assert table([result()]).splitlines() == [
        "| | tfcompose | peer, in the same run | ratio |",
        "| --- | --- | --- | --- |",
        "| a quantity | 2.00 ms (1.20 to 2.80) | peer: 2.00 ms | 1.00 (0.60 to 1.40) |",
        "| | | absent: – (not installed: pip install absent) | – |",
    ]


def test_without_peers_the_table_has_two_columns() -> None:
    alone = result(replace(BENCHMARK, contenders={TFCOMPOSE: giving(1)}))
    assert table([alone]).splitlines()[0] == "| | tfcompose |"


@pytest.mark.parametrize(
    ("limit", "is_kept"),
    [
        (Limit(2.0), True),
        (Limit(1.9), False),
        (Limit(2.9, "worst"), False),
        (Limit(1.0, "least"), True),
        (Limit(1.0, times=PEER), True),
        (Limit(0.9, times=PEER), False),
        (Limit(1.0, "worst", above=PEER), True),
        (Limit(0.9, "worst", above=PEER), False),
        (Limit(0.1, times=ABSENT), True),
    ],
)
def test_limits(limit: Limit, *, is_kept: bool) -> None:
    benchmark = replace(BENCHMARK, rows={"row": Row("a quantity", "ms", (limit,))})
    assert (not over_limits(benchmark, result(benchmark))) == is_kept


def test_a_result_survives_the_file_and_others_are_kept(tmp_path: Path) -> None:
    file = tmp_path / "record.json"
    record.write({"other": result()}, file)
    record.write({"trial": result()}, file)
    assert record.read(file) == {"other": result(), "trial": result()}
    assert '"peer": [2.0, 2.0, 2.0]' in file.read_text("utf-8")
    assert result().versions == {"peer": "1.2"}
    assert result().missing == {"absent": "not installed: pip install absent"}


@pytest.mark.parametrize("rest", ["", "\n## More\n"])
def test_a_page_gets_the_table_of_what_is_recorded(rest: str) -> None:
    mark, rows = "<!-- figures: trial other -->\n\n", table([result()])
    assert pages.with_tables(f"{mark}| old |\n{rest}", {"trial": result()}) == mark + rows + rest
    assert pages.with_tables(mark + rest[1:], {"trial": result()}) == mark + rows + rest
    assert pages.with_tables(mark + rest[1:], {}) == mark + rest[1:]


def test_plots_are_png_and_svg_and_the_same_each_time(tmp_path: Path) -> None:
    files = plot({"trial": result()}, tmp_path)
    assert {file.name for file in files} == {
        *("trial.svg", "trial.png", "ratios.svg", "ratios.png")
    }
    first = {file: file.read_bytes() for file in files if file.suffix == ".svg"}
    plot({"trial": result()}, tmp_path)
    assert first == {file: file.read_bytes() for file in first}
    assert (tmp_path / "trial.png").read_bytes().startswith(b"\x89PNG")


def test_only_plots_load_matplotlib() -> None:
    code = "import sys, tests.benchmarks.__main__; print('matplotlib' in sys.modules)"
    command = [sys.executable, "-c", code]
    assert processes.run(command, check=True, cwd=record.ROOT).stdout == "False\n"


def test_each_suite_module_is_a_benchmark_of_its_name_that_runs_tfcompose() -> None:
    assert len(NAMES) > 10
    for name in NAMES:
        benchmark = benchmark_of(name)
        assert benchmark.name == name
        assert TFCOMPOSE in benchmark.contenders
        limits = [limit for row in benchmark.rows.values() for limit in row.limits]
        peers = {peer for limit in limits for peer in (limit.times, limit.above) if peer}
        assert peers <= benchmark.contenders.keys(), name


@pytest.mark.slow
def test_a_benchmark_is_measured_in_a_process() -> None:
    benchmark = benchmark_of("command_line")
    rows = measured(benchmark, is_quick=True).rows
    assert rows.keys() == benchmark.rows.keys()
    assert {len(values) for row in rows.values() for values in row.samples.values()} == {3}


def test_one_that_takes_too_long_fails_and_is_ended() -> None:
    with pytest.raises(FailedError, match=r"0\.1 s"):
        measured(replace(benchmark_of("command_line"), timeout_s=0.1), is_quick=True)
    assert not processes.children()


def test_the_record_has_the_rows_of_the_suite_and_keeps_its_limits() -> None:
    for name, recorded in record.read().items():
        benchmark = benchmark_of(name)
        rows = {key: (row.title, row.unit) for key, row in benchmark.rows.items()}
        assert {key: (row.title, row.unit) for key, row in recorded.rows.items()} == rows, name
        assert recorded.about == benchmark.about, name
        assert over_limits(benchmark, recorded) == []


def test_ctrl_c_ends_all_that_was_started(tmp_path: Path) -> None:
    output = tmp_path / "output.txt"
    with output.open("wb") as out:
        command = [sys.executable, "-m", "tests.benchmarks", "--only", "command_line"]
        process = processes.start(
            [*command, "--output", str(tmp_path / "plots")],
            cwd=record.ROOT,
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    assert until(lambda: "1/21" in output.read_text("utf-8"))
    below = psutil.Process(process.pid).children(recursive=True)
    assert below
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 1
    assert "command_line was interrupted" in output.read_text("utf-8")
    assert until(lambda: all(map(gone, below)))
