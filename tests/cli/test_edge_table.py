"""The table of live edges in windows of all widths.

Nothing that is shown is cut within a number.
"""

import pytest

from tfcompose.cli.edge_table import lines_of
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.publishers import Publisher

SECOND = 1_000_000_000


def row(parent: str, child: str, stamp_ns: int) -> tuple[object, ...]:
    return (parent, child, *divmod(stamp_ns, SECOND), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def observer() -> TreeObserver:
    observed = TreeObserver()
    fixed = [Publisher(gid, "/static", static=True) for gid in (b"2", b"3")]
    observed.take_graph([Publisher(b"1", "/front/diff_drive_controller", static=False), *fixed])
    for tenth in range(10, 40):
        sent_ns = tenth * SECOND // 10
        rows = [row("front/odom", "front/base_footprint", sent_ns - 2_000_000)]
        observed.take(rows, static=False, gid=b"1", received_ns=sent_ns)  # type: ignore[arg-type]
    observed.take([row("base", "lidar", 0)], static=True, gid=b"2", received_ns=0)  # type: ignore[list-item]
    return observed


@pytest.mark.parametrize(
    ("width", "heads"),
    [
        (None, "edge publisher kind rate jitter gap age delay"),
        (140, "edge publisher kind rate jitter gap age delay"),
        (95, "edge publisher rate jitter gap age delay"),
        (85, "edge publisher rate gap age delay"),
        (70, "edge publisher rate age delay"),
    ],
)
def test_a_narrow_window_has_fewer_columns_and_complete_numbers(
    observer: TreeObserver, width: int | None, heads: str
) -> None:
    edges = observer.edges(4 * SECOND)
    _, head, *rows = lines_of(edges, observer, 4 * SECOND, width)
    assert " ".join(head.split()) == heads
    assert all(len(line) < (width or 200) for line in (head, *rows))
    assert any("10.0 Hz" in line and line.endswith("2.0 ms") for line in rows), rows


def test_a_remark_is_read_before_how_even_an_edge_is(observer: TreeObserver) -> None:
    observer.take([row("mast", "lidar", 0)], static=True, gid=b"3", received_ns=0)  # type: ignore[list-item]
    table = "\n".join(lines_of(observer.edges(4 * SECOND), observer, 4 * SECOND, 100))
    assert "jitter" not in table
    assert table.count("not the only one\n") + table.endswith("not the only one") == 2
