"""Two launchers with two hosts' shares of one plan, in one ROS domain."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from tests.run.test_hosts import TWO
from tests.waiting import until

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.conftest import Started

pytestmark = pytest.mark.ros


def ps() -> dict[str, dict[str, str]]:
    words = [sys.executable, "-m", "tfcompose", "ps", "--format", "json"]
    said = subprocess.run(words, capture_output=True, text=True, timeout=30, check=False).stdout
    robots = json.loads(said or "[]")
    return {
        robot["name"].partition("@")[0]: {one["name"]: one["state"] for one in robot["processes"]} for robot in robots
    }


def test_two_hosts_start_their_shares_and_each_sees_the_whole_tree(
    start: Callable[..., Started], tmp_path: Path
) -> None:
    file = tmp_path / "rover.yaml"
    file.write_text(TWO.replace("robot: rover", "robot: rover\nros: {discovery: localhost}"), "utf-8")
    main = start("tfcompose", "up", file, "-o", tmp_path / "a")
    main.until_says("expecting arm_drive (/arm_drive): host jetson starts it")
    main.until_says("live  drive")
    jetson = start("tfcompose", "up", file, "--host", "jetson", "-o", tmp_path / "b")
    assert until(lambda: "tree complete: 3 edges" in main.output and "tree complete: 3 edges" in jetson.output), (
        main.output + jetson.output
    )
    shares = {
        "rover": {"static": "RUNNING", "drive": "RUNNING", "arm_drive": "EXPECTED", "guard": "RUNNING"},
        "rover.jetson": {"static": "EXPECTED", "drive": "EXPECTED", "arm_drive": "RUNNING", "guard": "RUNNING"},
    }
    assert ps() == shares
    assert "TF8" not in main.output + jetson.output
    assert jetson.output.index("live  drive") < jetson.output.index("started arm_drive"), "it waits for another host's"
    assert jetson.end()[0] == 0
    assert until(lambda: "TF804" in main.output), "the guard on one host sees that the other's owner fell silent"
    assert main.end()[0] == 0


def test_a_share_that_is_live_on_another_machine_is_refused(
    start: Callable[..., Started], tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = tmp_path / "rover.yaml"
    file.write_text(TWO, "utf-8")
    first = start("tfcompose", "up", file, "-o", tmp_path / "a")
    first.until_says("live  drive")
    other_machine = tmp_path_factory.mktemp("runtime")
    other_machine.chmod(0o700)
    second = start("tfcompose", "up", file, "-o", tmp_path / "b", XDG_RUNTIME_DIR=str(other_machine))
    assert second.process.wait(30) == 1
    assert until(lambda: "ended with exit code 1" in second.output)
    assert "TF807" in second.output
    assert "/drive" in second.output or "/tfcompose_static" in second.output, "whoever is seen first"
    assert "started static" not in second.output
    assert first.end()[0] == 0
