"""Rules about sensors: calibrations, mounts and serial numbers."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from tfcompose.compiler.check.poses import (
    are_mirrored,
    are_swapped,
    envelope,
    is_near,
    poses_in_base,
    side_of,
    twins,
)
from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.geometry import IDENTITY_XYZW, OPTICAL_XYZW, Pose, angle_between, norm
from tfcompose.foundation.text import list_names
from tfcompose.model.robot import is_optical

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.model.robot import Calibration, Edge, MountedSensor, Process, Robot


#: A calibration is probably inverted if its inverse is closer to the nominal pose than the
#: calibration by this factor, and within this multiple of the limit.
_NEARER, _NEAR = 0.9, 3.0


@rule("TF615")
def calibration_probably_inverse(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        measured, why = edge.calibration, _why_inverse(robot, edge)
        if measured and why:
            message = (
                f"{measured.name} is probably the pose of {measured.parent} in {measured.child}:"
                f" {why}"
            )
            advice = _if_inverse(measured)
            if measured.nominal:
                advice += "; if the file is right, correct the pose that is written beside it"
            note = Note("measured here", measured.span)
            yield finding("TF615", message, measured.named_at, help=advice, notes=[note])


def _if_inverse(measured: Calibration) -> str:
    return (
        f"if the file holds the pose of {measured.parent}, swap parent and child, or invert its"
        " values"
    )


def _why_inverse(robot: Robot, edge: Edge) -> str:
    """Return the evidence that the edge's calibration is inverted; empty without evidence."""
    measured = edge.calibration
    if measured is None or measured.entry == Pose():
        return ""
    back = measured.pose.inverse()
    return (
        _nearer(measured, back)
        if measured.nominal
        else _outside(robot, measured, back, edge.sensor)
    )


def _nearer(measured: Calibration, back: Pose) -> str:
    times, inverted_times = _times_limit(measured, measured.pose), _times_limit(measured, back)
    if times > 1 and inverted_times < min(_NEAR, _NEARER * times):
        direct, inverted = (_distance(*measured.off(pose)) for pose in (measured.pose, back))
        return f"{direct} from nominal, and {inverted} if inverted"
    return ""


def _times_limit(measured: Calibration, pose: Pose) -> float:
    """Return the pose's distance from the nominal pose, as a multiple of the limit."""
    far, turned = measured.off(pose)
    return max(far / (measured.limit_m or 1e-9), turned / (measured.limit_rad or 1e-9))


def _outside(robot: Robot, measured: Calibration, back: Pose, sensor: str | None) -> str:
    box = envelope(robot, measured.parent, sensor)
    if box and not is_near(box, measured.pose.xyz) and is_near(box, back.xyz):
        return f"it is {norm(measured.pose.xyz):.3g} m away, outside the robot; inverted it is not"
    return ""


