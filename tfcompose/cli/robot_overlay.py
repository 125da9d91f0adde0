"""Overlay of one robot: compiling with it, and writing a mount's pose into it."""

from __future__ import annotations

import fcntl
import os
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from tfcompose.cli.compiling import compile_loaded, load_robot, overlays_of
from tfcompose.cli.fixing import ChangedError, rewrite
from tfcompose.cli.reading import read_text
from tfcompose.cli.writing import replace_file
from tfcompose.compiler.mounts.edit import ImmovableError, mount_of
from tfcompose.foundation.findings import RejectedError, finding
from tfcompose.foundation.geometry import angle_between, norm
from tfcompose.foundation.reading import exists
from tfcompose.spec.language import load_robot_overlay, overlay_path
from tfcompose.spec.language.overlay_text import OverlayChange, OverlayTextError, read_overlay
from tfcompose.spec.load import load

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterator, Mapping
    from datetime import date

    from tfcompose.compiler.compile import Compiled
    from tfcompose.compiler.mounts.edit import Mount
    from tfcompose.foundation.geometry import Pose
    from tfcompose.spec.language.overlay_text import OverlayText
    from tfcompose.spec.load import Source

#: By how much a pose that is read back may differ from the one written, in metres and radians.
_TOLERANCE = 1e-6
#: The length of the path of a part in the robot file.
_PART = 2


