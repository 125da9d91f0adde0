"""Rules about joints: limits, axes, mimics, and what ros2_control does with them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.check.rule import rule
from tfcompose.findings import Finding, Note, did_you_mean, finding
from tfcompose.model import BUILT_IN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.catalogue import Severity
    from tfcompose.findings import Span
    from tfcompose.model import Joint, Robot


@rule("TF701", of_urdf=True)
def mimic_without_master(robot: Robot) -> Iterator[Finding]:
    """A joint follows a joint that is not there or does not move.

    Its frame would never appear: nobody sends a position for a joint that is fixed or misspelt. Name a joint that
    moves, or leave ``mimic`` out.
    """
    joints = [edge.joint for edge in robot.edges if edge.joint]
    names = {joint.name for joint in joints}
    fixed = {edge.joint_name for edge in robot.edges if edge.joint_name} - names
    for joint in joints:
        if joint.mimic is not None and joint.mimic not in names and not robot.excuses(joint.mimic):
            message = f"{joint.name} follows {joint.mimic}, which is {'fixed' if joint.mimic in fixed else 'no joint'}"
            advice = "follow a joint that moves, or leave mimic out"
            if joint.mimic not in fixed:
                advice = did_you_mean(joint.mimic, sorted(names - {joint.name}), advice)
            yield finding("TF701", message, joint.at, help=advice)


@rule("TF702", of_urdf=True)
def mimic_loop(robot: Robot) -> Iterator[Finding]:
    """Joints follow each other in a circle.

    None of them has a position of its own.
    """
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    done: set[str] = set()
    for start in joints:
        path: dict[str, None] = {}  # in order, and quick to look up
        name: str | None = start
        while name in joints and name not in done and name not in path:
            path[name] = None
            name = joints[name].mimic
        if name in path:
            loop = list(path)[list(path).index(name) :]
            notes = [Note(f"{other} is one of them", joints[other].at) for other in loop[1:]]
            message = f"joints follow each other: {' → '.join([*loop, loop[0]])}"
            yield finding("TF702", message, joints[loop[0]].at, notes=notes, help="one of them must lead")
        done.update(path)


@rule("TF704", of_urdf=True)
def joint_without_limits(robot: Robot) -> Iterator[Finding]:
    """A revolute or prismatic joint does not say how far it goes.

    URDF requires a limit for these types, and readers refuse the whole robot without it. A joint that turns without
    end is ``continuous``. A URDF that somebody else wrote, and that gives effort and velocity only, is a warning:
    readers take 0 for lower and upper, so that planners and simulators hold the joint there.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.type == "continuous":
            continue
        ends = [end for end in (joint.limit.lower, joint.limit.upper) if end is not None] if joint.limit else []
        lax = joint.limit is not None and joint.at.file in robot.foreign  # where one end may be left out
        if len(ends) == 2 or (lax and ends):  # noqa: PLR2004 (lower and upper)
            continue
        usual = "lower: -90 deg, upper: 90 deg" if joint.type == "revolute" else "lower: 0, upper: 0.1"
        message = f"the {joint.type} joint {joint.name} has no lower and upper limit"
        severity: Severity = "warning" if lax else "error"
        yield finding("TF704", message, joint.at, help=f"limit: {{{usual}}}", severity=severity)


@rule("TF705", of_urdf=True)
def inverted_limits(robot: Robot) -> Iterator[Finding]:
    """A joint's lower limit is above its upper one.

    No position is allowed: planners find nothing, and simulators refuse the robot or clamp the joint to one end.
    Exchange the two, or check the sign: ``limit: {lower: -90 deg, upper: 90 deg}``.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.limit is None or joint.limit.lower is None or joint.limit.upper is None:
            continue
        if joint.limit.lower > joint.limit.upper and joint.type != "continuous":
            unit = "m" if joint.type == "prismatic" else "rad"
            message = f"{joint.name}: lower is {joint.limit.lower:g} {unit}, above upper, {joint.limit.upper:g} {unit}"
            yield finding("TF705", message, joint.at, help="exchange lower and upper")


@rule("TF706", of_urdf=True)
def zero_limit(robot: Robot) -> Iterator[Finding]:
    """A joint's greatest velocity or effort is 0.

    With velocity 0 it never moves: MoveIt refuses to time a path, and simulators hold the joint. With effort 0 a motor
    has no force. Give the motor's figures, or leave the key out: then nothing is said about them. Joints that follow
    another one, and wheels that turn freely, may well have no effort.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.limit is None:
            continue
        driven = joint.type != "continuous" and joint.mimic is None
        values = {"velocity": joint.limit.velocity, "effort": joint.limit.effort if driven else None}
        for name, value in values.items():
            if value is not None and value <= 0:
                message = f"{joint.name}: the greatest {name} is {value:g}"
                advice = f"give the motor's {name}, or leave it out"
                yield finding("TF706", message, joint.at, help=advice)


