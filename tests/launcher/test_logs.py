"""Logs on disk: merged, turned over, followed, and lost without harm."""

import errno
import os
import stat
import time
from argparse import ArgumentTypeError
from datetime import datetime
from pathlib import Path

import pytest

from tfcompose.cli.commands.logs import since
from tfcompose.launcher.output import (
    KEPT_FILES,
    KEPT_RUNS,
    Follower,
    Logs,
    last_modified,
    logged_processes,
    read_logs,
    runs_of,
)


def texts(folder: Path, *names: str) -> list[str]:
    return [text for _, _, text in read_logs(folder, list(names))]


def test_lines_of_several_processes_come_in_the_order_of_their_output(tmp_path: Path) -> None:
    logs = Logs(tmp_path)
    for name, text in (("a", "one"), ("b", "two "), ("a", ""), ("b", "four")):
        assert logs.write(name, text) is None
        while int(time.time() * 1000) == int(time.time() * 1000):
            pass  # until the next millisecond
    logs.close()
    assert [(name, text) for _, name, text in read_logs(tmp_path, logged_processes(tmp_path))] == [
        ("a", "one"),
        ("b", "two "),
        ("a", ""),
        ("b", "four"),
    ]


def test_processes_of_parts_have_logs_too(tmp_path: Path) -> None:
    logs = Logs(tmp_path / "logs", file_bytes=100)
    for number in range(10):
        for name in ("static", "arm/static", "arm/tool/static"):
            assert logs.write(name, f"line {number} of {name}") is None
    logs.close()
    assert logged_processes(tmp_path / "logs") == ["arm/static", "arm/tool/static", "static"]
    for name in logged_processes(tmp_path / "logs"):
        assert [text for _, _, text in read_logs(tmp_path / "logs", [name])][
            -1
        ] == f"line 9 of {name}"


def test_lines_and_not_file_times_tell_the_latest_run(
    tmp_path: Path,
) -> None:
    begun, later = Logs(tmp_path / "a"), Logs(tmp_path / "b")
    for logs, name, second in (
        (begun, "arm/static", 10),
        (later, "static", 20),
        (begun, "arm/static", 30),
    ):
        logs.write(name, "text")
        os.utime(logs.folder / f"{name}.log", (second, second))
    assert [last_modified(tmp_path / name) for name in ("a", "b", "none")] == [30, 20, 0]
    begun.close()
    later.close()


def test_a_file_that_is_full_is_turned_over_and_the_oldest_lines_go(tmp_path: Path) -> None:
    logs = Logs(tmp_path, file_bytes=1000)
    for number in range(1000):
        logs.write("a", f"line {number}")
    logs.close()
    files = sorted(tmp_path.glob("a.log*"))
    assert len(files) == KEPT_FILES + 1
    assert all(file.stat().st_size <= 1000 for file in files)
    kept = texts(tmp_path, "a")
    assert kept == [f"line {number}" for number in range(1000 - len(kept), 1000)]
    assert len(kept) > 20


def test_a_follower_sees_each_line_once_also_when_the_file_is_turned_over(tmp_path: Path) -> None:
    logs = Logs(tmp_path, file_bytes=1000)
    logs.write("a", "before")
    follower = Follower(tmp_path, ["a"])
    observed = []
    for number in range(200):
        logs.write("a", f"line {number}")
        if number % 7 == 0:
            observed += [text for _, _, text in follower.more()]
    observed += [text for _, _, text in follower.more()]
    logs.close()
    assert observed == [f"line {number}" for number in range(200)]


def test_a_follower_that_reads_back_leaves_out_what_was_before_a_time(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text(
        "2026-11-26T10:00:00+00:00 before\n2026-11-26T11:00:00+00:00 after\n"
    )
    begin_s = datetime.fromisoformat("2026-11-26T11:00:00+00:00").timestamp()
    follower = Follower(tmp_path, ["a"], back=1000, since_s=begin_s)
    assert [text for _, _, text in follower.more()] == ["after"]


def test_a_full_disk_is_reported_once_costs_lines_and_stops_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    logs = Logs(tmp_path)
    logs.write("a", "before")
    write = os.write

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "write", full)
    output = [logs.write("a", "lost") for _ in range(100)]
    assert str(tmp_path) in (output[0] or "")
    assert output[1:] == [None] * 99
    monkeypatch.setattr(os, "write", write)
    monkeypatch.setattr("tfcompose.launcher.output.LEFT_ALONE_S", 0.0)
    logs.write("a", "after")
    logs.close()
    assert texts(tmp_path, "a") == ["before", "after"]


