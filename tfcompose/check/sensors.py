"""Rules about sensors: calibrations, mounts, optical frames and serial numbers."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from tfcompose.check.placement import CAMERAS, are_mirrored, envelope, is_near, twins
from tfcompose.check.rule import rule
from tfcompose.findings import Finding, Note, finding
from tfcompose.geometry import Pose, angle_between, norm
from tfcompose.model import is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.catalogue import Severity
    from tfcompose.model import Calibration, Edge, MountedSensor, Process, Robot


#: How much nearer to the nominal pose the inverse must be.
_NEARER = 0.9


@rule("TF615")
def calibration_probably_inverse(robot: Robot) -> Iterator[Finding]:
    """A calibration is probably the wrong way round.

    Turned round it is near the pose written beside it; or, where none is, it puts the sensor outside the robot's bodies
    and turned round it would not. Calibration tools differ in whether they write the pose of the camera in the base or
    of the base in the camera. Turn the values round, or name the entry's frames the other way: parent: and child:.
    """
    for edge in robot.edges:
        made, why = edge.calibration, _why_inverse(robot, edge)
        if made and why:
            message = f"{made.name} is probably that of {made.parent} in {made.child}: {why}"
            advice = f"turn the values round, or take it as the pose of {made.parent}: swap parent and child"
            note = Note("the values stand here", made.at)
            severity: Severity = "error" if made.nominal else "warning"
            yield finding("TF615", message, made.named_at, help=advice, notes=[note], severity=severity)


def _why_inverse(robot: Robot, edge: Edge) -> str:
    """Return what shows that the edge's calibration is inverse, or an empty text."""
    made = edge.calibration
    if made is None or made.entry == Pose():
        return ""
    back = made.pose.inverse()
    return _nearer(made, back) if made.nominal else _outside(robot, made, back, edge.sensor)


def _nearer(made: Calibration, back: Pose) -> str:
    far, turned = made.off(back)
    if _times_limit(made, made.pose) > 1 and _times_limit(made, back) < _NEARER * _times_limit(made, made.pose):
        mm, deg = round(far * 1000, 3), round(math.degrees(turned), 3)
        return f"turned round it is {mm:.3g} mm and {deg:.2g} deg from nominal"
    return ""


def _times_limit(made: Calibration, pose: Pose) -> float:
    """Return how far the pose is from nominal, as a multiple of the limit."""
    far, turned = made.off(pose)
    return max(far / (made.limit_m or 1e-9), turned / (made.limit_rad or 1e-9))


def _outside(robot: Robot, made: Calibration, back: Pose, sensor: str | None) -> str:
    box = envelope(robot, made.parent, sensor)
    if box and not is_near(box, made.pose.xyz) and is_near(box, back.xyz):
        return f"it is {norm(made.pose.xyz):.3g} m away and outside the robot, turned round it is not"
    return ""


@rule("TF616")
def calibration_far_from_nominal(robot: Robot) -> Iterator[Finding]:
    """A calibration is farther from the pose written beside it than its limit.

    The sensor was moved, the file is of another robot, the frames are others than meant, or the nominal pose is rough.
    Look which; then mend the one that is wrong, or set the limit: {xyz: 5 cm, rot: 5 deg}.
    """
    for edge in robot.edges:
        made = edge.calibration
        if made is None or _is_all_zero(made) or _why_inverse(robot, edge):
            continue
        far, turned = made.off(made.pose)
        if far > made.limit_m or turned > made.limit_rad:
            off, limit = _distance(far, turned), _distance(made.limit_m, made.limit_rad)
            message = f"{made.name} is {off} from nominal; the limit is {limit}"
            advice = "mend the pose beside it, or set limit: {xyz: …, rot: …}"
            notes = [Note("measured here", made.at)]
            yield finding("TF616", message, made.named_at, help=advice, notes=notes)


def _distance(metres: float, radians: float) -> str:
    return f"{round(metres * 1000, 3):.3g} mm and {round(math.degrees(radians), 3):.2g} deg"


