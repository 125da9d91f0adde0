"""Verdicts on the kept recording of all sensors, with messages that lack something."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from tests.support.bags import STORE
from tests.support.simulated_rover import RECORDING, robot_file
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.model.robot import Robot  # noqa: TC001 (named in annotations)
from tfcompose.spec.load import Source  # noqa: TC001 (as above)
from tfcompose.tf.bags import Recording
from tfcompose.tools.prove.messages import CLOUDS, IMU, ODOMETRY, TYPES
from tfcompose.tools.prove.proof import Proof
from tfcompose.tools.prove.recording import Measurements
from tfcompose.tools.prove.verdict import SensorVerdict  # noqa: TC001 (as above)

Sent = list[tuple[str, str, bytes]]
#: Changes a message, of which there have been so many of its type, and may return other bytes.
Fault = Callable[[Any, int], "bytes | None"]


@dataclass(frozen=True)
class Drive:
    """The robot, and the messages of its recording."""

    robot: Robot
    source: Source
    sent: Sent

    def of_types(self, *types: str) -> Sent:
        return [each for each in self.sent if each[1] in types]

    def prove(
        self, messages: Sent, only: Iterable[str] = (), **faults: Fault
    ) -> dict[tuple[str, str], SensorVerdict]:
        """Return the verdicts by sensor and check; faults are named by the message's type."""
        measurements, counts = Measurements(), dict.fromkeys(TYPES, 0)
        for topic, type_, data in messages:
            fault, changed = faults.get(type_.rpartition("/")[2]), data
            counts[type_] += 1
            if fault:
                message: Any = STORE.deserialize_cdr(data, type_)
                changed = fault(message, counts[type_]) or b""
                changed = changed or bytes(STORE.serialize_cdr(message, type_))
            measurements.take(topic, type_, changed)
        names = frozenset(only)
        proof = Proof(self.robot, self.source, {}, measurements, names, has_edits=False)
        return {(each.sensor, each.judgement.check): each for each in proof.verdicts()}


@pytest.fixture(scope="module")
def drive() -> Drive:
    compiled = compile_robot(robot_file(), "robot.yaml", library())
    assert compiled.robot is not None
    messages = Recording(str(RECORDING)).messages_of_types(TYPES)
    sent = [(message.topic, message.type, message.data) for message in messages]
    return Drive(compiled.robot, compiled.sources[0], sent)


def answers(verdicts: dict[tuple[str, str], SensorVerdict]) -> dict[tuple[str, str], str]:
    return {key: verdict.judgement.answer for key, verdict in verdicts.items()}


def lacks(quantity: str, value: float, covariance: float) -> Fault:
    def change(message: Any, _: int) -> None:
        getattr(message, quantity).x = value
        setattr(message, f"{quantity}_covariance", np.array([covariance, *[0.0] * 8]))

    return change


@pytest.mark.parametrize(("value", "covariance"), [(0.0, -1.0), (np.nan, 0.0), (1e300, 0.0)])
@pytest.mark.parametrize(
    ("quantity", "judged_by"),
    [("linear_acceleration", {"yaw rate"}), ("angular_velocity", {"gravity", "heading"})],
)
def test_an_imu_without_a_quantity_is_judged_by_the_rest(
    quantity: str,
    judged_by: set[str],
    value: float,
    covariance: float,
    drive: Drive,
) -> None:
    messages = drive.of_types(IMU, ODOMETRY)
    verdicts = drive.prove(messages, ["imu"], Imu=lacks(quantity, value, covariance))
    checks = {check: verdict.judgement for (_, check), verdict in verdicts.items()}
    assert checks.keys() == {"frame", "gravity", "yaw rate", "heading"}
    agreeing = {name for name, check in checks.items() if check.answer == "agrees"}
    assert agreeing == {"frame", *judged_by}
    for name in checks.keys() - agreeing:
        assert checks[name].answer == "cannot tell"
        assert quantity.rpartition("_")[2] in checks[name].text
        assert "odometry" not in checks[name].text


