"""The view of a tree that really runs, beside a tf listener as the oracle."""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import viser

from tests.support.browser import TOKEN
from tests.support.robots import EXTERNAL
from tests.support.waiting import in_one_of_a_few, until
from tests.tools.view.test_view import session_of
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.geometry import Offset, Pose, offset_of
from tfcompose.foundation.signals import Stop
from tfcompose.model.plan.file import write_plan
from tfcompose.tools.view.judgement import Judgement
from tfcompose.tools.view.live_source import LiveSource, observers_of
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.reload import WatchedFiles
from tfcompose.tools.view.server import start_server, stop_server
from tfcompose.tools.view.session import Session
from tfcompose.tools.view.windows import Windows

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("domain")]


@dataclass(frozen=True)
class View:
    """A view that follows a tree."""

    server: viser.ViserServer
    windows: Windows
    following: LiveSource
    changed: threading.Event

    @property
    def panel(self) -> Panel:
        return self.windows.panels[0].panel

    @property
    def judgement(self) -> Judgement:
        return self.following.windows_by_panel[self.windows.panels[0]].tree.judgement

    @property
    def is_red(self) -> bool:
        return self.server.scene.get_handle_by_name("/live/wrong") is not None


WHEEL = """
tfcompose: 1
robot: r
links: {base_link: {}, wheel: {}}
joints: {w: {type: continuous, parent: base_link, child: wheel, xyz: [0, 0.2, 0], axis: [0, 1, 0]}}
"""


@contextmanager
def following(
    session: Session, *, joints: bool = False, edit: bool = False, in_browser: bool = False
) -> Iterator[View]:
    """Show the robot that runs in the test's domain, in a window of its own or a browser's."""
    files, changed = WatchedFiles(lambda path: Path(path).read_text("utf-8")), threading.Event()
    for file in session.texts:
        files(file)
    server, ending = start_server("127.0.0.1", 0, "test", TOKEN), Stop()
    observers = observers_of(plan_of(session.robot))
    follows = LiveSource(observers, Offset(1e-3, 1e-3), joints=joints, edit=edit)
    windows = Windows(server, session, files, follows)
    if not in_browser:
        windows.add(server, 0)
    thread = threading.Thread(target=follows.follow, args=(windows, changed, ending))
    thread.start()
    try:
        yield View(server, windows, follows, changed)
    finally:
        ending.request()
        thread.join()
        stop_server(server)


@pytest.fixture
def view(tmp_path: Path) -> Iterator[View]:
    """A view that follows the tree of a rover whose owners are the test's."""
    file = tmp_path / "rover.yaml"
    file.write_text(EXTERNAL, "utf-8")
    with following(session_of(file)) as opened:
        yield opened


def test_two_windows_choose_for_themselves(view: View) -> None:
    second = start_server("127.0.0.1", 0, "second", TOKEN)
    try:
        view.windows.add(second, 1)
        first_panel, second_panel = (window.panel for window in view.windows.panels)
        first_panel.tree.select("lidar")
        assert (first_panel.selected, second_panel.selected) == ("lidar", "odom")
        in_first, in_other = (
            view.following.windows_by_panel[panel] for panel in view.windows.panels
        )
        in_first.panel.fixed.value = "lidar"
        assert until(lambda: in_first.tree.fixed == "lidar")
        assert in_other.tree.fixed != "lidar"
    finally:
        stop_server(second)


def wheel_process(folder: Path, start: Callable[..., Any]) -> Session:
    """Start what publishes the wheel's frame from joint states; return the robot's session."""
    file = folder / "rover.yaml"
    file.write_text(WHEEL, "utf-8")
    session = session_of(file)
    (folder / "plan.json").write_text(write_plan(plan_of(session.robot)), "utf-8")
    (folder / "robot.urdf").write_text("<robot name='r'/>", "utf-8")
    start("joints", folder / "plan.json", "joints")
    return session


def pose_in(buffer: Any, parent: str, child: str) -> Pose | None:
    """Return the newest pose that a tf listener has, or None."""
    from rclpy.time import Time  # noqa: PLC0415 (as above)

    if not buffer.can_transform(parent, child, Time()):
        return None
    transform = buffer.lookup_transform(parent, child, Time()).transform
    xyz, quat = transform.translation, transform.rotation
    return Pose((xyz.x, xyz.y, xyz.z), (quat.x, quat.y, quat.z, quat.w))


