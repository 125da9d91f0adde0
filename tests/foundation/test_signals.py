"""Ctrl-C while a command loads, also where Python throws away what a signal's handler raises."""

import os
import signal
import sys
import weakref
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.waiting import until
from tfcompose.cli import main
from tfcompose.cli.parser import COMMANDS
from tfcompose.foundation.signal_queue import SignalQueue
from tfcompose.foundation.signals import RememberedInterrupt, Stop, take_interrupt


class Loaded:
    """An object that Python calls back when it forgets it, as it does with import locks."""


def send_an_interrupt(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGINT)
    for _step in range(10):  # the handler runs between two steps of the interpreter
        pass


def lose_an_interrupt() -> None:
    """Let SIGINT come in a callback, in which no exception gets through."""
    loaded = Loaded()
    kept = weakref.ref(loaded, send_an_interrupt)
    del loaded
    assert kept() is None


@pytest.fixture(autouse=True)
def lost(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    errors: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda what: errors.append(what.exc_type))
    return errors


def test_the_launcher_takes_an_interrupt_that_python_threw_away(lost: list[object]) -> None:
    with RememberedInterrupt():
        lose_an_interrupt()
        assert not lost, "it would be printed"
        with SignalQueue() as signals:
            assert os.read(signals.fd, 10)
            assert list(signals.take()) == [signal.SIGINT]
    assert not take_interrupt()


def test_who_waits_in_ros_takes_it_once(lost: list[object]) -> None:
    with RememberedInterrupt():
        lose_an_interrupt()
        with Stop() as stop:
            assert stop.requested
        with Stop() as stop:
            assert not stop.requested
    assert not lost, "it would be printed"


def test_an_interrupt_comes_to_pydantic_as_soon_as_that_has_returned() -> None:
    """Its Rust prints a panic of what Python raises while it loads."""
    pydantic = {"__name__": "pydantic_core", "send_an_interrupt": send_an_interrupt}
    exec("def load():\n    send_an_interrupt()\n    return 'loaded'", pydantic)  # noqa: S102 (a module of that name)
    with RememberedInterrupt():
        assert pydantic["load"]() == "loaded"  # type: ignore[operator]
        with pytest.raises(KeyboardInterrupt):
            until(lambda: False)
        assert take_interrupt()
    assert signal.getsignal(signal.SIGALRM) is signal.SIG_DFL


@pytest.mark.parametrize(
    "error", [RuntimeError("Error calling __set_name__"), BaseException("a panic of Rust")]
)
def test_an_interrupt_hidden_in_another_error_during_loading_ends_it(
    error: BaseException, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def load_and_run(_: object) -> int:
        try:
            send_an_interrupt()
        except KeyboardInterrupt:
            raise error from None
        return 0

    monkeypatch.setattr(COMMANDS["ps"], "run", load_and_run)
    assert main(["ps"]) == 130
    assert capsys.readouterr() == ("", "")


def test_another_error_of_a_command_is_none_of_an_interrupt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def run(_: object) -> int:
        raise ValueError("of the program")

    monkeypatch.setattr(COMMANDS["ps"], "run", run)
    with pytest.raises(ValueError, match="of the program"):
        main(["ps"])


def test_elsewhere_an_interrupt_ends_the_command_as_ever() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), RememberedInterrupt():
        send_an_interrupt()
    assert signal.getsignal(signal.SIGINT) is before
    assert take_interrupt()


INTERRUPTED_DATACLASSES = """
import builtins, dataclasses, os, signal

def interrupt():
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:  # a command loads
        os.kill(os.getpid(), signal.SIGINT)

def execute(text, *spaces):
    builtins.exec("interrupt()", {"interrupt": interrupt})
    builtins.exec(text, *spaces)

dataclasses.exec = execute
"""


def test_an_interrupt_in_an_exec_gives_the_exit_code_of_any_other(tmp_path: Path) -> None:
    """Python then ends a module run with -m by the signal; dataclasses are made by exec."""
    (tmp_path / "sitecustomize.py").write_text(INTERRUPTED_DATACLASSES, "utf-8")
    path = os.pathsep.join([str(tmp_path), *sys.path])
    command = [sys.executable, "-m", "tfcompose", "schema", "robot"]
    ended = processes.run(command, env={**os.environ, "PYTHONPATH": path})
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "")
