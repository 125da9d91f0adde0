"""What a person does in the browser reaches the robot, and its file."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
import viser
from playwright.sync_api import Locator, Page

from tests.support.browser import address_of, page_of
from tests.support.cli import tfcompose_in
from tests.support.scenes import body_pose
from tests.support.waiting import until
from tests.tools.view.test_view import ROVER, session_of
from tfcompose.foundation.geometry import Pose, offset_of, quat_from_rpy
from tfcompose.tools.view.panel import Panel

pytestmark = pytest.mark.xdist_group("browser")


def enter(page: Page, label: str, value: str) -> None:
    """Type a value into the control of that label, and leave it.

    Of a slider it is the number beside it.
    """
    control = "xpath=ancestor::div[1]/following-sibling::div"
    field = (
        page.locator("label")
        .get_by_text(label, exact=True)
        .locator(control)
        .locator("input:visible")
        .last
    )
    field.fill(value)
    field.press("Enter")
    field.blur()


def select_front_link(page: Page, panel: Panel) -> None:
    """Select a mount that stands in the robot's file."""
    enter(page, "search", "front_link")
    until(lambda: panel.selected == "front_link")
    page.get_by_text("pose of front_link in base_link").wait_for()


def test_a_mount_that_is_moved_in_the_browser_is_saved_as_one_line(
    rover: Path, server: viser.ViserServer
) -> None:
    session = session_of(rover)
    panel = Panel(server, session, edit=True)
    with page_of(address_of(server)) as page:
        select_front_link(page, panel)
        enter(page, "x (mm)", "512.5")
        until(lambda: bool(session.moved))
        dot = page.locator("[data-frame=front_bottom_screw_frame]").get_by_title(
            "moved, not saved"
        )
        dot.wait_for()
        page.get_by_role("button", name="save").click()
        page.get_by_text("+    xyz: [0.5125,").first.wait_for()
        assert until(lambda: dot.count() == 0)
    before, after = ROVER.read_text("utf-8").splitlines(), rover.read_text("utf-8").splitlines()
    assert [(old, new) for old, new in zip(before, after, strict=True) if old != new] == [
        (
            "    xyz: [0.48, 0.0475, 0.30]         # so the camera's middle is in the rover's",
            "    xyz: [0.5125, 0.0475, 0.30]         # so the camera's middle is in the rover's",
        )
    ]
    assert tfcompose_in(rover.parent, "lint", rover.name).returncode == 0


@pytest.mark.slow
def test_a_mount_that_is_dragged_by_its_gizmo_moves_along_that_axis(
    rover: Path, server: viser.ViserServer
) -> None:
    session = session_of(rover)
    panel = Panel(server, session, edit=True)
    with page_of(address_of(server), draws=True) as page:
        select_front_link(page, panel)
        before = session.mount("front_link").pose_in_file(session.mount("front_link").edge.pose)

        def is_dragged() -> bool:
            """Draw the tip of the arrow along z 10 cm on."""
            (client,) = server.get_clients().values()
            canvas = page.locator("canvas").first.bounding_box()
            assert canvas
            tip, on = (
                pixel(client, before @ Pose((0, 0, height)), canvas["x"]) for height in (0.2, 0.3)
            )
            page.mouse.move(*tip)
            page.wait_for_timeout(200)
            page.mouse.down()
            page.mouse.move(*on, steps=8)
            page.mouse.up()
            page.wait_for_timeout(500)
            return bool(session.moved)

        until(is_dragged)
        after = session.mount("front_link").pose_in_file(session.mount("front_link").edge.pose)
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
    (changed,) = [
        (line, new_line) for line, new_line in zip(old, new, strict=True) if line != new_line
    ]
    assert changed[0].partition("#")[2] == changed[1].partition("#")[2] != ""
    assert changed[1].split("#")[0].strip() == f"xyz: [{after.xyz[0]:g}, 0.0475, {after.xyz[2]:g}]"
    assert tfcompose_in(rover.parent, "lint", rover.name).returncode == 0


def pixel(client: viser.ClientHandle, pose: Pose, left: float) -> tuple[float, float]:
    """Return where a client's camera sees the origin of a frame on its page.

    The scene begins at ``left``.
    """
    camera = client.camera
    w, x, y, z = (float(number) for number in camera.wxyz)
    px, py, pz = (float(number) for number in camera.position)
    right, down, forward = (Pose((px, py, pz), (x, y, z, w)).inverse() @ pose).xyz
    focal = camera.image_height / 2 / math.tan(camera.fov / 2)
    return (
        left + camera.image_width / 2 + focal * right / forward,
        camera.image_height / 2 + focal * down / forward,
    )


