"""Published tree of a running or recorded robot: frames, ghosts, findings and processes."""

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
#: Of the names of frames that nobody declared so many are shown.
_MOST = 40


class PublishedTree:
    """The panel's section about the running or recorded tree of its robot."""

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
        #: The slider of a recording's time, in seconds; None: the tree runs.
        self.time: Any = None
        fixed = panel.choices.fixed or tree.robot.base  # what drives off stays in the picture
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
        """Update the scene to the current tree; unchanged frames send nothing."""
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
        """Show whether sliders publish joint states, or which node does instead."""
        _set(self._joints, paragraphs([escape(line) for line in lines]))

    def show_processes(self, title: str, rows: Sequence[Sequence[str]]) -> None:
        """Show the processes of the running robot; the first row has the column heads."""
        _set(self._processes, _table(title, rows))

    def _show_further(self, picture: Picture) -> None:
        """Show frames that nobody declared, by their names."""
        for frame in self._further.keys() - picture.further.keys():
            self._further.pop(frame).remove()
        for number, (frame, pose) in enumerate(picture.further.items()):
            if frame not in self._further:
                if len(self._further) >= _MOST:
                    break
                self._further[frame] = self._scene.add_label(f"/live/further/{number}", frame)
            self._further[frame].position = pose.xyz


class _ColouredLines:
    """Lines of one colour, as many as there are just now."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        self._scene = scene
        self._name = name
        self._colour = colour
        self._handle: Any = None
        self._points = np.zeros((0, 2, 3), np.float32)

    def show(self, points: Any) -> None:
        """Show lines between these ends, shape (lines, 2, 3)."""
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