@dataclass(frozen=True, slots=True)
class RobotOverlay:
    """A robot file, and the overlay of one robot, which may not exist yet."""

    source: Source
    #: The options of ``add_variant``, without --robot.
    arguments: Namespace
    #: The overlay's file.
    path: str
    #: Its text; None: there is no such file.
    text: str | None
    #: The day whose calibrations apply; None: those that are still valid.
    day: date | None = None

    @classmethod
    def open(
        cls, file: str, arguments: Namespace, robot: str, day: date | None = None
    ) -> RobotOverlay:
        """Return the overlay of the robot with this name.

        Raises:
            RejectedError: if the robot file has no overlays, or a file cannot be read.
        """
        source = load_robot(file)
        path = overlay_path(source, robot)
        options = copy(arguments)
        options.overlay_robot, options.by_hostname = None, False
        return cls(source, options, path, read_text(path) if exists(path) else None, day)

    def compile(self, text: str | None, *further: Source) -> Compiled:
        """Return the robot with this text as its overlay, and further ones merged over it.

        Raises:
            RejectedError: if a file cannot be read, or the robot has errors.
        """
        compiled = self._compile(text, *further)
        if compiled.robot is None or compiled.errors:
            raise RejectedError(list(compiled.findings))
        return compiled

    def _compile(self, text: str | None, *further: Source) -> Compiled:
        def read(file: str) -> str:
            return text if text is not None and file == self.path else read_text(file)

        overlays = [] if text is None else [load_robot_overlay(self.path, read)]
        overlays += overlays_of(self.arguments, self.source, read)
        return compile_loaded(self.source, [*overlays, *further], self.arguments, self.day, read)

    def save(
        self, child: str, parent_from_child: Pose, tool: str, source: str = "", *, joins: bool
    ) -> bool:
        """Write a frame's pose in its parent; return False if it has that pose already.

        The file and its folder are created if missing; a reader sees the old text or the new one.

        Raises:
            RejectedError: if the overlay cannot give the frame this pose; nothing is written.
            OSError: if the file cannot be written, or changed meanwhile; it is unchanged.
        """
        text = self.with_pose(child, parent_from_child, tool, source, joins=joins)
        if text is None:
            return False
        self.write(text)
        return True

    def with_pose(
        self, child: str, parent_from_child: Pose, tool: str, source: str = "", *, joins: bool
    ) -> str | None:
        """Return the text with a frame's pose in its parent; None if it has that pose already.

        Each pose is one of the mount's history, with its date, the ``tool``, the ``source`` of
        the pose, and the pose that it replaced. With ``joins``, it is joined with the newest if
        that is from the same tool: a hundred nudges are one.

        Raises:
            RejectedError: if the overlay cannot give the frame this pose.
        """
        mount = fixed_mount(self.compile(self.text), child)
        if _is_same(mount.edge.pose, parent_from_child):
            return None
        overlay = self._read()
        adjustments = list(overlay.adjustments(mount.entry))
        adjustment = OverlayChange(
            datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
            tool,
            {key: _parse(value) for key, value in mount.pose_values(mount.edge.pose).items()},
            source,
            overlay.pose_of(mount.entry, self.path),
        )
        if joins and adjustments and adjustments[-1].tool == tool:
            first = adjustments.pop()
            adjustment = replace(
                adjustment, replaced=first.replaced, before=first.before, further=first.further
            )
        values = self._values(mount, parent_from_child)
        new = self._with_pose(overlay, mount, values)
        text = self._render(new.with_history(mount.entry, [*adjustments, adjustment]))
        edge = self._robot_edge(text, child)
        if edge is None or not _is_same(edge, parent_from_child):
            self._refuse(f"another overlay, a setting or a calibration places {child}")
        return text

    def without_newest(self, mount: Mount) -> tuple[OverlayChange, str]:
        """Return the newest write of a mount's pose, and the overlay's text without it.

        Raises:
            RejectedError: if there is none, or the overlay cannot be edited.
        """
        overlay = self._read()
        adjustments = overlay.adjustments(mount.entry)
        if not adjustments:
            message = f"{self.path} has no earlier pose of {mount.edge.child}"
            raise RejectedError([finding("TF663", message, self.source.key_span(("overlays",)))])
        *rest, newest = adjustments
        new = self._with_pose(overlay, mount, newest.keys_before())
        return newest, self._render(new.with_history(mount.entry, rest))

    def write(self, text: str) -> None:
        """Write the overlay's new text, atomically; the file and its folder are created.

        Raises:
            OSError: if it cannot be written, or changed meanwhile; it is unchanged.
        """
        path = Path(self.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with _locked(path.parent):
            if self.text is not None:
                rewrite(path.resolve(), self.text, text)
            elif exists(path):
                raise ChangedError(0, "it was created in the meantime", str(path))
            else:
                replace_file(path, text.encode())

    def _values(self, mount: Mount, parent_from_child: Pose) -> dict[str, str]:
        """Return the keys for a mount's pose, without values that the robot file has already."""
        nominal = self._compile(None)
        edge = nominal.robot.parent_edge(mount.edge.child) if nominal.robot else None
        values = mount.pose_values(parent_from_child)
        if (edge or mount.edge).calibration is not None:
            values["calibration"] = "[]"
        data = nominal.sources[0].mapping(*mount.entry) if nominal.sources else {}
        return {key: value for key, value in values.items() if data.get(key) != _parse(value)}

    def _read(self) -> OverlayText:
        try:
            return read_overlay(self.text or "", self.path)
        except OverlayTextError as error:
            self._refuse(str(error))

    def _with_pose(
        self, overlay: OverlayText, mount: Mount, values: Mapping[str, str]
    ) -> OverlayText:
        try:
            return overlay.with_pose(mount.entry, self.path, values)
        except OverlayTextError as error:
            self._refuse(str(error))

    def _render(self, overlay: OverlayText) -> str:
        try:
            return overlay.render(self.path)
        except OverlayTextError as error:
            self._refuse(str(error))

    def _robot_edge(self, text: str, child: str) -> Pose | None:
        robot = self.compile(text).robot
        edge = robot.parent_edge(child) if robot else None
        return edge.pose if edge else None

    def _refuse(self, reason: str) -> NoReturn:
        message = f"{self.path} cannot set the pose: {reason}"
        raise RejectedError([finding("TF662", message, self.source.key_span(("overlays",)))])


def fixed_mount(compiled: Compiled, child: str) -> Mount:
    """Return the mount of a frame, which the robot file places on a fixed edge.

    Raises:
        RejectedError: if a joint moves it, or a driver or a part's file places it.
    """
    robot = compiled.robot
    assert robot is not None  # noqa: S101 (compiled without errors)
    edge = robot.parent_edge(child)
    reason, span = "", edge.span if edge else robot.frames[child]
    if edge is not None and edge.joint is not None:
        reason = f"the joint {edge.joint.name} moves {child} in {edge.parent}"
    elif edge is not None and edge.entry[:1] == ("parts",) and len(edge.entry) > _PART:
        reason = f"the file of the part {edge.entry[1]} places {child}"
    try:
        mount = mount_of(robot, compiled.sources[0], child)
    except ImmovableError as error:
        reason = reason or str(error)
    if reason:
        raise RejectedError([finding("TF661", f"{child} is not a fixed mount: {reason}", span)])
    return mount


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock, so that two commands do not write one overlay at once."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _is_same(a: Pose, b: Pose) -> bool:
    moved = norm(tuple(x - y for x, y in zip(a.xyz, b.xyz, strict=True)))
    return moved < _TOLERANCE and angle_between(a.quat_xyzw, b.quat_xyzw) < _TOLERANCE


def _parse(text: str) -> object:
    return load(f"value: {text}", "").data["value"]
