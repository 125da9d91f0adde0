"""Tables: whole into a pipe, fitted and coloured on a terminal."""

from pathlib import Path

import pytest

from tfcompose.cli.compiling import library
from tfcompose.cli.tables import Table, shortened
from tfcompose.cli.terminal import plain
from tfcompose.compile import compile_robot
from tfcompose.render.text import RED
from tfcompose.render.tree import tree

ROBOTS = Path(__file__).parents[2] / "robots"

ROWS = [
    ("edge", "kind", "rate", "remark"),
    ("camera_link → camera_color_optical_frame", "static", "", ""),
    ("camera_link → camera_depth_optical_frame", "static", "", "late, and refused for a reason that is long"),
    ("odom → base_link", "dynamic", "50 Hz", ""),
]
TABLE = Table(
    right=frozenset({2}),
    spare=(1,),
    least={3: 10, 0: 20},
    colour=lambda column, text: RED if column == 3 and text else "",
)


def test_a_pipe_gets_each_cell_in_full() -> None:
    lines = TABLE.lines(ROWS, indent="  ")
    for row, line in zip(ROWS, lines, strict=True):
        assert line.split("  ")[1] == row[0]
        assert line.endswith(next(cell for cell in reversed(row) if cell))


@pytest.mark.parametrize(
    ("width", "heads"),
    [
        (120, ["edge", "kind", "rate", "remark"]),
        (80, ["edge", "kind", "rate", "remark"]),
        (52, ["edge", "kind", "rate", "remark"]),
        (44, ["edge", "rate", "remark"]),
    ],
)
@pytest.mark.parametrize("indent", ["", "  "])
def test_a_terminal_gets_no_line_that_wraps_and_every_number(width: int, heads: list[str], indent: str) -> None:
    head, *lines = TABLE.lines(ROWS, width, indent=indent)
    assert head.split() == heads
    assert max(map(len, lines)) < width
    assert "50 Hz" in lines[-1]


def test_frames_that_differ_still_differ_when_they_are_shortened() -> None:
    lines = TABLE.lines(ROWS, 60)
    assert len(set(lines)) == len(ROWS)
    assert shortened("camera_link → camera_color_optical_frame", 28) == "camera_li…olor_optical_frame"


def test_colours_take_no_room() -> None:
    plain_lines, coloured_lines = TABLE.lines(ROWS, 60), TABLE.lines(ROWS, 60, coloured=True)
    assert [plain(line) for line in coloured_lines] == plain_lines
    assert [RED in line for line in coloured_lines] == [True, False, True, False]


def test_a_tree_too_wide_for_a_terminal_drops_the_gaps_not_the_poses() -> None:
    text = (ROBOTS / "autonomous_robot.yaml").read_text("utf-8")
    robot = compile_robot(text, "autonomous_robot.yaml", library()).robot
    assert robot
    assert tree(robot, 200) == tree(robot)
    narrow = tree(robot, 119).splitlines()
    assert max(map(len, narrow)) <= 119 < max(map(len, tree(robot).splitlines()))
    mount = "camera_bottom_screw_frame  static  xyz 0.186526 -0.0175 0.090669  rpy 0 15 0 deg"
    assert any(line.endswith(mount) for line in narrow)
    assert [line.split()[-1] for line in narrow] == [line.split()[-1] for line in tree(robot).splitlines()]
