"""What the shell completes, and how a mistyped command line is answered."""

import io
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import argcomplete
import pytest
from argcomplete.finders import CompletionFinder

from tests.support.cli import tfcompose_in
from tests.support.shell import PROMPT, Shell
from tfcompose.cli.commands.completion import SHELLS
from tfcompose.cli.parser import all_commands, all_groups
from tfcompose.cli.tool_commands import summary_of
from tfcompose.launcher.runtime_dir import Lock, runtime_dir_of
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.model.plan.file import write_plan

ROBOTS = Path(__file__).parents[2] / "robots"
CELL = """\
tfcompose: 1
robot: cell
args: {cameras: {default: 2}}
hosts: {main: {}, jetson: {}}
frames: {base_link: {}, tool0: {parent: base_link}}
profiles: {demo: {}}
"""

CASES = {
    "": {*all_commands()},
    "--": {"--help", "--version"},
    "li": {"lint"},
    "lint --sel": {"--select"},
    "lint --select TF61": {f"TF61{n}" for n in range(10)},
    "lint --select TF611,TF308": {"TF611,TF308"},
    "lint --format s": {"sarif"},
    "lint --format=s": {"--format=sarif"},
    "lint x.yaml -p ": set(),
    "up my_robot.yaml -p ": {"demo"},
    "up --guard ": {"off", "watch", "strict"},
    "up --timeout ": set(),
    "completion z": {"zsh"},
    "init a": {"arm"},
    "presets realsense/d45": {"realsense/d455", "realsense/d456", "realsense/d457"},
    "export sy": {"systemd"},
    "help backg": {"background"},
    "help sensors.pl": {"sensors.place"},
    "help docto": {"doctor"},
    "down --robot ": set(),
    "nothing ": set(),
}
#: Words that can be files, and what else they can be.
FILES = {
    "lint two": {"two_rovers.yaml"},
    "up --overlay two": {"two_rovers.yaml"},
    "up --overlay=two": {"--overlay=two_rovers.yaml"},
    "build -o ../rob": {"../robots/"},
    "pose rover.yaml odo": {"odom"},
    "explain TF30": {f"TF30{n}" for n in range(1, 10)},
    "explain rover.yaml ma": {"map"},
}


Asking = Callable[..., set[str]]


@pytest.fixture
def completed(monkeypatch: pytest.MonkeyPatch) -> Asking:
    """What argcomplete answers a shell whose cursor is at the end of a line."""

    def ask(folder: Path, line: str, breaks: str = "") -> set[str]:
        answer = io.StringIO()
        monkeypatch.setattr(
            argcomplete, "autocomplete", partial(CompletionFinder(), output_stream=answer)
        )
        monkeypatch.setattr(CompletionFinder, "_init_debug_stream", lambda _: None)  # takes fd 9
        variables = {
            "_ARGCOMPLETE": "1",
            "_ARGCOMPLETE_IFS": "\n",
            "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
            "_ARGCOMPLETE_COMP_WORDBREAKS": breaks,
            "COMP_LINE": line,
            "COMP_POINT": str(len(line)),
        }
        done = tfcompose_in(folder, **variables)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        return set(answer.getvalue().split("\n")) - {""}

    return ask


