"""All checks of a robot's sensors, and their findings with edits of the robot file."""

from __future__ import annotations

import math
import posixpath
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.compiler.mounts.edit import ImmovableError, MountEdits, change_of
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Pose, quat_from_rpy, rpy_from_quat
from tfcompose.model.robot import is_optical
from tfcompose.tools.prove.frame_ids import judge_frame
from tfcompose.tools.prove.imu import ImuCheck, describe_rotation, matrix_of
from tfcompose.tools.prove.messages import IMU, ODOMETRY, imu_of, odometry_of
from tfcompose.tools.prove.motion import motion_of
from tfcompose.tools.prove.verdict import CheckResult, SensorVerdict

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.findings import Edit, Finding, Span
    from tfcompose.foundation.geometry import Quaternion
    from tfcompose.model.robot import Edge, MountedSensor, Robot
    from tfcompose.spec.load import Source
    from tfcompose.tools.prove.messages import MeasuredTopic, Odometry
    from tfcompose.tools.prove.recording import Measurements


#: Fitting angles are rounded to this, in radians.
_STEP_RAD = math.radians(0.1)


@dataclass(frozen=True, slots=True)
class Proof:
    """A robot's declared mounts, and what its sensors measure."""

    robot: Robot
    #: The robot's source, with overlays merged over it.
    source: Source
    #: The texts of editable files, by their names in spans.
    texts: Mapping[str, str]
    measurements: Measurements
    #: Sensors or frames to check; empty: all.
    only: frozenset[str] = frozenset()

    def verdicts(self) -> list[SensorVerdict]:
        """Return the verdicts of all checks, by sensor and topic."""
        poses = self._base_from_frames()
        odometry = self._odometry()
        verdicts = [
            verdict
            for topic in self.measurements.topics.values()
            if topic.type != ODOMETRY and topic.frames
            for verdict in self._verdicts_on(topic, poses, odometry)
            if not self.only or verdict.sensor in self.only
        ]
        received = {verdict.sensor for verdict in verdicts}
        verdicts += [
            SensorVerdict(name, "", CheckResult("data", "cannot tell", "no message came"))
            for name in sorted(self.only or {sensor.name for sensor in self._measuring()})
            if name not in received
        ]
        return sorted(verdicts, key=lambda verdict: (verdict.sensor, verdict.topic))

    def _measuring(self) -> Iterator[MountedSensor]:
        """Yield the sensors whose messages can be checked."""
        kinds = {"imu", "camera", "stereo", "rgbd", "lidar2d", "lidar3d"}
        return (sensor for sensor in self.robot.sensors if sensor.kind in kinds)

    def _verdicts_on(
        self, topic: MeasuredTopic, poses: dict[str, Pose], odometry: Odometry | None
    ) -> Iterator[SensorVerdict]:
        declared, sensor = self._declared(topic)
        frame = next((name for name in self.robot.frames if self._is_frame(topic, name)), "")
        if sensor is None:
            sensor = next((each for each in self.robot.sensors if frame in _frames(each)), None)
        name = sensor.name if sensor else frame or topic.name
        judgements = [judge_frame(self.robot, topic, declared, poses)]
        if topic.type == IMU and frame and judgements[0].answer == "agrees":
            judgements += self._judge_imu(topic, frame, poses, odometry)
        for judgement in judgements:
            found = self._finding(name, topic, judgement, sensor, frame, poses)
            yield SensorVerdict(name, topic.name, judgement, found)

    def _is_frame(self, topic: MeasuredTopic, name: str) -> bool:
        return self.robot.final(name) == topic.frame

    def _declared(self, topic: MeasuredTopic) -> tuple[str, MountedSensor | None]:
        """Return the frame that a preset's driver uses on this topic, and the sensor."""
        for sensor in self.robot.sensors:
            for published in sensor.topics:
                if published.type == topic.type and topic.name in self._names(
                    sensor, published.name
                ):
                    return self.robot.final(published.frame), sensor
        return "", None

    def _names(self, sensor: MountedSensor, name: str) -> Iterator[str]:
        """Yield the full names that a driver's topic has, for each of its nodes."""
        process = next((each for each in self.robot.processes if each.name == sensor.driver), None)
        if process is None:
            return
        for node in process.nodes:
            full = node if node.startswith("/") else f"/{node}"
            if name.startswith("~/"):
                topic = posixpath.join(full, name[2:])
            else:
                topic = posixpath.join(posixpath.dirname(full), name)
            target = process.remap.get(name, process.remap.get(topic, topic))
            yield posixpath.join(posixpath.dirname(full), target)

    def _odometry(self) -> Odometry | None:
        """Return the motion of the base: of several topics, that with the most messages."""
        topics = [
            topic
            for topic in self.measurements.topics.values()
            if topic.type == ODOMETRY and topic.rows and self._is_of_base(topic)
        ]
        best = max(topics, key=lambda topic: len(topic.rows), default=None)
        return odometry_of(best) if best else None

    def _is_of_base(self, topic: MeasuredTopic) -> bool:
        """Return whether odometry is that of the base, or of what is fixed level above it."""
        poses = self._base_from_frames()
        names = [name for name in poses if self.robot.final(name) == topic.child_frame]
        return any(abs(poses[name].quat_xyzw[3]) > 1 - 1e-9 for name in names)

    def _base_from_frames(self) -> dict[str, Pose]:
        """Return the poses in the base of frames that are fixed to it and known."""
        robot = self.robot
        if robot.base is None:
            return {}
        roots = poses_in_roots(robot, {})
        inverse = roots[robot.base].inverse()
        return {
            name: inverse @ roots[name] for name in robot.frames if self._is_fixed_to_base(name)
        }

    def _is_fixed_to_base(self, frame: str) -> bool:
        passed: set[str] = set()
        while frame != self.robot.base:
            edge = self.robot.parent_edge(frame)
            if edge is None or frame in passed or edge.joint or not edge.pose_known:
                return False
            if edge.kind != "static":
                return False
            passed.add(frame)
            frame = edge.parent
        return True

    def _judge_imu(
        self, topic: MeasuredTopic, frame: str, poses: dict[str, Pose], odometry: Odometry | None
    ) -> Iterator[CheckResult]:
        if frame not in poses:
            reason = f"{frame} is not fixed to {self.robot.base or 'one base'}"
            yield CheckResult("gravity", "cannot tell", reason)
            return
        pose = poses[frame]
        motion = motion_of(imu_of(topic), odometry, np.array(pose.xyz))
        code = CATALOGUE["TF650"]
        limit = self.robot.limits.get("TF650", code.limit[0] if code.limit else 0.0)
        for judgement in ImuCheck(motion, matrix_of(pose.quat_xyzw), limit).judge():
            if odometry is None and judgement.check in {"yaw rate", "heading"}:
                reason = f"no odometry of {self.robot.base} came"
                yield replace(judgement, text=reason)
                continue
            yield judgement

    def _finding(  # noqa: PLR0913, PLR0917 (what a finding is made of)
        self,
        name: str,
        topic: MeasuredTopic,
        judgement: CheckResult,
        sensor: MountedSensor | None,
        frame: str,
        poses: dict[str, Pose],
    ) -> Finding | None:
        if judgement.answer != "differs":
            return None
        message = f"{name} {judgement.text}"
        notes = [Note(f"{topic.name}, {topic.type}")]
        edge = self._mount_edge(sensor, frame)
        span: Span | None = edge.span if edge else sensor.span if sensor else None
        if judgement.code != "TF650" or edge is None:
            return finding(judgement.code, message, span, help=judgement.help, notes=notes)
        span = self._rotation_span(edge)
        rotation = judgement.base_from_frame_xyzw
        if rotation is None:
            advice = judgement.help
            return finding(judgement.code, message, span, help=advice, notes=notes)
        base_from_frame = Pose(poses[frame].xyz, rotation)
        mount = edge.child
        base_from_parent = poses[mount] @ edge.pose.inverse()
        mount_from_frame = poses[mount].inverse() @ poses[frame]
        new = base_from_parent.inverse() @ base_from_frame @ mount_from_frame.inverse()
        new = Pose(edge.pose.xyz, _rounded(new.quat_xyzw))
        advice = f"{describe_rotation(new.quat_xyzw)} of {mount} in {edge.parent} would fit"
        advice += judgement.help
        edits, reason = self._edits(mount, new)
        if reason:
            notes.append(Note(f"--fix leaves it: {reason}"))
        return finding(judgement.code, message, span, help=advice, notes=notes, edits=edits)

    def _mount_edge(self, sensor: MountedSensor | None, frame: str) -> Edge | None:
        """Return the edge that mounts a sensor, or a camera's body."""
        child = sensor.mount if sensor else frame
        edge = self.robot.parent_edge(child)
        while edge is not None and is_optical(edge.child):
            edge = self.robot.parent_edge(edge.parent)
        return edge

    def _rotation_span(self, edge: Edge) -> Span:
        for key in ("rpy", "quat_xyzw", "look", "axis_angle", "matrix", "calibration"):
            span = self.source.exact_span((*edge.entry, key))
            if span is not None:
                return span
        return edge.span

    def _edits(self, child: str, pose: Pose) -> tuple[tuple[Edit, ...], str]:
        """Return the edits that give a frame this pose in its parent, or why there are none."""
        try:
            change = change_of(self.robot, self.source, self.texts, child, pose)
        except ImmovableError as error:
            return (), str(error)
        if isinstance(change, MountEdits):
            return change.edits, ""
        return (), change.reason


def _rounded(quat_xyzw: Quaternion) -> Quaternion:
    """Return the rotation with roll, pitch and yaw rounded to what a check can tell."""
    roll, pitch, yaw = (round(angle / _STEP_RAD) * _STEP_RAD for angle in rpy_from_quat(quat_xyzw))
    return quat_from_rpy(roll, pitch, yaw)


def _frames(sensor: MountedSensor) -> tuple[str, ...]:
    return (sensor.mount, *sensor.frames)
