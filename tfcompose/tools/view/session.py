"""Session of a robot in the view: moved poses, undo, and saving."""

from __future__ import annotations

from collections import Counter
from dataclasses import InitVar, dataclass, field, replace
from difflib import unified_diff
from typing import TYPE_CHECKING

from tfcompose.compiler.compile import Compiled
from tfcompose.compiler.mounts.edit import Elsewhere, MountEdits, change_of, mount_of
from tfcompose.foundation.findings import RejectedError, apply_edits

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from collections.abc import Set as AbstractSet

    from tfcompose.compiler.mounts.edit import Mount
    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Pose
    from tfcompose.model.robot import Robot


@dataclass(frozen=True, slots=True)
class Saved:
    """The result of saving."""

    diff: str = ""
    findings: tuple[Finding, ...] = ()
    #: New errors that prevented the save.
    refused: tuple[Finding, ...] = ()
    #: Poses that no edit of the files can set.
    elsewhere: tuple[Elsewhere, ...] = ()


@dataclass(slots=True)
class Session:
    """A robot with moved mounts."""

    #: The texts of editable files by name; the robot file is first.
    texts: Mapping[str, str]
    #: A function that compiles texts without writing them.
    compiled: Callable[[Mapping[str, str]], Compiled]
    #: A function that replaces a file's old text by a new text. Its arguments are the file, the
    #: old text and the new text.
    write: Callable[[str, str, str], None]
    #: The result of compiling ``texts``, if it is available.
    already_compiled: InitVar[Compiled | None] = None
    #: The compiled ``texts``.
    state: Compiled = field(init=False)
    #: The new poses of moved frames in their parents, by frame.
    moved: dict[str, Pose] = field(default_factory=dict)
    _undo: list[dict[str, Pose]] = field(default_factory=list)
    _redo: list[dict[str, Pose]] = field(default_factory=list)

    def __post_init__(self, already_compiled: Compiled | None) -> None:
        self.state = self.compiled(self.texts) if already_compiled is None else already_compiled

    @property
    def robot(self) -> Robot:
        """The robot with its moved mounts.

        Raises:
            ValueError: if the files have errors and give no robot.
        """
        if self.state.robot is None:
            raise ValueError("the files give no robot")
        moved = self.moved
        edges = (
            replace(edge, pose=moved.get(edge.child, edge.pose)) for edge in self.state.robot.edges
        )
        return replace(self.state.robot, edges=tuple(edges))

    def fork(self) -> Session:
        """Return a session on the same files, without moved frames."""
        return Session(self.texts, self.compiled, self.write, self.state)

    def read_again(self, read: Callable[[str], str]) -> tuple[dict[str, str], Compiled]:
        """Return the current texts and the result of compiling them.

        If a file cannot be read, return no texts.
        """
        try:
            texts = {file: read(file) for file in self.texts}
            return texts, self.compiled(texts)
        except RejectedError as error:
            return {}, Compiled(None, error.findings)

    def accepts(self, state: Compiled) -> bool:
        """Return whether the view can show changed files.

        They must give a robot. If the robot had no errors before, the changed files must also have
        none.
        """
        got_worse = bool(state.errors and not self.state.errors)
        return state.robot is not None and bool(state.robot.frames) and not got_worse

    def replace(self, texts: Mapping[str, str], state: Compiled) -> None:
        """Use files that changed on disk, and the result of compiling them.

        Moves of removed frames are lost.
        """
        self.texts, self.state = texts, state
        frames = state.robot.frames if state.robot else {}
        self.moved = {child: pose for child, pose in self.moved.items() if child in frames}
        self._undo.clear()
        self._redo.clear()

    def mount(self, child: str) -> Mount:
        """Return the pose in the file for the edge above a frame.

        If the file contains no pose for a frame inside a sensor, the frame moves with the sensor.

        Raises:
            ImmovableError: if the view cannot move the frame.
        """
        robot, source = self.robot, self.state.sources[0]
        mount = mount_of(robot, source, child)
        if mount.edge.sensor and not mount.edge.declared and not mount.data:
            holder = next(
                (sensor.mount for sensor in robot.sensors if sensor.name == mount.edge.sensor),
                child,
            )
            return mount_of(robot, source, holder)
        return mount

    def move(self, child: str, pose: Pose) -> None:
        """Move a frame to a pose in its parent; ``undo`` reverts the move."""
        self._undo.append(dict(self.moved))
        self._redo.clear()
        self.moved[child] = pose

    @property
    def touched(self) -> frozenset[str]:
        """The frames that are moved, or were and can be again by ``undo`` or ``redo``."""
        return frozenset(
            child for step in (self.moved, *self._undo, *self._redo) for child in step
        )

    def undo(self) -> bool:
        """Revert the last move; False if there is none."""
        return self._step(self._undo, self._redo)

    def redo(self) -> bool:
        """Repeat the move that was reverted last; False if there is none."""
        return self._step(self._redo, self._undo)

    def _step(self, source: list[dict[str, Pose]], target: list[dict[str, Pose]]) -> bool:
        if source:
            target.append(self.moved)
            self.moved = source.pop()
            return True
        return False

    def save(self) -> Saved:
        """Write the moved poses to the files that contain them, unless this adds an error.

        Raises:
            OSError: if a file cannot be written, or has changed in the meantime.
        """
        texts, state, elsewhere = dict(self.texts), self.state, dict[str, Elsewhere]()
        for child, pose in self.moved.items():
            if state.robot is None:
                break
            change = change_of(state.robot, state.sources[0], texts, child, pose)
            if isinstance(change, Elsewhere):
                elsewhere[child] = change
            elif change.edits:
                texts |= _with(texts, change)
                state = self.compiled(texts)
        before = Counter((error.code, error.message) for error in self.state.errors)
        refused = tuple(error for error in state.errors if not before[error.code, error.message])
        if refused:
            return Saved(refused=refused, elsewhere=tuple(elsewhere.values()))
        diff = ""
        for file, text in texts.items():
            old = self.texts[file]
            if text != old:
                self.write(file, old, text)
                lines = unified_diff(
                    old.splitlines(keepends=True), text.splitlines(keepends=True), file, file
                )
                diff += "".join(lines)
        self._keep_undo(self.moved.keys() - elsewhere.keys())
        self.texts, self.state = texts, state
        self.moved = {child: pose for child, pose in self.moved.items() if child in elsewhere}
        return Saved(diff, state.findings, elsewhere=tuple(elsewhere.values()))

    def _keep_undo(self, saved: AbstractSet[str]) -> None:
        """Keep the earlier poses, so that undo and redo also revert the save."""
        edges = self.state.robot.edges if self.state.robot else ()
        before = {edge.child: edge.pose for edge in reversed(edges) if edge.child in saved}
        for step in (*self._undo, *self._redo):
            step.update({child: pose for child, pose in before.items() if child not in step})


def _with(texts: Mapping[str, str], change: MountEdits) -> dict[str, str]:
    files = {edit.span.file for edit in change.edits}
    new = {
        file: apply_edits(texts[file], [edit for edit in change.edits if edit.span.file == file])
        for file in files
    }
    return {file: text for file, text in new.items() if text is not None}
