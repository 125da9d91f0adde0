"""The edges between two frames, and how old the newest pose of the one in the other is."""

import pytest

from tfcompose.cli.edge_table import chain_line
from tfcompose.tf.live.chain import FrameChain, chain_between
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.publishers import Publisher

MS = 1_000_000
SECOND = 1_000 * MS


def observed(
    *edges: str, late_ms: int = 0, every_ms: int = 100, until_ms: int = 4000, gid: bytes = b"1"
) -> TreeObserver:
    observer = TreeObserver()
    add(observer, *edges, late_ms=late_ms, every_ms=every_ms, until_ms=until_ms, gid=gid)
    return observer


def add(  # noqa: PLR0913 (a stream has that many parts)
    observer: TreeObserver,
    *edges: str,
    late_ms: int = 0,
    every_ms: int = 100,
    until_ms: int = 4000,
    gid: bytes = b"1",
    static: bool = False,
    length: float = 1.0,
) -> None:
    """Take each edge, "parent child", regularly from second 1 on, with stamps that are late."""
    for at_ms in range(1000, until_ms + 1, every_ms):
        stamp = divmod((at_ms - late_ms) * MS, SECOND)
        rows = [(*edge.split(), *stamp, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, length) for edge in edges]
        observer.take(rows, static=static, gid=gid, received_ns=at_ms * MS)  # type: ignore[arg-type]


def between(observer: TreeObserver, a: str, b: str) -> FrameChain:
    chain = chain_between(observer.edges(4 * SECOND), a, b)
    assert isinstance(chain, FrameChain), chain
    return chain


@pytest.mark.parametrize(
    ("a", "b", "frames"),
    [
        ("map", "laser", "map odom base laser"),
        ("laser", "map", "laser base odom map"),
        ("camera", "laser", "camera base laser"),
        ("base", "base", "base"),
    ],
)
def test_the_chain_goes_up_to_where_the_ways_meet_and_down(a: str, b: str, frames: str) -> None:
    chain = between(
        observed("map odom", "odom base", "base laser", "base camera", "odom lamp"), a, b
    )
    assert chain.frames == tuple(frames.split())
    pairs = [{edge.parent, edge.child} for edge in chain.newest]
    assert pairs == [set(pair) for pair in zip(chain.frames, chain.frames[1:], strict=False)]


def test_the_pose_is_as_old_as_the_edge_that_is_the_most_behind() -> None:
    observer = observed("odom base", late_ms=2, every_ms=20)
    add(observer, "map odom", late_ms=30, every_ms=100)
    add(observer, "base laser", static=True)
    delay = between(observer, "map", "laser").delay
    assert delay is not None
    assert delay.edge.name == "map → odom"
    assert (delay.mean_s, delay.most_s) == pytest.approx((0.030 + 0.050, 0.030 + 0.100))
    assert between(observer, "base", "laser").delay is None


def test_of_several_publishers_the_newest_counts_and_all_are_shown() -> None:
    observer = observed("odom base", until_ms=3000)
    add(observer, "map base", gid=b"2")
    chain = between(observer, "map", "base")
    assert [edge.parent for edge in chain.all_edges] == ["map", "odom"]
    observer.take_graph([Publisher(b"1", "/drive", static=False)])
    assert between(observer, "odom", "base").frames == (
        "odom",
        "base",
    ), "who has left does not count"


def test_two_trees_are_named_by_their_roots() -> None:
    edges = observed("odom base", "base laser", "map dock", "dock lamp").edges(4 * SECOND)
    reason = str(chain_between(edges, "laser", "lamp"))
    assert "begins at odom" in reason
    assert "at map" in reason


def test_what_tf2_refuses_is_no_edge() -> None:
    observer = observed("odom base")
    add(observer, "map odom", length=0.0)
    assert "map" in str(chain_between(observer.edges(4 * SECOND), "map", "base"))


def test_why_there_is_no_chain() -> None:
    edges = observed("odom base_link", "map lamp", "a b", "b c", "c a").edges(4 * SECOND)
    assert "base_link?" in str(chain_between(edges, "odom", "base_lnk"))
    two_trees = str(chain_between(edges, "base_link", "lamp"))
    assert "odom" in two_trees
    assert "map" in two_trees
    assert isinstance(chain_between(edges, "a", "lamp"), str)
    assert chain_line("no frame x", "x", "y") == "x → y: no frame x"