#: What two written decimals can be off: [0.71, 0.71, 0] has length 1.004.
_AXIS_TOLERANCE = 0.02


@rule("TF707", of_urdf=True)
def axis_not_unit(robot: Robot) -> Iterator[Finding]:
    """A joint's axis does not have length 1.

    An axis is a direction. tfcompose normalises it; other readers of a URDF scale the motion by its length, and often a
    digit or a sign was lost. Write [0, 0, 1], or [0.7071, 0, 0.7071].
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint and abs(joint.axis_length - 1) > _AXIS_TOLERANCE:
            axis = ", ".join(f"{part:.4g}" for part in joint.axis)
            message = f"{joint.name}: the axis has length {joint.axis_length:.4g}, not 1"
            yield finding("TF707", message, joint.at, help=f"of length 1: [{axis}]")


#: No more joints are followed than this.
_MOST_MIMICS = 100


@rule("TF708", of_urdf=True)
def mimic_chain(robot: Robot) -> Iterator[Finding]:
    """A joint follows a joint that follows another one.

    tfcompose follows such a chain to its end. The stock robot_state_publisher goes through the joints once, in
    alphabetical order, so a joint that comes before the one it follows stays behind or never appears; Gazebo and
    ros2_control do not follow chains at all. Let it follow the leader itself, with the multipliers multiplied.
    """
    joints = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint}
    for joint in joints.values():
        middle = joints.get(joint.mimic or "")
        if middle is None or middle.mimic not in joints or middle.mimic in {joint.name, middle.name}:
            continue
        if joints[middle.mimic].mimic is not None and _loops(joints, joint.name):
            continue
        multiplier = joint.multiplier * middle.multiplier
        offset = joint.multiplier * middle.offset + joint.offset
        end = f", offset: {offset:g}" if offset else ""
        message = f"{joint.name} follows {middle.name}, which follows {middle.mimic}"
        notes = [Note(f"{middle.name} stands here", middle.at)]
        advice = f"mimic: {{joint: {middle.mimic}, multiplier: {multiplier:g}{end}}}"
        yield finding("TF708", message, joint.at, help=advice, notes=notes)


def _loops(joints: dict[str, Joint], name: str) -> bool:
    """Whether the joint follows itself in the end; that is TF702."""
    seen: set[str] = set()
    while name in joints and name not in seen and len(seen) < _MOST_MIMICS:
        seen.add(name)
        name = joints[name].mimic or ""
    return name in seen


@rule("TF715")
def joint_without_owner(robot: Robot) -> Iterator[Finding]:
    """A planar or floating joint is nobody's.

    Joint states hold one position a joint, and these have two and six: neither tfcompose nor robot_state_publisher can
    place the child. Name the process that publishes the edge as its owner: odometry, a simulator, or a stand-in
    (simulate: {fixed: {}}).
    """
    for edge in robot.edges:
        joint = edge.free
        if joint and edge.owner in BUILT_IN:
            message = f"the {joint.type} joint {joint.name} has no owner: joint states cannot place {edge.child}"
            advice = "owner: the process that publishes it"
            if joint.at.file in robot.foreign:  # which cannot say it
                advice = "tfcompose import makes a robot file of it, where the joint can have an owner: spec: FILE"
            yield finding("TF715", message, edge.owner_at or joint.at, help=advice)


@rule("TF716", of_urdf=True)
def soft_limit_outside(robot: Robot) -> Iterator[Finding]:
    """A safety controller's soft limits are not inside the joint's limits, or leave no room.

    The controller begins to hold the joint back at the soft limits; beyond the hard ones it does so too late, or never.
    Left out, both are 0, as in URDF.
    """
    for edge in robot.edges:
        joint = edge.joint
        safety, limit = (joint.safety, joint.limit) if joint else (None, None)
        if joint is None or safety is None:
            continue
        low, high = safety.soft_lower_limit, safety.soft_upper_limit
        hard = (limit.lower, limit.upper) if limit else (None, None)
        inside = (hard[0] is None or hard[0] <= low) and (hard[1] is None or high <= hard[1])
        if joint.type != "continuous" and not (inside and low < high):
            message = f"the soft limits of {joint.name}, {low:g} to {high:g}, are not within its limits"
            advice = "soft_lower_limit and soft_upper_limit between lower and upper"
            yield finding("TF716", message, joint.at, help=advice)


@rule("TF717", of_urdf=True)
def interface_claimed_twice(robot: Robot) -> Iterator[Finding]:
    """Two hardware components of ros2_control have one interface of one joint.

    The controller manager refuses the second, and no controller starts. A joint is driven by one component; a second
    one may bring other interfaces of it.
    """
    first: dict[tuple[str, str, str], tuple[str, Span]] = {}
    for hardware in robot.hardware:
        for component in hardware.components:
            for way, interfaces in (("command", component.command), ("state", component.state)):
                for interface in interfaces:
                    claim = (component.name, way, interface.name)
                    other, at = first.setdefault(claim, (hardware.name, component.at))
                    if at != component.at:
                        message = f"{hardware.name} and {other} both have the {way} interface {claim[0]}/{claim[2]}"
                        notes = [Note(f"{other} has it here", at)]
                        yield finding("TF717", message, component.at, help="keep it in one of them", notes=notes)


@rule("TF718", of_urdf=True)
def mimic_joint_commanded(robot: Robot) -> Iterator[Finding]:
    """A joint that follows another one has a command interface of its own.

    It cannot do both, and ros2_control refuses the whole hardware. Leave its state interfaces, and command the joint
    that it follows.
    """
    mimics = {edge.joint.name: edge.joint for edge in robot.edges if edge.joint and edge.joint.mimic is not None}
    for hardware in robot.hardware:
        for component in hardware.components:
            joint = mimics.get(component.name)
            if joint and component.kind == "joint" and component.command:
                names = ", ".join(interface.name for interface in component.command)
                message = f"{joint.name} follows {joint.mimic}, and {hardware.name} commands its {names}"
                notes = [Note("the joint stands here", joint.at)]
                yield finding("TF718", message, component.at, help="keep its state interfaces only", notes=notes)


_MOST_LISTED = 5


@rule("TF728", of_urdf=True)
def joint_named_like_a_frame(robot: Robot) -> Iterator[Finding]:
    """A joint has the name of a link or frame.

    URDF lets both stand. Gazebo makes SDF of it, where links, joints and frames share one name space, and refuses the
    robot: the joint "has a name collision". Call the joint after its link, with ``_joint`` behind it. All of a
    robot are one finding.
    """
    named = {edge.joint_name: edge.joint_at or edge.at for edge in robot.edges if edge.joint_name in robot.frames}
    named.pop("", None)
    if named:
        first, *others = named
        kind = "link" if first in robot.links else "frame"
        notes = [Note(f"the {kind} stands here", robot.frames[first])]
        notes += [Note(f"{name} is another", named[name]) for name in others[:_MOST_LISTED]]
        more = f", and so {'are' if others[1:] else 'is'} {len(others)} more" if others else ""
        message = f"{first} is a joint and a {kind}{more}"
        yield finding("TF728", message, named[first], help=f"for example {first}_joint", notes=notes)


@rule("TF731", of_urdf=True)
def negative_damping(robot: Robot) -> Iterator[Finding]:
    """A joint's damping or friction is negative.

    It would drive the joint instead of slowing it down. Drake refuses such damping, and pinocchio such friction, with
    the whole robot. Both are 0 if left out.
    """
    for edge in robot.edges:
        joint = edge.joint
        if joint is None or joint.dynamics is None:
            continue
        for name, value in (("damping", joint.dynamics.damping), ("friction", joint.dynamics.friction)):
            if value < 0:
                message = f"the {name} of {joint.name} is {value:g}"
                yield finding("TF731", message, joint.at, help="0 or more, or leave it out")
