"""The tree of frames: its rows, what a search leaves of it, and what is hidden with a frame."""

import random

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.tools.view.frame_tree import FrameTree

PRESETS = library()
ARM = {
    "odom": "",
    "base_link": "odom",
    "mast": "base_link",
    "lidar": "mast",
    "arm": "base_link",
    "Tool_Arm": "arm",
}


def tree_of(parents: dict[str, str]) -> FrameTree:
    """Return the tree of frames by their parents; a root has none."""
    frames = "".join(
        f"  {child}: {{{f'parent: {parent}, xyz: [1, 0, 0]' if parent else ''}}}\n"
        for child, parent in parents.items()
    )
    robot = compile_robot(f"tfcompose: 1\nrobot: r\nframes:\n{frames}", "r.yaml", PRESETS).robot
    assert robot
    return FrameTree(robot)


def drawn(tree: FrameTree, chosen: dict[str, bool] | None = None, search: str = "") -> list[str]:
    """Return the rows as text: + is closed, - is open."""
    marks = {True: "-", False: "+", None: ""}
    return [
        f"{'  ' * row.depth}{marks[row.is_open]}{row.frame}"
        for row in tree.rows(chosen or {}, search)
    ]


def test_rows_are_indented_below_their_parents_in_the_order_of_the_file() -> None:
    assert drawn(tree_of(ARM)) == [
        "-odom",
        "  -base_link",
        "    -mast",
        "      lidar",
        "    -arm",
        "      Tool_Arm",
    ]


def test_nothing_below_a_closed_frame_has_a_row() -> None:
    tree = tree_of(ARM)
    assert drawn(tree, {"mast": False}) == [
        "-odom",
        "  -base_link",
        "    +mast",
        "    -arm",
        "      Tool_Arm",
    ]
    assert drawn(tree, {"odom": False, "arm": True}) == ["+odom"]


@pytest.mark.parametrize(
    ("search", "rows"),
    [
        ("lid", ["-odom", "  -base_link", "    -mast", "      lidar"]),
        ("ARM", ["-odom", "  -base_link", "    -arm", "      Tool_Arm"]),
        ("arm  too", ["-odom", "  -base_link", "    -arm", "      Tool_Arm"]),
        ("wheel", []),
        ("  ", ["+odom"]),
    ],
)
def test_a_search_leaves_what_it_finds_and_all_above_open(search: str, rows: list[str]) -> None:
    assert drawn(tree_of(ARM), {"odom": False, "mast": False}, search) == rows


def test_many_frames_open_by_complete_levels_and_show_the_selected_one() -> None:
    numbers = random.Random(5)
    parents = {
        "f0": "",
        **{f"f{n}": f"f{numbers.randrange(max(0, n - 20), n)}" for n in range(1, 300)},
    }
    tree = tree_of(parents)
    first = list(tree.rows({}))
    assert 2 <= len(first) <= 40
    assert max(row.depth for row in first if row.is_open) < min(
        row.depth for row in first if row.is_open is False
    )
    assert "f299" not in [row.frame for row in first]
    assert "f299" in [row.frame for row in tree.rows(tree.open_to("f299"))]
    assert len(list(tree.rows(dict.fromkeys(parents, True)))) == 300


LOOPS: list[dict[str, str]] = [
    {"a": "b", "b": "a"},
    {"a": "a"},
    {"r": "", "a": "b", "b": "c", "c": "a", "d": "c"},
    {"a": "nobody"},
]


@pytest.mark.parametrize("parents", LOOPS)
def test_frames_of_a_loop_or_below_an_unknown_one_have_rows_too(parents: dict[str, str]) -> None:
    tree = tree_of(parents)
    rows = list(tree.rows(dict.fromkeys(tree.frames, True)))
    assert sorted(row.frame for row in rows) == sorted(tree.frames)
    assert {row.frame for row in rows} >= parents.keys()


def test_all_below_a_hidden_frame_is_hidden_until_it_is_shown_itself() -> None:
    tree = tree_of(ARM)
    chosen = tree.show("base_link", {}, is_visible=False)
    assert tree.hidden_frames(chosen) == ARM.keys() - {"odom"}
    chosen = tree.show("arm", chosen, is_visible=True)
    assert tree.hidden_frames(chosen) == {"base_link", "mast", "lidar"}
    chosen = tree.show("base_link", chosen, is_visible=True)
    assert chosen == {}
    assert not tree.hidden_frames(chosen)


def test_a_frame_that_comes_below_a_hidden_one_is_hidden_too() -> None:
    chosen = tree_of(ARM).show("mast", {"gone": False}, is_visible=False)
    assert tree_of({**ARM, "camera": "lidar", "gone": "odom"}).hidden_frames(chosen) == {
        "mast",
        "lidar",
        "camera",
        "gone",
    }
