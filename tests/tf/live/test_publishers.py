"""Memory of publishers that have left: bounded, and never of those that are there."""

from tfcompose.tf.live.publishers import MOST_LEFT, forget_oldest


def test_only_the_oldest_absent_publishers_are_forgotten() -> None:
    present = {0, 1, MOST_LEFT + 50}
    publishers = dict.fromkeys(range(MOST_LEFT + 100))
    forget_oldest(publishers, present)
    assert present <= publishers.keys()
    absent = [number for number in range(MOST_LEFT + 100) if number not in present]
    assert [number for number in publishers if number not in present] == absent[-MOST_LEFT:]
    before = dict(publishers)
    forget_oldest(publishers, present)
    assert publishers == before
