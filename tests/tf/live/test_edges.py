"""What is known of edges after messages, without ROS."""

import random
import statistics
from typing import Any

import pytest

from tfcompose.tf.live import edges as module
from tfcompose.tf.live.edges import EdgeState, TreeObserver, nearer_clock
from tfcompose.tf.live.publishers import Publisher
from tfcompose.tf.tf2.exceptions import Rejection

S = 10**9
A, B = b"a" * 16, b"b" * 16
NAN = float("nan")


def row(edge: str, stamp_ns: int = 0, x: float = 0.0, w: float = 1.0) -> tuple[object, ...]:
    parent, _, child = edge.partition(" ")
    return (parent, child, *divmod(stamp_ns, S), x, 0.0, 0.0, 0.0, 0.0, 0.0, w)


def take(
    observer: TreeObserver, edge: str, at_ns: int, stamp_ns: int | None = None, **more: object
) -> None:
    """Give the observer one message of one edge; without a stamp it is stamped when it came."""
    rest = {"static": False, "gid": A, **more}
    rows = [row(edge, at_ns if stamp_ns is None else stamp_ns)]
    observer.take(rows, received_ns=at_ns, **rest)  # type: ignore[arg-type]


def only(observer: TreeObserver, now_ns: int) -> EdgeState:
    [observed] = observer.edges(now_ns)
    return observed


def test_rate_jitter_gaps_and_delays_are_those_of_the_standard_library() -> None:
    rng = random.Random(7)
    gaps = [int(rng.uniform(0.01, 0.03) * S) for _ in range(500)]
    delays = [int(rng.uniform(-0.002, 0.02) * S) for _ in range(501)]
    observer, now_ns = TreeObserver(), 100 * S
    for gap, delay in zip([0, *gaps], delays, strict=True):
        now_ns += gap
        take(observer, "odom base_link", now_ns, now_ns - delay)
    observed = only(observer, now_ns)
    timing = observed.timing
    assert timing.rate == pytest.approx(500 / (sum(gaps) / S))
    assert timing.jitter_s == pytest.approx(statistics.pstdev(gaps) / S, rel=1e-6)
    assert timing.longest_gap_s == pytest.approx(max(gaps) / S)
    assert timing.delay_s == pytest.approx(statistics.mean(delays) / S)
    assert timing.least_delay_s == pytest.approx(min(delays) / S)
    assert timing.most_delay_s == pytest.approx(max(delays) / S)
    assert observed.stream.arrivals.count == 501
    assert observed.data_age_s == pytest.approx(delays[-1] / S)


@pytest.mark.parametrize("pause_s", [6, 25])
def test_after_a_pause_beyond_the_window_the_rate_counts_from_its_end(
    pause_s: int,
) -> None:
    observer, now_ns = TreeObserver(window_s=5.0), 0

    def send(seconds: float, hertz: int = 20) -> None:
        nonlocal now_ns
        for _ in range(round(seconds * hertz)):
            now_ns += S // hertz
            take(observer, "odom base_link", now_ns)

    send(8.0)
    now_ns += pause_s * S - S // 20
    send(1.0)
    timing = only(observer, now_ns).timing
    assert timing.rate == pytest.approx(20)
    assert timing.longest_gap_s == pytest.approx(pause_s)
    assert timing.since_gap_s == pytest.approx(0.95)
    assert (only(observer, now_ns + 2 * S).timing.rate or 20) < 10, "it falls while nothing comes"
    send(4.5)
    assert only(observer, now_ns).timing.longest_gap_s == pytest.approx(0.05)


def test_an_edge_rarer_than_the_window_keeps_its_rate() -> None:
    observer = TreeObserver(window_s=2.0)
    for offset_ns in range(0, 100 * S, 10 * S):
        take(observer, "map odom", S + offset_ns)
    timing = only(observer, 91 * S).timing
    assert timing.rate == pytest.approx(0.1)
    assert timing.longest_gap_s == pytest.approx(10)


def test_a_window_forgets_older_messages_and_the_rate_falls_in_silence() -> None:
    observer = TreeObserver(window_s=2.0)
    now_ns = 0
    for _ in range(100):  # 10 Hz for 10 s, then 50 Hz
        now_ns += S // 10
        take(observer, "odom base_link", now_ns)
    for _ in range(300):
        now_ns += S // 50
        take(observer, "odom base_link", now_ns)
    assert only(observer, now_ns).timing.rate == pytest.approx(50, rel=0.01)
    later = only(observer, now_ns + 10 * S)
    assert later.age_s == 10
    assert later.timing.rate is not None
    assert later.timing.rate < 25


def test_an_edge_from_two_publishers_is_reported_twice_each_with_its_node() -> None:
    observer = TreeObserver()
    take(observer, "odom base_link", S)
    take(observer, "odom base_link", S, gid=B)
    observer.take_graph([Publisher(A, "/drive", static=False), Publisher(B, None, static=False)])
    first, second = observer.edges(S)
    assert (first.name, first.publisher, first.present) == ("odom → base_link", "/drive", True)
    assert (second.publisher, observer.publishers.is_named(B)) == ("", False)
    observer.take_graph([Publisher(B, "/ekf", static=False)])
    assert [(each.publisher, each.present) for each in observer.edges(S)] == [
        ("/drive", False),
        ("/ekf", True),
    ]
    observer.take_graph([Publisher(B, None, static=False)])
    assert observer.publishers.is_named(B), "a name is not forgotten"


