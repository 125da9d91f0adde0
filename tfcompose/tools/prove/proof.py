"""All checks of a robot's sensors, with findings and edits of the robot file."""

from __future__ import annotations

import math
import posixpath
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from tfcompose.compiler.mounts.edit import ImmovableError, MountEdits, change_of
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Pose, quat_from_rpy, rpy_from_quat
from tfcompose.foundation.text import plural
from tfcompose.model.robot import is_optical
from tfcompose.tools.prove.frame_ids import judge_frame
from tfcompose.tools.prove.imu import ImuCheck
from tfcompose.tools.prove.messages import CLOUDS, IMU, ODOMETRY, imu_of, odometry_of
from tfcompose.tools.prove.motion import motion_of
from tfcompose.tools.prove.overlap import judge_overlap, pairs_of, points_in_base, residual_of
from tfcompose.tools.prove.ranging import RangingCheck
from tfcompose.tools.prove.rotations import describe_rotation, matrix_of
from tfcompose.tools.prove.travel import track_of
from tfcompose.tools.prove.verdict import CheckResult, SensorVerdict

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.findings import Edit, Span
    from tfcompose.foundation.geometry import Quaternion
    from tfcompose.model.robot import Edge, MountedSensor, Robot
    from tfcompose.spec.load import Source
    from tfcompose.tools.prove.messages import MeasuredTopic, Odometry
    from tfcompose.tools.prove.recording import Measurements


#: The steps to which fitting angles and lengths are rounded, in radians and metres.
_STEP_RAD, _STEP_M = math.radians(0.1), 0.001
#: Keys of a mount that set its rotation, and keys that set its position.
_ROTATIONS = ("rpy", "quat_xyzw", "look", "axis_angle", "matrix", "calibration")
_POSITIONS = ("xyz", "matrix", "calibration")


