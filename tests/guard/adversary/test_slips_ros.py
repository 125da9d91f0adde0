"""Children of a robot that try to slip out of its guard's sight.

Who is named, who is stopped, what everybody hears.
"""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.support.adversary import (
    OWNER_X,
    Child,
    PlainListener,
    Robot,
    foreign,
    holds_back,
    in_shell,
    node,
    running,
)
from tests.support.waiting import gone, until

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.ros

RENAMED_X, FORKED_X, PLAIN_X = 4.0, 5.0, 6.0
#: A file to be sourced, as robots have one in their launch shell.
SETUPS = {
    "own_profile": "export FASTRTPS_DEFAULT_PROFILES_FILE=$PWD/own.xml",
    "no_profile": "unset FASTRTPS_DEFAULT_PROFILES_FILE",
    "other_domain": "export ROS_DOMAIN_ID=$((ROS_DOMAIN_ID == 99 ? 98 : 99))",
}
CHILDREN = {
    **{
        name: Child(in_shell(f". ./{name}.sh; exec", node(name, PLAIN_X, f"odom {name}")))
        for name in SETUPS
    },
    "plain": Child(node("plain", PLAIN_X, "odom plain")),
    "renamed": Child(node("slam", RENAMED_X, "map odom")),
    "moved": Child(node("moved", PLAIN_X, "base_link moved", namespace="/other"), ["moved"]),
    "forked": Child(
        [
            "/bin/sh",
            "-c",
            f"(setsid {shlex.join(node('forked', FORKED_X, 'odom base_link'))} &); exec sleep 600",
        ]
    ),
    "foreign": Child(foreign(PLAIN_X, "odom foreign")),
}


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(guard, marks=pytest.mark.xdist_group(f"slips {guard}"))
        for guard in ("strict", "remap")
    ],
)
def robot(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Robot]:
    pytest.importorskip("cyclonedds")
    folder = tmp_path_factory.mktemp(request.param)
    for name, text in SETUPS.items():
        (folder / f"{name}.sh").write_text(f"{text}\n", encoding="utf-8")
    (folder / "own.xml").write_text("<dds><profiles/></dds>", encoding="utf-8")
    with running(folder, request.param, CHILDREN) as running_robot:
        running_robot.says("base_link", "live")
        yield running_robot


def pid_in(line: str) -> int:
    match = re.search(r"pid (\d+)", line)
    assert match, line
    return int(match[1])


def stopped(robot: Robot, name: str) -> bool:
    robot.says("error[TF852]", f"/{name} of {name}")
    robot.says("note: ", f"{name} is stopped")
    return until(lambda: gone(robot.pid_of(name)))


@pytest.mark.parametrize("name", ["own_profile", "no_profile", "plain"])
def test_leaving_the_fence_stops_a_process_and_undeclared_edges_are_named(
    robot: Robot, name: str
) -> None:
    if robot.guard == "remap" or name != "plain":
        assert stopped(robot, name)
        assert robot.output_after(0).count(f"/{name} of {name}") == 1
        return
    robot.says("TF803", f"odom → {name}", f"/{name}")
    robot.says("note: ", f"pid {robot.pid_of(name)}")


def test_a_child_with_the_owners_name_is_accused_and_not_the_owner(robot: Robot) -> None:
    robot.says("error[TF801]", "map → odom", "another /slam")
    robot.says("note: another /slam runs", f"pid {robot.pid_of('renamed')}")
    if robot.guard == "remap":
        robot.says("error[TF852]", "/slam of renamed")
    assert f"pid {robot.pid_of('slam')}:" not in robot.text
    if robot.guard == "strict":
        assert RENAMED_X not in PlainListener().until("odom", OWNER_X, 40)
    if robot.guard == "remap":
        assert until(lambda: gone(robot.pid_of("renamed")))


def test_a_child_in_another_namespace_is_advised_to_name_its_node(robot: Robot) -> None:
    robot.says("error[TF801]", "base_link → moved", "/other/moved")
    robot.says("help: it is moved itself", "/other/moved")
    assert not gone(robot.pid_of("moved"))


def test_a_child_that_left_its_session_is_named_by_its_own_process(robot: Robot) -> None:
    if robot.guard == "remap":
        assert stopped(robot, "forked")
        return
    robot.says("error[TF801]", "odom → base_link", "/forked")
    pid = pid_in(robot.says("note: /forked runs"))
    assert "node.py" in " ".join(psutil.Process(pid).cmdline())
    assert FORKED_X not in PlainListener().until("base_link", 0.0, 40)


def test_a_child_of_another_dds_is_named_as_such_and_listeners_get_it(robot: Robot) -> None:
    robot.says("TF803", "odom → foreign", "a DDS program that is not a ROS node")
    PlainListener().until("foreign", PLAIN_X)
    robot.says("cannot be held back")


def test_a_child_in_another_domain_is_nobodys(robot: Robot) -> None:
    robot.says("TF803", "odom → foreign")
    assert not gone(robot.pid_of("other_domain"))
    assert "odom → other_domain" not in robot.text


def test_who_joins_the_fence_on_purpose_is_held_back(robot: Robot) -> None:
    if robot.guard == "remap":  # test_rogues_ros has the other
        topic = {"TOPIC": "/_tfcompose/liars/slam/tf"}
        holds_back(robot, topic, PARTITION="", **topic)
