"""Reload of a view when files change on disk.

While the files have errors, the view keeps the last valid scene and shows the findings.
"""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import watchfiles

from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.reading import is_folder
from tfcompose.tools.view.findings import findings_html
from tfcompose.tools.view.panel import Panel

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    import viser
    from typing_extensions import Self

    from tfcompose.compiler.compile import Compiled
    from tfcompose.foundation.findings import Finding
    from tfcompose.model.robot import Robot
    from tfcompose.tools.view.session import Session

#: Changes within this time in milliseconds count as a single change.
_TOGETHER_MS = 100


class WatchedFiles:
    """Reads files and remembers their contents, to find changes.

    For a mesh, it remembers the time of the last change instead.
    """

    def __init__(self, read: Callable[[str], str]) -> None:
        self._read = read
        self._texts: dict[str, str] = {}
        self._meshes: dict[str, int] = {}

    def __call__(self, file: str) -> str:
        """Return the text of a file; raise the exceptions of the reader."""
        self._texts.setdefault(file, "")  # the file may be created later
        text = self._texts[file] = self._read(file)
        return text

    def wrote(self, file: str, text: str) -> None:
        """Remember a text that the view has written, so that it does not count as a change."""
        self._texts[file] = text

    def look_at(self, meshes: Iterable[str]) -> None:
        """Remember the times of the last changes of these mesh files, and forget other meshes."""
        self._meshes = {file: _mtime_ns(file) for file in meshes}

    @property
    def folders(self) -> set[Path]:
        """The folders of all files. The watcher watches folders, because editors replace files."""
        files = (*self._texts, *self._meshes)
        return {
            folder for file in files if is_folder(folder := Path(os.path.realpath(file)).parent)
        }

    def differ(self) -> bool:
        """Return whether a file's text or a mesh has changed since it was read."""
        return any(self._now(file) != text for file, text in self._texts.items()) or any(
            _mtime_ns(file) != before for file, before in self._meshes.items()
        )

    def _now(self, file: str) -> str:
        try:
            return self._read(file)
        except RejectedError:
            return ""


def _mtime_ns(file: str) -> int:
    try:
        return Path(file).stat().st_mtime_ns
    except OSError:
        return 0


class Watcher:
    """Sets ``changed`` when watched files change.

    It watches in its own thread, inside a ``with`` block.
    """

    def __init__(self, files: WatchedFiles) -> None:
        self.changed = threading.Event()
        self._files = files
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="watcher", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._over.is_set():
            folders = self._files.folders
            for _ in watchfiles.watch(
                *folders,
                watch_filter=None,
                debounce=_TOGETHER_MS,
                stop_event=self._over,
                rust_timeout=500,
                yield_on_timeout=True,
                raise_interrupt=False,
                recursive=False,
            ):
                if self._files.differ():
                    self.changed.set()
                if self._files.folders != folders:
                    break


def meshes_of(robot: Robot) -> set[str]:
    """Return the mesh files that a robot's bodies name."""
    bodies = (
        shape for link in robot.links.values() for shape in (*link.visuals, *link.collisions)
    )
    return {shape.mesh.path for shape in bodies if shape.mesh and shape.mesh.path}


class ReloadedPanel:
    """The panel of a session, rebuilt for each valid version of its files.

    ``server`` is the server or the window that shows the panel. ``files`` read the files of the
    session. ``options`` are the options of ``Panel``.
    """

    def __init__(
        self,
        server: viser.ViserServer | viser.ClientHandle,
        session: Session,
        files: WatchedFiles,
        **options: Any,
    ) -> None:
        self.session = session
        self.files = files
        self.server = server
        self._options = options
        self._broken: Any = None
        self.panel = Panel(server, session, **options)
        files.look_at(meshes_of(session.robot))

    def accept(self, texts: Mapping[str, str], state: Compiled) -> bool:
        """Show the current files or, if they have errors, the findings.

        Return whether there is a new panel.
        """
        if not self.session.accepts(state):
            self.show(state.findings)
            return False
        self.session.replace(texts, state)
        self.files.look_at(meshes_of(self.session.robot))
        before = self.panel
        before.end()
        with self.server.atomic():
            self.server.gui.reset()
            self.server.scene.reset()
            self._broken = None
            options = self._options | {"choices": before.choices, "window": before.window}
            self.panel = Panel(self.server, self.session, **options)
        if state.errors:
            self.show(state.findings)
        return True

    @property
    def report(self) -> str:
        """The findings about the current files as HTML; empty if there are none."""
        return self._broken.content if self._broken else ""

    def show(self, findings: tuple[Finding, ...]) -> None:
        """Show the findings about the current files."""
        if self._broken is None:
            with self.server.gui.add_folder("File", order=-2):
                self._broken = self.server.gui.add_html("")
        self._broken.content = findings_html(findings)