@dataclass(frozen=True, slots=True)
class Proof:
    """Compares the declared mounts of a robot with the measurements of its sensors."""

    robot: Robot
    #: The robot file with merged overlays.
    source: Source
    #: The texts of editable files, by the file names in spans.
    texts: Mapping[str, str]
    measurements: Measurements
    #: The sensors or frames to check; empty for all.
    only: frozenset[str] = frozenset()
    #: Whether findings have edits of the robot file.
    has_edits: bool = True
    #: The overlays and settings that take precedence over the overlay of one robot, by the file
    #: names in spans.
    overlays: frozenset[str] = frozenset()

    def verdicts(self) -> list[SensorVerdict]:
        """Return the verdicts of all checks, by sensor and topic."""
        poses = self._base_from_frames()
        odometry = self._odometry()
        verdicts = [
            verdict
            for topic in self.measurements.topics.values()
            for verdict in self._verdicts_on(topic, poses, odometry)
        ]
        received = {verdict.sensor for verdict in verdicts}
        verdicts += self._overlaps(verdicts, poses, odometry)
        verdicts += [
            SensorVerdict(name, "", CheckResult("data", "cannot tell", self._why_missing(name)))
            for name in sorted(self._only or {sensor.name for sensor in self._measuring()})
            if name not in received
        ]
        return sorted(verdicts, key=lambda verdict: (verdict.sensor, verdict.topic))

    @property
    def _only(self) -> set[str]:
        """The sensors, and frames of none, to check; empty for all."""
        return {self._sensor_name(name) for name in self.only}

    def _measuring(self) -> Iterator[MountedSensor]:
        """Yield the sensors that have messages to check."""
        kinds = {"imu", "camera", "stereo", "rgbd", "lidar2d", "lidar3d"}
        return (sensor for sensor in self.robot.sensors if sensor.kind in kinds)

    def _verdicts_on(
        self, topic: MeasuredTopic, poses: dict[str, Pose], odometry: Odometry | None
    ) -> Iterator[SensorVerdict]:
        declared, sensor = self._declared(topic)
        frame = self._frame_of(topic)
        if sensor is None:
            sensor = self._sensor_of(frame)
        name = sensor.name if sensor else frame or topic.name
        if self.only and name not in self._only:
            return
        if topic.unreadable:
            messages = plural(sum(topic.unreadable.values()), "message")
            reason = f"{messages} on {topic.name} cannot be read as {topic.type}"
            yield SensorVerdict(name, topic.name, CheckResult("data", "cannot tell", reason))
        if topic.type == ODOMETRY or not topic.frames:
            return
        judgements = [judge_frame(self.robot, topic, declared, poses)]
        if topic.type == IMU and frame and judgements[0].answer == "agrees":
            judgements += self._judge_imu(topic, frame, poses, odometry)
        if topic.type in CLOUDS and frame and judgements[0].answer == "agrees":
            judgements += self._judge_ranges(topic, frame, poses, odometry)
        for judgement in judgements:
            yield self._verdict(name, topic, judgement, sensor, frame, poses)

    def _sensor_of(self, frame: str) -> MountedSensor | None:
        """Return the sensor that has a frame."""
        return next((each for each in self.robot.sensors if frame in _frames(each)), None)

    def _sensor_name(self, name: str) -> str:
        """Return the sensor's name for that of its frame; other names stay as they are."""
        sensor = self._sensor_of(name)
        names = {each.name for each in self.robot.sensors}
        return sensor.name if sensor and name not in names else name

    def _why_missing(self, name: str) -> str:
        """Return why there are no measurements of a sensor."""
        shared = (
            topic.name
            for topic in self.measurements.topics.values()
            for frame in self.robot.frames
            if self.robot.final(frame) in topic.frames and self._sensor_name(frame) == name
        )
        topic_name = next(shared, None)
        reason = f"its messages on {topic_name} come with those of other frames"
        return reason if topic_name else "no message came"

    def _frame_of(self, topic: MeasuredTopic) -> str:
        """Return the declared frame of a topic's messages; empty if there is none."""
        final = self.robot.final
        return next((name for name in self.robot.frames if final(name) == topic.frame), "")

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
        """Yield the full names of a driver's topic, for each node of the driver."""
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
        """Return the motion of the base.

        If several topics contain odometry, use the topic with the most measurements.
        """
        measured = [
            odometry_of(topic)
            for topic in self.measurements.topics.values()
            if topic.type == ODOMETRY and self._is_of_base(topic)
        ]
        best = max(measured, key=lambda each: len(each.stamps_s), default=None)
        return best if best and len(best.stamps_s) else None

    def _is_of_base(self, topic: MeasuredTopic) -> bool:
        """Return whether odometry moves the base, or a frame that is fixed level to the base."""
        poses = self._base_from_frames()
        names = [name for name in poses if self.robot.final(name) == topic.child_frame]
        return any(abs(poses[name].quat_xyzw[3]) > 1 - 1e-9 for name in names)

    def _base_from_frames(self) -> dict[str, Pose]:
        """Return the known poses in the base of frames that are fixed to the base."""
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
        limit = self._limit("TF650")
        for judgement in ImuCheck(motion, matrix_of(pose.quat_xyzw), limit).judge():
            if odometry is None and judgement.check in {"yaw rate", "heading"}:
                reason = f"no usable odometry of {self.robot.base} came"
                yield replace(judgement, text=reason)
                continue
            yield judgement

    def _judge_ranges(
        self, topic: MeasuredTopic, frame: str, poses: dict[str, Pose], odometry: Odometry | None
    ) -> Iterator[CheckResult]:
        if frame not in poses:
            reason = f"{frame} is not fixed to {self.robot.base or 'one base'}"
            yield CheckResult("floor", "cannot tell", reason)
            return
        pose, ground = poses[frame], poses.get(self.robot.ground or "")
        yield from RangingCheck(
            topic.clouds,
            track_of(odometry) if odometry else None,
            base_from_frame=matrix_of(pose.quat_xyzw),
            xyz=np.array(pose.xyz),
            ground_z=ground.xyz[2] if ground else None,
            limit_rad=self._limit("TF650"),
            limit_m=self._limit("TF653"),
        ).judge()

    def _overlaps(
        self, verdicts: list[SensorVerdict], poses: dict[str, Pose], odometry: Odometry | None
    ) -> Iterator[SensorVerdict]:
        """Yield the results for pairs of sensors that see the same surfaces.

        Sensors of which another check differs, or whose floor is unknown, are left out.
        """
        checked = {
            verdict.topic: verdict.sensor
            for verdict in verdicts
            if verdict.judgement.check == "floor" and verdict.judgement.answer == "agrees"
        }
        for verdict in verdicts:
            if verdict.judgement.answer == "differs":
                checked.pop(verdict.topic, None)
        path = track_of(odometry) if odometry else None
        for first, second in combinations(sorted(checked), 2):
            topics = [self.measurements.topics[name] for name in (first, second)]
            frames = [self._frame_of(topic) for topic in topics]
            names = (checked[first], checked[second])
            pairs = pairs_of(topics[0].clouds, topics[1].clouds, path)
            clouds = [
                points_in_base(pair, [poses[name] for name in frames], path) for pair in pairs
            ]
            judgement = judge_overlap(
                residual_of(clouds),
                names,
                np.array(poses[frames[1]].xyz),
                self._limit("TF654"),
                self._limit("TF650"),
            )
            sensor = next((each for each in self.robot.sensors if each.name == names[1]), None)
            yield self._verdict(names[1], topics[1], judgement, sensor, frames[1], poses)

    def _limit(self, code: str) -> float:
        """Return the limit of a code's measurement, in radians or metres."""
        default = CATALOGUE[code].limit
        return self.robot.limits.get(code, default[0] if default else 0.0)

    def _verdict(  # noqa: PLR0913, PLR0917 (what a finding is made of)
        self,
        name: str,
        topic: MeasuredTopic,
        judgement: CheckResult,
        sensor: MountedSensor | None,
        frame: str,
        poses: dict[str, Pose],
    ) -> SensorVerdict:
        verdict = SensorVerdict(name, topic.name, judgement)
        if judgement.answer != "differs":
            return verdict
        message = f"{name} {judgement.text}"
        notes = [Note(f"{topic.name}, {topic.type}")]
        edge = self._mount_edge(sensor, frame)
        span: Span | None = edge.span if edge else sensor.span if sensor else None
        rotation, xyz = judgement.base_from_frame_xyzw, judgement.base_from_frame_xyz
        if edge is not None and judgement.code in {"TF650", "TF653", "TF654"}:
            span = self._pose_span(edge, _ROTATIONS if judgement.code == "TF650" else _POSITIONS)
        if edge is None or (rotation is None and xyz is None):
            problem = finding(judgement.code, message, span, help=judgement.help, notes=notes)
            return replace(verdict, finding=problem)
        declared = poses[frame]
        base_from_frame = Pose(xyz or declared.xyz, rotation or declared.quat_xyzw)
        mount = edge.child
        base_from_parent = poses[mount] @ edge.pose.inverse()
        mount_from_frame = poses[mount].inverse() @ declared
        new = base_from_parent.inverse() @ base_from_frame @ mount_from_frame.inverse()
        if xyz is None:
            new = Pose(edge.pose.xyz, _rounded(new.quat_xyzw))
            advice = describe_rotation(new.quat_xyzw)
        else:
            x, y, z = (round(value / _STEP_M) * _STEP_M for value in new.xyz)
            new = Pose((x, y, z), edge.pose.quat_xyzw)
            advice = f"xyz: [{x:.3f}, {y:.3f}, {z:.3f}]"
        advice += f" of {mount} in {edge.parent} would fit{judgement.help}"
        edits, reason = self._edits(mount, new) if self.has_edits else ((), "")
        if reason:
            notes.append(Note(f"--fix leaves it: {reason}"))
        problem = finding(judgement.code, message, span, help=advice, notes=notes, edits=edits)
        return replace(verdict, finding=problem, fit=(mount, new))

    def _mount_edge(self, sensor: MountedSensor | None, frame: str) -> Edge | None:
        """Return the edge that mounts a sensor or the body of a camera."""
        child = sensor.mount if sensor else frame
        edge = self.robot.parent_edge(child)
        while edge is not None and is_optical(edge.child):
            edge = self.robot.parent_edge(edge.parent)
        return edge

    def _pose_span(self, edge: Edge, keys: tuple[str, ...]) -> Span:
        """Return the span of the first existing key, or the span of the mount."""
        for key in keys:
            span = self.source.exact_span((*edge.entry, key))
            if span is not None:
                return span
        return edge.span

    def _edits(self, child: str, pose: Pose) -> tuple[tuple[Edit, ...], str]:
        """Return the edits that set a frame's pose in its parent, or why there are none."""
        try:
            change = change_of(self.robot, self.source, self.texts, child, pose)
        except ImmovableError as error:
            return (), str(error)
        if isinstance(change, MountEdits):
            return change.edits, ""
        measured = self.source.exact_span((*change.entry, "calibration"))
        spans = (change.span, measured) if measured else (change.span,)
        if change.entry and not any(span.file in self.overlays for span in spans):
            return (), f"{change.reason}; --fix --as NAME writes an overlay"
        return (), change.reason


def _rounded(quat_xyzw: Quaternion) -> Quaternion:
    """Return the rotation with roll, pitch and yaw rounded to ``_STEP_RAD``."""
    roll, pitch, yaw = (round(angle / _STEP_RAD) * _STEP_RAD for angle in rpy_from_quat(quat_xyzw))
    return quat_from_rpy(roll, pitch, yaw)


def _frames(sensor: MountedSensor) -> tuple[str, ...]:
    return (sensor.mount, *sensor.frames)
