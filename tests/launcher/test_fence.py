"""How a strict plan's processes are fenced off: by profiles with a partition, or by remappings; and what cannot be."""

import json
import os
import re
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.findings import expect
from tfcompose.findings import Finding
from tfcompose.geometry import Pose
from tfcompose.launcher.child import Command
from tfcompose.launcher.preflight import LAUNCH, commands_of
from tfcompose.plan import FenceWay, GuardPolicy, Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.plan.topics import private_topics
from tfcompose.ros.environment import child_environment
from tfcompose.variables import REMAPPED

GUARD = PlanProcess("guard", "guard", argv=("true",))
SLAM = PlanProcess("slam", "run", argv=("true",), nodes=("/slam",), owns=(("map", "odom"),))


def plan_of(*processes: PlanProcess, fence: FenceWay = "auto") -> Plan:
    edges = tuple(
        PlanEdge(parent, child, "dynamic", one.name, f"/{one.name}", Pose(), None, SourceLine("rover.yaml", 1))
        for one in processes
        for parent, child in one.owns
    )
    return Plan("rover", "", None, RosSettings(), edges, processes, GuardPolicy("strict", fence=fence))


def inspect(
    tmp_path: Path, *processes: PlanProcess, fence: FenceWay = "auto", **env: str
) -> tuple[dict[str, Command], list[Finding]]:
    base = {"PATH": os.environ["PATH"]} | env
    plan = plan_of(*processes, fence=fence)
    return commands_of(plan, list(processes), tmp_path / "plan.json", base, child_environment)


def partitions(command: Command) -> dict[tuple[str, str], str]:
    """Return the partitions that a command's fence gives readers or writers of a topic."""
    assert command.fence
    root = ET.fromstring(command.fence[1])  # noqa: S314 (made here)
    name = "{http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles}"
    return {
        (one.tag.removeprefix(name), one.attrib["profile_name"]): one.findtext(f".//{name}value") or ""
        for one in root.iter()
        if one.tag.startswith(f"{name}data_")
    }


def moved(command: Command) -> dict[str, str]:
    """Return what the command's ROS arguments remap, by the first rule that fits, as ROS does."""
    rules = [word.split(":=") for flag, word in zip(command.argv, command.argv[1:], strict=False) if flag == "-r"]
    return dict(reversed(rules))


# By partition.


