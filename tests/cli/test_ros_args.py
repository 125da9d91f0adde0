"""``--ros-args`` for a whole robot: a namespace above it, remappings, and the clock."""

import json
from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in

ROBOT = """
tfcompose: 1
robot: rover
ros: {namespace: inner, isolate: ISOLATE}
frames: {base_link: {}, lidar: {parent: base_link, xyz: [0, 0, 1]}}
processes:
  node: {run: {package: demo, executable: talker}, remap: {chatter: own}, ready: {topic: chatter}}
  alone: {run: {package: demo, executable: talker}, namespace: /alone, log_level: fatal}
  plain: {run: [sleep, "9"]}
"""


def processes_of(folder: Path, isolate: str, *ros_args: str) -> tuple[dict[str, dict], list[str]]:  # type: ignore[type-arg]  # JSON
    (folder / "robot.yaml").write_text(ROBOT.replace("ISOLATE", isolate), "utf-8")
    done = tfcompose_in(folder, "build", "robot.yaml", "-o", "build", "--ros-args", *ros_args)
    assert done.returncode == 0, done.stdout + done.stderr
    plan = json.loads((folder / "build/plan.json").read_text("utf-8"))
    frames = [edge["child"] for edge in plan["edges"]]
    return {process["name"]: process for process in plan["processes"]}, frames


@pytest.mark.parametrize(
    ("isolate", "frame"),
    [("none", "lidar"), ("frames", "inner/lidar"), ("both", "inner/lidar"), ("topics", "lidar")],
)
def test_a_namespace_is_above_nodes_and_isolated_topics_and_in_no_frame(
    tmp_path: Path, isolate: str, frame: str
) -> None:
    processes, frames = processes_of(tmp_path, isolate, "-r", "__ns:=/outer")
    assert frames == [frame]
    assert processes["node"]["nodes"] == ["/outer/inner/node"]
    assert processes["alone"]["nodes"] == ["/alone/alone"]
    assert processes["static"]["nodes"] == ["/outer/inner/tfcompose_static"]
    moved = processes["static"].get("remap", {}).get("/tf_static")
    assert moved == ("/outer/inner/tf_static" if isolate in {"both", "topics"} else None)


def test_remappings_come_before_those_of_each_node(tmp_path: Path) -> None:
    processes, _ = processes_of(
        tmp_path, "none", "-r", "chatter:=loud", "--remap", "/tf:=tf", "--"
    )
    assert processes["node"]["remap"] == {"/tf": "/inner/tf", "chatter": "loud"}
    assert processes["node"]["argv"].count("chatter:=loud") == 1
    assert processes["node"]["ready"]["text"] == "/inner/loud"
    assert processes["guard"]["remap"]["/tf"] == "/inner/tf"
    assert processes["plain"]["argv"] == ["sleep", "9"]


def test_the_clock_is_that_of_all_nodes(tmp_path: Path) -> None:
    processes, _ = processes_of(tmp_path, "none", "-p", "use_sim_time:=True")
    assert "use_sim_time:=true" in processes["node"]["argv"]


def test_a_log_level_is_that_of_the_nodes_without_one(tmp_path: Path) -> None:
    processes, _ = processes_of(tmp_path, "none", "--log-level", "DEBUG")
    levels = {name: process.get("log_level") for name, process in processes.items()}
    assert levels == {
        "static": None,
        "node": "debug",
        "alone": "fatal",
        "plain": None,
        "guard": None,
    }
    assert processes["node"]["argv"][-2:] == ["--log-level", "debug"]
    assert processes["alone"]["argv"].count("--log-level") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ("--log-level", "loud"),
        ("--log-level", "node:=debug"),
        ("-r", "__node:=x"),
        ("-p", "rate:=3"),
        ("--params-file", "a.yaml"),
        ("-r",),
        ("-r", "a"),
    ],
    ids=" ".join,
)
def test_what_is_for_one_node_is_refused(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("ISOLATE", "none"), "utf-8")
    done = tfcompose_in(tmp_path, "build", "robot.yaml", "--ros-args", *arguments)
    assert done.returncode == 2
    assert arguments[0] in done.stderr
    assert not (tmp_path / "build").exists()
