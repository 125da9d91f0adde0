"""Source of a scene for ``view --live``: a running tree, until a signal ends the view."""

from __future__ import annotations

import os
import time
import warnings
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.cli.adjusting import adjust, describe_adjustment, moved
from tfcompose.cli.process_table import HEAD, row, state_of, uptime
from tfcompose.cli.runs import is_meant, running
from tfcompose.cli.terminal import INTERRUPTED, reject, warn
from tfcompose.foundation.findings import RejectedError, finding
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
    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.plan import Plan, PlanEdge
    from tfcompose.model.robot import Robot
    from tfcompose.tools.view.reload import ReloadedPanel
    from tfcompose.tools.view.session import Session

    Topics = tuple[str, str]

#: The intervals in seconds at which the source moves the scene, judges the tree, and asks the
#: launcher for its state.
_SHOW_EVERY_S, _JUDGE_EVERY_S, _ASK_EVERY_S = 0.04, 0.35, 2.0
#: The columns of ``ps`` that fit into the panel.
_COLUMNS = ("PROCESS", "STATE", "CPU", "MEMORY", "EDGES")
#: The window for rates and gaps in seconds. They are measured over the last one to two windows.
_WINDOW_S = 5.0


def observers_of(plan: Plan) -> dict[Topics, TreeObserver]:
    """Return an observer for each pair of topics (moving, fixed) of the plan."""
    return {topics: TreeObserver(_WINDOW_S, SETTLE_S) for topics in parts_of(plan)}


class LiveWindow(NamedTuple):
    """The live parts of a window."""

    tree: LiveTree
    panel: PublishedTree


class LiveSource(SceneSource):
    """Updates the scenes of all windows with the running tree.

    Args:
        observers: an observer for each pair of topics (moving, fixed) of the plan.
        tolerance: the largest accepted deviation of a pose.
        joints: whether sliders publish joint states. The positions are those of the window in
            which a slider was moved last.
        edit: whether the running robot follows the mounts that a window moves.
    """

    def __init__(
        self,
        observers: Mapping[Topics, TreeObserver],
        tolerance: Offset,
        *,
        joints: bool,
        edit: bool = False,
    ) -> None:
        self._observers = observers
        self._tolerance = tolerance
        super().__init__(has_edit=edit, has_joints=joints)
        self._meter = UsageMeter()
        self.windows_by_panel: dict[ReloadedPanel, LiveWindow] = {}
        self._judge_at = self._ask_at = 0.0
        #: The positions that were set last in any window, and the last known positions of each
        #: window.
        self._positions: dict[str, float] = {}
        self._positions_in: dict[ReloadedPanel, dict[str, float]] = {}
        self._first_positions: dict[str, float] = {}
        self.senders: list[JointSender] = []

    def show_in(self, panel: ReloadedPanel) -> None:
        """Show the tree in a window, next to the panel of its robot."""
        robot, plan = panel.session.robot, plan_of_session(panel.session)
        observers = {pair: self._observers.get(pair) or TreeObserver() for pair in parts_of(plan)}
        tree = LiveTree(robot, plan, observers, self._tolerance)
        self.windows_by_panel[panel] = LiveWindow(
            tree, PublishedTree(panel.server, panel.panel, tree)
        )
        self._judge_at = self._ask_at = 0.0

    def take_save(self, panel: ReloadedPanel) -> None:
        """Compare with the files as a window has just saved them."""
        if panel in self.windows_by_panel:
            session = panel.session
            self.windows_by_panel[panel].tree.follow(session.robot, plan_of_session(session))

    def take_moves(self, session: Session) -> Sequence[str]:
        """Have the running robot publish the poses that a window's mounts have now."""
        robot = session.robot
        touched = session.touched
        poses = {robot.final(e.child): e.pose for e in robot.edges if e.child in touched}
        later: dict[str, str] = {}

        def choose(plan: Plan) -> dict[str, PlanEdge]:
            edges = [edge for edge in plan.edges if edge.child in poses]
            later.update((edge.name, edge.owner) for edge in edges if not plan.is_adjustable(edge))
            return {
                edge.child: moved(edge, poses[edge.child])
                for edge in edges
                if plan.is_adjustable(edge)
            }

        try:
            runtime_dir = _run_of(robot.name)
            if runtime_dir is None:
                return [f"no robot {robot.name} runs here to follow the move"]
            edges = adjust(runtime_dir, choose)
        except (RuntimeDirError, RequestRefusedError, RejectedError, OSError, ValueError) as error:
            return [f"{robot.name} does not follow: {error}"]
        lines = [f"{edge.name}: {describe_adjustment(edge)}" for edge in edges.values()]
        return lines + [
            f"{name} moves after save and up --update: {owner} publishes it"
            for name, owner in later.items()
        ]

    def run(self, windows: Windows, changed: threading.Event) -> int:
        """Follow the tree until a signal, and return the exit code.

        This process must be set up for the ROS settings of the robot.

        Raises:
            SystemExit: after printing why ROS cannot be started.
        """
        with Stop() as stop:
            try:
                self.follow(windows, changed, stop)
            except RosError as error:
                reject([finding("TF901", str(error), None)])
        return INTERRUPTED

    def follow(self, windows: Windows, changed: threading.Event, stop: Stop) -> None:
        """Follow the tree until ``stop`` is requested.

        If files change, show the new robot.

        Raises:
            RosError: if ROS cannot start a node or receive messages.
        """
        from tfcompose.tf.live.ros_feed import (
            RosFeed,  # rclpy reads the environment when it is loaded
        )

        # A window may close between two checks. viser then warns about messages to the closed
        # window.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        with RosFeed("tfcompose_view", self._observers) as feed:
            begun = time.monotonic()
            self._follow(windows.session, feed.node)

            def show() -> None:
                """Show the received messages for the current files."""
                now = time.monotonic()
                if changed.is_set():
                    changed.clear()
                    if windows.reload():
                        self._follow(windows.session, feed.node)
                is_open = self._open(windows)
                self._show(is_open, now, now - begun)
                if self.senders:
                    self._take_positions(windows.panels)
                    self._send(is_open, now, feed.clock_ns, windows.session.robot)

            follow(feed, stop, every_s=_SHOW_EVERY_S, show=show)
            for sender in self.senders:
                sender.close()

    def _follow(self, session: Session, node: Node) -> None:
        """Follow the current robot of the session."""
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
        """Return the live parts of open windows, and forget closed windows."""
        clients = list(self.windows_by_panel)  # first: a window may open now
        panels = windows.panels
        for closed in set(clients) - set(panels):
            del self.windows_by_panel[closed]
            self._positions_in.pop(closed, None)
        return [self.windows_by_panel[panel] for panel in panels if panel in self.windows_by_panel]

    def _show(self, windows: Sequence[LiveWindow], now: float, listened_s: float) -> None:
        """Show the messages since the last call."""
        if now >= self._judge_at:
            self._judge_at = now + _JUDGE_EVERY_S
            for tree, panel in windows:
                tree.judge(listened_s)
                panel.show_text()
        for _, panel in windows:
            panel.show()
        if now >= self._ask_at:
            self._ask_at = now + _ASK_EVERY_S
            title, rows = self._processes()
            for _, panel in windows:
                panel.show_processes(title, rows)

    def _take_positions(self, windows: Sequence[ReloadedPanel]) -> None:
        """Copy the positions of all sliders from a window in which a slider was moved."""
        for window in windows:
            positions = dict(window.panel.positions)
            if positions != self._positions_in.get(window, self._first_positions):
                self._positions = positions
            self._positions_in[window] = positions

    def _send(
        self, windows: Sequence[LiveWindow], now: float, clock_ns: int | None, robot: Robot
    ) -> None:
        """Publish the positions of sliders, with stamps of the plan's clock."""
        stamp_ns = clock_ns if self._plan.ros.clock == "sim" else time.time_ns()
        for sender in self.senders:
            before = sender.text
            sender.step(now, stamp_ns, robot, self._positions)
            if (
                sender.publishers_found
                and sender.text != before
                and NAMELESS not in sender.publishers_found
            ):
                warn(sender.text)
        for _, panel in windows:
            panel.show_joints([sender.text for sender in self.senders])

    def _processes(self) -> tuple[str, list[list[str]]]:
        """Return the state of the running robot, and a row for each of its processes."""
        status = _status(self._plan.robot)
        if status is None:
            return f"no robot {self._plan.robot} runs here", []
        used = self._meter.usage([process.pid for process in status.processes if process.pid])
        columns = [HEAD.index(name) for name in _COLUMNS]
        table = [HEAD, *(row(process, used) for process in status.processes)]
        rows = [[cells[column] for column in columns] for cells in table]
        return f"{self._plan.robot}: {state_of(status)}, since {uptime(status.uptime)}", rows