@rule("TF617")
def calibration_all_zero(robot: Robot) -> Iterator[Finding]:
    """A calibration is all zero, and the pose written beside it is not.

    So a file looks that was prepared and never filled. Calibrate, or leave calibration out: then the
    nominal pose holds.
    """
    for edge in robot.edges:
        made = edge.calibration
        if made and _is_all_zero(made):
            message = f"{made.name} is all zero, and its nominal pose is not"
            advice = "calibrate, or leave calibration out"
            yield finding("TF617", message, made.named_at, help=advice, notes=[Note("zero here", made.at)])


def _is_all_zero(made: Calibration) -> bool:
    """Return whether the calibration is all zero where its nominal pose is not."""
    return made.entry == Pose() and made.nominal is not None and max(made.off(Pose())) > 0


@rule("TF618")
def calibration_copied(robot: Robot) -> Iterator[Finding]:
    """Two mounts have the very same calibration values.

    Two measurements never agree to the last digit: one was copied and not changed, or both name one entry. Name each
    mount's own entry, or calibrate the second one.
    """
    first: dict[Pose, Calibration] = {}
    for edge in robot.edges:
        made = edge.calibration
        if made is None or made.entry == Pose():
            continue
        other = first.setdefault(made.entry, made)
        if other is not made:
            message = f"{made.name} has the very values of {other.child}"
            notes = [Note("the other one", other.at), Note("this one", made.at)]
            advice = "give each its own measurement"
            yield finding("TF618", message, made.named_at, help=advice, notes=notes)


@rule("TF620")
def camera_without_optical_frame(robot: Robot) -> Iterator[Finding]:
    """A camera has no optical frame.

    By REP-103 images are stamped with a frame whose z points forward and y down, named ``…_optical_frame``. Without it
    a driver stamps them with the body frame, and everything that projects pixels is turned by 90 degrees twice. Give
    the sensor one: ``frames: {NAME_optical_frame: {parent: NAME_link, rpy: [-90 deg, 0, -90 deg]}}``, or keep the
    preset's name for it.
    """
    children = robot.children()
    for sensor in robot.sensors:
        if sensor.kind not in CAMERAS:
            continue
        seen: set[str] = set()
        waiting = [sensor.mount]
        while waiting:
            frame = waiting.pop()
            if frame not in seen:
                seen.add(frame)
                waiting += [edge.child for edge in children.get(frame, ())]
        by_other_names = any(edge.other_axes for edge in robot.edges if edge.child in seen)
        if not by_other_names and not any(is_optical(frame) for frame in seen):
            message = f"the camera {sensor.name} has no optical frame"
            advice = f"a frame {sensor.name}_optical_frame with rpy: [-90 deg, 0, -90 deg]"
            yield finding("TF620", message, sensor.at, help=advice)


#: What is built into other devices, and so may share their place.
_BUILT_IN_KINDS = frozenset({"imu", "gnss"})
_SAME_M, _SAME_RAD = 1e-6, 1e-6


@rule("TF621", follows="pose")
def sensors_at_one_pose(robot: Robot) -> Iterator[Finding]:
    """Two sensors are mounted at exactly one pose.

    Two bodies cannot be in one place: a mount was copied, and its numbers not changed. Measure the second one. An IMU
    or GNSS receiver may sit inside another sensor, and sensors without any pose yet are left alone; about calibrations
    that were copied is TF618.
    """
    kinds = {sensor.name: sensor.kind for sensor in robot.sensors}
    mounts = [edge for edge in robot.edges if edge.given and edge.sensor in kinds and edge.pose != Pose()]
    first: dict[tuple[object, ...], Edge] = {}
    for edge in mounts:
        if edge.calibration or kinds[edge.sensor or ""] in _BUILT_IN_KINDS:
            continue
        place = (edge.parent, *(round(part / _SAME_M) for part in edge.pose.xyz))
        other = first.setdefault(place, edge)
        turned = angle_between(edge.pose.quat_xyzw, other.pose.quat_xyzw)
        if other is not edge and turned < _SAME_RAD and not are_mirrored(other, edge):
            message = f"{edge.sensor} and {other.sensor} are at one pose on {edge.parent}"
            notes = [Note(f"{other.sensor} is mounted here", other.at)]
            yield finding("TF621", message, edge.at, help="measure one of them again", notes=notes)


