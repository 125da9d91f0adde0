"""Containers and components as real processes.

A container of the tests' own, and rclcpp_components where it is.
"""

import json
import os
import shutil
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from signal import SIGKILL
from typing import Any

import pytest

from tests.support import processes
from tests.support.composition import can_build, composition_interfaces
from tests.support.domains import Domain
from tests.support.fake_nodes import FakeNodes
from tests.support.findings import expect
from tests.support.waiting import until
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.findings import Finding
from tfcompose.launcher.program import HERE
from tfcompose.launcher.supervisor import supervise
from tfcompose.model.messages import (
    AllReady,
    FindingShown,
    LogLine,
    Notice,
    ProcessState,
    TreeComplete,
)
from tfcompose.model.plan import Component
from tfcompose.model.plan.components import LoadRequest
from tfcompose.model.plan.file import write_plan
from tfcompose.tf.ros.node import open_node

pytestmark = [
    pytest.mark.ros,
    pytest.mark.xdist_group("containers"),  # so that no other worker waits for the package
    pytest.mark.skipif(not can_build(), reason="there is no compiler for composition_interfaces"),
]

ROBOT = """
tfcompose: 1
robot: rover
ros: {namespace: robot1}
frames: {odom: {}, base_link: {parent: odom, owner: odometry}}
containers: {box: {restart: on-failure, restart_delay: 0.2 s}}
processes:
  rectify:
    component: image_proc/demo::Empty
    container: box
    namespace: front
    params: {queue: 5, rate: 2.0, name: left, on: true, list: [1, 2.5], words: [a, b], deep: {er: 1}}
    remap: {image: camera/image_raw}
    extra_arguments: {use_intra_process_comms: true}
  odometry:
    component: drive/demo::Moving
    container: box
    params: {edge: odom base_link}
    publishes: [{parent: odom, child: base_link, off: none}]
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with composition_interfaces, which all workers share."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base
    return composition_interfaces(shared / "composition")


@pytest.fixture
def stand_in(package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file with what the containers of a ROS installation are requested.

    They are the stand-in.
    """
    for name in ("component_container", "component_container_isolated"):
        program = tmp_path / "ros/lib/rclcpp_components" / name
        program.parent.mkdir(parents=True, exist_ok=True)
        program.write_text(
            f'#!/bin/sh\nexec {sys.executable} -m tests.support.stand_in_container "$@"\n'
        )
        program.chmod(0o755)
    log = tmp_path / "requested.jsonl"
    path = os.pathsep.join(dict.fromkeys((str(package), str(Path.cwd()), *sys.path)))
    for name, value in (
        ("CONTAINER_LOG", log),
        ("AMENT_PREFIX_PATH", tmp_path / "ros"),
        ("PYTHONPATH", path),
    ):
        monkeypatch.setenv(name, str(value))
    monkeypatch.syspath_prepend(str(package))
    return log


Step = Callable[[list[Notice]], bool | None]


def run(folder: Path, text: str, *steps: Step) -> list[Notice]:
    """Run a robot until each step in turn has returned True.

    A step is given all notices, after each.
    """
    compiled = compile_robot(text, str(folder / "robot.yaml"), library())
    assert compiled.robot is not None
    file = folder / "plan.json"
    file.write_text(write_plan(plan_of(compiled.robot)))
    notices: list[Notice] = []
    left = list(steps)

    def report(notice: Notice) -> None:
        notices.append(notice)
        while left and left[0](notices):
            left.pop(0)
        if not left:
            raise BrokenPipeError  # enough was seen

    supervise(plan_of(compiled.robot), file, report=report, duration_s=120)
    return notices


def requested(log: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in log.read_text().splitlines()]


def has_requests(log: Path, count: int) -> bool:
    return log.exists() and len(requested(log)) == count


def findings_in(notices: list[Notice]) -> list[Finding]:
    return [notice.found for notice in notices if isinstance(notice, FindingShown)]


def states(notices: list[Notice], name: str) -> list[str]:
    return [
        notice.state
        for notice in notices
        if isinstance(notice, ProcessState) and notice.process == name
    ]


def are_ready(notices: list[Notice]) -> bool:
    return isinstance(notices[-1], AllReady)


def has_found(code: str) -> Step:
    return lambda notices: any(finding.code == code for finding in findings_in(notices))