@rule("TF616")
def calibration_far_from_nominal(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        measured = edge.calibration
        if measured is None or _is_all_zero(measured) or _why_inverse(robot, edge):
            continue
        far, turned = measured.off(measured.pose)
        if far > measured.limit_m or turned > measured.limit_rad:
            off, limit = _distance(far, turned), _distance(measured.limit_m, measured.limit_rad)
            message = f"{measured.name} is {off} from nominal; the limit is {limit}"
            advice = "correct the nominal pose, or raise limit: {xyz: …, rot: …}"
            x, y, z = measured.pose.xyz
            if far > measured.limit_m >= measured.off(Pose((x / 1000, y / 1000, z / 1000)))[0]:
                advice = "the file's positions are probably in millimetres: convert them to metres"
            elif swapped := _with_w_first(measured):
                advice = f"the file's quaternion probably has w first: write {swapped}"
            elif swapped := _nominal_with_w_first(measured):
                advice = f"the pose beside it probably has w first: write quat_xyzw: {swapped}"
            elif is_optical(measured.child) and _is_turned(measured, _OPTICAL):
                advice = (
                    f"the pose beside it probably has x forward: that of {measured.child}, an"
                    " optical frame, has z forward"
                )
            elif is_optical(measured.child) and _is_turned(measured, _OPTICAL.inverse()):
                advice = (
                    f"the pose beside it is probably that of {measured.child}: name it as place"
                )
            notes = [Note("measured here", measured.span)]
            yield finding("TF616", message, measured.named_at, help=advice, notes=notes)


def _with_w_first(measured: Calibration) -> str:
    """Return the calibration's quaternion in the intended order, if its file lists w first.

    Empty unless that order brings the rotation within the limit around the nominal pose.
    """
    w, x, y, z = measured.entry.quat_xyzw
    swapped = Pose(measured.entry.xyz, (x, y, z, w))
    pose = swapped.inverse() if measured.inverted else swapped
    is_far = measured.off(measured.pose)[1] > measured.limit_rad
    if not is_far or measured.off(pose)[1] > measured.limit_rad:
        return ""
    return f"x: {x:g}, y: {y:g}, z: {z:g}, w: {w:g}"


def _nominal_with_w_first(measured: Calibration) -> str:
    """Return the nominal quaternion in the intended order, if the robot file lists w first.

    Empty unless that order brings the nominal rotation within the limit around the calibration.
    """
    w, x, y, z = measured.nominal.quat_xyzw if measured.nominal else measured.pose.quat_xyzw
    turned = angle_between(measured.pose.quat_xyzw, (x, y, z, w))
    return f"[{x:g}, {y:g}, {z:g}, {w:g}]" if turned <= measured.limit_rad else ""


_OPTICAL = Pose((0.0, 0.0, 0.0), OPTICAL_XYZW)


def _is_turned(measured: Calibration, rotation: Pose) -> bool:
    """Return whether the nominal pose fits the calibration after another rotation."""
    turned = (measured.nominal or measured.pose) @ rotation
    return angle_between(measured.pose.quat_xyzw, turned.quat_xyzw) <= measured.limit_rad


#: Angles of at least this are rounded to degrees.
_ROUNDED_FROM_DEG = 10


def _distance(metres: float, radians: float) -> str:
    length = f"{round(metres * 1000, 3):.3g} mm" if metres < 1 else f"{metres:.3g} m"
    angle_deg = round(math.degrees(radians), 3)
    return (
        f"{length} and {angle_deg:.2g} deg"
        if angle_deg < _ROUNDED_FROM_DEG
        else f"{length} and {angle_deg:.0f} deg"
    )


@rule("TF617")
def calibration_all_zero(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        measured = edge.calibration
        if measured and _is_all_zero(measured):
            message = f"{measured.name} is all zero, but its nominal pose is not"
            advice = "calibrate the sensor, or remove calibration"
            yield finding(
                "TF617",
                message,
                measured.named_at,
                help=advice,
                notes=[Note("measured here", measured.span)],
            )


def _is_all_zero(measured: Calibration) -> bool:
    """Return whether the calibration is all zero although the nominal pose is not."""
    return (
        measured.entry == Pose() and measured.nominal is not None and max(measured.off(Pose())) > 0
    )


@rule("TF618")
def calibration_copied(robot: Robot) -> Iterator[Finding]:
    first: dict[Pose, Calibration] = {}
    for edge in robot.edges:
        measured = edge.calibration
        if measured is None or measured.entry == Pose():
            continue
        first_measured = first.setdefault(measured.entry, measured)
        if first_measured is not measured:
            message = f"{measured.name} has the same values as that of {first_measured.child}"
            notes = [
                Note(f"{first_measured.child} was measured here", first_measured.span),
                Note("measured here", measured.span),
            ]
            advice = "name each mount's own entry, or calibrate the second one"
            yield finding("TF618", message, measured.named_at, help=advice, notes=notes)


#: Kinds of sensors that other devices contain, and that may share those devices' pose.
_BUILT_IN_KINDS = frozenset({"imu", "gnss"})
_SAME_M, _SAME_RAD = 1e-6, 1e-6
#: If the parent is rotated by more, left and right in the parent differ from left and right in the
#: base.
_TURNED_RAD = 0.02


@rule("TF621", follows="pose")
def sensors_at_one_pose(robot: Robot) -> Iterator[Finding]:
    kinds = {sensor.name: sensor.kind for sensor in robot.sensors}
    mounts = [
        edge
        for edge in robot.edges
        if edge.declared and edge.sensor in kinds and edge.pose != Pose()
    ]
    first: dict[tuple[object, ...], Edge] = {}
    for edge in mounts:
        if edge.calibration or kinds[edge.sensor or ""] in _BUILT_IN_KINDS:
            continue
        position = (edge.parent, *(round(part / _SAME_M) for part in edge.pose.xyz))
        first_edge = first.setdefault(position, edge)
        turned = angle_between(edge.pose.quat_xyzw, first_edge.pose.quat_xyzw)
        if first_edge is not edge and turned < _SAME_RAD and not are_mirrored(first_edge, edge):
            message = (
                f"{edge.sensor} and {first_edge.sensor} are at the same pose in {edge.parent}"
            )
            notes = [Note(f"{first_edge.sensor} is mounted here", first_edge.span)]
            yield finding(
                "TF621",
                message,
                edge.xyz_at or edge.span,
                help="measure the pose of one of them",
                notes=notes,
            )


@rule("TF622", of_urdf=True, follows="pose")
def mount_copied(robot: Robot) -> Iterator[Finding]:
    mounts: dict[str, Edge] = {}
    for edge in robot.edges:
        if not edge.declared:
            continue
        candidates = [mounts[name] for name in twins(edge.child) if name in mounts]
        twin = next((candidate for candidate in candidates if are_mirrored(candidate, edge)), None)
        mounts.setdefault(edge.child, edge)
        if twin:
            axis, sign = side_of(edge.child, twin.child)
            wrong, right = (edge, twin) if edge.pose.xyz[axis] * sign < 0 else (twin, edge)
            x, y, z = edge.pose.xyz
            message = (
                f"{wrong.child} and {right.child} are both at [{x:g}, {y:g}, {z:g}] in"
                f" {edge.parent}"
            )
            notes = [Note(f"{right.child} is defined here", right.xyz_at or right.span)]
            advice = (
                f"change the sign of {'xy'[axis]} of {wrong.child}: y is positive to the left,"
                " x to the front"
            )
            yield finding("TF622", message, wrong.xyz_at or wrong.span, help=advice, notes=notes)


@rule("TF625", of_urdf=True, follows="pose")
def sides_swapped(robot: Robot) -> Iterator[Finding]:
    poses = poses_in_base(robot, moving=True)
    edges: dict[str, Edge] = {}
    for edge in robot.edges:
        base = poses.get(edge.parent)
        is_fixed = edge.joint.type == "continuous" if edge.joint else edge.kind == "static"
        if (
            not edge.declared
            or not is_fixed
            or base is None
            or angle_between(base.quat_xyzw, IDENTITY_XYZW) > _TURNED_RAD
        ):
            continue
        candidates = [edges[name] for name in twins(edge.child) if name in edges]
        swapped = (
            candidate
            for candidate in candidates
            if candidate.parent == edge.parent and are_swapped(candidate, edge)
        )
        twin = next(swapped, None)
        edges[edge.child] = edge
        if twin:
            axis = "xy"[side_of(edge.child, twin.child)[0]]
            places = " and ".join(
                f"{side.child} at {axis} = {side.pose.xyz['xy'.index(axis)]:g}"
                for side in (twin, edge)
            )
            message = f"{places} in {edge.parent}: each is on the other's side"
            notes = [Note(f"{twin.child} is defined here", twin.xyz_at or twin.span)]
            advice = "swap the signs, or the names: y is positive to the left, x to the front"
            yield finding("TF625", message, edge.xyz_at or edge.span, help=advice, notes=notes)


#: Parts of parameter names whose values, like a serial number, identify a device.
_DEVICE_WORDS = ("serial", "usb_port", "device_type", "device_id", "mxid", "guid", "mac", "ip")


@rule("TF623")
def serial_missing(robot: Robot) -> Iterator[Finding]:
    processes = {
        process.name: process
        for process in robot.processes
        if process.kind == "run" and process.package
    }
    groups: dict[tuple[str | None, str | None, str | None], list[MountedSensor]] = {}
    for sensor in robot.sensors:
        process = processes.get(sensor.driver)
        if process and sensor.driver == sensor.name and sensor.serial_option:
            groups.setdefault(
                (process.package, process.executable, sensor.serial_option), []
            ).append(sensor)
    for group in groups.values():
        nameless = [
            sensor
            for sensor in group
            if not (
                sensor.serial
                or robot.tolerates(sensor.name)
                or _names_device(processes[sensor.driver])
            )
        ]
        if len(group) == 1 or not nameless:
            continue
        sensor = nameless[0]
        siblings = [sibling for sibling in group if sibling is not sensor]
        same = "the same driver"
        if len(nameless) > 1:
            names = list_names([each.name for each in nameless])
            message = f"{names} have no serial numbers, and {same}"
        else:
            message = f"{sensor.name} has no serial number, and {siblings[0].name} has {same}"
        notes = [Note(f"{sibling.name} is defined here", sibling.span) for sibling in siblings]
        advice = f'add options: {{{sensor.serial_option}: "…"}}'
        yield finding("TF623", message, sensor.span, help=advice, notes=notes)


def _names_device(process: Process) -> bool:
    """Return whether a parameter of the process identifies its device."""
    return any(
        hint in re.split(r"[_.]", key) or (len(hint) > _SHORT_WORD and hint in key)
        for key in process.params
        for hint in _DEVICE_WORDS
    )


_SHORT_WORD = 3


@rule("TF624")
def serial_used_twice(robot: Robot) -> Iterator[Finding]:
    first: dict[tuple[str, str], MountedSensor] = {}
    visited: set[str] = set()
    for sensor in robot.sensors:
        if sensor.serial:
            first_sensor = first.setdefault(
                (sensor.preset.partition("/")[0], str(sensor.serial)), sensor
            )
            if first_sensor is not sensor:
                visited.add(sensor.driver)
                message = (
                    f"{sensor.name} and {first_sensor.name} have the same serial number"
                    f" {sensor.serial}"
                )
                notes = [Note(f"{first_sensor.name} is defined here", first_sensor.span)]
                advice = "correct the number of one of the two"
                yield finding("TF624", message, sensor.span, help=advice, notes=notes)
    yield from _addresses_used_twice(robot, visited)


#: Names of parameters that contain a device's address.
_ADDRESSES = re.compile(
    r"(?:.*_)?(?:port|ip|ip_addr|ip_address|host|hostname|device|device_id|device_path"
    r"|serial_no|serial_number|video_device|usb_port_id|mxid|guid)"
)
#: Device files that only one process can open: serial ports and cameras.
_EXCLUSIVE = re.compile(r"/dev/(?:tty|video|serial/)\w.*")
_ARGUMENT = re.compile(r"([\w.]+):=(.+)")


def _addresses_used_twice(robot: Robot, visited: set[str]) -> Iterator[Finding]:
    """Yield a finding for each process that opens the device of an earlier process on its host."""
    addresses = {
        process.name: _addresses(process)
        for process in robot.processes
        if process.kind in {"run", "component", "external"} and process.name not in visited
    }
    before: list[Process] = []
    for process in robot.processes:
        mine = addresses.get(process.name)
        if not mine:
            continue
        for peer in before:
            key = _shared_parameter(process, peer, mine, addresses[peer.name])
            if key:
                message = f"{process.name} and {peer.name} have the same {key} {mine[key]}"
                notes = [Note(f"{peer.name} is defined here", peer.span)]
                advice = f"correct {key} of one of the two"
                severity: Severity = "error" if _EXCLUSIVE.fullmatch(mine[key]) else "warning"
                yield finding(
                    "TF624", message, process.span, help=advice, notes=notes, severity=severity
                )
                break
        before.append(process)


def _addresses(process: Process) -> dict[str, str]:
    """Return the device addresses in the process's parameters and arguments, by name."""
    arguments = [
        match.groups() for argument in process.argv if (match := _ARGUMENT.fullmatch(argument))
    ]
    settings = [
        *arguments,
        *((process.ros_nodes[0].flat_params if process.ros_nodes else {}).items()),
    ]
    named = ((key.rpartition(".")[2], str(value)) for key, value in settings)
    return {key: value for key, value in named if value and _ADDRESSES.fullmatch(key)}


def _shared_parameter(
    process: Process, peer: Process, mine: dict[str, str], theirs: dict[str, str]
) -> str | None:
    """Return the parameter that names the same device for both processes, None without one."""
    if process.host != peer.host:
        return None
    for key, value in mine.items():
        if _EXCLUSIVE.fullmatch(value) and value in theirs.values():
            return key
    program = _program(process)
    are_alike = any(program) and program == _program(peer) and mine == theirs
    return next(iter(mine)) if are_alike else None


def _program(process: Process) -> tuple[object, ...]:
    if process.component:
        return (process.component.package, process.component.plugin)
    command = () if process.package or process.launch else process.argv[:1]
    return (process.package, process.executable, process.launch, *command)