def test_a_strict_plan_fences_off_what_children_send_and_lets_the_guard_read_both(tmp_path: Path) -> None:
    slam = PlanProcess("slam", "run", argv=("true",), remap={"/tf": "/r/tf"}, owns=(("map", "odom"),))
    commands, found = inspect(tmp_path, slam, GUARD)
    assert found == []
    assert partitions(commands["slam"]) == {
        ("data_writer", "/r/tf"): "tfc_rover",
        ("data_writer", "/tf_static"): "tfc_rover",
    }
    readers = {("data_reader", topic): ";tfc_rover" for topic in ("/r/tf", "/tf_static", "/tf")}
    assert partitions(commands["guard"]) == readers
    for command in commands.values():
        assert command.fence
        assert command.env["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(command.fence[0])
        assert not command.fence[0].exists(), "nothing is written before the start"
    assert REMAPPED not in commands["guard"].env
    assert "leaseAnnouncement" in (commands["guard"].fence or ("", ""))[1]
    assert "leaseAnnouncement" not in (commands["slam"].fence or ("", ""))[1]


def test_a_users_own_profiles_stay_behind_the_fence(tmp_path: Path) -> None:
    own = tmp_path / "own.xml"
    own.write_text("<profiles><data_writer profile_name='/scan'/></profiles>")
    commands, found = inspect(tmp_path, SLAM, GUARD, FASTRTPS_DEFAULT_PROFILES_FILE=str(own))
    assert found == []
    assert "profile_name='/scan'" in (commands["slam"].fence or ("", ""))[1]


def test_a_process_that_sends_on_topics_that_nobody_judges_is_left_alone(tmp_path: Path) -> None:
    debug = PlanProcess(
        "debug", "run", argv=("true",), nodes=("/debug",), owns=(), remap={"/tf": "/x/tf", "/tf_static": "/x/s"}
    )
    for fence in ("partition", "remap"):
        commands, found = inspect(tmp_path, SLAM, debug, GUARD, fence=fence)
        assert found == []
        assert commands["debug"].fence is None
        assert commands["debug"].argv[1:] == ()


@pytest.mark.parametrize(
    ("remap", "env", "names"),
    [
        ({}, {"RMW_IMPLEMENTATION": "rmw_x"}, ["rmw_fastrtps_cpp", "rmw_x"]),
        ({"/tf": "tf"}, {}, [" tf,", "slash"]),
        ({}, {"FASTRTPS_DEFAULT_PROFILES_FILE": "/no/such.xml"}, ["/no/such.xml", "fence: remap"]),
        ({}, {"FASTRTPS_DEFAULT_PROFILES_FILE": "OWN"}, ["own.xml", "fence: remap"]),
    ],
)
def test_what_a_partition_cannot_fence_off_is_one_finding_that_names_all(
    tmp_path: Path, remap: dict[str, str], env: dict[str, str], names: list[str]
) -> None:
    own = tmp_path / "own.xml"
    own.write_text('<profiles><data_writer profile_name="/tf"></data_writer></profiles>')
    env = {name: value.replace("OWN", str(own)) for name, value in env.items()}
    both = [PlanProcess(name, "run", argv=("true",), remap=remap, owns=(("map", name),)) for name in ("slam", "drive")]
    _, (found,) = inspect(tmp_path, *both, fence="partition", **env)
    expect(found, "TF902", *names)
    assert found.message.endswith(": slam, drive")


# By remapping.


def test_another_rmw_is_fenced_off_by_remapping(tmp_path: Path) -> None:
    static = PlanProcess("static", "static", argv=("${python}", "-m", "x", "${plan}", "static"))
    commands, found = inspect(tmp_path, SLAM, static, GUARD, RMW_IMPLEMENTATION="rmw_cyclonedds_cpp")
    assert found == []
    for name in ("slam", "static"):
        assert moved(commands[name]) == {
            "/tf": f"/_tfcompose/rover/{name}/tf",
            "/tf_static": f"/_tfcompose/rover/{name}/tf_static",
        }
        assert commands[name].fence is None
    assert REMAPPED in commands["guard"].env
    assert commands["guard"].argv[1:] == ()


def test_the_way_can_be_chosen(tmp_path: Path) -> None:
    commands, _ = inspect(tmp_path, SLAM, GUARD, fence="remap")
    assert moved(commands["slam"])
    assert commands["slam"].fence is None
    assert inspect(tmp_path, SLAM, GUARD)[0]["slam"].fence


def test_remappings_come_before_those_of_the_plan_and_catch_what_is_sent_on_its_topics(tmp_path: Path) -> None:
    argv = ("true", "--speed", "3", "--ros-args", "-r", "__node:=slam", "-r", "/tf:=/r/tf", "-p", "a:=1")
    remap = {"/tf": "/r/tf", "/tf_static": "/r/tf_static"}
    slam = PlanProcess("slam", "run", argv=argv, nodes=("/r/slam",), remap=remap, owns=(("map", "odom"),))
    commands, _ = inspect(tmp_path, slam, GUARD, fence="remap")
    words = commands["slam"].argv[1:]
    assert words[:3] == ("--speed", "3", "--ros-args")
    assert words[-6:] == ("-r", "__node:=slam", "-r", "/tf:=/r/tf", "-p", "a:=1")
    private = {"/tf": "/_tfcompose/rover/slam/tf", "/tf_static": "/_tfcompose/rover/slam/tf_static"}
    assert moved(commands["slam"]) == {
        **private,
        "/r/tf": private["/tf"],
        "/r/tf_static": private["/tf_static"],
        "__node": "slam",
    }


def test_a_launch_file_is_remapped_in_full(tmp_path: Path) -> None:
    share = tmp_path / "share" / "nav"
    share.mkdir(parents=True)
    (share / "nav.launch.py").write_text("")
    ros2 = tmp_path / "ros2"
    ros2.write_text("")
    ros2.chmod(0o755)
    argv = ("${launch:nav/nav.launch.py}", "a:=1")
    nav = PlanProcess("nav", "run", argv=argv, remap={"/scan": "/front/scan"}, owns=(("a", "b"),))
    env = {"PATH": str(tmp_path), "AMENT_PREFIX_PATH": str(tmp_path)}
    commands, found = inspect(tmp_path, nav, fence="remap", **env)
    assert found == []
    given = json.loads(commands["nav"].env[LAUNCH])
    topics = {"/tf": "/_tfcompose/rover/nav/tf", "/tf_static": "/_tfcompose/rover/nav/tf_static"}
    assert given["remap"] == topics | {"/scan": "/front/scan"}
    assert given["arguments"] == {"a": "1"}


def test_owners_that_no_remapping_reaches_are_one_finding(tmp_path: Path) -> None:
    shell = PlanProcess("shell", "run", argv=("/bin/sh", "-c", "drive | tee log"), nodes=("/a",), owns=(("a", "b"),))
    more = replace(shell, name="more", nodes=("/b",), owns=(("b", "c"),))
    _, (found,) = inspect(tmp_path, shell, more, SLAM, GUARD, fence="remap")
    expect(found, "TF902", "shell, more")


def test_a_command_that_may_be_no_node_gets_no_ros_arguments(tmp_path: Path) -> None:
    web = PlanProcess("web", "run", argv=("true", "--port", "80"), nodes=("/web",))
    play = PlanProcess("play", "run", argv=("true", "--ros-args", "-p", "a:=1"), nodes=("/play",))
    commands, found = inspect(tmp_path, web, play, SLAM, GUARD, fence="remap")
    assert found == []
    assert commands["web"].argv[1:] == ("--port", "80")
    assert moved(commands["play"])


@given(st.lists(st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,6}(/[A-Za-z][A-Za-z0-9_]{0,6})?", fullmatch=True), unique=True))
def test_every_process_has_topics_of_its_own_with_names_that_ros_takes(names: list[str]) -> None:
    processes = (PlanProcess(name, "run", argv=("true",), owns=(("map", name),)) for name in names)
    topics = private_topics(plan_of(*processes, GUARD)).values()
    each: list[Any] = list(chain(*topics))
    assert len(set(each)) == 2 * len(names)
    for topic in each:
        assert re.fullmatch(r"(/_?[A-Za-z](_?[A-Za-z0-9])*)+", topic)
