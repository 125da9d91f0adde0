"""Strange publishers beside a running robot: who is named, and what everybody hears."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

import psutil
import pytest

from tests.support.adversary import (
    OTHER_X,
    OWNER_X,
    Child,
    PlainListener,
    Robot,
    flood,
    foreign,
    holds_back,
    node,
    running,
)
from tfcompose.tf.ros.tf_codec import SentTransform, encode

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Iterator

pytestmark = [pytest.mark.ros]


#: What a guard may grow by, however much is sent.
MOST_GROWTH = 60_000_000


def of_each(*guards: str) -> pytest.MarkDecorator:
    """Give a robot of each of these ways of guarding; one worker tries all rogues on it."""
    robots = [
        pytest.param(guard, marks=pytest.mark.xdist_group(f"rogues {guard}")) for guard in guards
    ]
    return pytest.mark.parametrize("robot", robots, indirect=True, scope="module")


@pytest.fixture(scope="module")
def robot(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Robot]:
    with running(
        tmp_path_factory.mktemp(request.param), request.param, {"idle": Child(["sleep", "600"])}
    ) as running_robot:
        running_robot.says("tree complete")
        yield running_robot


@pytest.fixture
def rogue(robot: Robot) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    started: list[subprocess.Popen[str]] = []

    def start(command: list[str], **env: str) -> subprocess.Popen[str]:
        started.append(robot.start(command, **env))
        return started[-1]

    yield start
    for process in started:
        robot.stop(process)


def accused(robot: Robot, after: int) -> set[int]:
    """Return the process numbers in findings behind so many lines."""
    return {
        int(pid)
        for pid in re.findall(r"runs on this machine as pid (\d+)", robot.output_after(after))
    }


#: A node's name and namespace, and how it is called.
NODES = {
    "stranger": ("stranger", "/", "/stranger"),
    "owner's name": ("slam", "/", "another /slam"),
    "guard's name": ("tfcompose_guard", "/", "/tfcompose_guard"),
    "name of a process without a node": ("idle", "/", "/idle"),
}


@of_each("strict")
@pytest.mark.parametrize("kind", NODES)
def test_a_node_is_named_with_its_process_and_the_owner_is_not(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]], kind: str
) -> None:
    name, namespace, who = NODES[kind]
    after = len(robot.lines())
    started = rogue(node(name, OTHER_X, "map odom", namespace=namespace))
    robot.says("error[TF801]", "map → odom", f"published by {who}", after=after)
    robot.says("note: ", f"pid {started.pid}", after=after)
    heard = PlainListener().until("odom", OWNER_X)
    assert set(heard) <= {OWNER_X, OTHER_X}
    robot.says("cannot be held back", after=after)
    robot.stop(started)
    robot.says("over", "map → odom", after=after)
    assert accused(robot, after) == {started.pid}
    assert "owner: idle" not in robot.output_after(after), (
        "the plan's idle has nothing to do with it"
    )


@of_each("strict")
def test_a_program_of_another_dds_is_named_as_such_and_no_node_is_accused(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]]
) -> None:
    pytest.importorskip("cyclonedds")
    after = len(robot.lines())
    started = rogue(foreign(OTHER_X, "map odom"))
    robot.says("[TF801]", "map → odom", "a DDS program that is not a ROS node", after=after)
    PlainListener().until("odom", OTHER_X)
    robot.says("cannot be held back", after=after)
    robot.stop(started)
    assert accused(robot, after) == set()
    robot.says("over", "map → odom", after=after)


@of_each("strict")
def test_a_name_that_is_no_text_hides_nothing_of_its_message(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]]
) -> None:
    after, rest = len(robot.lines()), ((OTHER_X, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    data = encode(
        [SentTransform(0, "odom", "bad_name", *rest), SentTransform(0, "map", "odom", *rest)]
    )
    odd = data.replace(b"bad_name", b"b\xffd_name").hex()
    started = rogue(node("odd", OTHER_X, f"hex:{odd}"))
    robot.says("error[TF801]", "map → odom", "/odd", after=after)
    robot.says("note: ", f"pid {started.pid}", after=after)
    robot.stop(started)
    robot.says("over", "map → odom", after=after)


@of_each("strict")
def test_who_joins_the_fence_on_purpose_is_held_back(robot: Robot) -> None:
    """A node with the run's profile, and a plain DDS program; test_slips_ros has topics."""
    (fence,) = robot.folder.rglob("fence/slam.xml")
    holds_back(robot, {"FASTRTPS_DEFAULT_PROFILES_FILE": str(fence)}, PARTITION="tfc_liars")


@of_each("strict")
def test_a_flood_of_new_frames_is_named_and_harms_neither_tree_nor_memory(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]]
) -> None:
    guard = psutil.Process(robot.pid_of("guard"))
    before, after = guard.memory_info().rss, len(robot.lines())
    rogue([sys.executable, "-c", flood(1_500)])
    robot.says("error[TF853]", "/flood", after=after)
    PlainListener().until("odom", OWNER_X, 60)
    assert guard.memory_info().rss - before < MOST_GROWTH
    assert guard.is_running(), "it was not killed as one that hangs"
