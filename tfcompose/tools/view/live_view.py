"""``view --live``: the browser view follows the running tree until a signal ends it."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.cli.process_table import HEAD, row, uptime
from tfcompose.cli.runs import is_meant, running
from tfcompose.cli.terminal import INTERRUPTED, reject, warn
from tfcompose.foundation.findings import finding
from tfcompose.foundation.signals import Stop
from tfcompose.launcher.control import RequestRefusedError, ask
from tfcompose.launcher.procfs import UsageMeter
from tfcompose.launcher.runtime_dir import RuntimeDirError, domain_of
from tfcompose.model.messages import RobotStatus, StatusRequest
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.live.edges import SETTLE_S, TreeObserver
from tfcompose.tf.live.state import NAMELESS
from tfcompose.tf.ros.environment import RosError
from tfcompose.tools.view.joints import JointSender, joint_topics
from tfcompose.tools.view.live import LiveTree
from tfcompose.tools.view.live_panel import LivePanel
from tfcompose.tools.view.view_session import plan_of_session

if TYPE_CHECKING:
    import threading
    from collections.abc import Mapping

    import viser
    from rclpy.node import Node

    from tfcompose.foundation.geometry import Offset
    from tfcompose.model.plan import Plan
    from tfcompose.tools.view.reload import ReloadedPanel

    Topics = tuple[str, str]

#: How often the scene is moved, the tree judged, and the launcher asked for its state; seconds.
_SHOW_EVERY_S, _JUDGE_EVERY_S, _ASK_EVERY_S = 0.04, 0.35, 2.0
#: What the panel has room for of what ``ps`` lists.
_COLUMNS = ("PROCESS", "STATE", "CPU", "MEMORY", "EDGES")
#: Rates and gaps are those of the last one to two of these; seconds.
_WINDOW_S = 5.0


def observers_of(plan: Plan) -> dict[Topics, TreeObserver]:
    """Return an observer for each pair of topics (moving, fixed) of the plan."""
    return {topics: TreeObserver(_WINDOW_S, SETTLE_S) for topics in parts_of(plan)}


class Following:
    """Moves the scene, judges and asks, each as often as it is due.

    Of a file that changed it shows the new robot.

    With ``joints`` the panel's sliders publish joint states.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        shown: ReloadedPanel,
        changed: threading.Event,
        tolerance: Offset,
        *,
        joints: bool,
    ) -> None:
        self._server = server
        self._shown = shown
        self._changed = changed
        self._tolerance = tolerance
        self._joints = joints
        self._meter = UsageMeter()
        self.senders: list[JointSender] = []

    def run(self, observers: Mapping[Topics, TreeObserver], stop: Stop) -> None:
        """Follow the tree on the topics (moving, fixed) until ``stop`` is requested.

        Raises:
            RosError: if ROS cannot start a node, or take messages.
        """
        from tfcompose.tf.live.listener import (
            TreeListener,  # rclpy reads the environment when it is loaded
        )
        from tfcompose.tf.ros.node import open_node

        with open_node("tfcompose_view", "") as node:
            listeners = [
                TreeListener(node, observer, topics) for topics, observer in observers.items()
            ]
            begun, show_at = time.monotonic(), 0.0
            self._follow(observers, node)
            while not stop.requested:
                for listener in listeners:
                    listener.listen(_SHOW_EVERY_S / len(listeners), stop)
                if not listeners:
                    stop.wait(_SHOW_EVERY_S)
                now = time.monotonic()
                if now < show_at:
                    continue
                show_at = now + _SHOW_EVERY_S
                if self._changed.is_set():
                    self._changed.clear()
                    if self._shown.reload():
                        self._follow(observers, node)
                self._show(now, now - begun)
                self._send(now, next((one.clock_ns for one in listeners), None))
            for sender in self.senders:
                sender.close()

    def _follow(self, observers: Mapping[Topics, TreeObserver], node: Node) -> None:
        """Follow the robot that the session has now."""
        session = self._shown.session
        plan = plan_of_session(session)
        known = {topics: observers.get(topics) or TreeObserver() for topics in parts_of(plan)}
        self.tree = LiveTree(session.robot, plan, known, self._tolerance)
        self._panel = LivePanel(self._server, self._shown.panel, self.tree)
        self._plan = plan
        self._judge_at = self._ask_at = 0.0
        for sender in self.senders:
            sender.close()
        self.senders = []
        if self._joints:
            topics = joint_topics(session.robot, plan)
            self.senders = [_sender(node, topic, names) for topic, names in topics.items()]

    def _show(self, now: float, listened_s: float) -> None:
        """Show what came since the last time."""
        if now >= self._judge_at:
            self.tree.judge(listened_s)
            self._panel.show_text()
            self._judge_at = time.monotonic() + _JUDGE_EVERY_S
        self._panel.show()
        if now >= self._ask_at:
            self._ask_at = now + _ASK_EVERY_S
            self._show_processes()

    def _send(self, now: float, clock_ns: int | None) -> None:
        """Let sliders publish, by the plan's clock."""
        stamp_ns = clock_ns if self._plan.ros.clock == "sim" else time.time_ns()
        panel = self._shown.panel
        for sender in self.senders:
            before = sender.text
            sender.step(now, stamp_ns, panel.session.robot, panel.positions)
            if (
                sender.others_found
                and sender.text != before
                and NAMELESS not in sender.others_found
            ):
                warn(sender.text)
        if self.senders:
            self._panel.show_joints([sender.text for sender in self.senders])

    def _show_processes(self) -> None:
        status = _status(self._plan.robot)
        if status is None:
            self._panel.show_processes(f"no robot {self._plan.robot} runs here", [])
            return
        used = self._meter.usage([one.pid for one in status.processes if one.pid])
        state = (
            "stopping"
            if status.stopping
            else "tree complete"
            if status.complete
            else "tree not complete"
        )
        columns = [HEAD.index(name) for name in _COLUMNS]
        table = [HEAD, *(row(process, used) for process in status.processes)]
        rows = [[cells[column] for column in columns] for cells in table]
        self._panel.show_processes(
            f"{self._plan.robot}: {state}, since {uptime(status.uptime)}", rows
        )


