"""What the shell completes, and how a mistyped command line is answered."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tfcompose.cli.commands.completion import SCRIPTS
from tfcompose.cli.parser import COMMANDS, GROUPS, summary_of

ROBOTS = Path(__file__).parents[2] / "robots"

CASES = {
    "li": {"lint"},
    "lint --sel": {"--select"},
    "lint --select TF61": {f"TF61{n}" for n in range(10)},
    "lint --format s": {"sarif"},
    "lint x.yaml -p ": set(),
    "up my_robot.yaml -p ": {"demo"},
    "up --guard ": {"off", "watch", "strict"},
    "pose rover.yaml odo": {"odom"},
    "explain TF30": {f"TF30{n}" for n in range(1, 10)},
    "explain rover.yaml ma": {"map"},
    "presets realsense/d45": {"realsense/d455", "realsense/d456", "realsense/d457"},
    "export sy": {"systemd"},
    "help backg": {"background"},
    "help sensors.pl": {"sensors.place"},
    "help docto": {"doctor"},
    "down --robot ": set(),
    "nothing ": set(),
    "lint ro": set(),
}


@pytest.mark.parametrize("line", CASES)
def test_a_word_is_completed(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    words = line.split(" ")
    done = tfcompose_in(ROBOTS, "completion", "--at", len(words), "--", "tfcompose", *words)
    assert (done.returncode, set(done.stdout.split())) == (0, CASES[line])


@pytest.mark.parametrize("at", [-3, 0, 99])
def test_a_place_outside_of_the_line_has_nothing(at: int, tmp_path: Path) -> None:
    done = tfcompose_in(tmp_path, "completion", "--at", at, "--", "tfcompose", "nothing")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_bash_completes_with_the_script(tmp_path: Path) -> None:
    program = tmp_path / "tfcompose"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m tfcompose "$@"\n', "utf-8")
    program.chmod(0o755)
    line = "COMP_WORDS=(tfcompose up --gu); COMP_CWORD=2; _tfcompose"
    script = f'eval "$(tfcompose completion bash)"; {line}; echo "${{COMPREPLY[@]}}"'
    done = processes.run(["bash", "-c", script], env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"})
    assert (done.returncode, done.stdout.split(), done.stderr) == (0, ["--guard"], "")


@pytest.mark.parametrize("shell", SCRIPTS)
def test_each_shell_that_is_here_reads_its_script(shell: str, tmp_path: Path) -> None:
    assert tfcompose_in(tmp_path, "completion", shell).stdout == SCRIPTS[shell]
    if shutil.which(shell):
        (tmp_path / "script").write_text(SCRIPTS[shell], "utf-8")
        assert processes.run([shell, "-n", str(tmp_path / "script")]).returncode == 0
    assert tfcompose_in(tmp_path, "completion", "csh").returncode == 2


def test_help_groups_every_command_once_and_help_of_a_command_is_its_page(tmp_path: Path) -> None:
    text = tfcompose_in(tmp_path, "help").stdout
    assert sum(map(len, GROUPS.values())) == len(COMMANDS)
    assert all(text.count(f"  {summary_of(name)}\n") == 1 for name in COMMANDS)
    options = tfcompose_in(tmp_path, "lint", "--help").stdout
    assert tfcompose_in(tmp_path, "help", "lint").stdout.startswith(options)
    assert tfcompose_in(tmp_path, "help", "nothing").returncode == 2
    assert tfcompose_in(tmp_path, "-V").stdout == tfcompose_in(tmp_path, "--version").stdout


def test_the_option_or_command_that_is_near_is_named_and_a_far_one_is_not(tmp_path: Path) -> None:
    for words, near in (("up --detached", "--detach?"), ("lnt", "lint?"), ("lint --fromat=json", "--format?")):
        done = tfcompose_in(tmp_path, *words.split())
        assert (done.returncode, near in done.stderr) == (2, True), done.stderr
    for words in ("version", "up --xyzzy", "export launch -o", "lint --select XX1", "graph --direction up"):
        done = tfcompose_in(tmp_path, *words.split())
        assert (done.returncode, "did you mean" in done.stderr) == (2, False), done.stderr
