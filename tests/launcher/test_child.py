"""Bytes into lines, and signals into values."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.waiting import TIMEOUT_S
from tfcompose.foundation.signal_queue import SignalQueue
from tfcompose.launcher.child import BURST, LINE_LIMIT, Bucket, ChildCommand, Lines, Pipe, spawn
from tfcompose.launcher.children import Reaper
from tfcompose.launcher.program import HERE
from tfcompose.model.plan import PlanProcess

ON_A_TERMINAL = PlanProcess("p", "run", emulate_tty=True)


@given(st.text(alphabet="ab\né", max_size=60), st.integers(1, 7))
def test_lines_are_the_same_however_the_bytes_arrive(text: str, size: int) -> None:
    data, lines = text.encode(), Lines()
    lines_read = [
        line
        for start in range(0, len(data), size)
        for line in lines.feed(data[start : start + size])
    ]
    expected = text.split("\n")
    assert [*lines_read, *lines.end()] == (expected if expected[-1] else expected[:-1])


@given(st.lists(st.binary(max_size=40), max_size=20))
def test_lines_stay_within_the_limit_without_loss_or_much_memory(
    chunks: list[bytes],
) -> None:
    lines = Lines(8)
    lines_read: list[str] = []
    for chunk in (chunk.replace(b"\r", b"").replace(b"\n", b"x") for chunk in chunks):
        lines_read.extend(lines.feed(chunk))
        assert len(lines._rest) <= 8
    lines_read.extend(lines.end())
    assert all(len(line) <= 8 for line in lines_read)
    if all(max(chunk, default=0) < 128 for chunk in chunks):
        assert len("".join(lines_read)) == sum(len(chunk) - chunk.count(b"\r") for chunk in chunks)


def read_flood(source_text: bytes, ending: bytes) -> list[str]:
    """Return the lines kept of a process that writes everything at once and ends."""
    lines_read: list[str] = []
    read_end, write_end = os.pipe()
    with os.fdopen(write_end, "wb", buffering=0) as writer:
        pipe = Pipe(
            os.fdopen(read_end, "rb", buffering=0), lines_read.append, bucket=Bucket(lambda: 0.0)
        )
        for start in range(0, len(source_text), 4096):
            writer.write(source_text[start : start + 4096])
            pipe.read()
        writer.write(ending)
    pipe.drain()
    return lines_read


def test_the_last_words_of_a_process_that_flooded_are_kept() -> None:
    source_text = b"flood, flood\n" * (BURST // 13 + 100_000)
    *flood, note, last = read_flood(source_text, b"\nValueError: the reason\n")[-330:]
    assert last == "ValueError: the reason"
    assert (note, set(flood[-5:])) == ("", {"flood, flood"})
    (marker,) = [line for line in flood if line.startswith("…")]
    kept = len(flood) - flood.index(marker) - 1
    thrown = int(marker.split()[1].replace(",", ""))
    assert thrown + kept * 13 == pytest.approx(len(source_text) - BURST, abs=4096 + 13)


def test_the_last_words_after_an_endless_line_are_kept() -> None:
    lines_read = read_flood(b"a" * (BURST + 1_000_000), b"\nlast\n")
    assert lines_read[-1] == "last"
    assert max(map(len, lines_read)) <= LINE_LIMIT


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"a\r\n", "a"),
        (b"a\r\r\n", "a"),
        (b"\r 10 %\r100 %\n", "100 %"),
        (b"\r 10 %\r100 %\r\n", "100 %"),
        (b"\xff\n", "\ufffd"),
        (b"\n", ""),
    ],
)
def test_a_line_comes_without_its_end_and_never_fails_to_be_text(data: bytes, line: str) -> None:
    assert list(Lines().feed(data)) == [line]


def test_a_sighup_that_is_ignored_as_below_nohup_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with SignalQueue():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) != signal.SIG_DFL
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("seconds", [0.0, 0.03, 0.06, 0.1])
def test_an_own_process_ordered_to_end_during_its_start_ends_by_its_rules(
    number: int, seconds: float, tmp_path: Path
) -> None:
    argv = (*HERE, "static", str(tmp_path / "plan.json"), "static")
    popen = spawn(ChildCommand(argv, dict(os.environ), tmp_path, is_built_in=True), ())
    time.sleep(seconds)
    popen.send_signal(number)
    _, errors = popen.communicate(timeout=60)
    assert popen.returncode == 2  # there is no plan
    assert errors.decode().splitlines()[1:] == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_child_holder_stays_that_is_ordered_to_end_in_its_first_moment(number: int) -> None:
    """As systemd tells all of a unit's processes, also one that it has just started."""
    holder = Reaper()
    os.kill(holder.pid, number)
    holder.close()
    assert holder.returncode == 0


def test_a_process_that_is_not_our_own_is_started_with_no_signal_blocked(tmp_path: Path) -> None:
    popen = spawn(
        ChildCommand(
            (sys.executable, "-c", "import time; time.sleep(180)"), dict(os.environ), tmp_path
        ),
        (),
    )
    popen.send_signal(signal.SIGTERM)
    assert popen.wait(60) == -signal.SIGTERM
    popen.communicate()


def test_a_process_writes_lines_to_a_pseudo_terminal_and_none_is_lost(
    tmp_path: Path,
) -> None:
    code = (
        "import os, sys\n"
        "print(sys.stdout.isatty(), sys.stderr.isatty(), os.get_terminal_size(1).columns)\n"
        "print('error', file=sys.stderr)\n"
        "os._exit(3)  # nothing is flushed: a terminal has its lines already\n"
    )
    popen = spawn(
        ChildCommand(
            (sys.executable, "-I", "-c", code), dict(os.environ), tmp_path, process=ON_A_TERMINAL
        ),
        (),
    )
    assert popen.stdout
    assert popen.stderr
    assert popen.wait(TIMEOUT_S) == 3
    texts: list[str] = []
    for stream in (popen.stdout, popen.stderr):
        Pipe(stream, texts.append).drain()
    assert texts == ["True True 120", "error"]
    assert (popen.stdout.closed, popen.stderr.closed) == (True, True)


def test_a_program_that_cannot_be_started_leaves_no_pseudo_terminal_open(tmp_path: Path) -> None:
    before = sorted(Path("/proc/self/fd").iterdir())
    with pytest.raises(OSError, match="nowhere"):
        spawn(ChildCommand(("/nowhere/program",), {}, tmp_path, process=ON_A_TERMINAL), ())
    assert sorted(Path("/proc/self/fd").iterdir()) == before
