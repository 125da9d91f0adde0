"""The process that a stranger's file runs in: what it may send, print and take."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.support import processes
from tests.support.waiting import until
from tfcompose.foundation import confined
from tfcompose.foundation.confined import Outcome, run_confined
from tfcompose.foundation.shape import fits


def outcome_of(program: str, wall_s: float = 30, **request: Any) -> Outcome:
    return run_confined(
        "tests.support.confined_programs", {"program": program, **request}, {}, wall_s=wall_s
    )


def test_a_question_is_answered_with_bytes_and_the_answer_ends_the_process() -> None:
    questions = {"double": lambda text: ({"bytes": 2 * len(text)}, 2 * text.encode())}
    begun = time.monotonic()
    request = {"program": "ask", "value": "ab"}
    outcome = run_confined("tests.support.confined_programs", request, questions)
    assert outcome.answer == [{"bytes": 4}, "abab"]
    assert time.monotonic() - begun < 30


def test_what_means_no_harm_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SETTING", "set")
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")
    (tmp_path / "kept").write_text("kept", encoding="utf-8")
    paths = [str(tmp_path), sys.base_prefix, sys.prefix, "/usr/lib", "/lib"]
    outcome = outcome_of("read", file=str(tmp_path / "kept"), paths=paths)
    assert outcome.answer == ["kept", "set", False, [1.0]], outcome


def test_what_it_prints_is_truncated() -> None:
    outcome = outcome_of("flood")
    assert outcome.answer == "the end"
    assert len(outcome.printed) == confined.MOST_PRINTED_BYTES


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("x", 70 << 20),
        ("[", 5_000_000),
        ("[", 100_000),
        ("{", 1),
        ("[]", 1),
        ("{}", 1),
        ("7", 1),
        ('{"whatever": ""}', 1),
        ('{"double": 7}', 1),
        ("\xff", 1),
    ],
)
def test_what_is_no_answer_ends_it(text: str, times: int) -> None:
    outcome = outcome_of("raw", text=text, times=times)
    assert outcome.answer is None
    assert outcome.refused


def test_its_time_is_bounded_even_if_it_closes_its_pipe() -> None:
    begun = time.monotonic()
    outcome = outcome_of("wait", wall_s=1)
    assert outcome.timed_out
    assert outcome.answer is None
    assert time.monotonic() - begun < 20


def test_how_it_ends_is_known() -> None:
    assert outcome_of("exit").code == 7
    assert outcome_of("abort").code == -signal.SIGABRT
    assert "KeyError" in outcome_of("raise").printed
    outcome = outcome_of("grow")
    assert (outcome.code, "MemoryError" in outcome.printed) == (1, True)


def test_it_ends_with_who_started_it() -> None:
    program = (
        "import os, threading, sys\n"
        "from tfcompose.foundation import confined\n"
        "start = confined.subprocess.Popen\n"
        "def shown(*args, **kwargs):\n"
        "    process = start(*args, **kwargs)\n"
        "    print(process.pid, flush=True)\n"
        "    return process\n"
        "confined.subprocess.Popen = shown\n"
        "confined.run_confined('tests.support.confined_programs', {'program': 'wait'}, {})\n"
    )
    process = processes.start([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert process.stdout
    pid = int(process.stdout.readline())
    until(lambda: "Seccomp:\t2" in status_of(pid))
    assert os.getsid(pid) == pid
    (capabilities,) = re.findall(r"CapEff:\t(\w+)", status_of(pid))
    assert int(capabilities, 16) & ~0b110 == 0
    process.kill()
    process.wait()
    until(lambda: "State:\tZ" in status_of(pid) or not status_of(pid))


def status_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/status").read_text("utf-8")
    except OSError:
        return ""


def test_modules_of_the_working_folder_are_not_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "resource.py").write_text("raise SystemExit('loaded')", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "path", ["", *sys.path])
    assert outcome_of("exit").code == 7


@pytest.mark.parametrize(
    ("value", "shape", "does"),
    [
        (1, int, True),
        (True, int, False),
        (True, bool, True),
        ("a", int, False),
        (None, None, True),
        (0, None, False),
        (None, str, False),
        ([1, 2], [int], True),
        ([1, "a"], [int], False),
        ([], [int], True),
        ("a", [str], False),
        ({"a": 1}, {"a": int}, True),
        ({"a": 1, "b": 2}, {"a": int}, True),
        ({}, {"a": int}, False),
        ({}, {"a?": int}, True),
        ({"a": "b"}, {"a?": int}, False),
        (1.5, (int, float), True),
        ({}, Any, True),
        ([[1, 2, 3], None], [([int], None)], True),
        ([], {"a": int}, False),
    ],
)
def test_shapes(value: Any, shape: Any, *, does: bool) -> None:
    assert fits(value, shape) is does
