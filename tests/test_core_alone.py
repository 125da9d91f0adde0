"""The core without the folder ``tools``.

It does all of its work, and says what installs what is absent.
"""

from __future__ import annotations

import os
import re
import sys
from functools import partial
from typing import TYPE_CHECKING

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tests.support.house import ROOT
from tests.support.names import FILE, names
from tests.support.preloaded import preloaded
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.tool import shipped_tools

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from tfcompose.foundation.tool import Tool

    Run = Callable[..., subprocess.CompletedProcess[str]]

#: One worker has the copy, whose modules are compiled once.
pytestmark = pytest.mark.xdist_group("core")
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))


def test_its_names_are_those_of_the_core_and_of_the_tools() -> None:
    assert FILE.read_text("utf-8") == names(), "python -m tests.support.names --write"


#: Lints, builds and explains each robot in one process without tools.
WORK = """
import json, sys
from pathlib import Path
from tfcompose.cli import main
for robot in sys.argv[1:]:
    assert main(["lint", robot]) == 0
    out = Path(Path(robot).stem)
    assert main(["build", robot, "-o", str(out)]) == 0
    edge = json.loads((out / "plan.json").read_text())["edges"][0]
    print("explains:", edge["child"], "in", edge["parent"])
    assert main(["explain", robot, edge["parent"], edge["child"]]) == 0
"""


def test_it_lints_builds_and_explains_the_example_robots(core: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": str(core)}
    command = [sys.executable, "-c", WORK, *map(str, ROBOTS)]
    done = processes.run(command, cwd=tmp_path, env=environment)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    explained = re.findall(r"^explains: (.*)\npose of (.*?)[,:\n]", done.stdout, re.MULTILINE)
    assert len(explained) == len(ROBOTS)
    assert all(pose.startswith(edge) for edge, pose in explained), explained
    for robot in ROBOTS:
        complete = tmp_path / "complete" / robot.stem
        assert tfcompose_in(tmp_path, "build", robot, "-o", complete).returncode == 0
        for file in (tmp_path / robot.stem).rglob("*"):
            same = complete / file.relative_to(tmp_path / robot.stem)
            assert file.is_dir() or file.read_bytes() == same.read_bytes(), file


@pytest.fixture(scope="module")
def alone(core: Path) -> Iterator[Run]:
    """Run the core in a folder."""
    with preloaded(core) as forks:
        yield partial(forks.run, core)


def test_help_topics_and_codes_are_those_of_the_core(alone: Run, tmp_path: Path) -> None:
    text = alone(tmp_path, "--help").stdout
    assert "  lint " in text
    for tool in shipped_tools().tools:
        for command in tool.commands:
            assert f"  {command.name} " not in text
    for word in ("lint", "guard", "codes", "sensors"):
        assert alone(tmp_path, "help", word).returncode == 0
    assert alone(tmp_path, "schema").returncode == 0
    assert alone(tmp_path, "explain", "TF801").returncode == 0


@pytest.mark.parametrize("tool", shipped_tools().tools, ids=lambda tool: tool.name)
def test_a_command_of_an_absent_tool_says_what_installs_it(
    tool: Tool, alone: Run, tmp_path: Path
) -> None:
    for command in tool.commands:
        done = alone(tmp_path, command.name)
        install = f"tfcompose[{tool.extra}]" if tool.extra else "tfcompose"
        assert (done.returncode, done.stdout) == (2, "")
        assert f"pip install '{install}'" in done.stderr


@pytest.mark.parametrize(
    "argv",
    [
        ("help", "fleet"),
        ("help", "fleet.robot"),
        ("help", "deploy"),
        ("explain", "TF881"),
        ("explain", "tf881"),
        ("explain", CATALOGUE["TF881"].name),
        ("lint", "--select", "TF881"),
    ],
    ids=" ".join,
)
def test_a_topic_and_a_code_of_an_absent_tool_say_what_installs_it(
    argv: tuple[str, ...], alone: Run, tmp_path: Path
) -> None:
    done = alone(tmp_path, *argv)
    tool = "deploy" if "deploy" in argv else "fleet"
    assert (done.returncode, done.stdout) == (2, "")
    assert f"belongs to the tool {tool}" in done.stderr
    assert f"pip install 'tfcompose[{tool}]'" in done.stderr


def test_an_option_and_a_key_of_an_absent_tool_say_what_installs_it(
    alone: Run, tmp_path: Path
) -> None:
    done = alone(tmp_path, "ps", "--all-hosts")
    assert (done.returncode, "tfcompose[deploy]" in done.stderr) == (2, True)
    (tmp_path / "robot.yaml").write_text(
        "tfcompose: 1\nrobot: r\nframes: {base_link: {}} # tfcompose: allow TF887 because x\n"
        "fleet: fleet.yaml\nrules: {TF881: off}\n"
    )
    done = alone(tmp_path, "lint")
    assert "robot.yaml:4:1: error[TF101] unknown key fleet" in done.stdout
    assert done.stdout.count("tfcompose[fleet]") == 3
