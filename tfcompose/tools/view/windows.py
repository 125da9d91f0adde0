"""Browser windows on one robot, each with its own panel, selection, joints and unsaved moves.

All of them show the same files. A save in one appears in the others. If one window has moved a
pose that another has saved, it reports that before it saves.
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
    import viser

    from tfcompose.compiler.compile import Compiled
    from tfcompose.foundation.findings import Finding
    from tfcompose.tools.view.choices import Choices
    from tfcompose.tools.view.reload import WatchedFiles
    from tfcompose.tools.view.session import Session

#: What windows left that were closed is kept of so many.
_MOST_LEFT = 8


@dataclass(eq=False)
class SceneSource:
    """A source of a scene: frames are where the robot file and the sliders put them.

    A running tree and a recording override this.
    """

    #: Whether mounts can be moved and saved.
    has_edit: bool = False
    #: Whether a window has joint sliders.
    has_joints: bool = True

    def show_in(self, shown: ReloadedPanel) -> None:
        """Add the source's sections to a window, and show its frames there."""

    def run(self, windows: Windows, changed: threading.Event) -> int:
        """Keep the windows up to date until the view ends; return the exit code."""
        while True:
            changed.wait()
            changed.clear()
            windows.reload()


class Windows:
    """Makes a panel for each window that connects to a server, and reloads all of them.

    A new window continues the state of a closed one, because browsers reconnect when a page is
    reloaded or a computer sleeps.

    Args:
        server: where windows connect.
        session: what is shown; nothing is moved in it.
        files: what the session was read with.
        source: where frames are, and which sections a window has.
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
        for shown in self.panels:
            shown.panel.end()

    def reload(self) -> bool:
        """Read the files again if they have changed, and show them in all windows.

        Return whether there is a new robot.
        """
        with self._lock:
            if not self.files.differ():
                return False
            texts, state = self.session.read_again(self.files)
            for shown in self._open.values():
                if shown.accept(texts, state):
                    self._source.show_in(shown)
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
            shown = ReloadedPanel(
                place,
                session,
                self.files,
                edit=self._source.has_edit,
                joints=self._source.has_joints,
                choices=choices,
                window=Window(self._server, self._lock, lambda: self._share(number)),
            )
            self._open[number] = shown
            if self._findings:
                shown.show(self._findings)
            self._source.show_in(shown)

    def _remove(self, client: viser.ClientHandle) -> None:
        with self._lock:
            shown = self._open.pop(client.client_id, None)
            if shown is not None:
                shown.panel.end()
                self._left = [*self._left, (shown.session, shown.panel.choices)][-_MOST_LEFT:]

    def _share(self, number: int) -> None:
        """Show in all other windows what one has saved, and say so."""
        saved = self._open[number].session
        texts, state = dict(saved.texts), saved.state
        for other, shown in self._open.items():
            if other == number:
                continue
            conflicts = _conflicts(shown.session, state)
            if shown.accept(texts, state):
                self._source.show_in(shown)
            shown.panel.window.conflicts |= conflicts
            shown.panel.say(_word(list(shown.session.moved), conflicts))
        self._replace(texts, state)


def _conflicts(session: Session, state: Compiled) -> set[str]:
    """Return the frames that were moved in a session and have another pose in the files now."""
    before = session.state.robot.edges if session.state.robot else ()
    poses = {edge.child: edge.pose for edge in before}
    after = state.robot.edges if state.robot else ()
    return {
        edge.child
        for edge in after
        if edge.child in session.moved and edge.pose != poses.get(edge.child)
    }


def _word(moved: list[str], conflicts: set[str]) -> str:
    """Return what to say of a save in another window."""
    lines = ["another window saved its moves, which are shown here now"]
    if moved:
        lines.append(f"not saved yet here: {list_names(moved)}")
    if conflicts:
        lines.append(f"moved in both: {list_names(sorted(conflicts))}")
    return paragraphs([escape(line) for line in lines])