@rule("TF622", follows="pose")
def mount_copied(robot: Robot) -> Iterator[Finding]:
    """The left one is where the right one is, or the front one where the rear one is.

    Both have the same position in the same parent, away from the middle: the entry was copied, and its sign forgotten.
    By REP-103 y is positive to the left, x to the front. Example: ``wheel_left_link`` at y = 0.2 has its twin at −0.2.
    """
    given: dict[str, Edge] = {}
    for edge in robot.edges:
        if not edge.given:
            continue
        twin = next((given[name] for name in twins(edge.child) if name in given), None)
        given.setdefault(edge.child, edge)
        if twin and are_mirrored(twin, edge):
            x, y, z = edge.pose.xyz
            message = f"{edge.child} and {twin.child} are both at [{x:g}, {y:g}, {z:g}] in {edge.parent}"
            notes = [Note(f"{twin.child} stands here", twin.at)]
            advice = "y is positive to the left, x to the front: one of the two has another sign"
            yield finding("TF622", message, edge.at, help=advice, notes=notes)


#: Parts of parameter names that tell two devices apart as well as a serial number.
_DEVICE_WORDS = ("serial", "usb_port", "device_type", "device_id", "mxid", "guid", "mac", "ip")


@rule("TF623")
def serial_missing(robot: Robot) -> Iterator[Finding]:
    """Two sensors have the same driver, and one of them does not say which device is its.

    Each driver takes the first device that it finds, so after the next start left and right may be exchanged, or both
    drivers fight for one. Give each its serial number: ``options: {serial: "123456789012"}``. Another parameter that
    names the device (``usb_port_id``, ``device_type``) counts too. Drivers that somebody else starts are left alone.
    """
    processes = {process.name: process for process in robot.processes if process.kind == "run" and process.package}
    groups: dict[tuple[str | None, str | None, str | None], list[MountedSensor]] = {}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if process and sensor.driver == sensor.name and sensor.serial_option:
            groups.setdefault((process.package, process.executable, sensor.serial_option), []).append(sensor)
    for group in groups.values():
        for sensor in group if len(group) > 1 else ():
            if not (sensor.serial or robot.excuses(sensor.name) or _names_device(processes[sensor.driver])):
                other = next(one for one in group if one is not sensor)
                message = f"{sensor.name} and {other.name} have one driver, and {sensor.name} has no serial number"
                notes = [Note(f"{other.name} stands here", other.at)]
                advice = f'options: {{{sensor.serial_option}: "…"}}'
                yield finding("TF623", message, sensor.at, help=advice, notes=notes)


def _names_device(process: Process) -> bool:
    """Whether a parameter names the device."""
    return any(
        word in re.split(r"[_.]", key) or (len(word) > _SHORT_WORD and word in key)
        for key in process.params
        for word in _DEVICE_WORDS
    )


_SHORT_WORD = 3


@rule("TF624")
def serial_used_twice(robot: Robot) -> Iterator[Finding]:
    """Two sensors have one serial number.

    There is one such device, and the second driver does not get it. Read the number off the device or from the vendor's
    tool (``rs-enumerate-devices -s``).
    """
    first: dict[tuple[str, str], MountedSensor] = {}
    for sensor in robot.sensors:
        if sensor.serial:
            other = first.setdefault((sensor.preset.partition("/")[0], str(sensor.serial)), sensor)
            if other is not sensor:
                message = f"{sensor.name} and {other.name} have the serial number {sensor.serial}"
                notes = [Note(f"{other.name} stands here", other.at)]
                yield finding("TF624", message, sensor.at, help="one of the two is another device", notes=notes)
