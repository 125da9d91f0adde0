"""The guard's parameters, as clients of rclpy and the stock ``ros2 param`` read them."""

from __future__ import annotations

import shutil
import threading
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
import rclpy
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from yaml import safe_load

from tests.support import processes
from tests.support.running_robot import RunningRobot
from tests.support.waiting import TIMEOUT_S, until
from tfcompose.guard.plan_parameters import PlanParameters
from tfcompose.model.plan import Plan, PlanProcess, RosSettings

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.support.domains import Domain

pytestmark = pytest.mark.ros
PLAN = Plan(
    "rover",
    "sha256:1",
    None,
    RosSettings(),
    (),
    (PlanProcess("guard", "guard"),),
    file="rover.yaml",
    profiles=("demo", "night"),
    overlays=("overlays/ant.yaml",),
)
NAMES = ["file", "overlays", "profiles", "robot", "spec_digest"]
VALUES = ["rover.yaml", ["overlays/ant.yaml"], ["demo", "night"], "rover", "sha256:1"]


class Client:
    """A client of the test's node, whose parameters a thread of the test answers."""

    def __init__(self, node: Any, parameters: PlanParameters) -> None:
        self.context: Any = Context()
        rclpy.init(context=self.context)
        self._node: Any = rclpy.create_node("client", context=self.context)
        self._executor: Any = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self._node)
        self._is_over = threading.Event()
        self._parameters = parameters
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()
        name = node.get_fully_qualified_name()
        self.parameters = AsyncParameterClient(self._node, name)
        self.setter = self._node.create_client(SetParameters, f"{name}/set_parameters")
        assert self.parameters.wait_for_services(TIMEOUT_S)

    def result(self, future: Any) -> Any:
        self._executor.spin_until_future_complete(future, TIMEOUT_S)
        return future.result()

    def values(self, *names: str) -> list[Any]:
        answer = self.result(self.parameters.get_parameters(list(names)))
        return [rclpy.parameter.parameter_value_to_python(value) for value in answer.values]

    def close(self) -> None:
        self._is_over.set()
        self._thread.join()
        self._node.destroy_node()
        rclpy.shutdown(context=self.context)

    def _answer(self) -> None:
        while not self._is_over.wait(0.01):
            self._parameters.check([], 0.0)


@pytest.fixture
def served(node: Any) -> PlanParameters:
    return PlanParameters(node, PLAN)


@pytest.fixture
def client(node: Any, served: PlanParameters) -> Iterator[Client]:
    made = Client(node, served)
    yield made
    made.close()


def test_they_are_the_origin_of_the_plan_each_with_a_description(client: Client) -> None:
    listed = client.result(client.parameters.list_parameters()).result.names
    assert set(NAMES) < set(listed)
    assert client.values(*NAMES) == VALUES
    described = client.result(client.parameters.describe_parameters([*NAMES, "use_sim_time"]))
    assert all(descriptor.read_only for descriptor in described.descriptors)
    assert all(descriptor.description for descriptor in described.descriptors[:-1])


@pytest.mark.parametrize("name", ["robot", "use_sim_time", "unknown"])
def test_setting_them_is_refused_with_a_reason(client: Client, name: str) -> None:
    make: Any = Parameter
    setting = make(name, value=True if name == "use_sim_time" else "other")
    answer = client.result(client.parameters.set_parameters([setting]))
    (outcome,) = answer.results
    assert not outcome.successful
    assert outcome.reason
    assert client.values("robot", "use_sim_time") == ["rover", False]


def test_they_follow_a_plan_that_the_guard_goes_on_with(
    client: Client, served: PlanParameters
) -> None:
    ros = replace(PLAN.ros, clock="sim")
    served.follow(replace(PLAN, spec_digest="sha256:2", profiles=(), ros=ros))
    names = ("robot", "profiles", "spec_digest", "use_sim_time")
    assert client.values(*names) == ["rover", [], "sha256:2", True]
    described = client.result(client.parameters.describe_parameters(["spec_digest"]))
    assert described.descriptors[0].read_only


def test_a_malformed_request_ends_nothing(client: Client) -> None:
    request = SetParameters.Request(parameters=[ParameterMessage(name="robot")])
    request.parameters[0].value.type = 77
    client.setter.call_async(request)
    assert client.values("robot") == ["rover"]


def test_they_are_offered_once_no_process_waits_for_the_guard(node: Any) -> None:
    class StartingJudge:
        is_over = False

        def is_starting(self, _: float) -> bool:
            return not self.is_over

    judge: Any = StartingJudge()
    served = PlanParameters(node, PLAN)
    served.check([judge], 0.0)
    assert not list(node.services)
    judge.is_over = True
    served.check([judge], 0.0)
    assert len(list(node.services)) == 6


ROBOT = """
tfcompose: 1
robot: rover
ros: {discovery: localhost, namespace: inner}
frames: {base_link: {}, lidar: {parent: base_link, xyz: [0, 0, 1]}}
profiles: {demo: {frames: {mast: {parent: base_link, xyz: [1, 0, 0]}}}}
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ros2") is None, reason="there is no ros2 param")
def test_ros2_param_reads_them(domain: Domain, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    words = ("robot.yaml", "-p", "demo", "--no-live", "-o", "build")
    robot = RunningRobot(tmp_path, *words, env=domain.environment)
    robot.says("tree complete")
    name = "/inner/tfcompose_guard"

    def param(verb: str, *arguments: str) -> str:
        options = ("--no-daemon", "--spin-time", "2")
        command = ("ros2", "param", verb, *options, name, *arguments)
        return processes.run(command, env=domain.environment).stdout

    digest = safe_load((tmp_path / "build/plan.json").read_text("utf-8"))["spec_digest"]
    assert until(lambda: "spec_digest" in param("list"))
    dumped = safe_load(param("dump"))[name]["ros__parameters"]
    assert {key: dumped[key] for key in NAMES} == {
        "file": "robot.yaml",
        "overlays": [],
        "profiles": ["demo"],
        "robot": "rover",
        "spec_digest": digest,
    }
    assert digest in param("get", "spec_digest")
    assert "Read only: true" in param("describe", "profiles")
    assert "successful" not in param("set", "robot", "other")
    assert robot.end() == 0