def test_without_ids_the_publisher_is_one_of_those_on_its_topic() -> None:
    observer = TreeObserver()
    take(observer, "odom base_link", S, gid=None)
    observer.take_graph(
        [
            Publisher(gid, node, static=node == "/fixed")
            for gid, node in ((A, "/drive"), (B, "/ekf"), (b"c", "/fixed"))
        ]
    )
    assert only(observer, S).publisher == "one of /drive, /ekf"


def test_stamps_that_go_back_or_repeat_are_counted() -> None:
    observer = TreeObserver()
    for index, stamp in enumerate((5, 6, 6, 4, 5, 9)):
        take(observer, "odom base_link", index * S, stamp * S)
    stream = only(observer, 6 * S).stream
    assert (stream.stamps_back, stream.stamps_repeated, stream.newest_ns) == (1, 1, 9 * S)


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        (row("a a"), Rejection.SELF),
        (row("a "), Rejection.NO_CHILD),
        (row(" b"), Rejection.NO_PARENT),
        (row("a b", x=NAN), Rejection.NOT_FINITE),
        (row("a b", x=float("inf")), Rejection.NOT_FINITE),
        (row("a b", w=NAN), Rejection.NOT_FINITE),
        (row("a b", w=1.1), Rejection.DENORMALISED),
    ],
)
def test_what_tf2_refuses_is_counted_with_the_reason(
    bad: tuple[object, ...], why: Rejection
) -> None:
    observer = TreeObserver()
    observer.take([bad], static=True, gid=A, received_ns=S)  # type: ignore[list-item]
    stream = only(observer, S).stream
    assert (stream.rejected, stream.rejections) == (why, 1)


def test_a_sound_transform_is_not_refused_and_its_pose_is_kept() -> None:
    observer = TreeObserver()
    observer.take([row("a b", x=2.5)], static=True, gid=A, received_ns=S)  # type: ignore[list-item]
    observed = only(observer, 3 * S)
    assert (observed.stream.rejected, observed.stream.pose.xyz) == (None, (2.5, 0.0, 0.0))
    assert (observed.age_s, observed.data_age_s, observed.timing.delay_s) == (2, None, None)


def test_a_flood_of_names_is_counted_and_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_EDGES", 10)
    monkeypatch.setattr("tfcompose.tf.live.publishers.MOST_LEFT", 10)
    observer = TreeObserver()
    for number in range(30):
        take(observer, f"map tag_{number}", S, gid=number.to_bytes(16, "big"))
        observer.take_malformed(number.to_bytes(16, "big"))
        observer.take_graph([Publisher(number.to_bytes(16, "big"), f"/n{number}", static=False)])
    assert (len(observer.edges(S)), sum(observer.beyond.values())) == (10, 20)
    assert len(observer.malformed) <= 10
    assert len(observer.publishers.by_gid) <= 11


def test_stamps_are_compared_with_the_clock_that_is_given() -> None:
    observer = TreeObserver()
    rows = [row("a b", 9 * S)]
    observer.take(rows, static=False, gid=A, received_ns=1000 * S, clock_ns=10 * S)  # type: ignore[arg-type]
    observed = only(observer, 1001 * S)
    assert (observed.timing.delay_s, observed.data_age_s) == (1, 2)


def test_one_who_floods_the_tree_leaves_room_for_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """What one message holds is kept while there is room.

    Robots of thousands of fixed edges send them at once.
    """
    monkeypatch.setattr(module, "MOST_OF_ONE", 10)
    observer = TreeObserver()
    rows: Any = [row(f"base part_{number}") for number in range(20)]
    observer.take(rows, static=True, gid=A, received_ns=S)
    for number in range(30):
        take(observer, f"map tag_{number}", S, gid=A)
        take(observer, f"map own_{number}", S, gid=B) if number < 5 else None
    assert observer.beyond == {A: 30}
    assert (observer.floods(A), observer.floods(B)) == (True, False)
    assert {edge.child for edge in observer.edges(S) if edge.stream.gid == B} == {
        f"own_{number}" for number in range(5)
    }


@pytest.mark.parametrize(
    ("stamp_s", "clock_s", "nearer"),
    [(99, 5, False), (6, 5, True), (52, 5, True), (53, 5, False), (99, None, False)],
)
def test_a_stamp_is_compared_with_the_clock_that_it_is_nearer_to(
    stamp_s: int, clock_s: int | None, *, nearer: bool
) -> None:
    rows = [("odom", "base_link", stamp_s, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)]
    clock_ns = None if clock_s is None else clock_s * S
    expected = clock_ns if nearer else None
    assert nearer_clock(rows, 100 * S, clock_ns, static=False) == expected
    assert nearer_clock(rows, 100 * S, clock_ns, static=True) is None
