"""``verify`` and ``tree --live`` on a robot that runs, and on one where somebody interferes."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support import processes
from tests.support.doctor import at_last
from tests.support.fake_nodes import sending
from tests.support.processes import Started
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import PlanEdge, PlanProcess, Simulation
from tfcompose.spec.load import load

pytestmark = pytest.mark.ros


@pytest.fixture
def running(
    write: Callable[..., Path], start: Callable[..., Started], edge: Callable[..., PlanEdge]
) -> Path:
    """Start a base that is moved by a stand-in, and a laser on it; return the plan's file."""
    edges = [
        replace(edge("odom base_link", "drive"), rate=50.0),
        edge("base_link laser", pose=Pose((0.0, 0.0, 0.3))),
    ]
    drive = PlanProcess("drive", "simulate", simulate=Simulation("fixed", 50.0))
    plan = write(edges, PlanProcess("static", "static"), drive)
    for module, name in (("static", "static"), ("simulate", "drive")):
        start(module, plan, name).until_says("edge")
    return plan


def tfcompose(*words: str, code: int = 0) -> str:
    command = [sys.executable, "-m", "tfcompose", *words]
    done = processes.run(command)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


def test_what_is_imported_of_a_running_robot_is_as_expected_on_it(running: Path) -> None:
    """Import names the nodes, and the rate; what it writes passes verify on the same robot."""
    out = running.with_name("imported.yaml")

    def is_imported(seconds: float) -> None:
        tfcompose("import", "--live", "--for", str(seconds), "-o", str(out), "--force")
        frames = load(out.read_text("utf-8"), str(out)).data["frames"]
        assert frames["laser"] == {
            "parent": "base_link",
            "xyz": [0, 0, 0.3],
            "owner": "static_2",
            "static": True,
        }
        assert (frames["base_link"]["owner"], frames["base_link"]["rate"]) == ("drive", "50 Hz")
        assert "2 of 2" in tfcompose("verify", str(out), "--live", "--for", str(seconds))

    at_last(is_imported)


def test_the_live_tree_names_nodes_and_what_is_unexpected(running: Path) -> None:
    def are_named(seconds: float) -> None:
        output = tfcompose(
            "tree", str(running), "--live", "--for", str(seconds), "--format", "json"
        )
        rows: list[dict[str, Any]] = json.loads(output)["trees"]
        assert [tree["root"] for tree in rows] == ["odom", "world"]
        edges = [edge for tree in rows for edge in tree["edges"]]
        assert {
            edge["child"]: (edge["status"], edge["owner"], edge["seen"][0]["publisher"])
            for edge in edges
        } == {
            "base_link": ("expected", "drive", "/rover/drive"),
            "laser": ("expected", "static", "/rover/static"),
            "tag_1": ("unexpected", None, "/tags"),
        }

    def is_drawn(seconds: float) -> None:
        drawn = tfcompose("tree", str(running), "--live", "--for", str(seconds)).splitlines()
        assert drawn[0] == "odom"
        assert [
            word in drawn[1]
            for word in ("base_link", "drive (/rover/drive)", "Hz", "ms", "expected")
        ] == [True] * 5

    with sending("tags", "world", "tag_1", rate=20):
        at_last(are_named)
    at_last(is_drawn)


@pytest.mark.usefixtures("domain")
def test_of_a_robot_without_edges_nothing_is_missing_where_nothing_is_sent(tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text("tfcompose: 1\nrobot: post\nframes: {base_link: {}}\n")
    assert "0 of 0" in tfcompose("verify", str(robot), "--for", "0.1")
