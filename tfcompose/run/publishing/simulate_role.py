"""What a stand-in does: its edges, or joint states, at the plan's rate, by the wall's clock or the simulated one."""

from __future__ import annotations

import math
import time
from importlib import import_module
from typing import TYPE_CHECKING

from tfcompose.ros.clock import SimClock
from tfcompose.ros.node import TFPublisher, open_node, wait
from tfcompose.ros.tf_codec import Template
from tfcompose.run.clock_watch import CLOCK_AFTER_S, no_clock
from tfcompose.run.notify import ready
from tfcompose.run.own import count, say
from tfcompose.run.publishing.joint_source import JointSource
from tfcompose.run.publishing.motion import circle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rclpy.node import Node

    from tfcompose.plan import Simulation
    from tfcompose.ros.stop import Stop
    from tfcompose.run.own import Own

_SECOND_NS = 1_000_000_000


def simulate(own: Own, stop: Stop) -> None:
    """Publish the simulated edges, or joint states, at the plan's rate."""
    simulation = own.process.simulate
    if simulation is None:  # own.read_own has refused such a plan
        return
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        if simulation.kind == "joints":
            publish, what = _joint_states(own, node, simulation)
        else:
            publish, what = _body(own, node, simulation)
        say(f"{what}, simulated at {simulation.rate:g} Hz")
        ready()
        if own.plan.ros.clock == "sim":
            ticks = _sim_ticks(node, simulation.rate, stop)
        else:
            ticks = _wall_ticks(simulation.rate, stop)
        for time_s, stamp_ns in ticks:
            publish(time_s, stamp_ns)


def _body(own: Own, node: Node, simulation: Simulation) -> tuple[Callable[[float, int], None], str]:
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

    return publish, f"{count(len(edges), 'edge')} on /tf"


def _joint_states(own: Own, node: Node, simulation: Simulation) -> tuple[Callable[[float, int], None], str]:
    source = JointSource(simulation, [edge.joint for edge in own.plan.edges if edge.joint])
    joint_states = import_module("tfcompose.ros.joint_states")  # which loads numpy: most stand-ins do without
    publisher = joint_states.JointStatePublisher(node, source.names)

    def publish(time_s: float, stamp_ns: int) -> None:
        publisher.publish(stamp_ns, source.positions(time_s))

    return publish, f"{count(len(source.names), 'joint')} on {publisher.topic}"


def _wall_ticks(rate: float, stop: Stop) -> Iterator[tuple[float, int]]:
    """Give seconds since the start and the time to stamp with, at ``rate``; ticks that were missed are left out."""
    start, tick = time.monotonic(), 0
    while not stop.wait(max(0.0, start + tick / rate - time.monotonic())):
        elapsed_s = time.monotonic() - start
        yield elapsed_s, time.time_ns()
        tick = max(tick + 1, math.floor(elapsed_s * rate))


def _sim_ticks(node: Node, rate: float, stop: Stop) -> Iterator[tuple[float, int]]:
    """Give the same by /clock: nothing while it stands, and a new start when it jumps back."""
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