def test_a_slider_in_the_browser_moves_its_wheel_only(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    wheels = ("front_left_wheel_link", "front_right_wheel_link")
    left, right = (body_pose(panel.scene, wheel) for wheel in wheels)
    with page_of(address_of(server)) as page:
        enter(page, "front_left_wheel_joint (deg)", "30")
        until(lambda: panel.positions["front_left_wheel_joint"] != 0)
    off = offset_of(
        left @ Pose(quat_xyzw=quat_from_rpy(0, 0, math.radians(30))),
        body_pose(panel.scene, "front_left_wheel_link"),
    )
    assert max(off.xyz_m, off.rot_rad) < 1e-6
    assert body_pose(panel.scene, "front_right_wheel_link") == right


def tick(page: Page, label: str) -> None:
    """Click on the box of that label."""
    control = "xpath=ancestor::div[1]/following-sibling::div"
    page.locator("label").get_by_text(label, exact=True).locator(control).locator(
        "input"
    ).last.click(force=True)


def in_tree(page: Page, frame: str, does: str) -> Locator:
    """Return what selects a frame in the tree, opens it, or shows it."""
    return page.locator(f'[data-frame="{frame}"] [data-does={does}]')


def rows(page: Page) -> list[str]:
    """Return the frames that have a row in the tree, from top to bottom."""
    frames = page.locator("[data-frame]").evaluate_all(
        "rows => rows.map(row => row.dataset.frame)"
    )
    return [str(frame) for frame in frames]


@pytest.mark.slow
def test_a_click_selects_a_body_and_owners_can_be_hidden(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    with page_of(address_of(server), draws=True) as page:
        page.get_by_text("odom is a root").wait_for()
        assert until(lambda: clicked_body(page, panel) == "base_link")
        page.get_by_text("by ekf").wait_for()
        page.locator("[data-frame=base_link][aria-selected=true]").wait_for()
        lines: Any = server.scene.get_handle_by_name("/edges/1")
        assert lines.visible
        tick(page, "joints")
        assert until(lambda: not lines.visible)


def test_the_tree_selects_closes_and_hides_what_is_below_a_frame(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    with page_of(address_of(server)) as page:
        in_tree(page, "lidar_sensor", "select").click()
        page.get_by_text("lidar_sensor in base_link").wait_for()
        in_tree(page, "front_link", "open").click()
        page.locator("[data-frame=front_link][aria-expanded=false]").wait_for()
        assert "front_depth_frame" not in rows(page)
        in_tree(page, "base_link", "show").click()
        assert until(lambda: not panel.scene.is_shown("front_left_wheel_link"))
        assert not panel.scene.is_shown("base_link")
        in_tree(page, "front_left_wheel_link", "show").click()
        assert until(lambda: panel.scene.is_shown("front_left_wheel_link"))
        assert not panel.scene.is_shown("base_link")
        page.get_by_role("button", name="show all").click()
        assert until(lambda: panel.scene.is_shown("base_link"))
        page.locator("[data-frame=lidar_imu] input:checked").wait_for()


@pytest.mark.slow
@pytest.mark.alone
def test_arrow_keys_lead_through_the_tree(rover: Path, server: viser.ViserServer) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    with page_of(address_of(server)) as page:
        in_tree(page, "front_link", "select").click()
        page.locator("[data-frame=front_link][aria-selected=true]").wait_for()
        for key, frame in (
            ("ArrowDown", "front_depth_frame"),
            ("ArrowUp", "front_link"),
            ("ArrowLeft", "front_link"),
        ):
            page.keyboard.press(key)
            page.locator(f"[data-frame={frame}][aria-selected=true]").wait_for()
        page.locator("[data-frame=front_link][aria-expanded=false]").wait_for()
        page.keyboard.press("ArrowDown")
        assert until(lambda: panel.selected == "rear_bottom_screw_frame")
        enter(page, "search", "li")
        page.keyboard.press("ArrowDown")
        page.mouse.click(470, 100)
        panel.tree.select("lidar_sensor")
        page.locator("[data-frame=lidar_sensor][aria-selected=true]").wait_for()
        page.keyboard.press("ArrowDown")
        page.wait_for_timeout(500)
        assert panel.selected == "lidar_sensor", "keys are the scene's"


@pytest.mark.slow
def test_a_search_keeps_what_is_above_and_selects_the_one_that_is_found(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    with page_of(address_of(server)) as page:
        page.get_by_text("odom is a root").wait_for()
        everything = rows(page)
        assert everything == list(panel.tree.tree.frames)
        enter(page, "search", "gyro")
        page.get_by_text("2 of 25 frames").wait_for()
        assert rows(page)[-2:] == ["front_gyro_frame", "front_gyro_optical_frame"]
        assert rows(page)[:2] == ["odom", "base_link"]
        assert panel.selected == "odom"
        enter(page, "search", "gyro opt")
        page.get_by_text("front_gyro_optical_frame in front_gyro_frame").wait_for()
        enter(page, "search", "")
        assert until(lambda: rows(page) == everything)


@pytest.mark.slow
def test_names_are_text_wherever_the_panel_has_them(
    tmp_path: Path, server: viser.ViserServer
) -> None:
    name = "<img src=x onerror='window.isHit = true'>"
    text = f"""tfcompose: 1
robot: r
links: {{base_link: {{visual: {{box: [0.1, 0.1, 0.1]}}}}}}
frames: {{{json.dumps(name)}: {{parent: base_link, xyz: [1, 0, 0]}}}}
sensors: {{{json.dumps(name + "s")}: {{preset: generic/camera, parent: base_link, xyz: [0, 0, 1]}}}}
"""  # noqa: E501 (a text as its reader has it)
    (tmp_path / "r.yaml").write_text(text, "utf-8")
    panel = Panel(server, session_of(tmp_path / "r.yaml"), edit=True)
    with page_of(address_of(server)) as page:
        panel.tree.select(name)
        page.get_by_text(f"pose of {name} in base_link").wait_for()
        panel.move(Pose((2, 0, 0)))
        panel.save()
        page.get_by_text("saved:").wait_for()
        assert not page.evaluate("window.isHit")


def test_a_tree_of_hundreds_of_frames_stays_where_it_was_scrolled_to(
    tmp_path: Path, server: viser.ViserServer
) -> None:
    names = ["<i>&'\"", *(f"f{number}" for number in range(300))]
    frames = "".join(
        f"  {json.dumps(name)}: {{parent: base, xyz: [{index}, 0, 0]}}\n"
        for index, name in enumerate(names)
    )
    (tmp_path / "r.yaml").write_text(
        f"tfcompose: 1\nrobot: r\nframes:\n  base: {{}}\n{frames}", "utf-8"
    )
    panel = Panel(server, session_of(tmp_path / "r.yaml"), edit=False)
    with page_of(address_of(server)) as page:
        row = page.locator("[data-frame=f250]")
        row.scroll_into_view_if_needed()
        before = row.bounding_box()
        in_tree(page, "f250", "show").click()
        assert until(lambda: panel.tree.hidden == {"f250"})
        in_tree(page, "f251", "select").click()
        page.locator("[data-frame=f251][aria-selected=true]").wait_for()
        assert row.bounding_box() == before
        panel.tree.select("f2")
        assert until(lambda: in_view(page, "f2"))
        assert not in_view(page, "f250")


def test_the_window_has_the_robots_name_all_frame_names_and_named_views(
    tmp_path: Path, server: viser.ViserServer
) -> None:
    frame = "wrist_camera_depth_optical_frame_of_the_second_arm"
    (tmp_path / "r.yaml").write_text(
        f"tfcompose: 1\nrobot: rover_7\n"
        f"frames: {{base: {{}}, {frame}: {{parent: base, xyz: [1, 0, 0]}}}}\n",
        "utf-8",
    )
    Panel(server, session_of(tmp_path / "r.yaml"), edit=False)
    with page_of(address_of(server)) as page:
        name = in_tree(page, frame, "select")
        name.wait_for()
        assert name.evaluate("name => name.scrollWidth <= name.clientWidth"), "nothing is cut"
        assert until(lambda: page.title() == "rover_7")
        for label in ("top", "orthographic"):
            page.get_by_text(label, exact=True).click()
        (client,) = server.get_clients().values()
        assert until(lambda: client.camera.fov < math.radians(2))
        assert until(lambda: client.camera.position[2] > 10 * abs(client.camera.position[1]))


def in_view(page: Page, frame: str) -> bool:
    """Return whether a row of the tree is in the picture."""
    box = page.locator(f"[data-frame={frame}]").bounding_box()
    return box is not None and 0 < box["y"] < 700


def clicked_body(page: Page, panel: Panel) -> str:
    """Click where the camera looks, and return the frame that is selected then."""
    page.mouse.click(470, 365)
    page.wait_for_timeout(300)
    return str(panel.selected)


@pytest.mark.slow
def test_a_sweep_moves_every_joint_until_it_is_switched_off(
    rover: Path, server: viser.ViserServer
) -> None:
    panel = Panel(server, session_of(rover), edit=False)
    joints = dict(panel.positions)
    with page_of(address_of(server)) as page:
        page.get_by_text("sweep", exact=True).wait_for()
        tick(page, "sweep")
        until(lambda: all(abs(panel.positions[name] - joints[name]) > 0.5 for name in joints))
        tick(page, "sweep")
        until(lambda: not panel.is_sweeping)
        wheel = body_pose(panel.scene, "rear_left_wheel_link")
        page.wait_for_timeout(300)
        assert body_pose(panel.scene, "rear_left_wheel_link") == wheel
