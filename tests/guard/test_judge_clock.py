"""What stamps say of clocks."""

import pytest

from tests.support.findings import expect, words_of
from tests.support.guard_history import FIXED, History, Publisher, edge, wall


def stamped(running: History, publisher: Publisher, edges: str, stamps: list[float]) -> History:
    """Let the publisher send with these stamps, in seconds, ten times a second."""
    for stamp in stamps:
        running.send(publisher, edges, stamp_s=stamp).wait(0.1)
    return running


def test_an_owner_with_a_wrong_clock_is_reported_and_so_is_its_recovery(
    running: History,
) -> None:
    slam = running.joins("/slam")
    stamped(running, slam, "map odom", [5 + n / 10 for n in range(10)])
    (finding,) = running.findings()
    expect(finding, "TF825", "/slam", "map → odom", "stamped 5.", "simulated")
    assert finding.severity == "error"
    for _ in range(40):
        running.send(slam, "map odom", stamp_s=wall(running)).wait(0.1)
    (over,) = running.over()
    assert words_of(over) >= {"/slam", "map", "odom"}
    assert len(running.findings()) == 1


@pytest.mark.parametrize(
    ("off", "reports"),
    [
        (-60.0, "60 s behind"),
        (3600.0, "1 h ahead of"),
        (-9.0, ""),
        (9.0, ""),
        (None, "without"),
    ],
)
def test_a_clock_that_is_more_than_ten_seconds_off_is_wrong(
    running: History, off: float | None, reports: str
) -> None:
    slam = running.joins("/slam")
    for _ in range(10):
        running.send(slam, "map odom", stamp_s=0 if off is None else wall(running) + off).wait(0.1)
    assert [finding.code for finding in running.findings() if finding.code != "TF823"] == (
        ["TF825"] if reports else []
    )
    assert not reports or reports in running.reports()[0]


def test_one_stray_stamp_is_no_wrong_clock(running: History) -> None:
    slam = running.joins("/slam")
    for n in range(50):
        running.send(slam, "map odom", stamp_s=wall(running) - 100 * (n % 10 == 0)).wait(0.1)
    assert "TF825" not in {finding.code for finding in running.findings()}


@pytest.mark.parametrize("off", [0.0, -60.0])
def test_messages_that_waited_for_a_paused_guard_accuse_no_senders_clock(
    running: History, off: float
) -> None:
    slam = running.joins("/slam")
    stamped(running, slam, "map odom", [wall(running) + n / 10 for n in range(20)])
    waited = wall(running)
    running.now += 12.7  # the guard, or the machine, stood still, and looks again
    for n in range(30):
        running.send(slam, "map odom", stamp_s=waited + n / 50)
    assert running.check().reports() == []
    for _ in range(60):
        running.send(slam, "map odom", stamp_s=wall(running) + off).wait(0.1)
    assert [finding.code for finding in running.findings() if finding.code != "TF824"] == (
        ["TF825"] if off else []
    )


def test_in_simulated_time_the_system_time_is_wrong_and_clock_decides() -> None:
    running = History(clock="sim").clear()
    slam, drive = running.joins("/slam"), running.joins("/drive")
    for n in range(20):
        running.send(slam, "map odom", stamp_s=wall(running))
        running.send(drive, "odom base", stamp_s=100 + n / 10).wait(0.1)
    assert running.reports() == []  # nothing on /clock, so nothing is known
    for n in range(20):
        running.judge.clock(round((102 + n / 10) * 1e9), running.now)
        running.send(slam, "map odom", stamp_s=wall(running))
        running.send(drive, "odom base", stamp_s=102 + n / 10).wait(0.1)
    expect(
        running.only(), "TF825", "/slam", "map → odom", "the system's time", "/clock", "102.2 s"
    )