def test_frames_are_where_a_tf_listener_has_them(view: View, nodes: Any) -> None:
    from tfcompose.tf.tf2 import Buffer, TransformListener  # noqa: PLC0415 (as above)

    panel = view.panel
    nodes.latched(
        nodes.node("tfcompose_static"),
        ("base_link", "lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)),
    )
    nodes.moving(nodes.node("diff_drive"), "odom base_link", quat=(0.0, 0.6, 0.0, 0.8))
    with TransformListener(buffer := Buffer()):

        def is_there() -> bool:
            pose = pose_in(buffer, "odom", "lidar")
            if pose is None or panel.published is None:
                return False
            displayed = panel.published["odom"].inverse() @ panel.published["lidar"]
            return pose.xyz != (0, 0, 0.3) and max(offset_of(pose, displayed)) < 1e-6

        assert until(is_there)


def test_a_rogue_publisher_makes_its_edge_red_within_a_second(view: View, nodes: Any) -> None:
    from tests.support.fake_nodes import sending  # noqa: PLC0415 (as above)

    panel = view.panel
    nodes.latched(
        nodes.node("tfcompose_static"),
        ("base_link", "lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)),
    )
    nodes.moving(nodes.node("diff_drive"), "odom base_link", hz=20)
    assert until(lambda: panel.published is not None and not view.is_red)

    def is_found(number: int) -> bool:
        """A rogue comes, is found in time, and leaves."""
        assert until(lambda: not view.is_red)
        with sending(f"rogue{number}", "odom", "base_link", rate=20) as sent:
            begun = time.monotonic()
            assert until(lambda: view.is_red)
            took_s = time.monotonic() - begun
            assert sent()
            assert [finding.code for finding in view.judgement.findings] == ["TF801"]
            assert f"/rogue{number}" in view.judgement.findings[0].message
        return took_s < 1

    assert in_one_of_a_few(is_found)


def test_a_slider_moves_the_wheel_on_tf_until_another_node_moves_it(
    tmp_path: Path, start: Callable[..., Any], nodes: Any
) -> None:
    from sensor_msgs.msg import JointState  # noqa: PLC0415 (as above)

    from tfcompose.tf.tf2 import Buffer, TransformListener  # noqa: PLC0415 (as above)

    session, angle = wheel_process(tmp_path, start), math.radians(40)
    with following(session, joints=True) as view, TransformListener(buffer := Buffer()):

        def is_at(expected: float) -> bool:
            pose = pose_in(buffer, "base_link", "wheel")
            if pose is None or view.panel.published is None:
                return False
            displayed = view.panel.published["wheel"]
            return (
                pose.xyz == displayed.xyz == (0, 0.2, 0)
                and pose.rpy[1] == pytest.approx(expected) == displayed.rpy[1]
            )

        view.panel.set_joint("w", angle)
        assert until(lambda: is_at(angle))
        nodes.typed(
            nodes.node("jsp"),
            JointState,
            "/joint_states",
            lambda _: JointState(name=["w"], position=[-0.5]),
        )
        assert until(lambda: [sender.state for sender in view.following.senders] == ["stopped"])
        assert until(lambda: view.following.senders[0].publishers_found == ("/jsp",))


def test_a_file_that_changes_is_followed_from_then_on(
    view: View, nodes: Any, tmp_path: Path
) -> None:
    nodes.latched(
        nodes.node("tfcompose_static"),
        ("base_link", "lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)),
    )
    nodes.moving(nodes.node("diff_drive"), "odom base_link")
    assert until(lambda: view.panel.published is not None)
    moved = EXTERNAL.replace("xyz: [0, 0, 0.3]", "xyz: [0, 0, 0.4]")
    (tmp_path / "rover.yaml").write_text(moved, "utf-8")
    view.changed.set()
    assert until(lambda: [finding.code for finding in view.judgement.findings] == ["TF846"])
    assert until(lambda: view.server.scene.get_handle_by_name("/ghost/2") is not None)
    (tmp_path / "rover.yaml").write_text(EXTERNAL + "  odom2: [\n", "utf-8")
    view.changed.set()
    assert until(lambda: "TF" in view.windows.panels[0].report)
    (tmp_path / "rover.yaml").write_text(EXTERNAL, "utf-8")
    view.changed.set()
    assert until(lambda: not view.judgement.findings and not view.windows.panels[0].report)
