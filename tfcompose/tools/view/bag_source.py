"""Source of a scene for ``view --bag``: a recording at a chosen time."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from tfcompose.cli.live import from_bag
from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.model.plan.topics import parts_of
from tfcompose.tools.view.bag import BagTree, Recorded
from tfcompose.tools.view.published_tree import PublishedTree
from tfcompose.tools.view.view_session import plan_of_session
from tfcompose.tools.view.windows import SceneSource

if TYPE_CHECKING:
    import viser

    from tfcompose.foundation.geometry import Offset
    from tfcompose.tools.view.panel import Panel
    from tfcompose.tools.view.reload import ReloadedPanel
    from tfcompose.tools.view.session import Session

#: The longest recording, in seconds. A larger ``--at`` is a time since the epoch.
_LONGEST_S = 1e8
#: The step of the time slider, in seconds.
_STEP_S = 0.01


class BagSource(SceneSource):
    """Shows the robot of a session at the poses that a bag has at a chosen time.

    Raises:
        SystemExit: after printing why the bag cannot be shown, or not at that time.
    """

    def __init__(self, path: str, at_s: float, session: Session, tolerance: Offset) -> None:
        super().__init__(has_joints=False)
        plan = plan_of_session(session)
        self._recorded = from_bag(lambda: Recorded(path, parts_of(plan)))
        self._tolerance = tolerance
        self._at_s = at_s - self._recorded.begin_ns / 1e9 if at_s > _LONGEST_S else at_s
        if not 0 <= self._at_s <= self._recorded.length_s:
            length = f"{self._recorded.length_s:.2f}"
            fail(
                f"--at {at_s:g} is not in {path}: it lasts {length} s from its first transform",
                UNREADABLE,
            )

    def show_in(self, panel: ReloadedPanel) -> None:
        """Show the recording in a window, with the current robot."""
        session, choices = panel.session, panel.panel.choices
        tree = BagTree(session.robot, plan_of_session(session), self._recorded, self._tolerance)
        tree.at_s = self._at_s if choices.at_s is None else choices.at_s
        show_recording(panel.server, panel.panel, tree, self._recorded.length_s)


def show_recording(
    server: viser.ViserServer | viser.ClientHandle, panel: Panel, tree: BagTree, length_s: float
) -> PublishedTree:
    """Add a recorded tree and a time slider to the panel of its robot."""
    section = PublishedTree(server, panel, tree, "Tree")
    with server.gui.add_folder("Recording", order=-2):
        slider = server.gui.add_slider(
            "time (s)", 0.0, max(length_s, _STEP_S), _STEP_S, min(tree.at_s, length_s)
        )
    lock = threading.Lock()

    def show(_event: object = None) -> None:
        with lock:
            tree.at_s = panel.choices.at_s = slider.value
            section.show()
            section.show_text()

    for control in (slider, section.fixed):
        control.on_update(show)
    show()
    section.time = slider
    return section
