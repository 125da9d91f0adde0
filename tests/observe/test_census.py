"""What is known of edges after messages, without ROS."""

from __future__ import annotations

import random
import statistics

import pytest

from tfcompose.observe import census as module
from tfcompose.observe.census import Census, EdgeSeen, Publisher
from tfcompose.tf2.exceptions import Rejection

S = 10**9
A, B = b"a" * 16, b"b" * 16
NAN = float("nan")


def row(edge: str, stamp_ns: int = 0, x: float = 0.0, w: float = 1.0) -> tuple[object, ...]:
    parent, _, child = edge.partition(" ")
    return (parent, child, *divmod(stamp_ns, S), x, 0.0, 0.0, 0.0, 0.0, 0.0, w)


def take(census: Census, edge: str, at_ns: int, stamp_ns: int | None = None, **more: object) -> None:
    """Give the census one message of one edge; without a stamp it is stamped when it came."""
    rest = {"static": False, "gid": A, **more}
    rows = [row(edge, at_ns if stamp_ns is None else stamp_ns)]
    census.take(rows, received_ns=at_ns, **rest)  # type: ignore[arg-type]


def only(census: Census, now_ns: int) -> EdgeSeen:
    [seen] = census.edges(now_ns)
    return seen


def test_rate_jitter_gaps_and_delays_are_those_of_the_standard_library() -> None:
    rng = random.Random(7)
    gaps = [int(rng.uniform(0.01, 0.03) * S) for _ in range(500)]
    delays = [int(rng.uniform(-0.002, 0.02) * S) for _ in range(501)]
    census, at = Census(), 100 * S
    for gap, delay in zip([0, *gaps], delays, strict=True):
        at += gap
        take(census, "odom base_link", at, at - delay)
    seen = only(census, at)
    timing = seen.timing
    assert timing.rate == pytest.approx(500 / (sum(gaps) / S))
    assert timing.jitter_s == pytest.approx(statistics.pstdev(gaps) / S, rel=1e-6)
    assert timing.longest_gap_s == pytest.approx(max(gaps) / S)
    assert timing.delay_s == pytest.approx(statistics.mean(delays) / S)
    assert timing.least_delay_s == pytest.approx(min(delays) / S)
    assert timing.most_delay_s == pytest.approx(max(delays) / S)
    assert seen.strand.tally.count == 501
    assert seen.data_age_s == pytest.approx(delays[-1] / S)


def test_a_window_forgets_what_was_before_it_and_a_rate_falls_while_nothing_comes() -> None:
    census = Census(window_s=2.0)
    at = 0
    for _ in range(100):  # 10 Hz for 10 s, then 50 Hz
        at += S // 10
        take(census, "odom base_link", at)
    for _ in range(300):
        at += S // 50
        take(census, "odom base_link", at)
    assert only(census, at).timing.rate == pytest.approx(50, rel=0.01)
    later = only(census, at + 10 * S)
    assert later.age_s == 10
    assert later.timing.rate is not None
    assert later.timing.rate < 25


def test_an_edge_from_two_publishers_is_told_twice_each_with_its_node() -> None:
    census = Census()
    take(census, "odom base_link", S)
    take(census, "odom base_link", S, gid=B)
    census.graph([Publisher(A, "/drive", static=False), Publisher(B, None, static=False)])
    first, second = census.edges(S)
    assert (first.name, first.publisher, first.present) == ("odom → base_link", "/drive", True)
    assert (second.publisher, census.is_known(B)) == ("", False)
    census.graph([Publisher(B, "/ekf", static=False)])
    assert [(each.publisher, each.present) for each in census.edges(S)] == [("/drive", False), ("/ekf", True)]
    census.graph([Publisher(B, None, static=False)])
    assert census.is_known(B), "a name is not forgotten"


def test_without_ids_the_publisher_is_one_of_those_on_its_topic() -> None:
    census = Census()
    take(census, "odom base_link", S, gid=None)
    census.graph(
        [Publisher(gid, node, static=node == "/fixed") for gid, node in ((A, "/drive"), (B, "/ekf"), (b"c", "/fixed"))]
    )
    assert only(census, S).publisher == "one of /drive, /ekf"


def test_stamps_that_go_back_or_repeat_are_counted() -> None:
    census = Census()
    for at, stamp in enumerate((5, 6, 6, 4, 5, 9)):
        take(census, "odom base_link", at * S, stamp * S)
    strand = only(census, 6 * S).strand
    assert (strand.stamps_back, strand.stamps_repeated, strand.newest_ns) == (1, 1, 9 * S)


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
def test_what_tf2_refuses_is_counted_with_the_reason(bad: tuple[object, ...], why: Rejection) -> None:
    census = Census()
    census.take([bad], static=True, gid=A, received_ns=S)  # type: ignore[list-item]
    strand = only(census, S).strand
    assert (strand.refused, strand.refusals) == (why, 1)


def test_a_sound_transform_is_not_refused_and_its_pose_is_kept() -> None:
    census = Census()
    census.take([row("a b", x=2.5)], static=True, gid=A, received_ns=S)  # type: ignore[list-item]
    seen = only(census, 3 * S)
    assert (seen.strand.refused, seen.strand.pose.xyz) == (None, (2.5, 0.0, 0.0))
    assert (seen.age_s, seen.data_age_s, seen.timing.delay_s) == (2, None, None)


def test_a_flood_of_names_is_counted_and_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_STRANDS", 10)
    census = Census()
    for number in range(30):
        take(census, f"map tag_{number}", S, gid=number.to_bytes(16, "big"))
        census.take_malformed(number.to_bytes(16, "big"))
        census.graph([Publisher(number.to_bytes(16, "big"), f"/n{number}", static=False)])
    assert (len(census.edges(S)), census.beyond) == (10, 20)
    assert len(census.malformed) <= 10
    assert len(census.publishers) <= 11


def test_stamps_are_compared_with_the_clock_that_is_given() -> None:
    census = Census()
    rows = [row("a b", 9 * S)]
    census.take(rows, static=False, gid=A, received_ns=1000 * S, clock_ns=10 * S)  # type: ignore[arg-type]
    seen = only(census, 1001 * S)
    assert (seen.timing.delay_s, seen.data_age_s) == (1, 2)
