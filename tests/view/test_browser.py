"""What a person does in the browser reaches the robot, and its file."""

import math
from pathlib import Path
from typing import Any

import pytest
import viser
from playwright.sync_api import Page

from tests.support.browser import page_of
from tests.support.cli import tfcompose_in
from tests.support.waiting import until
from tests.view.test_view import ROVER, session_of
from tfcompose.geometry import Pose, offset_of, quat_from_rpy
from tfcompose.view.panel import Panel

pytestmark = pytest.mark.xdist_group("browser")


def enter(page: Page, label: str, value: str) -> None:
    """Type a value into the control of that label, and leave it; of a slider it is the number beside it."""
    control = "xpath=ancestor::div[1]/following-sibling::div"
    field = page.locator("label").get_by_text(label, exact=True).locator(control).locator("input:visible").last
    field.fill(value)
    field.press("Enter")
    field.blur()


def select_front_link(page: Page, panel: Panel) -> None:
    """Select a mount that stands in the robot's file."""
    enter(page, "search", "front_link")
    until(lambda: panel.frames.value == "front_link")
    page.get_by_text("pose of front_link in base_link").wait_for()


def test_a_mount_that_is_moved_in_the_browser_is_saved_as_one_line(rover: Path, server: viser.ViserServer) -> None:
    session = session_of(rover)
    panel = Panel(server, session, edit=True)
    with page_of(f"http://127.0.0.1:{server.get_port()}") as page:
        select_front_link(page, panel)
        enter(page, "x (mm)", "512.5")
        until(lambda: bool(session.moved))
        page.get_by_role("button", name="save").click()
        page.get_by_text("+    xyz: [0.5125,").first.wait_for()
    before, after = ROVER.read_text("utf-8").splitlines(), rover.read_text("utf-8").splitlines()
    assert [(old, new) for old, new in zip(before, after, strict=True) if old != new] == [
        (
            "    xyz: [0.48, 0.0475, 0.30]         # so the camera's middle is in the rover's",
            "    xyz: [0.5125, 0.0475, 0.30]         # so the camera's middle is in the rover's",
        )
    ]
    assert tfcompose_in(rover.parent, "lint", rover.name).returncode == 0


def test_a_mount_that_is_dragged_by_its_gizmo_moves_along_that_axis(rover: Path, server: viser.ViserServer) -> None:
    session = session_of(rover)
    panel = Panel(server, session, edit=True)
    with page_of(f"http://127.0.0.1:{server.get_port()}") as page:
        select_front_link(page, panel)
        before = session.mount("front_link").given(session.mount("front_link").edge.pose)

        def is_dragged() -> bool:
            """Draw the tip of the arrow along z 10 cm on."""
            (client,) = server.get_clients().values()
            tip, on = (pixel(client, before @ Pose((0, 0, at))) for at in (0.2, 0.3))
            page.mouse.move(*tip)
            page.wait_for_timeout(200)
            page.mouse.down()
            page.mouse.move(*on, steps=8)
            page.mouse.up()
            page.wait_for_timeout(500)
            return bool(session.moved)

        until(is_dragged)
        after = session.mount("front_link").given(session.mount("front_link").edge.pose)
        page.get_by_role("button", name="undo").click()
        until(lambda: not session.moved)
        page.get_by_role("button", name="redo").click()
        until(lambda: bool(session.moved))
        page.get_by_role("button", name="save").click()
        page.get_by_text("+    xyz: [").first.wait_for()
    off = before.inverse() @ after
    assert after.xyz[1] == before.xyz[1] == 0.0475, "what is not dragged is not snapped either"
    assert after.quat_xyzw == pytest.approx(before.quat_xyzw)
    assert off.xyz == pytest.approx((0, 0, 0.1), abs=0.01)
    old, new = ROVER.read_text("utf-8").splitlines(), rover.read_text("utf-8").splitlines()
    (changed,) = [(one, other) for one, other in zip(old, new, strict=True) if one != other]
    assert changed[0].partition("#")[2] == changed[1].partition("#")[2] != ""
    assert changed[1].split("#")[0].strip() == f"xyz: [{after.xyz[0]:g}, 0.0475, {after.xyz[2]:g}]"
    assert tfcompose_in(rover.parent, "lint", rover.name).returncode == 0


def pixel(client: viser.ClientHandle, pose: Pose) -> tuple[float, float]:
    """Return where a client's camera has the origin of a frame in its picture."""
    camera = client.camera
    w, x, y, z = (float(one) for one in camera.wxyz)
    px, py, pz = (float(one) for one in camera.position)
    right, down, forward = (Pose((px, py, pz), (x, y, z, w)).inverse() @ pose).xyz
    focal = camera.image_height / 2 / math.tan(camera.fov / 2)
    return camera.image_width / 2 + focal * right / forward, camera.image_height / 2 + focal * down / forward


def test_a_slider_in_the_browser_moves_its_wheel_only(rover: Path, server: viser.ViserServer) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    wheels = ("front_left_wheel_link", "front_right_wheel_link")
    left, right = (panel.scene.body_pose(wheel) for wheel in wheels)
    with page_of(f"http://127.0.0.1:{server.get_port()}") as page:
        enter(page, "front_left_wheel_joint (deg)", "30")
        until(lambda: panel.positions["front_left_wheel_joint"] != 0)
    off = offset_of(
        left @ Pose(quat_xyzw=quat_from_rpy(0, 0, math.radians(30))), panel.scene.body_pose("front_left_wheel_link")
    )
    assert max(off.xyz_m, off.rot_rad) < 1e-6
    assert panel.scene.body_pose("front_right_wheel_link") == right


def tick(page: Page, label: str) -> None:
    """Click on the box of that label."""
    control = "xpath=ancestor::div[1]/following-sibling::div"
    page.locator("label").get_by_text(label, exact=True).locator(control).locator("input").last.click(force=True)


def test_a_click_selects_a_body_and_subtrees_and_owners_can_be_hidden(rover: Path, server: viser.ViserServer) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    with page_of(f"http://127.0.0.1:{server.get_port()}") as page:
        page.get_by_text("odom is a root").wait_for()
        until(lambda: clicked_body(page, panel) == "base_link")
        page.get_by_text("by ekf").wait_for()
        tick(page, "hide it and what is below")
        until(lambda: not panel.scene.is_shown("front_left_wheel_link"))
        assert not panel.scene.is_shown("base_link")
        tick(page, "hide it and what is below")
        until(lambda: panel.scene.is_shown("front_left_wheel_link"))
        lines: Any = server.scene.get_handle_by_name("/edges/1")
        assert lines.visible
        tick(page, "joints")
        until(lambda: not lines.visible)


def clicked_body(page: Page, panel: Panel) -> str:
    """Click where the camera looks, and return the frame that is selected then."""
    page.mouse.click(490, 365)
    page.wait_for_timeout(300)
    return str(panel.frames.value)


def test_a_sweep_moves_every_joint_until_it_is_switched_off(rover: Path, server: viser.ViserServer) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    joints = dict(panel.positions)
    with page_of(f"http://127.0.0.1:{server.get_port()}") as page:
        page.get_by_text("sweep", exact=True).wait_for()
        tick(page, "sweep")
        until(lambda: all(abs(panel.positions[name] - joints[name]) > 0.5 for name in joints))
        tick(page, "sweep")
        until(lambda: not panel.is_sweeping)
        wheel = panel.scene.body_pose("rear_left_wheel_link")
        page.wait_for_timeout(300)
        assert panel.scene.body_pose("rear_left_wheel_link") == wheel
