"""What the launcher hears of edges that come no more."""

import pytest

from tests.support.guard_history import FIXED, History, edge
from tfcompose.guard import channel
from tfcompose.guard.channel import FindingsReport, SilentEdges
from tfcompose.model.messages import CurrentFindings, GuardEvent, Silent


def test_each_silent_or_orphaned_edge_is_reported_once_and_when_it_is_back() -> None:
    edges = (edge("base lidar", "static", "static"), edge("base camera", "static", "static"))
    running = History(edges=(edge("odom base", "drive", rate=10), *edges)).clear()
    events: list[GuardEvent] = []
    report_silent = SilentEdges([running.judge], events.append).report
    static, drive = running.joins("/static", static=True), running.joins("/drive")
    running.send(static, FIXED).repeat(drive, "odom base", 20)
    report_silent()
    assert events == []
    running.leaves(static)
    running.repeat(drive, "odom base", 50)
    report_silent()
    assert events == [Silent(("camera", "lidar"), over=False)]
    running.send(running.joins("/static", static=True), FIXED).wait(5)
    report_silent()
    report_silent()
    assert events[1:] == [Silent(("base",), over=False), Silent(("camera", "lidar"), over=True)]


def test_what_is_wrong_now_is_reported_when_it_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channel, "FINDINGS_EVERY_S", 0.0)
    running = History(edges=(edge("odom base", "drive", rate=10),)).clear()
    events: list[GuardEvent] = []
    sources = [running.judge.wrong, running.judge.live.wrong]
    report = FindingsReport(sources, events.append).report

    def codes() -> list[str]:
        report()
        report()
        current = events[-1] if events else CurrentFindings(())
        assert isinstance(current, CurrentFindings)
        return [finding.code for finding in current.findings]

    drive = running.joins("/drive")
    running.repeat(drive, "odom base", 20)
    assert codes() == []
    running.wait(5)
    assert codes() == ["TF804"]
    rogue = running.joins("/rogue")
    running.repeat(rogue, "odom base", 10)
    assert codes() == ["TF801", "TF804"]
    running.repeat(drive, "odom base", 20)
    assert codes() == ["TF801"]
    running.leaves(rogue)
    running.repeat(drive, "odom base", 100)
    assert codes() == []
    assert len(events) == 4
