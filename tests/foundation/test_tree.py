"""What networkx says of a graph of frames, for any graph; and drawings as they look."""

from itertools import pairwise

import networkx as nx
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.foundation.tree import (
    DEEPEST_DRAWN,
    below,
    children_of,
    draw_tree,
    loop_closed_by,
    loops,
    trees,
    way_up,
)

FRAMES = st.sampled_from("abcdefg")
EDGES = st.lists(st.tuples(FRAMES, FRAMES), max_size=14)


@given(EDGES, FRAMES)
def test_below_a_frame_are_it_and_its_descendants(
    edges: list[tuple[str, str]], frame: str
) -> None:
    graph = nx.DiGraph([*edges, (frame, frame)])
    assert below(children_of(edges), frame) == {frame, *nx.descendants(graph, frame)}


@given(EDGES)
def test_each_root_has_its_tree_and_the_largest_comes_first(edges: list[tuple[str, str]]) -> None:
    graph = nx.DiGraph(edges)
    trees_by_root = trees(edges)
    assert set(trees_by_root) == {frame for frame in graph if graph.in_degree(frame) == 0}
    assert all(
        frames == {root, *nx.descendants(graph, root)} for root, frames in trees_by_root.items()
    )
    assert list(trees_by_root) == sorted(
        trees_by_root, key=lambda root: (-len(trees_by_root[root]), root)
    )


@given(EDGES)
def test_loops_are_cycles_that_hold_every_frame_that_is_in_one(
    edges: list[tuple[str, str]],
) -> None:
    graph = nx.DiGraph(edges)
    cycles = loops(edges)
    assert all(
        graph.has_edge(*edge)
        for loop in cycles
        for edge in zip(loop, (*loop[1:], loop[0]), strict=True)
    )
    assert all(len(set(loop)) == len(loop) and loop[0] == min(loop) for loop in cycles)
    in_one = {
        frame
        for some in nx.strongly_connected_components(graph)
        if len(some) > 1
        for frame in some
    }
    in_one |= {frame for frame in graph if graph.has_edge(frame, frame)}
    assert {frame for loop in cycles for frame in loop} == in_one


@given(st.dictionaries(FRAMES, FRAMES), FRAMES, FRAMES)
def test_a_further_edge_closes_a_loop_where_its_child_is_above_its_parent(
    parents: dict[str, str], parent: str, child: str
) -> None:
    without_child = nx.DiGraph(
        [(above, frame) for frame, above in parents.items() if frame != child]
    )
    without_child.add_nodes_from((parent, child))
    loop = loop_closed_by((parent, child), parents.get)
    assert bool(loop) == (parent == child or nx.has_path(without_child, child, parent))
    if loop:
        assert (loop[0], loop[-1], loop[-2]) == (child, child, parent)
        assert all(without_child.has_edge(*edge) for edge in pairwise(loop[:-1]))


def test_the_way_up_ends_at_the_root_and_before_a_frame_that_was_passed() -> None:
    parents = {"laser": "base", "base": "odom", "a": "b", "b": "a"}
    assert way_up("laser", parents.get) == ["laser", "base", "odom"]
    assert way_up("a", parents.get) == ["a", "b"]
    assert way_up("nobody", parents.get) == ["nobody"]


def test_a_drawing_has_the_lines_of_a_tree() -> None:
    children = {"map": ["odom", "dock"], "odom": ["base"], "base": ["laser", "arm"]}
    assert [lines + frame for lines, frame in draw_tree(children, "map", str)] == [
        "├── odom",
        "│   └── base",
        "│       ├── laser",
        "│       └── arm",
        "└── dock",
    ]


def test_a_deep_tree_is_drawn_no_wider_than_its_deepest_indented_level() -> None:
    chain = {str(depth): [str(depth + 1)] for depth in range(5000)}
    lines = [lines for lines, _ in draw_tree(chain, "0", str)]
    assert len(lines) == 5000
    assert max(map(len, lines)) <= 4 * DEEPEST_DRAWN + 10
    assert [line.strip() for line in lines[DEEPEST_DRAWN - 1 : DEEPEST_DRAWN + 2]] == [
        "└──",
        "+1 └──",
        "+2 └──",
    ]
