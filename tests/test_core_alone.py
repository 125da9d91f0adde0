"""The core without the folder ``tools``.

It does all of its work, and says what installs what is absent.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from tests.support.core import copy_core, run_with
from tests.support.house import ROOT
from tests.support.names import FILE, names
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.tool import shipped

if TYPE_CHECKING:
    from pathlib import Path

    from tfcompose.foundation.tool import Tool

ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_core(tmp_path_factory.mktemp("core"))


def test_its_names_are_those_of_the_core_and_of_the_tools() -> None:
    assert FILE.read_text("utf-8") == names(), "python -m tests.support.names --write"


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.stem)
def test_it_lints_builds_rehearses_and_explains_the_example_robots(
    robot: Path, core: Path, tmp_path: Path
) -> None:
    linted = run_with(core, tmp_path, "lint", robot)
    assert (linted.returncode, linted.stderr) == (0, ""), linted.stdout
    built = run_with(core, tmp_path, "build", robot, "-o", tmp_path / "alone")
    assert (built.returncode, built.stderr) == (0, "")
    with_tools = run_with(ROOT, tmp_path, "build", robot, "-o", tmp_path / "whole")
    assert with_tools.returncode == 0
    for file in (tmp_path / "alone").rglob("*"):
        same = tmp_path / "whole" / file.relative_to(tmp_path / "alone")
        assert file.is_dir() or file.read_bytes() == same.read_bytes(), file
    plan = json.loads((tmp_path / "alone/plan.json").read_text())
    edge = plan["edges"][0]
    explained = run_with(core, tmp_path, "explain", robot, edge["parent"], edge["child"])
    assert explained.returncode == 0, explained.stderr
    assert explained.stdout.startswith(f"pose of {edge['child']} in {edge['parent']}")


def test_help_topics_and_codes_are_those_of_the_core(core: Path, tmp_path: Path) -> None:
    text = run_with(core, tmp_path, "--help").stdout
    assert "  lint " in text
    for tool in shipped().tools:
        for command in tool.commands:
            assert f"  {command.name} " not in text
    for word in ("lint", "guard", "codes", "sensors"):
        assert run_with(core, tmp_path, "help", word).returncode == 0
    assert run_with(core, tmp_path, "schema").returncode == 0
    assert run_with(core, tmp_path, "explain", "TF801").returncode == 0


@pytest.mark.parametrize("tool", shipped().tools, ids=lambda tool: tool.name)
def test_a_command_of_an_absent_tool_says_what_installs_it(
    tool: Tool, core: Path, tmp_path: Path
) -> None:
    for command in tool.commands:
        done = run_with(core, tmp_path, command.name)
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
    argv: tuple[str, ...], core: Path, tmp_path: Path
) -> None:
    done = run_with(core, tmp_path, *argv)
    tool = "deploy" if "deploy" in argv else "fleet"
    assert (done.returncode, done.stdout) == (2, "")
    assert f"belongs to the tool {tool}" in done.stderr
    assert f"pip install 'tfcompose[{tool}]'" in done.stderr


def test_an_option_and_a_key_of_an_absent_tool_say_what_installs_it(
    core: Path, tmp_path: Path
) -> None:
    done = run_with(core, tmp_path, "ps", "--all-hosts")
    assert (done.returncode, "tfcompose[deploy]" in done.stderr) == (2, True)
    (tmp_path / "robot.yaml").write_text(
        "tfcompose: 1\nrobot: r\nframes: {base_link: {}} # tfcompose: allow TF887 because x\n"
        "fleet: fleet.yaml\nrules: {TF881: off}\n"
    )
    done = run_with(core, tmp_path, "lint")
    assert "robot.yaml:4:1: error[TF101] unknown key fleet" in done.stdout
    assert done.stdout.count("tfcompose[fleet]") == 3