@pytest.mark.usefixtures("domain")
def test_components_load_return_with_their_container_and_own_their_edges(
    tmp_path: Path, stand_in: Path
) -> None:
    """Names, parameters and remappings are as launch gives them."""
    fakes = FakeNodes()

    def kill(notices: list[Notice]) -> bool:
        if are_ready(notices):
            os.kill(requested(stand_in)[-1]["pid"], SIGKILL)
        return are_ready(notices)

    def steal(notices: list[Notice]) -> bool:
        is_back = (
            sum(isinstance(notice, TreeComplete) for notice in notices) == 2
            and states(notices, "rectify")[-1] == "running"
        )
        if is_back:
            assert findings_in(notices) == [], (
                "an edge of a component is its owner's, though the container sends it"
            )
            fakes.moving(fakes.node("thief"), "odom base_link")
        return is_back

    try:
        notices = run(tmp_path, ROBOT, kill, steal, has_found("TF801"))
    finally:
        fakes.close()
    expect(findings_in(notices)[0], "TF801", "/thief", "odometry", "(/robot1/odometry)")
    for name in ("rectify", "odometry"):
        assert states(notices, name) == ["starting", "running", "stopped", "starting", "running"]
    first, second = requested(stand_in)[:2], requested(stand_in)[2:]
    assert [request | {"pid": 0} for request in second] == [
        request | {"pid": 0} for request in first
    ]
    assert {request["pid"] for request in first}.isdisjoint(request["pid"] for request in second)
    rectify, odometry = first
    assert rectify["node"] == "/robot1/front/rectify"
    assert rectify["plugin"] == "image_proc/demo::Empty"
    assert rectify["remap"] == ["image:=camera/image_raw"]
    assert rectify["extra"] == {"use_intra_process_comms": True}
    params = {
        "queue": 5,
        "rate": 2.0,
        "name": "left",
        "on": True,
        "list": [1.0, 2.5],
        "words": ["a", "b"],
        "deep.er": 1,
    }
    assert {name: (type(value), value) for name, value in rectify["params"].items()} == {
        name: (type(value), value) for name, value in params.items()
    }
    assert odometry["node"] == "/robot1/odometry"
    lines = {
        notice.process
        for notice in notices
        if isinstance(notice, LogLine) and "is up" in notice.text
    }
    assert lines == {"rectify", "odometry"}, "what a component logs is its own"


@pytest.mark.usefixtures("domain")
def test_a_failed_component_is_named_with_the_containers_text(
    tmp_path: Path, stand_in: Path
) -> None:
    notices = run(tmp_path, ROBOT.replace("demo::Empty", "demo::Missing"), has_found("TF808"))
    assert requested(stand_in)
    expect(
        findings_in(notices)[0],
        "TF808",
        "rectify",
        "/robot1/box",
        "image_proc/demo::Missing",
        "requested plugin name.",
    )


def start_box() -> None:
    """Start a container that has the node ``/robot1/box``."""
    names = ("--ros-args", "-r", "__node:=box", "-r", "__ns:=/robot1")
    processes.start([sys.executable, "-m", "tests.support.stand_in_container", *names])


@pytest.fixture
def theirs(stand_in: Path, domain: Domain) -> Path:  # noqa: ARG001 (the container is in that domain)
    """A container that somebody else started."""
    start_box()
    return stand_in


EXTERNAL = ROBOT.replace("{restart: on-failure, restart_delay: 0.2 s}", "{external: true}")


def test_components_are_unloaded_from_a_container_that_is_external(
    tmp_path: Path, theirs: Path
) -> None:
    notices = run(tmp_path, EXTERNAL, are_ready)
    assert [request["unloaded"] for request in requested(theirs) if "unloaded" in request] == [
        2,
        1,
    ]
    assert findings_in(notices) == []


def test_a_component_whose_node_a_container_has_already_is_refused(
    tmp_path: Path, theirs: Path
) -> None:
    # Its messages are built by then.
    from tfcompose.tf.ros.composition import Container  # noqa: PLC0415

    with open_node("somebody", "") as node:
        container = Container(node, "/robot1/box")
        assert until(lambda: container.load.is_there)
        container.ask_to_load(
            LoadRequest(
                "/robot1/box",
                "/robot1/front/rectify",
                Component("box", "image_proc", "demo::Empty"),
            )
        )
        assert until(container.load.answer)
        container.close()
    notices = run(tmp_path, EXTERNAL, has_found("TF808"))
    expect(
        findings_in(notices)[0],
        "TF808",
        "rectify",
        "/robot1/front/rectify",
        "/robot1/box",
        "unload",
        "1",
    )
    assert len(requested(theirs)) == 1


def test_without_a_launcher_the_guard_loads_into_a_restarted_container(
    tmp_path: Path, stand_in: Path, domain: Domain
) -> None:
    del domain
    compiled = compile_robot(ROBOT, str(tmp_path / "robot.yaml"), library())
    assert compiled.robot
    file = tmp_path / "plan.json"
    file.write_text(write_plan(plan_of(compiled.robot)))

    def started(name: str) -> Any:
        return processes.start([*HERE, "exec", str(file), name])

    started("guard")
    for count in (2, 4):
        box = started("box")
        assert until(partial(has_requests, stand_in, count))
        box.kill()
        box.wait()
    nodes = [request["node"] for request in requested(stand_in)]
    assert nodes == ["/robot1/front/rectify", "/robot1/odometry"] * 2


STOCK = """
tfcompose: 1
robot: rover
frames: {base_link: {}, laser: {parent: base_link, owner: mount, static: true}}
containers: {box: {isolation: isolated}}
processes:
  mount:
    component: tf2_ros/tf2_ros::StaticTransformBroadcasterNode
    container: box
    params: {frame_id: base_link, child_frame_id: laser, translation.x: 0.5}
    publishes: [{parent: base_link, child: laser, off: none}]
"""


@pytest.mark.skipif(
    not shutil.which(
        "component_container_isolated",
        path=os.pathsep.join(
            f"{prefix}/lib/rclcpp_components"
            for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        ),
    ),
    reason="rclcpp_components comes with a distribution only",
)
@pytest.mark.usefixtures("domain")
def test_the_containers_of_rclcpp_components_load_a_component(tmp_path: Path) -> None:
    notices = run(tmp_path, STOCK, are_ready)
    assert findings_in(notices) == []
