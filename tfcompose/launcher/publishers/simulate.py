"""Simulated owner: publishes edges or joint states at the plan's rate and by the plan's clock.

The simulated motions are pure functions in seconds, metres and radians.
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
    from tfcompose.tf.process import OwnProcess

_SECOND_NS = 1_000_000_000


def main(argv: Sequence[str]) -> int:
    """Run the process with arguments PLAN_FILE PROCESS_NAME, and return the exit code."""
    return start(argv, "simulate", simulate)


def simulate(own_process: OwnProcess, stop: Stop) -> None:
    """Publish the simulated edges, or joint states, at the plan's rate."""
    simulation = own_process.process.simulate
    if simulation is None:  # process.read_own rejects such a plan
        return
    from tfcompose.tf.ros.node import open_node  # noqa: PLC0415 (ROS, once signals are handled)

    with open_node(
        own_process.node_name, own_process.namespace, args=own_process.ros_args
    ) as node:
        if simulation.kind == "joints":
            publish, what = _joint_states(own_process, node, simulation)
        else:
            publish, what = _body(own_process, node, simulation)
        if not wait_for_go(stop):
            return
        say(f"{what}, simulated at {simulation.rate:g} Hz")
        ready()
        if own_process.plan.ros.clock == "sim":
            ticks = _sim_ticks(node, simulation.rate, stop)
        else:
            ticks = wall_ticks(simulation.rate, stop)
        for time_s, stamp_ns in ticks:
            publish(time_s, stamp_ns)


def _body(
    own_process: OwnProcess, node: Node, simulation: Simulation
) -> tuple[Callable[[float, int], None], str]:
    from tfcompose.tf.ros.node import TFPublisher  # noqa: PLC0415 (ROS, once signals are handled)

    edges = own_process.edges
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
    own_process: OwnProcess, node: Node, simulation: Simulation
) -> tuple[Callable[[float, int], None], str]:
    # It imports numpy, which most simulated owners do not need.
    from tfcompose.tf.ros.sensor_data import JointStatePublisher  # noqa: PLC0415

    source = JointSource(simulation, [edge.joint for edge in own_process.plan.edges if edge.joint])
    publisher = JointStatePublisher(node, source.names)

    def publish(time_s: float, stamp_ns: int) -> None:
        publisher.publish(stamp_ns, source.positions(time_s))

    return publish, f"{plural(len(source.names), 'joint')} on {publisher.topic}"


def wall_ticks(rate: float, stop: Stop) -> Iterator[tuple[float, int]]:
    """Yield seconds since the start and the time to stamp with, at ``rate``; skip missed ticks."""
    start, tick = time.monotonic(), 0
    while not stop.wait(max(0.0, start + tick / rate - time.monotonic())):
        elapsed_s = time.monotonic() - start
        yield elapsed_s, time.time_ns()
        tick = max(tick + 1, math.floor(elapsed_s * rate))


def _sim_ticks(node: Node, rate: float, stop: Stop) -> Iterator[tuple[float, int]]:
    """Yield the same values as ``_wall_ticks``, by /clock.

    Nothing is yielded while /clock is paused. A jump back starts again at 0 seconds.
    """
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
    """The simulated joints and the joints that mimic them, including chains.

    robot_state_publisher follows a chain of mimicking joints only in the order of the names, so
    the joint states contain the positions of mimicking joints.
    """

    def __init__(self, simulation: Simulation, joints: Sequence[PlanJoint]) -> None:
        joint_names = list(simulation.joints)
        self._moves = [
            (start, simulation.sweep.get(name)) for name, start in simulation.joints.items()
        ]
        movable = [joint for joint in joints if joint.type in TURNING + SLIDING]
        followed = {
            movable[joint.joint].name: joint for joint in Joints(movable).follow(joint_names)
        }
        self._mimics = [joint for name, joint in followed.items() if name not in simulation.joints]
        #: The names, in the order of the positions.
        self.names = joint_names + [name for name in followed if name not in simulation.joints]

    def positions(self, time_s: float) -> list[float]:
        """Return the positions ``time_s`` seconds after the start, in rad, or m if prismatic."""
        positions = [start for start, _ in self._moves]
        for index, (rest, sweep) in enumerate(self._moves):
            if sweep:
                positions[index] = swept(sweep, rest, time_s)
        return positions + [
            mimic.multiplier * positions[mimic.column] + mimic.offset for mimic in self._mimics
        ]


def circle(radius: float, speed: float, time_s: float) -> Pose:
    """Return the pose of a body that drives on a circle, relative to the circle's centre.

    x = r cos ωt, y = r sin ωt. ``radius`` is r in metres. ``speed`` is ω in rad/s, positive
    counter-clockwise. The body faces its direction of travel.
    """
    angle = speed * time_s
    heading = angle + math.copysign(math.pi / 2, speed)
    return Pose(
        (radius * math.cos(angle), radius * math.sin(angle), 0.0), quat_from_rpy(0.0, 0.0, heading)
    )


def swept(sweep: Sweep, start: float, time_s: float) -> float:
    """Return the position, in rad or m, of a joint that sweeps from ``start`` at time 0.

    A sweep between limits is a sine about the middle and first moves upwards. Position and speed
    have no steps, and the speed is at most π · (upper - lower) / period. For a continuous
    rotation, the angle stays between -π and π.
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
