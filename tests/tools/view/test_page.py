"""The page that ``view --html`` writes: it moves joints, finds, selects and measures by itself."""

import math
from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.support.browser import page_of
from tests.support.cli import tfcompose_in
from tests.tools.view.test_view import session_of
from tfcompose.compiler.mounts.kinematics import poses_in_roots
from tfcompose.tools.view.facts import numbers

pytestmark = pytest.mark.xdist_group("browser")

ARM = """tfcompose: 1
robot: arm
links:
  base: {visual: {box: [0.2, 0.2, 0.2]}}
  upper: {}
  tool: {visual: {sphere: 0.05, xyz: [0.1, 0, 0]}}
frames: {camera_of_the_second_arm_depth_optical_frame: {parent: hand}, hand: {parent: tool, xyz: [0.2, 0.1, 0], rpy: [0.3, 0.2, 0.1]}}
joints:
  turn: {type: revolute, parent: base, child: upper, xyz: [0, 0, 0.5], rpy: [10 deg, 0, 40 deg], axis: [0, 0.6, 0.8],
         limit: {lower: -90 deg, upper: 57.2957795 deg, effort: 1, velocity: 1}}
  out: {type: prismatic, parent: upper, child: tool, xyz: [0.1, 0, 0], axis: [1, 0, 0],
        limit: {lower: -1, upper: 1, effort: 1, velocity: 1}, mimic: {joint: turn, multiplier: 0.5, offset: 0.1}}
sensors: {eye: {preset: generic/camera, parent: hand, xyz: [0, 0, 0.1]}}
"""  # noqa: E501 (a text as its reader has it)


def arm_page(folder: Path, text: str) -> str:
    """Write the page of a robot; return its address."""
    (folder / "arm.yaml").write_text(text, "utf-8")
    done = tfcompose_in(folder, "view", "arm.yaml", "--html", "arm.html")
    assert (done.returncode, done.stdout) == (0, "")
    return (folder / "arm.html").as_uri()


def rows(page: Page) -> list[str]:
    """Return the frames that have a row, from top to bottom."""
    frames = page.locator("[data-frame]:visible").evaluate_all(
        "rows => rows.map(row => row.dataset.frame)"
    )
    return [str(frame) for frame in frames]


def place_of(page: Page, frame: str) -> tuple[float, float]:
    """Return where the picture has the name of a frame, in pixels."""
    box = page.locator("#names").get_by_text(frame, exact=True).bounding_box()
    assert box
    return box["x"], box["y"]


def test_the_page_moves_joints_finds_selects_measures_and_has_named_views(tmp_path: Path) -> None:
    address = arm_page(tmp_path, ARM)
    robot = session_of(tmp_path / "arm.yaml").robot
    poses = poses_in_roots(robot, {"turn": math.radians(-35.5)})
    relative = poses["base"].inverse() @ poses["hand"]
    with page_of(address) as page:
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        slider = page.get_by_label("turn (deg)")
        assert (slider.get_attribute("min"), slider.get_attribute("max")) == ("-90", "57.3")
        assert page.locator("input[type=range]").count() == 1, "the other joint follows"
        slider.fill("-35.5")
        everything = rows(page)
        aside = page.locator("aside").first
        assert aside.evaluate("one => one.scrollWidth <= one.clientWidth"), "no name is cut"
        page.locator("#search").fill("HA")
        assert rows(page) == ["base", "upper", "tool", "hand"]
        page.get_by_text("hand in tool, static, by static").wait_for()
        page.locator("#base").select_option("base")
        away = f"{math.dist(*(poses[name].xyz for name in ('base', 'hand'))) * 1000:.4g} mm away"
        assert f"{away}: {numbers(relative)}" in page.locator("#about").inner_text()
        page.locator("#search").fill("")
        assert rows(page) == everything
        page.get_by_label("names of all frames").check()
        page.get_by_label("orthographic").check()
        x, y, z = relative.xyz
        scales = []
        for view, right, above in (("top", -y, x), ("left", -x, z), ("front", y, z)):
            page.get_by_role("button", name=view).click()
            page.wait_for_timeout(200)
            (x0, y0), (x1, y1) = place_of(page, "base"), place_of(page, "hand")
            scales += [(x1 - x0) / right, (y0 - y1) / above]
        assert scales == pytest.approx([scales[0]] * 6, rel=0.03)
        assert scales[0] > 50
        page.mouse.click(*place_of(page, "base"))
        page.get_by_text("base is a root").wait_for()
        assert not errors
