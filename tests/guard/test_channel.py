"""What the launcher hears of edges that come no more."""

from tests.support.guard_history import FIXED, History, edge
from tfcompose.guard.channel import SilentEdges
from tfcompose.model.messages import GuardEvent, Silent


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
