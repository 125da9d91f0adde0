"""Browser windows of a view, each with its own panel, selection, joints and unsaved moves.

All windows show the same files. When a window saves, all other windows show the change. If a
window has moved a mount that another window has saved, it reports this before it saves.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

from tfcompose.foundation.text import list_names
from tfcompose.tools.view.findings import paragraphs
from tfcompose.tools.view.panel import Window
from tfcompose.tools.view.reload import ReloadedPanel, meshes_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    import viser

    from tfcompose.compiler.compile import Compiled
    from tfcompose.foundation.findings import Finding
    from tfcompose.tools.view.choices import Choices
    from tfcompose.tools.view.reload import WatchedFiles
    from tfcompose.tools.view.session import Session

#: The maximum number of closed windows whose state is kept.
_MOST_LEFT = 8


@dataclass(eq=False)
class SceneSource:
    """A source of poses. This base class uses the poses of the robot file and the sliders.

    Subclasses use the poses of a running tree or a recording.
    """

    #: Whether mounts can be moved and saved.
    has_edit: bool = False
    #: Whether windows have joint sliders.
    has_joints: bool = True

    def show_in(self, panel: ReloadedPanel) -> None:
        """Add the source's sections to a window, and show its frames there."""

    def take_save(self, panel: ReloadedPanel) -> None:
        """Compare with the files as a window has just saved them."""

    def take_moves(self, session: Session) -> Sequence[str]:  # noqa: ARG002 (an override uses it)
        """Follow the mounts that were moved in a window's session; return lines about that."""
        return ()

    def run(self, windows: Windows, changed: threading.Event) -> int:
        """Keep the windows up to date until the view ends; return the exit code."""
        while True:
            changed.wait()
            changed.clear()
            windows.reload()


class Windows:
    """Makes a panel for each window that connects to a server, and reloads all panels.

    A new window continues with the state of a closed window, because browsers reconnect when a
    page is reloaded or when a computer wakes up.

    ``session`` has no moved frames. ``files`` read its files. ``source`` sets the poses, and the
    sections of a window.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        files: WatchedFiles,
        source: SceneSource,
    ) -> None:
        self.session = session
        self.files = files
        self._server = server
        self._source = source
        self._lock = threading.RLock()
        self._open: dict[int, ReloadedPanel] = {}
        self._left: list[tuple[Session, Choices]] = []
        self._findings: tuple[Finding, ...] = ()
        files.look_at(meshes_of(session.robot))
        server.scene.world_axes.visible = False
        server.on_client_connect(lambda client: self.add(client, client.client_id))
        server.on_client_disconnect(self._remove)

    @property
    def panels(self) -> tuple[ReloadedPanel, ...]:
        """The panels of open windows, in the order of opening."""
        with self._lock:
            return tuple(self._open.values())

    def end(self) -> None:
        """Stop all panels from moving anything."""
        for panel in self.panels:
            panel.panel.end()

    def reload(self) -> bool:
        """If the files have changed, read them and show them in all windows.

        Return whether there is a new robot.
        """
        with self._lock:
            if not self.files.differ():
                return False
            texts, state = self.session.read_again(self.files)
            for panel in self._open.values():
                if panel.accept(texts, state):
                    self._source.show_in(panel)
            self._findings = state.findings
            if not self.session.accepts(state):
                return False
            self._findings = state.findings if state.errors else ()
            self._replace(texts, state)
            return True

    def _replace(self, texts: dict[str, str], state: Compiled) -> None:
        for session in (self.session, *(session for session, _ in self._left)):
            session.replace(texts, state)

    def add(self, place: viser.ViserServer | viser.ClientHandle, number: int) -> None:
        """Make a panel for the window with this number, and register it."""
        with self._lock:
            session, choices = self._left.pop() if self._left else (self.session.fork(), None)
            panel = ReloadedPanel(
                place,
                session,
                self.files,
                edit=self._source.has_edit,
                joints=self._source.has_joints,
                choices=choices,
                window=Window(
                    self._server,
                    self._lock,
                    share=lambda: self._share(number),
                    take_moves=lambda: self._source.take_moves(session),
                ),
            )
            self._open[number] = panel
            if self._findings:
                panel.show(self._findings)
            self._source.show_in(panel)

    def _remove(self, client: viser.ClientHandle) -> None:
        with self._lock:
            panel = self._open.pop(client.client_id, None)
            if panel is not None:
                panel.panel.end()
                self._left = [*self._left, (panel.session, panel.panel.choices)][-_MOST_LEFT:]

    def _share(self, number: int) -> None:
        """Show a save of a window in all other windows, with a notice."""
        saved = self._open[number].session
        texts, state = dict(saved.texts), saved.state
        for panel_number, panel in self._open.items():
            if panel_number == number:
                self._source.take_save(panel)
                continue
            conflicts = _conflicts(panel.session, state)
            if panel.accept(texts, state):
                self._source.show_in(panel)
            panel.panel.window.conflicts |= conflicts
            panel.panel.say(_word(list(panel.session.moved), conflicts))
        self._replace(texts, state)


def _conflicts(session: Session, state: Compiled) -> set[str]:
    """Return the frames that a session has moved and whose poses in the files have changed."""
    before = session.state.robot.edges if session.state.robot else ()
    poses = {edge.child: edge.pose for edge in before}
    after = state.robot.edges if state.robot else ()
    return {
        edge.child
        for edge in after
        if edge.child in session.moved and edge.pose != poses.get(edge.child)
    }


def _word(moved: list[str], conflicts: set[str]) -> str:
    """Return the notice about a save in another window."""
    lines = ["another window saved its moves, which are shown here now"]
    if moved:
        lines.append(f"not saved yet here: {list_names(moved)}")
    if conflicts:
        lines.append(f"moved in both: {list_names(sorted(conflicts))}")
    return paragraphs([escape(line) for line in lines])
