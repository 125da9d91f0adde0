"""``view --live``: the browser view follows the running tree until a signal ends it."""

from __future__ import annotations

import os
import time
import warnings
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.cli.process_table import HEAD, row, state_of, uptime
from tfcompose.cli.runs import is_meant, running
from tfcompose.cli.terminal import INTERRUPTED, reject, warn
from tfcompose.foundation.findings import finding
from tfcompose.foundation.signals import Stop
from tfcompose.launcher.control import RequestRefusedError, ask
from tfcompose.launcher.runtime_dir import RuntimeDirError, domain_of
from tfcompose.launcher.usage import UsageMeter
from tfcompose.model.messages import RobotStatus, StatusRequest
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.live.edges import SETTLE_S, TreeObserver
from tfcompose.tf.live.feed import follow
from tfcompose.tf.live.state import NAMELESS
from tfcompose.tf.ros.environment import RosError
from tfcompose.tools.view.joints import JointSender, first_positions, joint_topics
from tfcompose.tools.view.live import LiveTree
from tfcompose.tools.view.published_tree import PublishedTree
from tfcompose.tools.view.view_session import plan_of_session
from tfcompose.tools.view.windows import SceneSource, Windows

if TYPE_CHECKING:
    import threading
    from collections.abc import Mapping, Sequence

    from rclpy.node import Node

    from tfcompose.foundation.geometry import Offset
    from tfcompose.model.plan import Plan
    from tfcompose.model.robot import Robot
    from tfcompose.tools.view.reload import ReloadedPanel
    from tfcompose.tools.view.session import Session

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


class LiveWindow(NamedTuple):
    """The live parts of a window."""

    tree: LiveTree
    panel: PublishedTree


