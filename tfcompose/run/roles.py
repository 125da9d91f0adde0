"""What tfcompose's own publishing processes do between start and signal; the part of them that needs ROS."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

from tfcompose.ros.clock import SimClock
from tfcompose.ros.joint_states import JointStatePublisher, JointStateSubscription
from tfcompose.ros.message import Template, Transform, encode
from tfcompose.ros.node import latch, open_node
from tfcompose.ros.tf import TFPublisher, wait
from tfcompose.run.motion import Joints, circle, read_positions
from tfcompose.run.own import say
from tfcompose.run.watch import guard

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rclpy.node import Node

    from tfcompose.plan import Simulation
    from tfcompose.ros.joint_states import Positions
    from tfcompose.ros.stop import Stop
    from tfcompose.run.own import Own

_SECOND_NS = 1_000_000_000
# Joint states come with one set of names from each driver; a source that never repeats itself must not fill the memory.
_MOST_TEMPLATES = 64


def static(own: Own, stop: Stop) -> None:
    """Latch all fixed edges in one message on /tf_static, and the description where no joints process does."""
    # A fixed edge holds at every time and tf2 does not look at its stamp; simulated time may not have begun.
    stamp_ns = 0 if own.plan.ros.clock == "sim" else time.time_ns()
    edges = [Transform(stamp_ns, e.parent, e.child, e.pose.xyz, e.pose.quat_xyzw) for e in own.edges]
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        publisher = TFPublisher(node, static=True)
        if edges:
            publisher.publish(encode(edges))
        say(f"{_count(len(edges), 'edge')} on /tf_static")
        latched = None
        if not any(p.kind == "joints" and p.description == own.process.description for p in own.plan.processes):
            latched = _latch_description(own, node)
        stop.wait(None)
        del latched


def joints(own: Own, stop: Stop) -> None:
    """Publish the moving edges of each message on ``joint_states``, with its stamp, and latch the description."""
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        mover = _JointMover(own, node)
        latched = _latch_description(own, node)
        subscription = JointStateSubscription(node)
        say(f"{_count(len(mover), 'edge')} on /tf, from {subscription.topic}")
        while not stop.requested:
            wait(node, [subscription], None, stop)
            for state in subscription.take_positions():
                mover.take(state)
        del latched


def simulate(own: Own, stop: Stop) -> None:
    """Publish the simulated edges, or joint states, at the plan's rate."""
    simulation = own.process.simulate
    if simulation is None:  # own.read_own has refused such a plan
        return
    with open_node(own.node_name, own.namespace, args=own.ros_args) as node:
        if simulation.kind == "joints":
            publish, what = _joint_states(node, simulation)
        else:
            publish, what = _body(own, node, simulation)
        say(f"{what}, simulated at {simulation.rate:g} Hz")
        if own.plan.ros.clock == "sim":
            ticks = _sim_ticks(node, simulation.rate, stop)
        else:
            ticks = _wall_ticks(simulation.rate, stop)
        for time_s, stamp_ns in ticks:
            publish(time_s, stamp_ns)


ROLES: dict[str, Callable[[Own, Stop], None]] = {
    "static": static,
    "joints": joints,
    "simulate": simulate,
    "guard": guard,
}


class _JointMover:
    """From joint states to /tf."""

    def __init__(self, own: Own, node: Node) -> None:
        self._edges = [(edge.parent, edge.child) for edge in own.edges if edge.joint]
        self._joints = Joints(own.edges)
        self._sim = own.plan.ros.clock == "sim"
        self._publisher = TFPublisher(node, static=False)
        self._templates: dict[tuple[int, ...], Template] = {}
        self._said: set[str] = set()

    def __len__(self) -> int:
        return len(self._edges)

    def take(self, state: Positions | None) -> None:
        """Publish what a joint state says; one that cannot be believed is dropped, with a line the first time."""
        if state is None:
            self._drop("its bytes are not one")
            return
        try:
            sent = read_positions(state.names, state.positions, self._joints.names)
        except ValueError as error:
            self._drop(str(error))
        else:
            self._publish(sent, state.stamp_ns, state.received_ns)

    def _publish(self, sent: dict[str, float], stamp_ns: int, received_ns: int) -> None:
        poses = self._joints.poses(sent)
        if not poses:
            return
        template = self._template(tuple(poses))
        for index, pose in enumerate(poses.values()):
            template.set_pose(index, pose)
        # Messages sent by hand often have no stamp, and tf2 takes only the first transform of one time.
        template.set_stamp(stamp_ns if stamp_ns or self._sim else received_ns)
        self._publisher.publish(template.data)

    def _template(self, indices: tuple[int, ...]) -> Template:
        found = self._templates.get(indices)
        if found is None:
            if len(self._templates) >= _MOST_TEMPLATES:
                self._templates.clear()
            found = self._templates[indices] = Template([self._edges[index] for index in indices])
        return found

    def _drop(self, why: str) -> None:
        if why not in self._said:
            self._said.add(why)
            say(f"dropped a joint state: {why} (said once)")


def _latch_description(own: Own, node: Node) -> Any:
    """Publish the description and return its publisher; without the file TF goes on, and a line says so."""
    try:
        text = own.description.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        say(f"no robot_description: {error}")
        return None
    return latch(node, "robot_description", text)


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

    return publish, f"{_count(len(edges), 'edge')} on /tf"


def _joint_states(node: Node, simulation: Simulation) -> tuple[Callable[[float, int], None], str]:
    publisher = JointStatePublisher(node, simulation.joints)
    return lambda _, stamp_ns: publisher.publish(
        stamp_ns
    ), f"{_count(len(simulation.joints), 'joint')} on {publisher.topic}"


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
    while not stop.requested:
        wait(node, [clock.subscription], None, stop)
        now_ns = clock.now_ns()
        if now_ns is None:
            continue
        if now_ns < last_ns or tick == 0:
            start_ns, tick = now_ns, 0
        last_ns = now_ns
        elapsed_s = (now_ns - start_ns) / _SECOND_NS
        if elapsed_s * rate >= tick:
            yield elapsed_s, now_ns
            tick = math.floor(elapsed_s * rate) + 1


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
