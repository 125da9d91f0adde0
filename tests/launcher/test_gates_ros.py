"""Gates at real nodes: a topic, a service, and a managed lifecycle node."""

import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.findings import expect, words_of
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.geometry import Pose
from tfcompose.launcher.supervisor import supervise
from tfcompose.model.messages import AllReady, FindingShown, Notice, ProcessReady
from tfcompose.model.plan import (
    PROGRAM,
    LifecycleState,
    Plan,
    PlanEdge,
    PlanProcess,
    Ready,
    RosSettings,
    Simulation,
    SourceLine,
)
from tfcompose.model.plan.file import write_plan

pytestmark = pytest.mark.ros

NODE = """
import sys, time
import rclpy
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import String
from std_srvs.srv import Trigger

class Slam(LifecycleNode):
    def on_configure(self, state):
        print("configured", flush=True)
        fails = "fail" in sys.argv
        return TransitionCallbackReturn.FAILURE if fails else TransitionCallbackReturn.SUCCESS
    def on_activate(self, state):
        print("activated", flush=True)
        return super().on_activate(state)

rclpy.init(args=[])
node = Slam("slam", namespace="/robot") if "lifecycle" in sys.argv else rclpy.create_node("lidar", namespace="/robot")
if "lifecycle" not in sys.argv:
    time.sleep(0.5)
    publisher = node.create_publisher(String, "scan", 1)
    service = node.create_service(Trigger, "reset", lambda request, response: response)
    client = node.create_client(Trigger, "asked_for")
try:
    rclpy.spin(node)
except BaseException:
    pass
"""  # noqa: E501 (a text as its reader has it)
GUARD = PlanProcess("guard", "guard", (PROGRAM, "guard", "${plan}", "guard"), nodes=("/guard",))


def node(
    name: str,
    *words: str,
    ready: Ready | None = None,
    lifecycle: dict[str, LifecycleState] | None = None,
) -> PlanProcess:
    argv = (sys.executable, "-c", NODE, *words)
    return PlanProcess(
        name, "run", argv, ready=ready, lifecycle=lifecycle or {}, nodes=(f"/robot/{name}",)
    )


def script(name: str, text: str, ready: Ready | None, **more: Any) -> PlanProcess:
    return PlanProcess(
        name, "run", ("sh", "-c", text), ready=ready, nodes=(f"/robot/{name}",), **more
    )


def simulated(ready: Ready) -> PlanProcess:
    """Return the owner of odom → base_link, which stands still there."""
    argv = (PROGRAM, "simulate", "${plan}", "drive")
    owns = (("odom", "base_link"),)
    still = Simulation("fixed", 20.0, pose=Pose())
    return PlanProcess(
        "drive", "simulate", argv, ready=ready, nodes=("/robot/drive",), owns=owns, simulate=still
    )


def run(tmp_path: Path, *processes: PlanProcess, late: int = 0) -> list[Notice]:
    """Run the plan until all are ready, or as many gates were said to stay shut."""
    edges = tuple(
        PlanEdge(
            parent,
            child,
            "dynamic",
            process.name,
            process.nodes[0],
            Pose(),
            None,
            SourceLine("robot.yaml", 1),
        )
        for process in processes
        for parent, child in process.owns
    )
    plan = Plan("rover", "", None, RosSettings(), edges, (*processes, GUARD))
    file = tmp_path / "plan.json"
    file.write_text(write_plan(plan))
    notices: list[Notice] = []

    def report(notice: Notice) -> None:
        notices.append(notice)
        shut = [
            late_notice
            for late_notice in notices
            if isinstance(late_notice, FindingShown) and late_notice.found.code == "TF817"
        ]
        if isinstance(notice, AllReady) or (late and len(shut) == late):
            raise BrokenPipeError  # enough was seen

    supervise(plan, file, report=report, duration_s=120)
    return notices


def late_of(notices: list[Notice]) -> dict[str, Finding]:
    """Return what was shown, by the process that is not ready."""
    findings = [notice.found for notice in notices if isinstance(notice, FindingShown)]
    return {finding.message.split()[0]: finding for finding in findings}


@pytest.mark.usefixtures("domain")
def test_each_kind_of_gate_opens_says_what_it_saw_and_what_waits_follows(tmp_path: Path) -> None:
    lidar, reset = Ready("topic", "/robot/scan"), Ready("service", "/robot/reset")
    slam = node("slam", "lifecycle", lifecycle={"/robot/slam": "active"})
    line = script(
        "line", "echo booting; sleep 0.3; echo ready 17; sleep 180", Ready("log", "ready [0-9]+")
    )
    code = script("code", "exit 4", Ready("exit", number=4.0))
    later = script("later", "sleep 180", Ready("time", number=0.4))
    gates = (
        node("lidar", ready=lidar),
        node("reset", ready=reset),
        slam,
        simulated(Ready("edges")),
        line,
        code,
        later,
    )
    names = {gate.name for gate in gates}
    last = script("last", "sleep 180", None, after=dict.fromkeys(sorted(names), "ready"))
    notices = run(tmp_path, *gates, last)
    observed = {
        notice.process: notice.seen for notice in notices if isinstance(notice, ProcessReady)
    }
    assert "/robot/scan" in words_of(observed.pop("lidar")), (
        "its node's name may come later than its topic"
    )
    assert "/robot/reset" in words_of(observed.pop("reset"))
    assert observed == {
        "slam": "/robot/slam is active",
        "drive": "its edges are live",
        "line": "ready 17",
        "later": "0.4 s have passed",
    }
    output = [
        getattr(notice, "text", "")
        for notice in notices
        if getattr(notice, "process", "") == "slam"
    ]
    assert [text for text in output if text] == ["configured", "activated"]
    assert isinstance(notices[-1], AllReady)
    assert {row.process for row in notices[-1].rows} >= names | {"last"}


@pytest.mark.usefixtures("domain")
def test_gates_that_stay_shut_report_what_was_there_instead(tmp_path: Path) -> None:
    scan = Ready("topic", "/robot/scam", timeout_s=9.0)
    ready = Ready("topic", "/front/scan", timeout_s=9.0)
    active = Ready("lifecycle", "active", timeout_s=10.0)
    slam = node("slam", "lifecycle", "fail", lifecycle={"/robot/slam": "active"}, ready=active)
    requested = Ready("service", "/robot/asked_for", timeout_s=9.0)
    notices = run(
        tmp_path,
        *(
            node("lidar", ready=scan),
            slam,
            script("calm", "sleep 180", requested),
            script("c", "sleep 180", ready),
        ),
        late=4,
    )
    findings = late_of(notices)
    expect(findings["lidar"], "TF817", " 9 s", "/robot/scam", "/robot/scan")
    expect(
        findings["c"], "TF817", "/front/scan", "topics /robot/scan, "
    )  # the same name elsewhere comes first
    expect(
        findings["calm"],
        "TF817",
        "/robot/asked_for",
        "services /robot/reset, /robot/slam/change_state, ",
    )
    assert "asked_for" not in findings["calm"].notes[0].message, "nobody offers it"
    expect(findings["slam"], "TF817", " 10 s", "/robot/slam", "unconfigured", "slam: configured")
