"""Memory of publishers that have left: bounded, and never of those that are there."""

from tfcompose.tf.live.publishers import MOST_LEFT, forget_oldest


def test_the_oldest_of_absent_publishers_are_forgotten_and_those_present_never() -> None:
    present = {0, 1, MOST_LEFT + 50}
    known = dict.fromkeys(range(MOST_LEFT + 100))
    forget_oldest(known, present)
    assert present <= known.keys()
    absent = [number for number in range(MOST_LEFT + 100) if number not in present]
    assert [number for number in known if number not in present] == absent[-MOST_LEFT:]
    before = dict(known)
    forget_oldest(known, present)
    assert known == before
