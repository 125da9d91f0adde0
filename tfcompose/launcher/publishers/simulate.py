"""Stand-in for an owner: its edges or joint states, at the plan's rate and by its clock.

The simulated motions are pure functions, in seconds, metres and radians.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import Pose, quat_from_rpy
from tfcompose.foundation.text import plural
from tfcompose.launcher.publishers.mimics import SLIDING, TURNING, Joints
from tfcompose.tf.process import ready, say, start, wait_for_go
from tfcompose.tf.ros.tf_codec import Template

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rclpy.node import Node

    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan import PlanJoint, Simulation, Sweep
    from tfcompose.tf.process import Own

_SECOND_NS = 1_000_000_000


def main(argv: Sequence[str]) -> int:
    """Run the process that PLAN_FILE PROCESS_NAME names, and return the exit code."""
    return start(argv, "simulate", simulate)


def simulate(own: Own, stop: Stop) -> None:
    """Publish the simulated edges, or joint states, at the plan's rate."""
    simulation = own.process.simulate
    if simulation is None:  # process.read_own has refused such a plan
        return
    from tfcompose.tf.ros.node import open_node  # noqa: PLC0415 (ROS, once signals are handled)

    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        if simulation.kind == "joints":
            publish, what = _joint_states(own, node, simulation)
        else:
            publish, what = _body(own, node, simulation)
        if not wait_for_go(stop):
            return
        say(f"{what}, simulated at {simulation.rate:g} Hz")
        ready()
        if own.plan.ros.clock == "sim":
            ticks = _sim_ticks(node, simulation.rate, stop)
        else:
            ticks = _wall_ticks(simulation.rate, stop)
        for time_s, stamp_ns in ticks:
            publish(time_s, stamp_ns)


def _body(
    own: Own, node: Node, simulation: Simulation
) -> tuple[Callable[[float, int], None], str]:
    from tfcompose.tf.ros.node import TFPublisher  # noqa: PLC0415 (ROS, once signals are handled)

    edges = own.edges
    template = Template([(edge.parent, edge.child) for edge in edges])
    publisher = TFPublisher(node, static=False)

    def publish(time_s: float, stamp_ns: int) -> None:
        pose = simulation.pose
        if simulation.kind == "circle":
            pose = pose @ circle(simulation.radius, simulation.speed, time_s)
        for index in range(len(edges)):
            template.set_pose(index, pose)
        template.set_stamp(stamp_ns)
        publisher.publish(template.data)

    return publish, f"{plural(len(edges), 'edge')} on /tf"


def _joint_states(
    own: Own, node: Node, simulation: Simulation
) -> tuple[Callable[[float, int], None], str]:
    # Numpy: most stand-ins do without.
    from tfcompose.tf.ros.sensor_data import JointStatePublisher  # noqa: PLC0415

    source = JointSource(simulation, [edge.joint for edge in own.plan.edges if edge.joint])
    publisher = JointStatePublisher(node, source.names)

    def publish(time_s: float, stamp_ns: int) -> None:
        publisher.publish(stamp_ns, source.positions(time_s))

    return publish, f"{plural(len(source.names), 'joint')} on {publisher.topic}"


def _wall_ticks(rate: float, stop: Stop) -> Iterator[tuple[float, int]]:
    """Yield seconds since the start and the time to stamp with, at ``rate``; skip missed ticks."""
    start, tick = time.monotonic(), 0
    while not stop.wait(max(0.0, start + tick / rate - time.monotonic())):
        elapsed_s = time.monotonic() - start
        yield elapsed_s, time.time_ns()
        tick = max(tick + 1, math.floor(elapsed_s * rate))


def _sim_ticks(node: Node, rate: float, stop: Stop) -> Iterator[tuple[float, int]]:
    """Yield the same by /clock: nothing while it is paused, a new start when it jumps back."""
    # ROS, once signals are handled.
    from tfcompose.tf.ros.clock import CLOCK_AFTER_S, SimClock, no_clock  # noqa: PLC0415
    from tfcompose.tf.ros.node import wait  # noqa: PLC0415 (ROS, once signals are handled)

    clock = SimClock(node)
    start_ns = last_ns = tick = 0
    due: float | None = time.monotonic() + CLOCK_AFTER_S
    while not stop.requested:
        wait(node, [clock.subscription], due and max(0.0, due - time.monotonic()), stop)
        now_ns = clock.now_ns()
        if now_ns is None:
            if due and time.monotonic() >= due:
                due = None
                say(no_clock(node))
            continue
        due = None
        if now_ns < last_ns or tick == 0:
            start_ns, tick = now_ns, 0
        last_ns = now_ns
        elapsed_s = (now_ns - start_ns) / _SECOND_NS
        if elapsed_s * rate >= tick:
            yield elapsed_s, now_ns
            tick = math.floor(elapsed_s * rate) + 1


class JointSource:
    """The simulated joints and their mimics, also through chains.

    robot_state_publisher follows a chain of mimics only in the order of the names, so mimics are
    sent with their own values.
    """

    def __init__(self, simulation: Simulation, joints: Sequence[PlanJoint]) -> None:
        own = list(simulation.joints)
        self._moves = [
            (start, simulation.sweep.get(name)) for name, start in simulation.joints.items()
        ]
        movable = [joint for joint in joints if joint.type in TURNING + SLIDING]
        followed = {movable[joint.joint].name: joint for joint in Joints(movable).follow(own)}
        self._mimics = [joint for name, joint in followed.items() if name not in simulation.joints]
        #: The names, in the order of the positions.
        self.names = own + [name for name in followed if name not in simulation.joints]

    def positions(self, time_s: float) -> list[float]:
        """Return the positions ``time_s`` after the start: rad, or m for prismatic joints."""
        own = [start for start, _ in self._moves]
        for index, (rest, sweep) in enumerate(self._moves):
            if sweep:
                own[index] = swept(sweep, rest, time_s)
        return own + [
            mimic.multiplier * own[mimic.column] + mimic.offset for mimic in self._mimics
        ]


def circle(radius: float, speed: float, time_s: float) -> Pose:
    """Return the pose, in the circle's centre, of a body that drives on it.

    x = r cos ωt, y = r sin ωt. ``radius`` is r in metres, ``speed`` is ω in rad/s,
    counter-clockwise if positive. The body faces its direction of travel.
    """
    angle = speed * time_s
    heading = angle + math.copysign(math.pi / 2, speed)
    return Pose(
        (radius * math.cos(angle), radius * math.sin(angle), 0.0), quat_from_rpy(0.0, 0.0, heading)
    )


def swept(sweep: Sweep, start: float, time_s: float) -> float:
    """Return the position (rad or m) of a joint that sweeps from ``start`` at time 0.

    Back and forth is a sine about the middle, upwards at first: position and speed have no steps,
    and the speed is at most π · (upper - lower) / period. A continuous rotation keeps the angle
    between -π and π.
    """
    phase = math.tau * time_s / sweep.period_s
    if sweep.lower is None or sweep.upper is None:
        return math.remainder(start + phase, math.tau)
    middle, half = (sweep.lower + sweep.upper) / 2, (sweep.upper - sweep.lower) / 2
    if half <= 0:
        return middle
    return middle + half * math.sin(
        phase + math.asin(max(-1.0, min(1.0, (start - middle) / half)))
    )
