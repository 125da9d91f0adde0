"""The view of a tree that really runs, beside a tf listener as the oracle."""

import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import viser

from tests.support.robots import EXTERNAL
from tests.support.waiting import in_one_of_a_few, until
from tests.view.test_view import session_of
from tfcompose.cli.live_view import Following, observers_of
from tfcompose.emit.plan import plan_of
from tfcompose.geometry import Offset, Pose, offset_of
from tfcompose.signals import Stop
from tfcompose.view.live import LiveTree
from tfcompose.view.panel import Panel
from tfcompose.view.reload import Files, ReloadedPanel
from tfcompose.view.server import started, stop

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("domain")]


@dataclass(frozen=True)
class View:
    """A view that follows a tree."""

    server: viser.ViserServer
    panel: Panel
    tree: LiveTree

    @property
    def is_red(self) -> bool:
        return self.server.scene.get_handle_by_name("/live/wrong") is not None


@pytest.fixture
def view(tmp_path: Path) -> Iterator[View]:
    """A view that follows the tree of a rover whose owners are the test's."""
    file = tmp_path / "rover.yaml"
    file.write_text(EXTERNAL, "utf-8")
    session = session_of(file)
    files = Files(lambda one: Path(one).read_text("utf-8"))
    from tfcompose.live.listener import listen  # noqa: PLC0415 (ROS, which may not be there)

    server, ending = started("127.0.0.1", 0, "test"), Stop()
    shown = ReloadedPanel(server, session, files, edit=False, joints=False)
    observers = observers_of(plan_of(session.robot))
    following = Following(server, shown, observers, Offset(1e-3, 1e-3), threading.Event())

    def run() -> None:
        listen("tfcompose_view", observers, ending, duration_s=None, every_s=0.04, show=following.show)

    thread = threading.Thread(target=run)
    thread.start()
    yield View(server, shown.panel, following.tree)
    ending.request()
    thread.join()
    stop(server)


def test_frames_are_where_a_tf_listener_has_them(view: View, nodes: Any) -> None:
    from rclpy.time import Time  # noqa: PLC0415 (as above)

    from tfcompose.tf2 import Buffer, TransformListener  # noqa: PLC0415 (as above)

    panel = view.panel
    nodes.latched(nodes.node("tfcompose_static"), ("base_link", "lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)))
    nodes.moving(nodes.node("diff_drive"), "odom base_link", quat=(0.0, 0.6, 0.0, 0.8))
    with TransformListener(buffer := Buffer()):

        def is_there() -> bool:
            if not buffer.can_transform("odom", "lidar", Time()) or panel.published is None:
                return False
            found = buffer.lookup_transform("odom", "lidar", Time()).transform
            xyz, quat = found.translation, found.rotation
            pose = Pose((xyz.x, xyz.y, xyz.z), (quat.x, quat.y, quat.z, quat.w))
            return max(offset_of(pose, panel.published["lidar"])) < 1e-6

        assert until(is_there)
        assert panel.published
        assert panel.published["lidar"].xyz != (0, 0, 0.3)


def test_a_rogue_publisher_makes_its_edge_red_within_a_second(view: View, nodes: Any) -> None:
    from tests.support.fake_nodes import sending  # noqa: PLC0415 (as above)

    panel = view.panel
    nodes.latched(nodes.node("tfcompose_static"), ("base_link", "lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)))
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
            assert [one.code for one in view.tree.judgement.found] == ["TF801"]
            assert f"/rogue{number}" in view.tree.judgement.found[0].message
        return took_s < 1

    assert in_one_of_a_few(is_found)
