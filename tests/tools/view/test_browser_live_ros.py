"""A running tree, a recording and a token, in a real browser."""

import io
import math
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page

from tests.support.bags import write_bag
from tests.support.browser import TOKEN, address_of, page_of
from tests.support.fake_nodes import sending
from tests.support.robots import EXTERNAL
from tests.support.waiting import in_one_of_a_few, until
from tests.tools.view.test_bag import sent
from tests.tools.view.test_browser import enter
from tests.tools.view.test_live import TEXT, TOLERANCE
from tests.tools.view.test_live_ros import following, pose_in, wheel_process
from tests.tools.view.test_view import session_of
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.tf2 import Buffer, TransformListener
from tfcompose.tools.view.bag import BagTree, Recorded
from tfcompose.tools.view.bag_source import show_recording
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.server import start_server, stop_server

pytestmark = [pytest.mark.ros, pytest.mark.xdist_group("browser")]


def red_pixels(page: Page) -> int:
    """Return how much of the scene is as red as the line of a wrong edge."""
    shot = Image.open(io.BytesIO(page.locator("canvas").first.screenshot())).convert("RGB")
    red, green, blue = np.asarray(shot).transpose(2, 0, 1)
    return int(((red > 190) & (green < 60) & (blue < 60)).sum())


def steady_red_pixels(page: Page) -> int:
    """Return how much of the scene is red once it is drawn, and fades in no more.

    That of the axes.
    """
    counts = [0]

    def is_steady() -> bool:
        page.wait_for_timeout(700)
        counts.append(red_pixels(page))
        return 0 < counts[-2] == counts[-1]

    assert until(is_steady), counts
    return counts[-1]


@pytest.mark.slow
@pytest.mark.alone
def test_a_rogue_publisher_makes_its_edge_red_within_a_second(tmp_path: Path, nodes: Any) -> None:
    (tmp_path / "r.yaml").write_text(EXTERNAL, "utf-8")
    nodes.latched(
        nodes.node("tfcompose_static"),
        ("base_link", "lidar", (0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)),
    )
    with (
        sending("diff_drive", "odom", "base_link", rate=20),
        following(session_of(tmp_path / "r.yaml"), in_browser=True) as view,
        page_of(address_of(view.server), draws=True) as page,
    ):
        page.get_by_text("all edges as expected").wait_for()
        page.locator("canvas").first.wait_for()
        before = steady_red_pixels(page)

        def becomes_red(number: int) -> bool:
            with sending(f"rogue{number}", "odom", "base_link", rate=20):
                begun = time.monotonic()
                page.get_by_text(re.compile(f"TF801.*/rogue{number}")).first.wait_for()
                took_s = time.monotonic() - begun
                assert until(lambda: red_pixels(page) > 1.3 * before)
            page.get_by_text("all edges as expected").wait_for()
            assert until(lambda: red_pixels(page) < 1.3 * before)
            return took_s < 1

        assert in_one_of_a_few(becomes_red)


def test_a_slider_in_the_browser_moves_the_wheel_as_a_tf_listener_has_it(
    tmp_path: Path, start: Callable[..., Any]
) -> None:
    session = wheel_process(tmp_path, start)
    with (
        following(session, joints=True, in_browser=True) as view,
        TransformListener(buffer := Buffer()),
        page_of(address_of(view.server)) as page,
    ):
        page.get_by_text("the sliders publish /joint_states").wait_for()
        enter(page, "w (deg)", "30")

        def is_at_30_degrees() -> bool:
            pose = pose_in(buffer, "base_link", "wheel")
            return (
                pose is not None
                and abs(pose.rpy[1] - math.radians(30)) < 1e-6
                and pose.xyz == (0, 0.2, 0)
            )

        assert until(is_at_30_degrees)


def test_a_recording_is_scrubbed_forward_and_back_in_the_browser(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(TEXT, "utf-8")
    session = session_of(tmp_path / "r.yaml")
    recorded = Recorded(str(write_bag(tmp_path / "bag", sent())), [GLOBAL])
    server = start_server("127.0.0.1", 0, "test", TOKEN)
    try:
        panel = Panel(server, session, edit=False, joints=False)
        show_recording(
            server,
            panel,
            BagTree(session.robot, plan_of(session.robot), recorded, TOLERANCE),
            recorded.length_s,
        )
        with page_of(address_of(server)) as page:
            for at_s in (8.0, 3.0):
                enter(page, "time (s)", str(at_s))
                odom_x = pytest.approx(-at_s)
                assert until(lambda x=odom_x: panel.poses()["odom"].xyz[0] == x)  # type: ignore[misc]
            enter(page, "search", "wheel")
            page.get_by_text("in base_link, 20 Hz, recorded").wait_for()
            enter(page, "time (s)", "1")
            page.get_by_text("nothing was recorded yet at 1.00 s").wait_for()
    finally:
        stop_server(server)


def test_the_page_of_another_address_opens_with_its_token(tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(TEXT, "utf-8")
    server = start_server("127.0.0.2", 0, "test", TOKEN)
    try:
        Panel(server, session_of(tmp_path / "r.yaml"), edit=False)
        address = f"http://127.0.0.2:{server.get_port()}"
        with page_of(address) as page:
            page.get_by_text("open the address with its token").wait_for()
            page.goto(address_of(server, "127.0.0.2"), wait_until="load")
            page.get_by_text("drive").first.wait_for()
    finally:
        stop_server(server)
