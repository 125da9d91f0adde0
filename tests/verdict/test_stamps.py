"""What is said of stamps that are of another clock."""

from __future__ import annotations

import pytest

from tfcompose.verdict.stamps import other_clock

S = 10**9
NOW, SIM = 1_800_000_000 * S, 100 * S


@pytest.mark.parametrize(
    ("stamp_ns", "sim_ns", "simulated", "said"),
    [
        (NOW, None, False, ""),
        (NOW - 10 * S, None, False, ""),
        (NOW - 11 * S, None, False, "stamped 11 s behind the system's time"),
        (NOW + 7200 * S, None, False, "stamped 2 h ahead of the system's time"),
        (0, None, False, "without a stamp"),
        (SIM, None, False, "stamped 100.0 s, which is simulated time, or time since a start"),
        (SIM + S, SIM, False, "stamped with simulated time (101.0 s), unlike others"),
        (SIM, SIM, True, ""),
        (SIM - 10 * S, SIM, True, ""),
        (SIM - 30 * S, SIM, True, "stamped 70.0 s, 30 s behind /clock"),
        (NOW, SIM, True, "stamped with the system's time, while /clock says 100.0 s"),
        (0, SIM, True, "without a stamp"),
        (NOW, None, True, ""),
    ],
)
def test_a_stamp_is_compared_with_the_clock_that_it_should_be_of(
    stamp_ns: int, sim_ns: int | None, said: str, *, simulated: bool
) -> None:
    assert other_clock(stamp_ns, NOW, sim_ns, simulated=simulated) == said


def test_where_nobody_knows_when_it_came_nothing_is_said_of_the_systems_time() -> None:
    assert other_clock(NOW, 0, None, simulated=False) == ""
