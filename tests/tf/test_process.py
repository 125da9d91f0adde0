from collections.abc import Callable
from pathlib import Path

import pytest

from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.signals import Stop
from tfcompose.model.plan import PlanProcess, Simulation
from tfcompose.tf.process import OwnProcess, read_own, start
from tfcompose.tf.ros.environment import RosError


def _last_error(capsys: pytest.CaptureFixture[str]) -> str:
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def never(own_process: OwnProcess, _: Stop) -> None:
    raise AssertionError(f"{own_process.process.name} begins")


def test_wrong_arguments_end_with_code_2_and_the_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert start(["plan.json"], "static", never) == 2
    assert "usage: tfcompose static " in _last_error(capsys)


def test_a_missing_plan_ends_with_code_2_and_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert start(["no/such/plan.json", "joints"], "joints", never) == 2
    assert "no/such/plan.json" in _last_error(capsys)


def test_what_is_no_plan_ends_with_code_2(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "plan.json"
    file.write_text("{}")
    assert start([str(file), "static"], "static", never) == 2
    assert "not a plan" in _last_error(capsys)


def test_a_process_that_the_plan_does_not_have_is_refused(write: Callable[..., Path]) -> None:
    file = str(write([], PlanProcess("static", "static")))
    with pytest.raises(RejectedError, match="other"):
        read_own([file, "other"], "static")
    with pytest.raises(RejectedError, match=r"static\b.*\bjoints"):
        read_own([file, "static"], "joints")


def test_a_simulation_without_a_rate_is_refused(write: Callable[..., Path]) -> None:
    file = str(write([], PlanProcess("body", "simulate", simulate=Simulation("fixed", 0.0))))
    with pytest.raises(RejectedError, match=r"processes\[0\]\.simulate\.rate"):
        read_own([file, "body"], "simulate")


def test_a_node_has_the_name_and_the_namespace_of_the_plan(write: Callable[..., Path]) -> None:
    file = str(write([], PlanProcess("static", "static", nodes=("/fleet/r1/frames",))))
    own_process = read_own([file, "static", "--ros-args", "-r", "/tf:=tf"], "static")
    assert (own_process.namespace, own_process.node_name, own_process.ros_args) == (
        "/fleet/r1",
        "frames",
        ["-r", "/tf:=tf"],
    )
    assert own_process.description.parent == own_process.file.parent


@pytest.mark.parametrize(
    ("ros_args", "clock"),
    [
        ((), "wall"),
        (("-p", "use_sim_time:=True"), "sim"),
        (("--param", "use_sim_time:=true", "-p", "use_sim_time:=false"), "wall"),
        (("-r", "use_sim_time:=true"), "wall"),
        (("-p", "use_sim_time:=3"), "wall"),
    ],
)
def test_its_clock_is_that_of_its_arguments(
    write: Callable[..., Path], ros_args: tuple[str, ...], clock: str
) -> None:
    file = str(write([], PlanProcess("static", "static")))
    assert read_own([file, "static", "--ros-args", *ros_args], "static").plan.ros.clock == clock


def test_without_ros_it_ends_with_code_1_and_says_what_to_install(
    write: Callable[..., Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tfcompose.tf.process.missing_ros", lambda: "no rclpy: install it")
    assert start([str(write([], PlanProcess("static", "static"))), "static"], "static", never) == 1
    assert _last_error(capsys) == "no rclpy: install it\n"


def test_what_ros_refuses_ends_with_code_1_and_its_words(
    write: Callable[..., Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(_process: OwnProcess, _stop: Stop) -> None:
        raise RosError("ROS cannot start a node")

    monkeypatch.setattr("tfcompose.tf.process.missing_ros", lambda: None)
    monkeypatch.setattr("tfcompose.tf.process.child_environment", lambda *_, **__: {})
    file = str(write([], PlanProcess("static", "static")))
    assert start([file, "static"], "static", refused) == 1
    assert _last_error(capsys) == "ROS cannot start a node\n"
