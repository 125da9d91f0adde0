"""Tables: whole into a pipe, fitted and coloured on a terminal."""

import json
import re
from collections import Counter
from pathlib import Path
from typing import get_args

import msgspec
import pytest

from tfcompose.cli import preset_page
from tfcompose.cli.compiling import library
from tfcompose.cli.documentation import code_table, topic
from tfcompose.cli.process_table import row
from tfcompose.cli.tables import Table, shorten
from tfcompose.cli.terminal import plain
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.render.text import RED
from tfcompose.compiler.render.tree import pose_text, tree
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.tree import draw_tree
from tfcompose.model.messages import ProcessState, ProcessStatus, StateName, notice_line

ROBOTS = Path(__file__).parents[2] / "robots"

ROWS = [
    ("edge", "kind", "rate", "remark"),
    ("camera_link → camera_color_optical_frame", "static", "", ""),
    (
        "camera_link → camera_depth_optical_frame",
        "static",
        "",
        "late, and refused for a reason that is long",
    ),
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
    for cells, line in zip(ROWS, lines, strict=True):
        assert line.split("  ")[1] == cells[0]
        assert line.endswith(next(cell for cell in reversed(cells) if cell))


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
def test_a_terminal_gets_no_line_that_wraps_and_every_number(
    width: int, heads: list[str], indent: str
) -> None:
    head, *lines = TABLE.lines(ROWS, width, indent=indent)
    assert head.split() == heads
    assert max(map(len, lines)) < width
    assert "50 Hz" in lines[-1]


def test_frames_that_differ_still_differ_when_they_are_shortened() -> None:
    lines = TABLE.lines(ROWS, 60)
    assert len(set(lines)) == len(ROWS)
    assert (
        shorten("camera_link → camera_color_optical_frame", 28) == "→ camera_color_optical_frame"
    )
    assert shorten("camera_link → camera_color_optical_frame", 20) == "→ camer…ptical_frame"
    assert shorten("base_link → front_left_wheel_link", 29) == "b…ink → front_left_wheel_link"


@pytest.mark.parametrize("columns", [60, 80, 100])
@pytest.mark.parametrize(
    "name", ["autonomous_robot", "field_rover", "house_robot", "picker", "two_rovers"]
)
def test_a_narrow_tree_wraps_and_omits_only_kinds_that_owners_imply(
    name: str, columns: int
) -> None:
    robot = compile_robot(
        (ROBOTS / f"{name}.yaml").read_text("utf-8"),
        f"{name}.yaml",
        library(),
        read=lambda file: (ROBOTS / file).read_text("utf-8"),
    ).robot
    assert robot
    robot = robot.with_final_names()
    text = tree(robot, columns)
    assert max(map(len, text.splitlines())) <= columns
    words = iter(re.sub("[│├└─]", " ", text).split())
    for edge in (
        line
        for root in robot.roots()
        for _, line in draw_tree(robot.children(), root, lambda edge: edge.child)
    ):
        expected = [edge.child, edge.owner, *pose_text(edge).split()]
        assert all(word in words for word in expected), f"{expected} stand there in this order"


@pytest.mark.parametrize("columns", [60, 80, 120])
@pytest.mark.parametrize("name", ["realsense/d455", "hesai/ot128"])
def test_a_preset_page_fits_the_terminal_and_keeps_every_word(name: str, columns: int) -> None:
    facts = preset_page.facts(name, library())
    page = preset_page.text(facts, columns)
    assert max(map(len, page.splitlines())) <= columns
    plain_words, words = (
        re.sub("[│├└─]", " ", text).split() for text in (preset_page.text(facts), page)
    )
    assert Counter(words) == Counter(plain_words)


@pytest.mark.parametrize("state", get_args(StateName))
def test_a_state_is_one_word_in_text_in_json_and_in_the_help(state: StateName) -> None:
    status = ProcessStatus(
        "drive",
        "run",
        None,
        state,
        "",
        True,  # noqa: FBT003
        False,  # noqa: FBT003
        True,  # noqa: FBT003
        "",
        "",
        7,
        1.0,
        0,
        0,
        0,
        (),
    )
    event = json.loads(notice_line(ProcessState("drive", state), 0))
    assert row(status, {})[1] == msgspec.to_builtins(status)["state"] == event["state"]
    assert f"`{state}`" in topic("background")


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
    assert [line.split()[-1] for line in narrow] == [
        line.split()[-1] for line in tree(robot).splitlines()
    ]


def test_the_table_of_codes_has_all_of_them_or_those_of_a_family() -> None:
    assert re.findall(r"^\| (TF\d{3}) ", code_table("names"), re.MULTILINE) == [
        code for code in CATALOGUE if code.startswith("TF5")
    ]
    lines = code_table().splitlines()
    assert len(lines) == len(CATALOGUE) + 2
    assert all(line.endswith(". |") for line in lines[2:])
