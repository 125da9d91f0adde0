"""What is said of stamps that are of another clock."""

import pytest

from tfcompose.guard.verdict.stamps import other_clock

S = 10**9
NOW, SIM = 1_800_000_000 * S, 100 * S


@pytest.mark.parametrize(
    ("stamp_ns", "sim_ns", "simulated", "values"),
    [
        (NOW, None, False, []),
        (NOW - 10 * S, None, False, []),
        (NOW - 11 * S, None, False, ["11 s behind"]),
        (NOW + 7200 * S, None, False, ["2 h ahead"]),
        (0, None, False, ["without"]),
        (SIM, None, False, ["100.0 s", "simulated"]),
        (SIM + S, SIM, False, ["101.0 s", "simulated"]),
        (SIM, SIM, True, []),
        (SIM - 10 * S, SIM, True, []),
        (SIM - 30 * S, SIM, True, ["70.0 s", "30 s behind /clock"]),
        (NOW, SIM, True, ["the system's time", "/clock", "100.0 s"]),
        (0, SIM, True, ["without"]),
        (NOW, None, True, []),
    ],
)
def test_a_stamp_is_compared_with_the_clock_that_it_should_be_of(
    stamp_ns: int, sim_ns: int | None, values: list[str], *, simulated: bool
) -> None:
    output = other_clock(stamp_ns, NOW, sim_ns, simulated=simulated)
    assert bool(output) == bool(values)
    assert [value for value in values if value not in output] == []


def test_without_arrival_times_the_system_time_is_not_reported() -> None:
    assert other_clock(NOW, 0, None, simulated=False) == ""