def _status(name: str) -> RobotStatus | None:
    """Return the state of the robot that runs in this domain, or None."""
    try:
        domain = domain_of(os.environ)
        places = [
            place for place, _ in running() if place.domain == domain and is_meant(place, name)
        ]
        return ask(places[0], StatusRequest(), RobotStatus) if places else None
    except (RuntimeDirError, RequestRefusedError, OSError):
        return None


def _sender(node: Node, topic: str, names: Mapping[str, str]) -> JointSender:
    from tfcompose.tf.ros.graph import UNKNOWN_NODE, ids_say_who, writers
    from tfcompose.tf.ros.sensor_data import JointStatePublisher

    own: set[bytes] = set()

    def make() -> JointStatePublisher:
        publisher = JointStatePublisher(node, tuple(names), topic)
        own.add(publisher.gid)
        return publisher

    def others() -> list[str]:
        name = "" if ids_say_who(node) else node.get_fully_qualified_name()
        found = {
            one.node for one in writers(node, topic) if one.gid not in own and one.node != name
        }
        unnamed = [name for name in found if name.endswith(UNKNOWN_NODE)]
        return sorted([*(found - set(unnamed)), *(NAMELESS for _ in unnamed)])

    return JointSender(topic, names, make, others)


def follow(
    server: viser.ViserServer,
    shown: ReloadedPanel,
    changed: threading.Event,
    tolerance: Offset,
    *,
    joints: bool,
) -> int:
    """Show the running tree until a signal comes, in a process that is set up for its ROS.

    Return the exit code.

    Raises:
        SystemExit: after saying why ROS cannot be started.
    """
    plan = plan_of_session(shown.session)
    following = Following(server, shown, changed, tolerance, joints=joints)
    with Stop() as stop:
        try:
            following.run(observers_of(plan), stop)
        except RosError as error:
            reject([finding("TF901", str(error), None)])
    return INTERRUPTED