def _status(name: str) -> RobotStatus | None:
    """Return the state of the robot in this ROS domain, or None."""
    try:
        runtime_dir = _run_of(name)
        return ask(runtime_dir, StatusRequest(), RobotStatus) if runtime_dir else None
    except (RuntimeDirError, RequestRefusedError, OSError):
        return None


def _run_of(name: str) -> RuntimeDir | None:
    """Return the runtime directory of the robot in this domain; None if it does not run.

    Raises:
        RuntimeDirError: if the directories cannot be read.
    """
    domain = domain_of(os.environ)
    runs = (runtime_dir for runtime_dir, _ in running())
    return next((run for run in runs if run.domain == domain and is_meant(run, name)), None)


def _sender(node: Node, topic: str, names: Mapping[str, str]) -> JointSender:
    from tfcompose.tf.ros.graph import UNKNOWN_NODE, gid_identifies_node, writers
    from tfcompose.tf.ros.sensor_data import JointStatePublisher

    own_gids: set[bytes] = set()

    def make() -> JointStatePublisher:
        publisher = JointStatePublisher(node, tuple(names), topic)
        own_gids.add(publisher.gid)
        return publisher

    def other_publishers() -> list[str]:
        name = "" if gid_identifies_node(node) else node.get_fully_qualified_name()
        nodes = {
            writer.node
            for writer in writers(node, topic)
            if writer.gid not in own_gids and writer.node != name
        }
        unnamed = [name for name in nodes if name.endswith(UNKNOWN_NODE)]
        return sorted([*(nodes - set(unnamed)), *(NAMELESS for _ in unnamed)])

    return JointSender(topic, names, make, other_publishers)
