"""Strange publishers beside a running robot: who is named, and what everybody hears."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from tests.support.adversary import (
    GUARDS,
    OTHER_X,
    OWNER_X,
    Child,
    PlainListener,
    Robot,
    foreign,
    node,
    running,
)
from tests.support.waiting import until
from tfcompose.tf.ros.tf_codec import Transform, encode

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Iterator

pytestmark = [pytest.mark.ros]


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
    ) as one:
        one.says("tree complete")
        yield one


@pytest.fixture
def rogue(robot: Robot) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    started: list[subprocess.Popen[str]] = []

    def start(command: list[str], **env: str) -> subprocess.Popen[str]:
        started.append(robot.start(command, **env))
        return started[-1]

    yield start
    for one in started:
        robot.stop(one)


def accused(robot: Robot, after: int) -> set[int]:
    """Return the process numbers in findings behind so many lines."""
    return {
        int(pid)
        for pid in re.findall(r"runs on this machine as pid (\d+)", robot.output_after(after))
    }


def names_last(robot: Robot, after: int, pids: set[int]) -> bool:
    """Return whether the last finding behind so many lines names these processes, in the end."""

    def named() -> set[int]:
        _, _, last = robot.output_after(after).rpartition("error[TF801]")
        return {int(pid) for pid in re.findall(r"runs on this machine as pid (\d+)", last)}

    return until(lambda: named() == pids, 60)


#: A node's name and namespace, and how it is called.
NODES = {
    "stranger": ("stranger", "/", "/stranger"),
    "owner's name": ("slam", "/", "another /slam"),
    "owner's name below": ("slam", "/slam", "/slam/slam"),
    "owner's name as namespace": ("node", "/slam", "/slam/node"),
    "guard's name": ("tfcompose_guard", "/", "/tfcompose_guard"),
    "name of a process without a node": ("idle", "/", "/idle"),
}


@of_each(*GUARDS)
@pytest.mark.parametrize("kind", NODES)
def test_a_node_is_named_with_its_process_and_the_owner_is_not(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]], kind: str
) -> None:
    name, namespace, who = NODES[kind]
    after = robot.lines()
    one = rogue(node(name, OTHER_X, "map odom", namespace=namespace))
    robot.says("error[TF801]", "map → odom", f"published by {who}", after=after)
    robot.says("note: ", f"pid {one.pid}", after=after)
    heard = PlainListener().until("odom", OWNER_X)
    assert set(heard) <= {OWNER_X, OTHER_X}
    if robot.guard != "watch":
        robot.says("cannot be held back", after=after)
    robot.stop(one)
    robot.says("over", "map → odom", after=after)
    assert accused(robot, after) == {one.pid}
    assert "owner: idle" not in robot.output_after(after), (
        "the plan's idle has nothing to do with it"
    )


@of_each("watch", "strict")
def test_each_of_three_namesakes_is_named_and_who_remains(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]]
) -> None:
    after = robot.lines()
    namesakes = [rogue(node("slam", OTHER_X, "map odom")) for _ in range(3)]
    assert names_last(robot, after, {namesake.pid for namesake in namesakes})
    while len(namesakes) > 1:
        after = robot.lines()
        ended = namesakes.pop()
        robot.stop(ended)
        assert names_last(robot, after, {namesake.pid for namesake in namesakes})
        robot.says("note: another /slam has ended", f"pid {ended.pid}:", after=after)
        assert "over" not in robot.output_after(after)
    after = robot.lines()
    robot.stop(namesakes[0])
    robot.says("over", "map → odom", after=after)
    assert f"pid {robot.pid_of('slam')}:" not in robot.text, "the owner is not accused"
    guard = [line for line in robot.text.splitlines() if line.startswith("guard")]
    assert not [line for line in guard if "/slam" in line]


@of_each("watch", "strict")
def test_of_ten_strangers_and_ten_namesakes_each_is_named(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]]
) -> None:
    after = robot.lines()
    names = [*(f"rogue_{number}" for number in range(10)), *["slam"] * 10]
    rogues = [rogue(node(name, OTHER_X, "map odom")) for name in names]
    pids = {process.pid for process in rogues}
    assert until(lambda: accused(robot, after) == pids, 90), robot.output_after(after)
    PlainListener().until("odom", OWNER_X)
    assert f"pid {robot.pid_of('slam')}:" not in robot.text, "the owner is not accused"
    guard = [line for line in robot.output_after(after).splitlines() if line.startswith("guard")]
    assert not [line for line in guard if "/slam" in line]
    for process in rogues:
        robot.stop(process)
    robot.says("over", "map → odom", "another /slam", after=after)


@of_each(*GUARDS)
@pytest.mark.parametrize("edge", ["map odom", "odom extra"])
def test_a_program_of_another_dds_is_named_as_what_it_is_and_no_node_is_accused(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]], edge: str
) -> None:
    pytest.importorskip("cyclonedds")
    after, (parent, child) = robot.lines(), edge.split()
    one = rogue(foreign(OTHER_X, edge))
    code = "TF801" if child == "odom" else "TF803"
    robot.says(
        f"[{code}]", f"{parent} → {child}", "a DDS program that is no ROS node", after=after
    )
    PlainListener().until(child, OTHER_X)
    if robot.guard != "watch":
        robot.says("cannot be held back", after=after)
    robot.stop(one)
    assert accused(robot, after) == set()
    robot.says("over", f"{parent} → {child}", after=after)


@of_each(*GUARDS)
@pytest.mark.parametrize("odd", [b"b\xffd_name", b"b\0d_name"])
def test_a_name_that_is_no_text_hides_nothing_of_its_message(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]], odd: bytes
) -> None:
    after, rest = robot.lines(), ((OTHER_X, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    data = encode([Transform(0, "odom", "bad_name", *rest), Transform(0, "map", "odom", *rest)])
    one = rogue(node("odd", OTHER_X, f"hex:{data.replace(b'bad_name', odd).hex()}"))
    robot.says("error[TF801]", "map → odom", "/odd", after=after)
    robot.says("note: ", f"pid {one.pid}", after=after)
    robot.stop(one)
    robot.says("over", "map → odom", after=after)


@of_each("strict", "remap")
def test_who_joins_the_fence_on_purpose_is_held_back(
    robot: Robot, rogue: Callable[..., subprocess.Popen[str]]
) -> None:
    """A node with the run's profile or on its process's topic, and a plain DDS program."""
    after = robot.lines()
    fences = list(robot.folder.rglob("fence/slam.xml"))
    env = {"TOPIC": "/_tfcompose/liars/slam/tf"} if robot.guard == "remap" else {}
    profile = {} if robot.guard == "remap" else {"FASTRTPS_DEFAULT_PROFILES_FILE": str(fences[0])}
    one = rogue(node("inside", OTHER_X, "map odom"), **env, **profile)
    robot.says("error[TF801]", "map → odom", "/inside", after=after)
    robot.says("note: ", f"pid {one.pid}", after=after)
    try:
        import cyclonedds  # noqa: F401, PLC0415 (there is none for every Python)
    except ImportError:
        pass
    else:
        rogue(
            foreign(OTHER_X, "map odom", "odom extra"),
            PARTITION="tfc_liars" if not env else "",
            **env,
        )
        robot.says("a DDS program that is no ROS node", after=after)
    listener = PlainListener()
    assert OTHER_X not in listener.until("odom", OWNER_X, 40)
    assert "extra" not in listener.heard
    assert "listeners receive it" not in robot.output_after(after)
