"""Panel next to the scene: selected frame, owners, joints, and the pose of a mount to edit."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.mounts.edit import ImmovableError
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.foundation.geometry import Pose, norm, quat_from_rpy
from tfcompose.foundation.numbers import clean_rpy
from tfcompose.foundation.text import list_names
from tfcompose.tools.view.camera import VIEWS, begin_at, go_to, project
from tfcompose.tools.view.choices import Choices
from tfcompose.tools.view.facts import facts_of, numbers
from tfcompose.tools.view.findings import format_saved, paragraphs
from tfcompose.tools.view.joints import slider_range
from tfcompose.tools.view.scene import RobotScene, wxyz
from tfcompose.tools.view.tree_panel import TreePanel

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import viser

    from tfcompose.compiler.mounts.edit import Mount
    from tfcompose.model.robot import Joint, Robot
    from tfcompose.tools.view.session import Session

#: The steps of the gizmo, in millimetres and degrees.
_SNAP_MM, _SNAP_DEG = 1.0, 1.0
#: The size of the gizmo in metres, for a robot whose largest body is 1 m long.
_GIZMO_M = 0.25
#: The step and the decimals of joint sliders, in millimetres or degrees.
_STEP, _DECIMALS = 0.1, 1
#: The choice for which the panel shows a pose in the parent of its frame.
_PARENT = "its parent"
#: HTML for the colour of an owner. It is at the right end of the line of the owner's checkbox.
_SWATCH = (
    '<div style="position: relative; height: 0"><div style="position: absolute; right: 1em; top:'
    ' 0.15em; width: 4em; height: 0.8em; border-radius: 0.2em; background: {}"></div></div>'
)
#: The width of the panel, in CSS pixels.
_WIDTH_PX = 350
#: The duration of a sweep of the joints, and the time between two steps, in seconds.
_SWEEP_S, _SWEEP_STEP_S = 6.0, 0.05


@dataclass(slots=True)
class Window:
    """A browser window. Several windows may show the same files; they save one after another."""

    #: The server of the window, which sets its first camera position; None if all windows share a
    #: panel.
    server: viser.ViserServer | None = None
    #: Held during a save.
    lock: threading.RLock = field(default_factory=threading.RLock)
    #: A function that shows a save of this window in all other windows.
    share: Callable[[], None] = lambda: None
    #: Lets the source of frames follow the window's moves, and returns lines about that.
    take_moves: Callable[[], Sequence[str]] = tuple
    #: Frames that were moved in this window and that another window has saved at another pose.
    conflicts: set[str] = field(default_factory=set)


def _snap(pose: Pose, before: Pose) -> Pose:
    """Return a pose in whole mm and degrees.

    A number that changes by less than half a step keeps the value of ``before``.
    """

    def snap(new: float, old: float, step: float) -> float:
        return old if abs(new - old) < step / 2 else round(new / step) * step

    x, y, z = (snap(*pair, _SNAP_MM / 1000) for pair in zip(pose.xyz, before.xyz, strict=True))
    angles = zip(clean_rpy(pose.quat_xyzw), clean_rpy(before.quat_xyzw), strict=True)
    roll, pitch, yaw = (snap(*pair, math.radians(_SNAP_DEG)) for pair in angles)
    return Pose((x, y, z), quat_from_rpy(roll, pitch, yaw))


def _phase(slider: Any) -> float:
    """Return the phase of a slider in its sweep, in radians; the phase is 0 in the middle."""
    half = (slider.max - slider.min) / 2
    return math.asin(max(-1.0, min(1.0, (slider.value - slider.min) / half - 1)))


class Panel:
    """Shows a session on a server.

    With ``edit``, the user can move and save mounts. With ``joints``, the user can move joints.
    ``server`` may be a client of a server; then ``window`` is the window of this client.
    ``choices`` are the choices of the user, which the panel changes. ``published`` are the poses
    of frames in the roots of their trees, if these do not come from the session.
    """

    def __init__(  # noqa: PLR0913 (where, what and how it is shown)
        self,
        server: viser.ViserServer | viser.ClientHandle,
        session: Session,
        *,
        edit: bool,
        joints: bool = True,
        choices: Choices | None = None,
        window: Window | None = None,
    ) -> None:
        self.window = window or Window()
        self.session = session
        self.choices = choices or Choices()
        self._gui = server.gui
        self._server = server
        self.positions = self.choices.positions
        self.published: Mapping[str, Pose] | None = None
        self.scene = RobotScene(server.scene, session.robot)
        #: The gizmo that drags the selected mount; None if the mount cannot be moved.
        self.gizmo: Any = None
        self._numbers: list[Any] = []
        #: The sliders of joints that are not mimic joints, in degrees or mm.
        self.sliders: list[Any] = []
        self._showing = False
        self._blocked: Any = None
        #: Whether the joints are sweeping.
        self.is_sweeping = False
        #: Whether another panel has replaced this panel.
        self.is_gone = False
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(_WIDTH_PX)
        self.tree = TreePanel(server.gui, session.robot, self.scene.colours, self.choices)
        bases = (_PARENT, *session.robot.frames)
        base = self.choices.base if self.choices.base in bases else _PARENT
        with server.gui.add_folder("Frame"):
            self._base: Any = server.gui.add_dropdown("in", bases, initial_value=base)
            self._about = server.gui.add_html("")
            self._names: Any = server.gui.add_checkbox(
                "names of all frames", initial_value=self.choices.has_names
            )
        self._add_views()
        self.tree.on_select(self._show_selected)
        self.tree.on_show(lambda: self.scene.hide(self.tree.hidden))
        self._base.on_update(lambda _: self._choose_base())
        self._names.on_update(lambda _: self._show_names())
        self.scene.clicked = self.tree.select
        if edit:
            self._add_editor()
        self._add_owners()
        if self.scene.fields.sensors:
            self._add_sensors()
        if joints:
            self._add_joints(session.robot)
        self._begin()
        self._bounds = self.scene.add_grid(poses_in_roots(session.robot, self.positions))
        begin_at(self.window.server or server, self._bounds)
        threading.Thread(target=self.scene.add_meshes, name="meshes", daemon=True).start()

    def _begin(self) -> None:
        """Show the user's earlier choices."""
        self.refresh()
        self.tree.mark_moved(frozenset(self.session.moved))
        self.scene.hide(self.tree.hidden)
        for owner in self.scene.colours:
            self.scene.show_owner(owner, visible=self.choices.owners.get(owner, True))
        self._show_names()
        self._show_selected()
        self._show_blocked()

    def end(self) -> None:
        """Stop moving frames, because this panel is no longer used."""
        self.is_gone = True
        self.scene.end()

    def refresh(self) -> None:
        """Update the scene to the current joints and mounts."""
        if self.published is None:
            self.scene.update(self.session.robot, self.poses())

    def poses(self) -> Mapping[str, Pose]:
        """Return the current pose of each frame, in the root of its tree."""
        return self.published or poses_in_roots(self.session.robot, self.positions)

    @property
    def selected(self) -> str:
        """The selected frame."""
        return self.choices.selected

    def _add_views(self) -> None:
        with self._gui.add_folder("View"):
            views: Any = self._gui.add_button_group("from", tuple(VIEWS))
            parallel = self._gui.add_checkbox(
                "orthographic", initial_value=self.choices.is_parallel
            )
        views.on_click(lambda event: self._go_to(event, views.value))
        parallel.on_update(lambda event: self._project(event, is_parallel=parallel.value))

    def _go_to(self, event: viser.GuiEvent[Any], view: str) -> None:
        if event.client is not None:
            go_to(event.client, self._bounds, view, is_parallel=self.choices.is_parallel)

    def _project(self, event: viser.GuiEvent[Any], *, is_parallel: bool) -> None:
        self.choices.is_parallel = is_parallel
        if event.client is not None:
            project(event.client, is_parallel=is_parallel)

    def _choose_base(self) -> None:
        self.choices.base = "" if self._base.value == _PARENT else self._base.value
        self._show_selected()

    def _show_names(self) -> None:
        self.choices.has_names = self._names.value
        self.scene.name_all(visible=self.choices.has_names)

    def _show_selected(self) -> None:
        robot, frame = self.session.robot, self.selected
        self.scene.select(frame)
        first, *further = facts_of(robot, self.session.state.sources, frame)
        lines = [f"<b>{escape(first)}</b>", *map(escape, further)]
        base, poses = self.choices.base, self.poses()
        is_measured = base != frame and {base, frame} <= poses.keys()
        if is_measured:
            relative = poses[base].inverse() @ poses[frame]
            distance = f"{norm(relative.xyz) * 1000:.4g} mm away"
            lines += [f"in <b>{escape(base)}</b>, as shown, {distance}:", numbers(relative)]
        self.scene.measure((base, frame) if is_measured else ())
        self._about.content = paragraphs(lines)
        if self._numbers:
            self._show_mount()

    def _add_owners(self) -> None:
        with self._gui.add_folder("Owners"):
            for owner, (red, green, blue) in self.scene.colours.items():
                self._gui.add_html(_SWATCH.format(f"rgb({red}, {green}, {blue})"))
                box = self._gui.add_checkbox(
                    owner, initial_value=self.choices.owners.get(owner, True)
                )
                box.on_update(partial(self._show_owner, owner, box))

    def _show_owner(self, owner: str, box: Any, _event: Any) -> None:
        self.choices.owners[owner] = box.value
        self.scene.show_owner(owner, visible=box.value)

    def _add_sensors(self) -> None:
        """Add switches that show fields of view, and the rays that the robot blocks."""
        fields = self.scene.fields
        for sensor, is_shown in self.choices.sensors.items():
            fields.show(sensor, visible=is_shown)
        if self.choices.reach is not None:
            fields.draw(self.choices.reach)
        with self._gui.add_folder("Fields of view"):
            for sensor in fields.sensors:
                box = self._gui.add_checkbox(sensor, initial_value=fields.visible[sensor])
                box.on_update(partial(self._show_field, sensor, box))
            reach = self._gui.add_number(
                "drawn to (m)", fields.reach, min=0.01, max=300.0, step=0.01
            )
            reach.on_update(lambda _: self._draw_fields(reach.value))
            self._blocked = self._gui.add_checkbox(
                "blocked rays", initial_value=self.choices.has_blocked
            )
            self._blocked.on_update(lambda _: self._choose_blocked())
            self.blocked = self._gui.add_html("")

    def _draw_fields(self, reach: float) -> None:
        self.choices.reach = reach
        self.scene.fields.draw(reach)

    def _choose_blocked(self) -> None:
        self.choices.has_blocked = self._blocked.value
        self._show_blocked()

    def _show_field(self, sensor: str, box: Any, _event: Any) -> None:
        self.choices.sensors[sensor] = box.value
        self.scene.fields.show(sensor, visible=box.value)
        self._show_blocked()

    def _show_blocked(self) -> None:
        """Draw blocked rays and show their number, if the user has chosen this."""
        if self._blocked is not None:
            lines = self.scene.fields.show_blocked(
                self.session.robot if self._blocked.value else None
            )
            self.blocked.content = paragraphs([escape(line) for line in lines])

    def _add_joints(self, robot: Robot) -> None:
        joints = [edge.joint for edge in robot.edges if edge.joint and edge.joint.mimic is None]
        if not joints:
            return
        with self._gui.add_folder("Joints"):
            self.sliders = [self._slider(joint) for joint in joints]
            self._gui.add_button("zero").on_click(lambda _: self._zero())
            self._sweeps = self._gui.add_checkbox("sweep", initial_value=False)
            self._sweeps.on_update(lambda _: self._sweep())

    def _slider(self, joint: Joint) -> Any:
        slides = joint.type == "prismatic"
        lower, upper = slider_range(joint)
        scale, unit = (1000.0, "mm") if slides else (math.degrees(1), "deg")
        start = min(max(self.positions.get(joint.name, 0.0), lower), upper)
        least, most = (round(limit * scale, _DECIMALS) for limit in (lower, upper))
        slider = self._gui.add_slider(
            f"{joint.name} ({unit})",
            least,
            max(most, least + _STEP),
            _STEP,
            min(max(round(start * scale, _DECIMALS), least), most),
        )
        self.positions[joint.name] = start

        def changed(_event: Any) -> None:
            self.set_joint(joint.name, min(max(slider.value / scale, lower), upper))

        slider.on_update(changed)
        return slider

    def set_joint(self, name: str, position: float) -> None:
        """Move a joint to a position in radians or metres."""
        self.positions[name] = position
        if not self.is_sweeping:
            self.refresh()

    def _sweep(self) -> None:
        """Sweep each joint between its limits until switched off or closed."""
        if self._sweeps.value and not self.is_sweeping:
            self.is_sweeping = True
            threading.Thread(target=self._sweep_until_over, daemon=True).start()

    def _sweep_until_over(self) -> None:
        begin, starts = time.monotonic(), [_phase(slider) for slider in self.sliders]
        try:
            while self._sweeps.value and not self.is_gone:
                angle = (time.monotonic() - begin) / _SWEEP_S * math.tau
                with self._server.atomic():
                    for slider, start in zip(self.sliders, starts, strict=True):
                        middle, half = (slider.max + slider.min) / 2, (slider.max - slider.min) / 2
                        slider.value = middle + half * math.sin(angle + start)
                    self.refresh()
                time.sleep(_SWEEP_STEP_S)
        finally:
            self.is_sweeping = False

    def _zero(self) -> None:
        for slider in self.sliders:
            slider.value = min(max(0.0, slider.min), slider.max)

    def _add_editor(self) -> None:
        labels = ("x (mm)", "y (mm)", "z (mm)", "roll (deg)", "pitch (deg)", "yaw (deg)")
        with self._gui.add_folder("Mount"):
            self._given = self._gui.add_html("")
            self._numbers = [self._gui.add_number(label, 0.0, step=0.001) for label in labels]
            self._snap: Any = self._gui.add_checkbox(
                "snap to mm and degrees", initial_value=self.choices.snaps
            )
            self._snap.on_update(lambda _: self._choose_snap())
            self._gui.add_button("undo").on_click(lambda _: self._again(self.session.undo()))
            self._gui.add_button("redo").on_click(lambda _: self._again(self.session.redo()))
            self._gui.add_button("save").on_click(lambda _: self.save())
            self.report = self._gui.add_html("")
        for handle in self._numbers:
            handle.on_update(lambda _: self._take_typed())

    def _choose_snap(self) -> None:
        self.choices.snaps = self._snap.value

    def _again(self, has_moved: bool) -> None:  # noqa: FBT001 (what undo and redo return)
        if has_moved:
            self._show_moved()
            self._show_selected()

    def _show_moved(self) -> None:
        self.tree.mark_moved(frozenset(self.session.moved))
        if notices := self.window.take_moves():
            self.say(paragraphs([escape(notice) for notice in notices]))
        self.refresh()
        self._show_blocked()

    def _show_mount(self) -> None:
        """Show the numbers of the selected frame's pose in the file, and a gizmo at the frame."""
        if self.gizmo is not None:
            self.gizmo.remove()
            self.gizmo = None
        try:
            mount = self.session.mount(self.selected)
        except ImmovableError as error:
            self._given.content = paragraphs(
                [f'<span style="color: #888">{escape(str(error))}</span>']
            )
            self._enable(is_enabled=False)
            return
        self._enable(is_enabled=True)
        pose = mount.pose_in_file(mount.edge.pose)
        self._given.content = paragraphs(
            [f"pose of <b>{escape(mount.place)}</b> in <b>{escape(mount.relative_to)}</b>"]
        )
        self._fill(pose)
        pose_of_mount = self._pose_of(mount)
        scale = _GIZMO_M * self.scene.scale
        self.gizmo = self._server.scene.add_transform_controls(
            "/gizmo", scale=scale, wxyz=wxyz(pose_of_mount), position=pose_of_mount.xyz
        )
        self.gizmo.on_update(lambda event: self._take_dragged() if event.phase == "end" else None)

    def _enable(self, *, is_enabled: bool) -> None:
        """Enable or disable the editing of the mount."""
        for handle in (*self._numbers, self._snap):
            if handle.disabled == is_enabled:
                handle.disabled = not is_enabled

    def _fill(self, pose: Pose) -> None:
        values = [value * 1000 for value in pose.xyz] + [
            math.degrees(angle) for angle in clean_rpy(pose.quat_xyzw)
        ]
        self._showing = True
        for handle, value in zip(self._numbers, values, strict=True):
            handle.value = round(value, 6) + 0.0
        self._showing = False

    def _take_typed(self) -> None:
        if not self._showing:
            x, y, z, roll, pitch, yaw = (handle.value for handle in self._numbers)
            angles = (math.radians(angle) for angle in (roll, pitch, yaw))
            self.move(Pose((x / 1000, y / 1000, z / 1000), quat_from_rpy(*angles)))

    def _take_dragged(self) -> None:
        mount = self.session.mount(self.selected)
        w, qx, qy, qz = (float(value) for value in self.gizmo.wxyz)
        px, py, pz = (float(value) for value in self.gizmo.position)
        base = self.poses()[mount.relative_to]
        pose = base.inverse() @ Pose((px, py, pz), (qx, qy, qz, w))
        self.move(_snap(pose, mount.pose_in_file(mount.edge.pose)) if self.choices.snaps else pose)
        self._show_selected()

    def move(self, pose: Pose) -> None:
        """Move the selected mount to a pose, which is the pose to write to the file."""
        try:
            mount = self.session.mount(self.selected)
        except ImmovableError as error:
            self.report.content = paragraphs([escape(str(error))])
            return
        self.session.move(mount.edge.child, mount.of_edge(pose))
        self._show_moved()
        if self.gizmo is not None:
            pose_of_mount = self._pose_of(self.session.mount(self.selected))
            self.gizmo.wxyz, self.gizmo.position = wxyz(pose_of_mount), pose_of_mount.xyz

    def _pose_of(self, mount: Mount) -> Pose:
        """Return the pose of a mount in the root of its tree, as moved here."""
        return self.poses()[mount.relative_to] @ mount.pose_in_file(mount.edge.pose)

    def save(self) -> None:
        """Save the moved mounts, and report the result.

        If another window has saved a mount at another pose in the meantime, report this instead.
        The next save then overwrites the pose.
        """
        with self.window.lock:
            conflicts = sorted(self.window.conflicts & self.session.moved.keys())
            self.window.conflicts.clear()
            if conflicts:
                message = (
                    f"not saved: another window saved {list_names(conflicts)} at another pose"
                )
                self.say(paragraphs([escape(message), "save again to replace that"]))
                return
            try:
                saved = self.session.save()
            except OSError as error:
                self.say(paragraphs([escape(f"not saved: {error}")]))
                return
            self.say(format_saved(saved))
            self.tree.mark_moved(frozenset(self.session.moved))
            self._show_selected()
            if saved.diff:
                self.window.share()

    def say(self, html: str) -> None:
        """Show a text in the section for editing mounts."""
        if self._numbers:
            self.report.content = html
