"""``view --live``: the browser view follows the running tree until a signal ends it."""

from __future__ import annotations

import os
import time
from typing import TYPE_CHECKING

from tfcompose.cli.live import set_up_ros
from tfcompose.cli.process_table import HEAD, row, uptime
from tfcompose.cli.runs import is_meant, running
from tfcompose.cli.terminal import INTERRUPTED, reject
from tfcompose.cli.view_session import plan_of_session
from tfcompose.findings import finding
from tfcompose.ipc import RobotStatus, StatusRequest
from tfcompose.launcher.control import RefusedError, ask
from tfcompose.launcher.procfs import UsageMeter
from tfcompose.launcher.runtime_dir import RuntimeDirError, domain_of
from tfcompose.live.edges import SETTLE_S, TreeObserver
from tfcompose.plan.topics import parts_of
from tfcompose.ros.environment import RosError
from tfcompose.signals import Stop
from tfcompose.view.live import LiveTree
from tfcompose.view.live_panel import LivePanel

if TYPE_CHECKING:
    import threading
    from collections.abc import Mapping

    import viser

    from tfcompose.geometry import Offset
    from tfcompose.plan import Plan
    from tfcompose.view.reload import ReloadedPanel

    Topics = tuple[str, str]

#: How often the scene is moved, the tree judged, and the launcher asked for its state; seconds.
_SHOW_EVERY_S, _JUDGE_EVERY_S, _ASK_EVERY_S = 0.04, 0.25, 2.0
#: Rates and gaps are those of the last one to two of these; seconds.
_WINDOW_S = 5.0


def observers_of(plan: Plan) -> dict[Topics, TreeObserver]:
    """Return an observer for each pair of topics (moving, fixed) of the plan."""
    return {topics: TreeObserver(_WINDOW_S, SETTLE_S) for topics in parts_of(plan)}


class Following:
    """Moves the scene, judges and asks, each as often as it is due; of a file that changed it shows the new robot."""

    def __init__(
        self,
        server: viser.ViserServer,
        shown: ReloadedPanel,
        observers: Mapping[Topics, TreeObserver],
        tolerance: Offset,
        changed: threading.Event,
    ) -> None:
        self._server = server
        self._shown = shown
        self._observers = observers
        self._tolerance = tolerance
        self._changed = changed
        self._meter = UsageMeter()
        self._begun = time.monotonic()
        self._follow()

    def _follow(self) -> None:
        """Follow the robot that the session has now."""
        session = self._shown.session
        plan = plan_of_session(session)
        observers = {topics: self._observers.get(topics) or TreeObserver() for topics in parts_of(plan)}
        self.tree = LiveTree(session.robot, plan, observers, self._tolerance)
        self._panel = LivePanel(self._server, self._shown.panel, self.tree)
        self._name = plan.robot
        self._judge_at = self._ask_at = 0.0

    def show(self) -> None:
        """Show what came since the last time."""
        now = time.monotonic()
        if self._changed.is_set():
            self._changed.clear()
            if self._shown.reload():
                self._follow()
        if now >= self._judge_at:
            self.tree.judge(now - self._begun)
            self._panel.show_text()
            self._judge_at = time.monotonic() + _JUDGE_EVERY_S
        self._panel.show()
        if now >= self._ask_at:
            self._ask_at = now + _ASK_EVERY_S
            self._show_processes()

    def _show_processes(self) -> None:
        status = _status(self._name)
        if status is None:
            self._panel.show_processes(f"no robot {self._name} runs here", [])
            return
        used = self._meter.usage([one.pid for one in status.processes if one.pid])
        state = "stopping" if status.stopping else "tree complete" if status.complete else "tree not complete"
        rows = [HEAD, *(row(process, used) for process in status.processes)]
        self._panel.show_processes(f"{self._name}: {state}, since {uptime(status.uptime)}", rows)


def _status(name: str) -> RobotStatus | None:
    """Return the state of the robot that runs in this domain, or None."""
    try:
        domain = domain_of(os.environ)
        places = [place for place, _ in running() if place.domain == domain and is_meant(place, name)]
        return ask(places[0], StatusRequest(), RobotStatus) if places else None
    except (RuntimeDirError, RefusedError, OSError):
        return None


def follow(server: viser.ViserServer, shown: ReloadedPanel, changed: threading.Event, tolerance: Offset) -> int:
    """Show the running tree until a signal comes; return the exit code.

    Raises:
        SystemExit: after saying why ROS cannot be started.
    """
    plan = plan_of_session(shown.session)
    set_up_ros(plan.ros)
    from tfcompose.live.listener import listen  # rclpy reads the environment when it is loaded

    observers = observers_of(plan)
    following = Following(server, shown, observers, tolerance, changed)
    with Stop() as stop:
        try:
            listen("tfcompose_view", observers, stop, duration_s=None, every_s=_SHOW_EVERY_S, show=following.show)
        except RosError as error:
            reject([finding("TF901", str(error), None)])
    return INTERRUPTED