def test_a_log_that_is_a_link_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").touch()
    (tmp_path / "a.log").symlink_to(tmp_path / "elsewhere")
    logs = Logs(tmp_path)
    assert str(logs.folder) in (logs.write("a", "text") or "")
    assert (tmp_path / "elsewhere").read_text() == ""


@pytest.mark.parametrize("process", ["a", "arm/a"])
def test_a_folder_that_is_a_link_gets_no_logs(tmp_path: Path, process: str) -> None:
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "logs"
    elsewhere.mkdir()
    folder.mkdir()
    link = folder / "arm" if "/" in process else tmp_path / "link"
    link.symlink_to(elsewhere)
    logs = Logs(folder if "/" in process else link)
    assert "link" in (logs.write(process, "text") or "")
    assert list(elsewhere.iterdir()) == []


def test_another_users_folder_gets_no_logs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_uid = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: own_uid + 1)
    assert "another user" in (Logs(tmp_path).write("a", "text") or "")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_another_user_could_exchange_gets_no_logs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "robot").mkdir()
    status, lstat = list((tmp_path / "robot").lstat()), Path.lstat
    status[stat.ST_UID] = os.geteuid() + 1
    monkeypatch.setattr(
        Path, "lstat", lambda path: os.stat_result(status) if path == tmp_path else lstat(path)
    )
    assert "another user" in (Logs(tmp_path / "robot").write("a", "text") or "")
    assert list((tmp_path / "robot").iterdir()) == []


def test_the_lines_of_each_run_are_known_from_its_first_to_its_last(tmp_path: Path) -> None:
    for run in ("first", "second", "third"):
        logs = Logs(tmp_path, file_bytes=200)
        for name in ("a", "b"):
            assert logs.write(name, run) is None
        logs.close()
        time.sleep(0.002)
    begins = runs_of(tmp_path)
    for run, begin, end in zip(
        ("first", "second", "third"), begins, (*begins[1:], 2e9), strict=True
    ):
        lines = read_logs(tmp_path, ["a", "b"], begin, end)
        assert [(name, text) for _, name, text in lines] == [("a", run), ("b", run)]
    assert logged_processes(tmp_path) == ["a", "b"]


def test_the_begin_of_old_runs_is_forgotten(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("2026-01-01T00:00:00.000+00:00\ntorn\n" * KEPT_RUNS, "utf-8")
    logs = Logs(tmp_path)
    assert logs.write("a", "text") is None
    logs.close()
    runs = runs_of(tmp_path)
    assert len(runs) == KEPT_RUNS
    assert abs(runs[-1] - time.time()) < 60


@pytest.mark.parametrize(
    ("text", "ago_s"),
    [("90s", 90), ("10m", 600), ("1.5 min", 90), ("2h", 7200), ("3d", 259200)],
)
def test_a_time_that_is_so_long_ago_is_read(text: str, ago_s: float) -> None:
    assert abs(time.time() - since(text) - ago_s) < 5


def test_a_local_time_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    begin = time.mktime(time.strptime("2026-11-26 14:03", "%Y-%m-%d %H:%M"))
    assert since("2026-11-26T14:03") == begin
    monkeypatch.setattr(time, "strftime", lambda _: "2026-11-26")
    assert since("14:03") == since("14:03:00") == begin
    assert since("9:05") == begin - 4 * 3600 - 58 * 60


@pytest.mark.parametrize("text", ["", "yesterday", "10", "10x", "-5m", "25:00", "14:3", "9:99"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(ArgumentTypeError):
        since(text)
