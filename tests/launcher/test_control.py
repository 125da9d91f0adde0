"""The control socket: whatever is asked for, the robot goes on."""

import io
import json
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from selectors import DefaultSelector
from socket import AF_UNIX, socket

import pytest

from tfcompose.launcher import answers, control
from tfcompose.launcher.answers import CommandInputs, answer
from tfcompose.launcher.control import LONGEST_REQUEST, Control, ask, listen
from tfcompose.launcher.events import NewPlan
from tfcompose.launcher.runtime_dir import Lock, RuntimeDir
from tfcompose.launcher.state import initial
from tfcompose.model.messages import (
    Done,
    PlanChange,
    Refusal,
    Request,
    RobotStatus,
    StatusRequest,
    UpdateRequest,
    line_of,
)
from tfcompose.model.plan import Plan, RosSettings
from tfcompose.model.plan.file import write_plan

PLAN = Plan("rover", "", None, RosSettings(), (), ())


class Connection:
    """Both ends of a control socket, served by hand."""

    def __init__(self, address: str) -> None:
        self.requests: list[Request] = []
        self._selector, listener = DefaultSelector(), socket(AF_UNIX)
        listener.bind(address)
        listener.listen()
        listener.setblocking(False)  # noqa: FBT003 (its only argument)
        self._control = Control(listener, self._selector, self._answer)
        self._client = socket(AF_UNIX)
        self._client.connect(address)
        self._client.settimeout(5)

    def _answer(self, request: Request) -> Done:
        self.requests.append(request)
        return Done()

    def ask(self, data: bytes) -> bytes:
        """Return what comes back, after everything was served; empty where the connection ends."""
        for start in range(0, len(data), 8192):
            try:
                self._client.sendall(data[start : start + 8192])
            except OSError:
                break
            for key, _ in self._selector.select(0):
                key.data()
        for key, _ in self._selector.select(0):
            key.data()
        try:
            return self._client.recv(65536)
        except ConnectionResetError:
            return b""

    def close(self) -> None:
        self._control.close()
        self._client.close()
        self._selector.close()


@pytest.fixture
def connection(tmp_path: Path) -> Iterator[Connection]:
    made = Connection(str(tmp_path / "s"))
    yield made
    made.close()


@pytest.mark.parametrize(
    "line", [b"{", b"[" * 50_000, b"\xff\xfe", b"7", b'{"request": []}', b'"\\ud800"', b"\0"]
)
def test_an_invalid_request_gets_an_error_and_the_next_is_heard(
    connection: Connection, line: bytes
) -> None:
    assert "error" in json.loads(connection.ask(line + b"\n"))
    update = UpdateRequest("plan.json", "/")
    assert "error" not in json.loads(connection.ask(line_of(update)))
    assert connection.requests == [update]


def test_a_request_that_does_not_end_ends_the_connection(connection: Connection) -> None:
    assert connection.ask(b"x" * (LONGEST_REQUEST + 40_000)) == b""
    assert connection.requests == []


def plan_file(folder: Path, kind: str) -> str:
    """Return the name of something that cannot be the next plan."""
    file = folder / "plan.json"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    elif kind == "large":
        file.write_bytes(b" " * 2000)
    elif kind == "bytes":
        file.write_bytes(b"\xff\xfe")
    return {"device": "/dev/zero", "NUL": "plan\0.json", "nothing": str(folder / "x")}.get(
        kind, str(file)
    )


def setting(folder: Path) -> CommandInputs:
    return CommandInputs(folder / "old.json", None, {}, lambda base, *_, **__: dict(base))


@pytest.mark.parametrize(
    "kind", ["device", "NUL", "nothing", "pipe", "folder", "large", "bytes", "blocks"]
)
def test_a_plan_that_cannot_be_read_is_refused_at_once(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answers, "MOST_PLAN_BYTES", 1000)
    request = UpdateRequest(plan_file(tmp_path, kind), str(tmp_path))
    refused, event, commands = answer(request, initial(PLAN), setting(tmp_path))
    assert isinstance(refused, Refusal)
    assert (event, commands) == (None, None)


def test_a_plan_whose_lines_moved_is_followed_and_the_same_plan_is_not(tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    for digest, is_followed in (("moved", True), (PLAN.spec_digest, False)):
        file.write_text(write_plan(replace(PLAN, spec_digest=digest)))
        change, event, _ = answer(
            UpdateRequest(str(file), str(tmp_path)), initial(PLAN), setting(tmp_path)
        )
        assert change == PlanChange((), (), (), (), differs=is_followed)
        assert isinstance(event, NewPlan) == is_followed


class _Waiting(io.BytesIO):
    """A file whose reader would wait, as that of /proc/kmsg: reading it gives nothing."""

    def read(self, size: int | None = -1, /) -> bytes:
        assert size == 0, "no more is read than the file's size"
        return None  # type: ignore[return-value]


def test_a_plan_whose_reader_would_wait_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "plan.json").touch()
    monkeypatch.setattr(os, "fdopen", lambda *_: _Waiting())
    request = UpdateRequest(str(tmp_path / "plan.json"), str(tmp_path))
    refused, *_ = answer(request, initial(PLAN), setting(tmp_path))
    assert isinstance(refused, Refusal)


def test_a_launcher_that_is_suspended_before_it_answers_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = RuntimeDir("rover@0", tmp_path, tmp_path)
    lock, suspended = Lock(run), iter([False, True])
    monkeypatch.setattr(control, "ANSWER_S", 0.05)
    monkeypatch.setattr(control, "_is_suspended", lambda _: next(suspended))
    with listen(run), pytest.raises(ConnectionError, match=f"kill -CONT {os.getpid()} "):
        ask(run, StatusRequest(), RobotStatus)
    lock.close()
