"""A recording at any of its times, forward and back.

Moving frames, latched ones, and what is wrong.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.bags import START_S, UP, Sent, write_bag
from tests.support.browser import TOKEN
from tests.support.cli import tfcompose_in
from tests.support.scenes import body_pose
from tests.tools.view.test_live import TEXT, TOLERANCE, robot_of
from tests.tools.view.test_view import session_of
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.model.plan.topics import GLOBAL
from tfcompose.tf.bags import BagError
from tfcompose.tools.view.bag import BagTree, Recorded
from tfcompose.tools.view.bag_source import show_recording
from tfcompose.tools.view.panel import Panel
from tfcompose.tools.view.server import start_server, stop_server

SECONDS = 10


def sent(mast_m: float = 0.5) -> Iterator[Sent]:
    """A base at 1 m/s, a wheel that comes after 2 s, and latched frames after 1 s."""
    for tick in range(SECONDS * 20):
        at_s = tick / 20
        yield "/tf", at_s, "odom", "base_link", at_s, (at_s, 0.0, 0.0), UP
        if at_s >= 2:
            half = math.radians(at_s) / 2
            yield (
                "/tf",
                at_s,
                "base_link",
                "wheel",
                at_s,
                (0.0, 0.2, 0.0),
                (0.0, math.sin(half), 0.0, math.cos(half)),
            )
        if at_s == 1:
            yield "/tf_static", at_s, "base_link", "mast", 0.0, (0.0, 0.0, mast_m), UP
            yield "/tf_static", at_s, "mast", "lidar", 0.0, (0.1, 0.0, 0.3), UP


def tree_of(bag: Path) -> BagTree:
    robot = robot_of()
    return BagTree(robot, plan_of(robot), Recorded(str(bag), [GLOBAL]), TOLERANCE)


@pytest.fixture(params=[True, False], ids=["mcap", "sqlite"])
def bag(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return write_bag(tmp_path / "bag", sent(), mcap=request.param)


def test_a_bag_is_scrubbed_forward_and_back(bag: Path) -> None:
    tree = tree_of(bag)
    for at_s in (0.0, 5.0, 9.95, 3.0, 0.0, 7.5):
        tree.at_s = at_s + 1e-3  # times since the epoch are exact to a microsecond
        picture = tree.next_picture()
        assert picture, at_s
        assert picture.poses["base_link"].xyz[0] == pytest.approx(at_s)
        assert picture.poses["lidar"].xyz == pytest.approx((at_s + 0.1, 0, 0.8))
        assert tree.next_picture() is None


def test_latched_frames_hold_at_any_time_also_before_they_were_recorded(tmp_path: Path) -> None:
    tree = tree_of(write_bag(tmp_path / "bag", sent(mast_m=0.7)))
    for at_s in (9.0, 0.0, 0.5, 1.0):
        tree.at_s = at_s
        picture = tree.next_picture()
        assert picture
        assert picture.poses["mast"].xyz[2] == pytest.approx(0.7)
        assert set(picture.ghosts) == {"mast", "lidar"}
        assert picture.ghosts["mast"].xyz[2] == pytest.approx(0.5)
        assert ("base_link", "mast") in picture.wrong


def test_a_latched_frame_that_is_replaced_has_the_value_of_the_time(tmp_path: Path) -> None:
    late: Sent = ("/tf_static", 6.0, "base_link", "mast", 6.0, (0.0, 0.0, 0.9), UP)
    tree = tree_of(write_bag(tmp_path / "bag", sorted([*sent(), late], key=lambda row: row[1])))
    for at_s, height_m in ((5.9, 0.5), (6.0, 0.9), (2.0, 0.5), (9.0, 0.9)):
        tree.at_s = at_s
        picture = tree.next_picture()
        assert picture
        assert picture.poses["mast"].xyz[2] == pytest.approx(height_m), at_s


def test_a_moving_frame_is_where_the_robot_has_it_until_it_comes(bag: Path) -> None:
    tree = tree_of(bag)
    tree.at_s = 1.99
    tree.next_picture()
    assert tree.about("wheel")[0] == "nothing was recorded yet at 1.99 s"
    tree.at_s = 2.0
    picture = tree.next_picture()
    assert picture
    assert picture.poses["wheel"].quat_xyzw[1] == pytest.approx(math.sin(math.radians(1)))
    assert tree.about("wheel")[0] == "in base_link, 20 Hz, recorded 0 ms before"
    tree.at_s = 1.0
    picture = tree.next_picture()
    assert picture
    assert picture.poses["wheel"].quat_xyzw == (0, 0, 0, 1)


def test_a_bag_without_the_robots_topics_is_refused(tmp_path: Path) -> None:
    elsewhere = ((f"/r1{topic}", *rest) for topic, *rest in sent())
    write_bag(tmp_path / "bag", elsewhere)  # type: ignore[arg-type]
    with pytest.raises(BagError):
        Recorded(str(tmp_path / "bag"), [GLOBAL])


def test_the_slider_moves_the_scene(bag: Path, tmp_path: Path) -> None:
    (tmp_path / "r.yaml").write_text(
        TEXT.replace("{base_link: {}", "{base_link: {visual: {box: [1, 1, 1]}}"), "utf-8"
    )
    session = session_of(tmp_path / "r.yaml")
    server = start_server("127.0.0.1", 0, "test", TOKEN)
    try:
        panel = Panel(server, session, edit=False, joints=False)
        recorded = Recorded(str(bag), [GLOBAL])
        tree = BagTree(session.robot, plan_of(session.robot), recorded, TOLERANCE)
        view = show_recording(server, panel, tree, recorded.length_s)
        assert body_pose(panel.scene, "base_link").xyz == (
            0,
            0,
            0,
        ), "the robot stays in the picture"
        view.tree.fixed = "odom"
        for at_s in (8.0, 3.0):
            view.time.value = at_s
            assert body_pose(panel.scene, "base_link").xyz[0] == pytest.approx(at_s)
        view.fixed.value = "mast"
        later = Panel(server, session, edit=False, joints=False, choices=panel.choices)
        assert show_recording(server, later, tree, recorded.length_s).fixed.value == "mast", (
            "it outlives a reload"
        )
    finally:
        stop_server(server)


@pytest.mark.parametrize("time_text", ["10.5", "-1", "x", f"{START_S - 1}"])
def test_a_time_outside_of_the_recording_is_refused(
    time_text: str, bag: Path, tmp_path: Path
) -> None:
    (tmp_path / "r.yaml").write_text(TEXT, "utf-8")
    done = tfcompose_in(
        tmp_path, "view", "r.yaml", "--bag", str(bag), "--at", time_text, "--port", "0"
    )
    assert done.returncode == 2
    assert "--at" in done.stderr