class LiveSource(SceneSource):
    """Updates the scenes of all windows, judges, and asks, each at its own interval.

    With ``joints``, sliders publish joint states. Those of the window whose slider was moved last
    count.

    Args:
        observers: by topics (moving, fixed): those of the plan.
        tolerance: how far a pose may be off.
        joints: whether sliders publish.
    """

    def __init__(
        self, observers: Mapping[Topics, TreeObserver], tolerance: Offset, *, joints: bool
    ) -> None:
        self._observers = observers
        self._tolerance = tolerance
        super().__init__(has_joints=joints)
        self._meter = UsageMeter()
        self.shown: dict[ReloadedPanel, LiveWindow] = {}
        self._judge_at = self._ask_at = 0.0
        #: Where sliders were moved last, and where each window had them the last time.
        self._positions: dict[str, float] = {}
        self._positions_in: dict[ReloadedPanel, dict[str, float]] = {}
        self._first_positions: dict[str, float] = {}
        self.senders: list[JointSender] = []

    def show_in(self, shown: ReloadedPanel) -> None:
        """Show the tree in a window, next to the panel of its robot."""
        robot, plan = shown.session.robot, plan_of_session(shown.session)
        known = {pair: self._observers.get(pair) or TreeObserver() for pair in parts_of(plan)}
        tree = LiveTree(robot, plan, known, self._tolerance)
        self.shown[shown] = LiveWindow(tree, PublishedTree(shown.server, shown.panel, tree))
        self._judge_at = self._ask_at = 0.0

    def run(self, windows: Windows, changed: threading.Event) -> int:
        """Follow the tree until a signal, in a process that is set up for its ROS.

        Return the exit code.

        Raises:
            SystemExit: after saying why ROS cannot be started.
        """
        with Stop() as stop:
            try:
                self.follow(windows, changed, stop)
            except RosError as error:
                reject([finding("TF901", str(error), None)])
        return INTERRUPTED

    def follow(self, windows: Windows, changed: threading.Event, stop: Stop) -> None:
        """Follow the tree until ``stop`` is requested; show the new robot if files change.

        Raises:
            RosError: if ROS cannot start a node, or take messages.
        """
        from tfcompose.tf.live.ros_feed import (
            RosFeed,  # rclpy reads the environment when it is loaded
        )

        # A window may close between two looks at which are open: viser warns of what it then gets.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        with RosFeed("tfcompose_view", self._observers) as feed:
            begun = time.monotonic()
            self._follow(windows.session, feed.node)

            def show() -> None:
                """Show what came, of the files as they are now."""
                now = time.monotonic()
                if changed.is_set():
                    changed.clear()
                    if windows.reload():
                        self._follow(windows.session, feed.node)
                shown = self._open(windows)
                self._show(shown, now, now - begun)
                if self.senders:
                    self._take_positions(windows.panels)
                    self._send(shown, now, feed.clock_ns, windows.session.robot)

            follow(feed, stop, every_s=_SHOW_EVERY_S, show=show)
            for sender in self.senders:
                sender.close()

    def _follow(self, session: Session, node: Node) -> None:
        """Follow the robot that the session has now."""
        self._plan = plan_of_session(session)
        for sender in self.senders:
            sender.close()
        self.senders = []
        if self.has_joints:
            first = self._first_positions = first_positions(session.robot)
            self._positions = {name: self._positions.get(name, first[name]) for name in first}
            topics = joint_topics(session.robot, self._plan)
            self.senders = [_sender(node, topic, names) for topic, names in topics.items()]

    def _open(self, windows: Windows) -> list[LiveWindow]:
        """Return what shows the tree in windows that are open, and forget the others."""
        known = list(self.shown)  # before: what is opened meanwhile is not forgotten
        panels = windows.panels
        for closed in set(known) - set(panels):
            del self.shown[closed]
            self._positions_in.pop(closed, None)
        return [self.shown[panel] for panel in panels if panel in self.shown]

    def _show(self, shown: Sequence[LiveWindow], now: float, listened_s: float) -> None:
        """Show what came since the last time."""
        if now >= self._judge_at:
            self._judge_at = now + _JUDGE_EVERY_S
            for tree, panel in shown:
                tree.judge(listened_s)
                panel.show_text()
        for _, panel in shown:
            panel.show()
        if now >= self._ask_at:
            self._ask_at = now + _ASK_EVERY_S
            title, rows = self._processes()
            for _, panel in shown:
                panel.show_processes(title, rows)

    def _take_positions(self, windows: Sequence[ReloadedPanel]) -> None:
        """Take where sliders are from a window in which one was moved."""
        for shown in windows:
            positions = dict(shown.panel.positions)
            if positions != self._positions_in.get(shown, self._first_positions):
                self._positions = positions
            self._positions_in[shown] = positions

    def _send(
        self, shown: Sequence[LiveWindow], now: float, clock_ns: int | None, robot: Robot
    ) -> None:
        """Let sliders publish, by the plan's clock."""
        stamp_ns = clock_ns if self._plan.ros.clock == "sim" else time.time_ns()
        for sender in self.senders:
            before = sender.text
            sender.step(now, stamp_ns, robot, self._positions)
            if (
                sender.others_found
                and sender.text != before
                and NAMELESS not in sender.others_found
            ):
                warn(sender.text)
        for _, panel in shown:
            panel.show_joints([sender.text for sender in self.senders])

    def _processes(self) -> tuple[str, list[list[str]]]:
        """Return the state of the robot that runs, and a row for each of its processes."""
        status = _status(self._plan.robot)
        if status is None:
            return f"no robot {self._plan.robot} runs here", []
        used = self._meter.usage([process.pid for process in status.processes if process.pid])
        columns = [HEAD.index(name) for name in _COLUMNS]
        table = [HEAD, *(row(process, used) for process in status.processes)]
        rows = [[cells[column] for column in columns] for cells in table]
        return f"{self._plan.robot}: {state_of(status)}, since {uptime(status.uptime)}", rows


def _status(name: str) -> RobotStatus | None:
    """Return the state of the robot that runs in this domain, or None."""
    try:
        domain = domain_of(os.environ)
        places = [
            runtime_dir
            for runtime_dir, _ in running()
            if runtime_dir.domain == domain and is_meant(runtime_dir, name)
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
            writer.node
            for writer in writers(node, topic)
            if writer.gid not in own and writer.node != name
        }
        unnamed = [name for name in found if name.endswith(UNKNOWN_NODE)]
        return sorted([*(found - set(unnamed)), *(NAMELESS for _ in unnamed)])

    return JointSender(topic, names, make, others)
