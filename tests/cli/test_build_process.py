"""``up`` builds a robot file in a process of its own.

It ends with it, and the launcher holds no compiler.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from argparse import Namespace
from functools import partial
from pathlib import Path

import psutil
import pytest

from tests.support import processes
from tests.support.robots import ROVER
from tests.support.waiting import TIMEOUT_S, gone, until
from tfcompose.cli.build_process import BuildProcess

pytestmark = pytest.mark.ros


def up(file: str | Path, *words: str) -> subprocess.Popen[str]:
    """Start ``tfcompose up``; what it may read from its stdin is never written."""
    command = [sys.executable, "-m", "tfcompose", "up", str(file), *words]
    return processes.start(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def build_of(launcher: subprocess.Popen[str]) -> psutil.Process:
    """Return the process that builds, once it has loaded the compiler."""

    def builds() -> list[psutil.Process]:
        below = psutil.Process(launcher.pid).children()
        return [
            process
            for process in below
            if any("pydantic_core" in mapped.path for mapped in process.memory_maps())
        ]

    assert until(builds)
    return builds()[0]


def test_the_launcher_of_a_robot_file_holds_no_compiler(domain: object, tmp_path: Path) -> None:
    assert domain
    (tmp_path / "rover.yaml").write_text(ROVER, "utf-8")
    launcher = up(tmp_path / "rover.yaml", "-o", str(tmp_path / "build"))
    assert launcher.stdout
    assert any("tree complete" in line for line in launcher.stdout)
    maps = Path(f"/proc/{launcher.pid}/maps").read_text("utf-8")
    assert "pydantic" not in maps
    launcher.send_signal(signal.SIGINT)
    launcher.communicate(timeout=TIMEOUT_S)
    assert launcher.returncode == 0


def test_an_interrupt_ends_the_build_too_and_nothing_is_printed() -> None:
    launcher = up("/dev/stdin")
    build = build_of(launcher)
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(TIMEOUT_S) == 130
    assert until(partial(gone, build))
    assert launcher.communicate() == ("", "")


def test_a_build_that_is_killed_ends_the_launcher_which_names_the_signal() -> None:
    launcher = up("/dev/stdin")
    build_of(launcher).kill()
    _, errors = launcher.communicate(timeout=TIMEOUT_S)
    assert launcher.returncode == 1
    assert "SIGKILL" in errors


@pytest.mark.parametrize(
    ("text", "code"), [("tfcompose: 1\nrobot: r\nframes: {a: {parent: b}}\n", 1), (None, 2)]
)
def test_up_ends_as_the_build_does(text: str | None, code: int, tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    if text is not None:
        file.write_text(text, "utf-8")
    ends = [
        processes.run([sys.executable, "-m", "tfcompose", command, file], cwd=tmp_path)
        for command in ("build", "up")
    ]
    assert {(ended.returncode, ended.stdout) for ended in ends} == {(code, "")}
    assert ends[0].stderr == ends[1].stderr != ""


@pytest.mark.parametrize("hook", ["after_in_child", "after_in_parent"])
def test_an_interrupt_during_a_forked_build_ends_both_and_prints_nothing(
    hook: str, tmp_path: Path
) -> None:
    """Python prints what a hook of a fork raises, and goes on."""
    (tmp_path / "robot.yaml").write_text(ROVER, "utf-8")
    send = f"import os; os.register_at_fork({hook}=lambda: os.kill(os.getpid(), 2))"
    (tmp_path / "sitecustomize.py").write_text(send, "utf-8")
    path = os.pathsep.join([str(tmp_path), *sys.path])
    command = [sys.executable, "-m", "tfcompose", "up"]
    ended = processes.run(command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": path})
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "")
    assert not (tmp_path / "build" / "rover" / "plan.json").exists()


def test_a_ctrl_c_while_the_build_is_waited_for_is_no_other_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It comes after the kernel has given the exit code, and before that is known."""
    (tmp_path / "rover.yaml").write_text("{tfcompose: 1, robot: rover", "utf-8")
    arguments = Namespace(file=str(tmp_path / "rover.yaml"), output=None)
    waitpid = os.waitpid

    def wait(pid: int, options: int) -> tuple[int, int]:
        monkeypatch.undo()
        waitpid(pid, options)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "waitpid", wait)
    with pytest.raises(KeyboardInterrupt), BuildProcess(arguments) as build:
        build.wait_until_built()