@pytest.mark.parametrize(
    ("stretches", "codes"),
    [
        ([(1.0, 0.25)], ["TF805"]),
        ([(0.2, 0.25)], []),
        ([(1.0, 0.05), (0.2, 0.25)], []),
        ([(0.2, 0.25), (1.0, 0.25)], ["TF805"]),
    ],
)
def test_where_simulated_time_goes_slowly_rates_are_judged_by_it(
    stretches: list[tuple[float, float]], codes: list[str]
) -> None:
    running = History(clock="sim", edges=(edge("odom base", "drive", rate=20.0),)).clear()
    drive, sim_s = running.joins("/drive"), 100.0
    for speed, every_s in stretches:
        for _ in range(round(12 / every_s)):
            running.judge.clock(round(sim_s * 1e9), running.now)
            running.send(drive, "odom base", stamp_s=sim_s).wait(every_s)
            sim_s += speed * every_s
    assert [finding.code for finding in running.findings()] == codes


@pytest.mark.parametrize(("sent", "codes"), [(True, []), (False, ["TF804"])])
def test_no_owner_is_silent_in_paused_time_unless_the_clock_sender_is_gone(
    *, sent: bool, codes: list[str]
) -> None:
    """A simulator that is paused, twice, and one that has crashed."""
    running = History(clock="sim", edges=(edge("odom base", "drive", rate=20.0),)).clear()
    drive, sim_s = running.joins("/drive"), 100.0
    for paused_s in (30.0, 5.0, 0.0):
        for _ in range(100):
            running.judge.clock(round(sim_s * 1e9), running.now)
            running.send(drive, "odom base", stamp_s=sim_s).wait(0.05)
            sim_s += 0.05
        running.judge.clocks.sent = sent or not paused_s
        running.wait(paused_s)
    assert [finding.code for finding in running.findings()][:1] == codes
    for _ in range(40):  # time goes on, and the owner does not
        running.judge.clock(round(sim_s * 1e9), running.now)
        running.wait(0.05)
        sim_s += 0.05
    assert running.findings()[-1].code == "TF804"


def test_simulated_time_that_begins_again_takes_the_stamps_with_it() -> None:
    running = History(clock="sim").clear()
    drive = running.joins("/drive")
    for n in range(60):
        running.judge.clock(round((20 + n % 30 / 10) * 1e9), running.now)
        running.send(drive, "odom base", stamp_s=20 + n % 30 / 10).wait(0.1)
    assert running.reports() == []


def test_a_clock_that_is_read_twice_at_one_time_takes_no_stamps_with_it() -> None:
    running = History(clock="sim").clear()
    drive = running.joins("/drive")
    for n in range(40):
        for _ in range(2):
            running.judge.clock(round((20 + n / 10) * 1e9), running.now)
        running.send(drive, "odom base", stamp_s=20 + n // 20).wait(0.1)
    assert [finding.code for finding in running.findings()] == ["TF823"]


def test_only_a_steadily_repeated_stamp_is_a_warning(
    running: History,
) -> None:
    slam, drive = running.joins("/slam"), running.joins("/drive")
    begun = wall(running)
    for n in range(40):
        running.send(slam, "map odom", stamp_s=begun + min(n, 5) / 10)
        running.send(drive, "odom base", stamp_s=begun + (n - (n % 4 == 0)) / 10).wait(0.1)
    expect(running.only(), "TF823", "/slam", "map → odom")
    assert running.only().severity == "warning"


@pytest.mark.parametrize(
    ("steps", "codes"), [([-3.0], ["TF824"]), ([-0.2], []), ([-0.3] * 4, ["TF824"])]
)
def test_stamps_that_go_back_are_a_warning_if_far_or_often(
    running: History, steps: list[float], codes: list[str]
) -> None:
    slam = running.joins("/slam")
    stamps = [wall(running) + n / 10 for n in range(10)]
    for step in steps:
        stamps += [stamps[-1] + step, stamps[-1]]
    stamped(running, slam, "map odom, base camera", stamps)
    assert [finding.code for finding in running.findings() if finding.code != "TF801"] == codes


def test_the_stamps_of_fixed_edges_and_of_strangers_are_not_judged(running: History) -> None:
    static, rogue = running.joins("/static", static=True), running.joins("/rogue")
    for _ in range(10):
        running.send(static, FIXED, stamp_s=0).send(rogue, "map odom", stamp_s=0).wait(0.1)
    assert [finding.code for finding in running.findings()] == ["TF801"]
