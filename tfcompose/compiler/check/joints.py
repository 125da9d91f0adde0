"""Rules about joints: limits, axes, mimicking joints, and use by ros2_control."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from tfcompose.compiler.check.poses import twins
from tfcompose.compiler.check.rule import rule
from tfcompose.foundation.findings import Finding, Note, did_you_mean, finding
from tfcompose.foundation.geometry import rotate
from tfcompose.model.robot import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.findings import Span
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Edge, Joint, Robot


@rule("TF701", of_urdf=True)
def mimic_without_master(robot: Robot) -> Iterator[Finding]:
    joints = [edge.joint for edge in robot.edges if edge.joint]
    names = {joint.name for joint in joints}
    fixed = {edge.joint_name for edge in robot.edges if edge.joint_name} - names
    for joint in joints:
        if (
            joint.mimic is not None
            and joint.mimic not in names
            and not robot.tolerates(joint.mimic)
        ):
            message = f"{joint.name}: unknown joint {joint.mimic} under mimic"
            advice = "name a joint that moves, or remove mimic"
            if joint.mimic in fixed:
                message = f"{joint.name} mimics {joint.mimic}, which is fixed"
            else:
                advice = did_you_mean(joint.mimic, sorted(names - {joint.name}), advice)
            yield finding("TF701", message, joint.mimic_at or joint.span, help=advice)


@rule("TF702", of_urdf=True)
def mimic_loop(robot: Robot) -> Iterator[Finding]:
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    done: set[str] = set()
    for start in joints:
        path: dict[str, None] = {}  # keys only: keeps the order, and lookup is fast
        name: str | None = start
        while name in joints and name not in done and name not in path:
            path[name] = None
            name = joints[name].mimic
        if name in path:
            loop = list(path)[list(path).index(name) :]
            notes = [Note(f"{member} is defined here", joints[member].span) for member in loop[1:]]
            message = f"joints mimic each other: {' → '.join([*loop, loop[0]])}"
            yield finding(
                "TF702",
                message,
                joints[loop[0]].span,
                notes=notes,
                help="remove mimic from one of them",
            )
        done.update(path)


@rule("TF704", of_urdf=True)
def joint_without_limits(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.type == "continuous":
            continue
        ends = (
            [end for end in (joint.limit.lower, joint.limit.upper) if end is not None]
            if joint.limit
            else []
        )
        lax = joint.limit is not None and robot.is_foreign(
            joint.span
        )  # a <limit> of a URDF may lack one end
        if len(ends) == 2 or (lax and ends):  # noqa: PLR2004 (lower and upper)
            continue
        usual = (
            "lower: -90 deg, upper: 90 deg" if joint.type == "revolute" else "lower: 0, upper: 0.1"
        )
        advice = f"for example limit: {{{usual}}}"
        if robot.is_foreign(joint.span):
            advice = 'for example <limit lower="-1.57" upper="1.57" effort="10" velocity="1"/>'
        advice += "; a joint without limits is continuous" if joint.type == "revolute" else ""
        message = f"{joint.type} joint {joint.name} has no lower and upper limit"
        severity: Severity = "warning" if lax else "error"
        span = joint.limit_at or joint.span
        yield finding("TF704", message, span, help=advice, severity=severity)


@rule("TF705", of_urdf=True)
def inverted_limits(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        if (
            joint is None
            or joint.limit is None
            or joint.limit.lower is None
            or joint.limit.upper is None
        ):
            continue
        if joint.limit.lower > joint.limit.upper and joint.type != "continuous":
            unit = "m" if joint.type == "prismatic" else "rad"
            message = (
                f"{joint.name}: lower {joint.limit.lower:g} {unit} is above upper"
                f" {joint.limit.upper:g} {unit}"
            )
            span = joint.limit_at or joint.span
            yield finding("TF705", message, span, help="swap lower and upper, or check the sign")


@rule("TF706", of_urdf=True)
def zero_limit(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.limit is None:
            continue
        driven = joint.type != "continuous" and joint.mimic is None
        values = {
            "velocity": joint.limit.velocity,
            "effort": joint.limit.effort if driven else None,
        }
        for name, value in values.items():
            if value is not None and value <= 0:
                message = f"{joint.name}: {name} limit is {value:g}"
                advice = f"give the motor's {name}, or remove it"
                yield finding("TF706", message, joint.limit_at or joint.span, help=advice)


#: Tolerance for an axis with two decimals: [0.71, 0.71, 0] has length 1.004.
_AXIS_TOLERANCE = 0.02


@rule("TF707", of_urdf=True)
def axis_not_unit(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        if joint and abs(joint.axis_length - 1) > _AXIS_TOLERANCE:
            axis = ", ".join(f"{part:.4g}" for part in joint.axis)
            message = f"{joint.name}: axis has length {joint.axis_length:.4g}, not 1"
            span = joint.axis_at or joint.span
            yield finding("TF707", message, span, help=f"the unit vector is [{axis}]")


#: Maximum number of joints to follow.
_MOST_MIMICS = 100


@rule("TF708", of_urdf=True)
def mimic_chain(robot: Robot) -> Iterator[Finding]:
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    for joint in joints.values():
        middle = joints.get(joint.mimic or "")
        if (
            middle is None
            or middle.mimic not in joints
            or middle.mimic in {joint.name, middle.name}
        ):
            continue
        if joints[middle.mimic].mimic is not None and _loops(joints, joint.name):
            continue
        multiplier = joint.multiplier * middle.multiplier
        offset = joint.multiplier * middle.offset + joint.offset
        offset -= multiplier * joints[middle.mimic].zero_offset  # not in the file's values
        end = f", offset: {offset:g}" if offset else ""
        message = f"{joint.name} mimics {middle.name}, which mimics {middle.mimic}"
        notes = [Note(f"{middle.name} is defined here", middle.span)]
        advice = f"write mimic: {{joint: {middle.mimic}, multiplier: {multiplier:g}{end}}}"
        if robot.is_foreign(joint.span):
            end = f' offset="{offset:g}"' if offset else ""
            advice = f'write <mimic joint="{middle.mimic}" multiplier="{multiplier:g}"{end}/>'
        yield finding("TF708", message, joint.span, help=advice, notes=notes)


def _loops(joints: dict[str, Joint], name: str) -> bool:
    """Return whether following ``mimic`` from the joint leads into a loop, which TF702 reports."""
    passed: set[str] = set()
    while name in joints and name not in passed and len(passed) < _MOST_MIMICS:
        passed.add(name)
        name = joints[name].mimic or ""
    return name in passed


@rule("TF715")
def joint_without_owner(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.free
        if joint and edge.owner in BUILT_IN:
            message = (
                f"{joint.type} joint {joint.name} has no owner, and joint states cannot place"
                f" {edge.child}"
            )
            advice = "add owner: the process that publishes the edge"
            if robot.is_foreign(joint.span):  # URDF has no owners
                advice = (
                    "convert the file with tfcompose import, and give the joint an owner there"
                )
            yield finding("TF715", message, edge.owner_at or joint.span, help=advice)


#: Soft limits that exceed both limits by half a turn disable the safety controller.
_FAR_OUTSIDE_RAD = math.pi


@rule("TF716", of_urdf=True)
def soft_limit_outside(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        safety, limit = (joint.safety, joint.limit) if joint else (None, None)
        if joint is None or safety is None:
            continue
        low, high = safety.soft_lower_limit, safety.soft_upper_limit
        hard = (limit.lower, limit.upper) if limit else (None, None)
        inside = (hard[0] is None or hard[0] <= low) and (hard[1] is None or high <= hard[1])
        if low + _FAR_OUTSIDE_RAD < (hard[0] or 0) and (hard[1] or 0) < high - _FAR_OUTSIDE_RAD:
            continue  # the author disabled the soft limits on purpose
        if joint.type != "continuous" and not (inside and low < high):
            message = f"{joint.name}: soft limits {low:g} to {high:g} are not within its limits"
            advice = "set soft_lower_limit and soft_upper_limit to values between lower and upper"
            yield finding("TF716", message, joint.span, help=advice)


@rule("TF717", of_urdf=True)
def interface_claimed_twice(robot: Robot) -> Iterator[Finding]:
    first: dict[tuple[str, str, str], tuple[str, Span]] = {}
    for hardware in robot.hardware:
        for component in hardware.components:
            for way, interfaces in (("command", component.command), ("state", component.state)):
                for interface in interfaces:
                    claim = (component.name, way, interface.name)
                    claimant, span = first.setdefault(claim, (hardware.name, component.span))
                    if span != component.span:
                        message = (
                            f"{hardware.name} and {claimant} both have the {way} interface"
                            f" {claim[0]}/{claim[2]}"
                        )
                        notes = [Note(f"{claimant} has it here", span)]
                        yield finding(
                            "TF717",
                            message,
                            component.span,
                            help="remove it from one of them",
                            notes=notes,
                        )


@rule("TF718", of_urdf=True)
def mimic_joint_commanded(robot: Robot) -> Iterator[Finding]:
    mimics = {
        edge.joint.name: edge.joint
        for edge in robot.edges
        if edge.joint and edge.joint.mimic is not None
    }
    for hardware in robot.hardware:
        for component in hardware.components:
            joint = mimics.get(component.name)
            if joint and component.kind == "joint" and component.command:
                names = ", ".join(interface.name for interface in component.command)
                message = (
                    f"{joint.name} mimics {joint.mimic}, but {hardware.name} commands its {names}"
                )
                notes = [Note(f"{joint.name} is defined here", joint.span)]
                yield finding(
                    "TF718",
                    message,
                    component.span,
                    help="keep only its state interfaces",
                    notes=notes,
                )


_MOST_LISTED = 5


@rule("TF728", of_urdf=True)
def joint_named_like_a_frame(robot: Robot) -> Iterator[Finding]:
    named = {
        edge.joint_name: edge.joint_at or edge.span
        for edge in robot.edges
        if edge.joint_name in robot.frames
    }
    named.pop("", None)
    if named:
        first, *further = named
        kind = "link" if first in robot.links else "frame"
        notes = [Note(f"the {kind} is defined here", robot.frames[first])]
        notes += [Note(f"so has {name}", named[name]) for name in further[:_MOST_LISTED]]
        more = f", and {len(further)} more {'have' if further[1:] else 'has'}" if further else ""
        message = f"joint {first} has the same name as a {kind}{more}"
        yield finding(
            "TF728", message, named[first], help=f"name it {first}_joint, for example", notes=notes
        )


@rule("TF731", of_urdf=True)
def negative_damping(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.dynamics is None:
            continue
        for name, value in (
            ("damping", joint.dynamics.damping),
            ("friction", joint.dynamics.friction),
        ):
            if value < 0:
                message = f"{joint.name}: {name} is {value:g}"
                yield finding("TF731", message, joint.span, help="give 0 or more, or remove it")


#: Verb phrases for the axes of joints that do not rotate.
_ABOUT = {"prismatic": "moves along", "planar": "lies across"}


@rule("TF736", of_urdf=True)
def joint_without_axis(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint or edge.free
        if joint is None or joint.axis_at or joint.type == "floating":
            continue
        about = _ABOUT.get(joint.type, "turns about")
        message = f"{joint.type} joint {joint.name} has no axis, and so {about} x"
        advice = "write axis: [1, 0, 0] if x is right, else for example [0, 0, 1]"
        if robot.is_foreign(joint.span):
            advice = 'write <axis xyz="1 0 0"/> if x is right, else for example "0 0 1"'
        yield finding("TF736", message, joint.span, help=advice)


#: If a revolute finger or slide moves by less than this, in rad, its limits are in metres.
_LEAST_REVOLUTE_RAD = 0.12
#: Names of joints that usually slide. Prismatic limits that span a fraction of a full turn are
#: probably in rad.
_SLIDES = re.compile(
    r"finger|grip|jaw|claw|slid|prismatic|linear|rail|telescop|lift|elevator|extension"
)
_ANGLES_RAD = (math.tau, math.pi, math.pi / 2, 3 * math.pi / 2)
_ROUNDED = 0.002
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


@rule("TF734", of_urdf=True)
def limits_of_another_type(robot: Robot) -> Iterator[Finding]:
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.limit is None:
            continue
        low, high = joint.limit.lower, joint.limit.upper
        if low is None or high is None or low >= high:
            continue
        place, span = joint.limit_at or joint.span, high - low
        foreign = robot.is_foreign(joint.span)
        if (
            joint.type == "revolute"
            and span < _LEAST_REVOLUTE_RAD
            and _SLIDES.search(f"{joint.name} {edge.child}".lower())
        ):
            message = (
                f"revolute joint {joint.name} turns by {math.degrees(span):.2g} deg only, from"
                f" {low:g} to {high:g} rad"
            )
            advice = f"if it slides by {span:g} m, write type{'=' if foreign else ': '}"
            advice += '"prismatic"' if foreign else "prismatic"
            yield finding("TF734", message, place, help=advice)
        elif joint.type == "prismatic" and any(
            abs(abs(end) - part) < _ROUNDED * part for end in (low, high) for part in _ANGLES_RAD
        ):
            message = (
                f"prismatic joint {joint.name} slides from {low:g} to {high:g} m, parts of a turn"
            )
            advice = f"if it turns, write type{'=' if foreign else ': '}"
            advice += '"revolute"' if foreign else "revolute"
            yield finding("TF734", message, place, help=advice)


_FINGER = re.compile(r"finger|grip|jaw|claw|knuckle")


@rule("TF735", of_urdf=True)
def fingers_move_alike(robot: Robot) -> Iterator[Finding]:
    first: dict[str, Edge] = {}
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or not _FINGER.search(f"{joint.name} {edge.child}".lower()):
            continue
        twin = next((first[name] for name in twins(edge.child) if name in first), None)
        first[edge.child] = edge
        if twin is None or twin.parent != edge.parent or twin.joint is None:
            continue
        opening, twin_opening = _opening(edge), _opening(twin)
        if sum(a * b for a, b in zip(opening, twin_opening, strict=True)) < _ALIKE:
            continue
        is_same_place = edge.pose == twin.pose
        verb = "slide" if joint.type == "prismatic" else "turn"
        message = f"{twin.child} and {edge.child} both {verb} the same way when they open"
        if is_same_place:
            message += ", and from the same place"
        advice = "change the sign of the axis, or of the multiplier, of one of them"
        notes = [Note(f"{twin.joint.name} is defined here", twin.joint.span)]
        yield finding("TF735", message, joint.axis_at or joint.span, help=advice, notes=notes)


def _opening(edge: Edge) -> Vector:
    """Return the direction in which the finger opens from its zero pose, in the parent frame.

    The limits determine the sign; for a mimicking joint, the multiplier does.
    """
    joint = edge.joint
    if joint is None:
        return (0.0, 0.0, 0.0)
    sign = 1.0
    if joint.mimic is not None:
        sign = math.copysign(1.0, joint.multiplier)
    elif joint.limit and (joint.limit.upper or 0.0) + (joint.limit.lower or 0.0) < 0:
        sign = -1.0
    x, y, z = rotate(edge.pose.quat_xyzw, joint.axis)
    return (sign * x, sign * y, sign * z)


#: The cosine of 30 degrees.
_ALIKE = 0.87


@rule("TF737", of_urdf=True)
def position_outside_limits(robot: Robot) -> Iterator[Finding]:
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    for hardware in robot.hardware:
        for component in hardware.components:
            joint = joints.get(component.name)
            if component.kind != "joint" or joint is None:
                continue
            for interface in component.state:
                start = interface.params.get("initial_value", "")
                if interface.name != "position" or not _NUMBER.fullmatch(start):
                    continue
                if limits := joint.exceeded_limits(float(start)):
                    message = (
                        f"{joint.name} starts at {joint.in_unit(float(start))}, outside its"
                        f" limits, {limits}"
                    )
                    advice = "correct initial_value, or the limits"
                    yield finding("TF737", message, component.span, help=advice)