@pytest.mark.parametrize("line", [*CASES, *FILES])
def test_an_argument_is_completed(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, completed: Asking
) -> None:
    tmp_path.chmod(0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert completed(ROBOTS, f"tfcompose {line}") == (CASES | FILES)[line]


LINES = {
    "tfcompose li": {"lint"},
    "tfcompose lint --format=s": {"sarif"},
    "tfcompose pose 'my robot.yaml' odo": {"odom"},
    'tfcompose pose "my robot.yaml" odo': {"odom"},
    "tfcompose pose my\\ robot.yaml odo": {"odom"},
    "tfcompose pose 'my robot.yaml' 'odo": {"odom"},
    "tfcompose up cell.yaml cameras:": {"="},
    "tfcompose up cell.yaml --host ": {"main", "jetson"},
    "tfcompose up cell.yaml -p ": {"demo"},
}


@pytest.mark.parametrize("line", LINES)
def test_a_line_is_split_as_bash_does_it(line: str, folder: Path, completed: Asking) -> None:
    assert completed(folder, line, " \t\n\"'@><=;|&(:") == LINES[line]


#: What is typed before the tab key, and the line after it; a frame, a file, a preset, a code, a
#: robot, a process.
TYPED = {
    "tfcompose li": "lint ",
    "tfcompose pose cell.yaml too": "tool0 ",
    "tfcompose pose 'my robot.yaml' odo": "odom ",
    "tfcompose lint cel": "cell.yaml ",
    "tfcompose lint -f my": "my\\ robot.yaml ",
    "tfcompose lint --overlay=cel": "--overlay=cell.yaml ",
    "tfcompose presets realsense/d45": "realsense/d45",
    "tfcompose lint --select TF611,TF308": "TF611,TF308 ",
    "tfcompose lint --format=s": "--format=sarif ",
    "tfcompose down --robot rov": "rover@67 ",
    "tfcompose logs base": "base_drive ",
    "tfcompose up cell.yaml cam": "cameras:=",
    "tfcompose up cell.yaml -p d": "demo ",
    "tfcompose up cell.yaml --host je": "jetson ",
}
SETUP = {
    "bash": 'eval "$(tfcompose completion bash)"',
    "zsh": 'autoload -Uz compinit; compinit -u; eval "$(tfcompose completion zsh)"',
    "fish": "tfcompose completion fish | source",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with two robot files, and a robot that runs in domain 67.

    The robot is as others see it.
    """
    (tmp_path / "runtime").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    monkeypatch.setenv("ROS_DOMAIN_ID", "67")
    (tmp_path / "my robot.yaml").write_text((ROBOTS / "rover.yaml").read_text("utf-8"), "utf-8")
    (tmp_path / "cell.yaml").write_text(CELL, "utf-8")
    plan = Plan("rover", "", None, RosSettings(), (), (PlanProcess("base_drive", "run"),))
    runtime_dir = runtime_dir_of(plan, os.environ)
    lock = Lock(runtime_dir)
    plan_file = runtime_dir.plan_folder("0") / "plan.json"
    plan_file.parent.mkdir()
    plan_file.write_text(write_plan(plan), "utf-8")
    runtime_dir.link_plan(plan_file.parent)
    yield tmp_path
    lock.close()


@pytest.mark.parametrize("name", SETUP)
def test_a_shell_on_a_terminal_completes_words_at_the_tab_key(name: str, folder: Path) -> None:
    if not shutil.which(name):
        pytest.skip(f"{name} is not installed")
    (folder / "bin").mkdir()
    program = folder / "bin" / "tfcompose"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m tfcompose "$@"\n', "utf-8")
    program.chmod(0o755)
    path = f"{program.parent}:{os.environ['PATH']}"
    shell = Shell(
        folder, name, PATH=path, HOME=str(folder), PYTHONPATH=str(ROBOTS.parent), LC_ALL="C.UTF-8"
    )
    try:
        shell.type(f"{SETUP[name]}\r")
        for typed, completed in TYPED.items():
            shell.type(f"\x15\x0c{typed}\t#")  # on an empty line of an empty screen
            shell.shows(f"{PROMPT}{typed.rpartition(' ')[0]} {completed}#")
        shell.type("\x15\x0ctfcompose up cell.yaml --timeout \t#")
        shell.shows("--timeout #")
        assert "my robot.yaml" not in shell.screen_text
        assert shell.text.count("command not found") == 0
    finally:
        shell.close()


def test_there_is_a_script_for_each_shell_and_for_no_other(tmp_path: Path) -> None:
    assert SETUP.keys() == set(SHELLS)
    assert all(
        "tfcompose" in tfcompose_in(tmp_path, "completion", shell).stdout for shell in SHELLS
    )
    assert tfcompose_in(tmp_path, "completion", "csh").returncode == 2


def test_help_groups_every_command_once_and_help_of_a_command_is_its_page(tmp_path: Path) -> None:
    text = tfcompose_in(tmp_path, "help").stdout
    commands = all_commands()
    assert sum(map(len, all_groups().values())) == len(commands)
    assert all(text.count(f"  {summary_of(command)}\n") == 1 for command in commands.values())
    options = tfcompose_in(tmp_path, "lint", "--help").stdout
    assert tfcompose_in(tmp_path, "help", "lint").stdout.startswith(options)
    assert tfcompose_in(tmp_path, "help", "nothing").returncode == 2
    assert tfcompose_in(tmp_path, "-V").stdout == tfcompose_in(tmp_path, "--version").stdout


def test_the_option_or_command_that_is_near_is_named_and_a_far_one_is_not(tmp_path: Path) -> None:
    for words, near in (
        ("up --detached", "--detach?"),
        ("lnt", "lint?"),
        ("lint --fromat=json", "--format?"),
    ):
        done = tfcompose_in(tmp_path, *words.split())
        assert (done.returncode, near in done.stderr) == (2, True), done.stderr
    for words in (
        "version",
        "up --xyzzy",
        "export launch -o",
        "lint --select XX1",
        "graph --direction up",
    ):
        done = tfcompose_in(tmp_path, *words.split())
        assert (done.returncode, "did you mean" in done.stderr) == (2, False), done.stderr
