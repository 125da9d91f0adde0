"""Panel section for the tree of a running or recorded robot."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from tfcompose.tools.view.findings import findings_html, paragraphs
from tfcompose.tools.view.scene import Ghosts

if TYPE_CHECKING:
    from collections.abc import Sequence

    import viser

    from tfcompose.tools.view.panel import Panel
    from tfcompose.tools.view.picture import Picture, ShownTree

_RED = (220, 30, 30)
#: The maximum number of undeclared frames whose names the view shows.
_MOST = 40


class PublishedTree:
    """Shows the frames, expected poses, findings and processes of a running or recorded robot."""

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        panel: Panel,
        tree: ShownTree,
        title: str = "Live",
    ) -> None:
        self.tree = tree
        self._panel = panel
        self._scene = server.scene
        self._ghosts = Ghosts(server.scene, tree.robot)
        self._wrong = _ColouredLines(server.scene, "/live/wrong", _RED)
        self._further: dict[str, Any] = {}
        #: The time slider of a recording, in seconds; None for a running tree.
        self.time: Any = None
        fixed = panel.choices.fixed or tree.robot.base  # keeps a driving robot in view
        tree.fixed = fixed if fixed in tree.robot.frames else tree.robot.roots()[0]
        with server.gui.add_folder(title, order=-1):
            self.fixed: Any = server.gui.add_dropdown(
                "fixed frame", tuple(tree.robot.frames), initial_value=tree.fixed
            )
            self._edge = server.gui.add_html("")
            self._found = server.gui.add_html("")
            self._joints = server.gui.add_html("")
            self._processes = server.gui.add_html("")
        panel.tree.on_select(self.show_text)
        self.fixed.on_update(lambda _: self._fix())

    def _fix(self) -> None:
        self.tree.fixed = self._panel.choices.fixed = self.fixed.value

    def show(self) -> None:
        """Update the scene to the current tree; send only frames that have changed."""
        picture = self.tree.next_picture()
        if picture is None:
            return
        self._panel.published = picture.poses
        self._panel.scene.update(picture.robot, picture.poses)
        self._ghosts.show(picture.ghosts)
        self._wrong.show(_ends(picture))
        self._show_further(picture)

    def show_text(self) -> None:
        """Show the findings, and the facts about the selected frame."""
        frame = self._panel.selected
        self._panel.tree.mark(self.tree.judgement.wrong)
        _set(
            self._edge,
            paragraphs([f"<b>{escape(frame)}</b>", *map(escape, self.tree.about(frame))]),
        )
        _set(self._found, findings_html(self.tree.judgement.findings, self.tree.judgement.summary))

    def show_joints(self, lines: Sequence[str]) -> None:
        """Show if sliders publish joint states, or which other node does."""
        _set(self._joints, paragraphs([escape(line) for line in lines]))

    def show_processes(self, title: str, rows: Sequence[Sequence[str]]) -> None:
        """Show the processes of the running robot; the first row has the column heads."""
        _set(self._processes, _table(title, rows))

    def _show_further(self, picture: Picture) -> None:
        """Show undeclared frames with their names."""
        for frame in self._further.keys() - picture.further.keys():
            self._further.pop(frame).remove()
        for number, (frame, pose) in enumerate(picture.further.items()):
            if frame not in self._further:
                if len(self._further) >= _MOST:
                    break
                self._further[frame] = self._scene.add_label(f"/live/further/{number}", frame)
            self._further[frame].position = pose.xyz


class _ColouredLines:
    """A varying number of lines with the same colour."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        self._scene = scene
        self._name = name
        self._colour = colour
        self._handle: Any = None
        self._points = np.zeros((0, 2, 3), np.float32)

    def show(self, points: Any) -> None:
        """Show lines between end points, an array of shape (lines, 2, 3)."""
        if np.array_equal(points, self._points):
            return
        if self._handle is not None and len(points) != len(self._points):
            self._handle.remove()
            self._handle = None
        self._points = points
        if self._handle is not None:
            self._handle.points = points
        elif len(points):
            self._handle = self._scene.add_line_segments(
                self._name, points, self._colour, thickness=6, thickness_units="screen"
            )


def _ends(picture: Picture) -> Any:
    poses = {**picture.further, **picture.poses}
    ends = [(poses[parent].xyz, poses[child].xyz) for parent, child in picture.wrong]
    return np.array(ends, np.float32).reshape(-1, 2, 3)


def _table(title: str, rows: Sequence[Sequence[str]]) -> str:
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return (
        '<div style="padding: 0 0.7em; font-size:'
        f' 0.8em">{escape(title)}<table>{body}</table></div>'
    )


def _set(handle: Any, content: str) -> None:
    if handle.content != content:
        handle.content = content