def test_a_rate_without_odometry_at_its_times_does_not_blame_the_base(drive: Drive) -> None:
    def later(message: Any, _: int) -> None:
        message.header.stamp.sec += 1000

    verdicts = drive.prove(drive.of_types(IMU, ODOMETRY), Odometry=later)
    for check in ("yaw rate", "heading"):
        judgement = verdicts["imu", check].judgement
        assert judgement.answer == "cannot tell"
        assert "times of odometry" in judgement.text


def test_odometry_without_speeds_leaves_what_needs_none(drive: Drive) -> None:
    def silence(message: Any, _: int) -> None:
        message.twist.twist.linear.x = np.nan

    messages = [each for each in drive.sent if each[0] in {"/imu", "/odom", "/front/points"}]
    judged = answers(drive.prove(messages, Odometry=silence))
    assert judged["imu", "gravity"] == "agrees"
    assert judged["imu", "yaw rate"] == judged["front", "forward"] == "cannot tell"
    assert "differs" not in judged.values()


@pytest.mark.parametrize("name", ["imu", "imu_link"])
def test_a_frame_on_the_command_line_is_its_sensor(name: str, drive: Drive) -> None:
    judged = answers(drive.prove(drive.of_types(IMU, ODOMETRY), [name]))
    assert judged["imu", "gravity"] == "agrees"
    assert {sensor for sensor, _ in judged} == {"imu"}
    missing = answers(drive.prove(drive.of_types(ODOMETRY), [name]))
    assert missing == {("imu", "data"): "cannot tell"}


def truncate(message: Any, _: int) -> bytes:
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))[:60]


def as_integers(message: Any, _: int) -> None:
    for each in message.fields:
        each.datatype = 4


@pytest.mark.parametrize(
    ("sensor", "type_", "fault"),
    [("imu", IMU, truncate), ("front", CLOUDS[1], truncate), ("front", CLOUDS[1], as_integers)],
)
def test_messages_that_cannot_be_read_are_counted(
    sensor: str, type_: str, fault: Fault, drive: Drive
) -> None:
    messages = drive.of_types(type_)
    verdicts = drive.prove(messages, [sensor], **{type_.rpartition("/")[2]: fault})
    ((key, verdict),) = verdicts.items()
    assert (key, verdict.judgement.answer) == ((sensor, "data"), "cannot tell")
    count = sum(topic == verdict.topic for topic, *_ in messages)
    assert (
        verdict.judgement.text == f"{count} messages on {verdict.topic} cannot be read as {type_}"
    )


@pytest.mark.parametrize(
    ("sensor", "second", "code"),
    [
        ("imu", "camera_link", "TF652"),
        ("imu", "ghost", "TF652"),
        ("front", "ghost", "TF652"),
        ("front", "camera_link", ""),
    ],
)
def test_frames_that_share_a_topic_are_not_judged_as_one(
    sensor: str, second: str, code: str, drive: Drive
) -> None:
    def share(message: Any, count: int) -> None:
        if count % 5 == 0:
            message.header.frame_id = second

    messages = [each for each in drive.sent if each[0] in {f"/{sensor}", f"/{sensor}/points"}]
    verdicts = drive.prove(messages, [sensor], Imu=share, PointCloud2=share)
    ((key, verdict),) = verdicts.items()
    assert key == (sensor, "frame")
    assert verdict.judgement.code == code
    assert verdict.judgement.answer == ("differs" if code else "cannot tell")
    assert f"{sensor}_link and {second}" in verdict.judgement.text


def test_a_sensor_on_the_topic_of_another_has_sent_messages(drive: Drive) -> None:
    def share(message: Any, count: int) -> None:
        if count % 5 == 0:
            message.header.frame_id = "rear_link"

    messages = [each for each in drive.sent if each[0] == "/front/points"]
    (verdict,) = drive.prove(messages, ["rear"], PointCloud2=share).values()
    assert verdict.judgement.answer == "cannot tell"
    assert "/front/points" in verdict.judgement.text
