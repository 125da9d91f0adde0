"""A fleet on loopback: robots with Zenoh routers, poses between them, broken links."""

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

import pytest
import zenoh

from tests.support import processes
from tests.support.fleets import Link, RobotProcesses, SimulatedRobot, fleet_of, fleet_text
from tests.support.waiting import TIMEOUT_S, until
from tests.support.zenoh_peers import free_port, session
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode
from tfcompose.tf.tf2.exceptions import TransformException
from tfcompose.tools.fleet.observe import FleetObserver, StaleError
from tfcompose.tools.fleet.share import SharedEdges

IDENTITY = (0.0, 0.0, 0.0, 1.0)


@dataclass
class Two:
    """Two robots that run, and the link from here to the second one's router."""

    routers: dict[str, str]
    link: Link


@pytest.fixture
def two() -> Iterator[Two]:
    with ExitStack() as stack:
        routers = {name: f"tcp/127.0.0.1:{free_port()}" for name in ("r1", "r2")}
        for router in routers.values():
            stack.enter_context(session("router", listen=[router]))
        fleet = fleet_of(routers)
        for x, name in enumerate(routers, 1):
            robot = SimulatedRobot(fleet, name, float(x))
            stack.callback(robot.close)
        link = Link(routers["r2"])
        stack.callback(link.close)
        yield Two(routers | {"r2": link.endpoint}, link)


@pytest.fixture
def observe() -> Iterator[Callable[[dict[str, str]], FleetObserver]]:
    with ExitStack() as stack:

        def made(routers: dict[str, str]) -> FleetObserver:
            observer = FleetObserver(fleet_of(routers))
            stack.callback(observer.close)
            return observer

        yield made


def test_a_pose_between_two_robots_is_found(
    two: Two, observe: Callable[[dict[str, str]], FleetObserver]
) -> None:
    observer = observe(two.routers)
    assert observer.wait(60)
    # The last poses of two edges have a time in common once one of both is known before and after
    # the other's.
    assert until(lambda: not observer.buffer.can_lookup("r1/base_link", "r2/base_link"))
    pose, stamp_ns = observer.buffer.latest("r1/base_link", "r2/base_link")
    assert pose.xyz == pytest.approx((1.0, 0.0, 0.0))
    assert stamp_ns is not None
    assert [(edge.robot, edge.state) for edge in observer.status()] == [
        ("r1", "live"),
        ("r2", "live"),
    ]
    assert until(lambda: list(observer.findings()) == [])


def test_for_one_pose_only_robots_with_edges_between_its_frames_are_heard(two: Two) -> None:
    observer = FleetObserver(fleet_of(two.routers), ("r1/odom", "r1/base_link"))
    try:
        assert until(lambda: observer.buffer.can_lookup("r1/odom", "r1/base_link"))
        time.sleep(1)  # a robot that was heard would have sent twice
        assert [robot.age_s is None for robot in observer.status()] == [False, True]
        callbacks = {thread for thread in threading.enumerate() if "pyo3" in thread.name}
        assert {thread.daemon for thread in callbacks} == {False}, "Python waits for them"
    finally:
        observer.close()


def test_a_broken_link_is_stale_within_3_s_and_live_again_once_mended(
    two: Two, observe: Callable[[dict[str, str]], FleetObserver]
) -> None:
    observer = observe(two.routers)
    assert observer.wait(60)
    two.link.break_()
    broken = time.monotonic()

    def states() -> dict[str, str]:
        return {edge.robot: edge.state for edge in observer.status()}

    assert until(lambda: states()["r2"] != "live")
    assert time.monotonic() - broken < 3.0
    assert states()["r1"] == "live"
    assert {finding.code for finding in observer.findings()} <= {"TF882", "TF883"}
    two.link.mend()
    assert until(lambda: states()["r2"] == "live")


@pytest.mark.slow
@pytest.mark.parametrize(
    "broken_s", [5.0, 30.0]
)  # what is sent meanwhile comes late, or Zenoh has ended the session
def test_no_pose_is_given_over_a_broken_link_and_new_ones_after(
    two: Two, observe: Callable[[dict[str, str]], FleetObserver], broken_s: float
) -> None:
    observer = observe(two.routers)
    assert observer.wait(60)
    poses: list[tuple[float, float]] = []

    def pose() -> bool:
        """Look the pose up as often as it can be.

        Whether there was one, and how old it was then.
        """
        try:
            _, stamp_ns = observer.pose("r1/base_link", "r2/base_link")
        except (StaleError, TransformException):
            return False
        poses.append((time.monotonic(), time.time() - (stamp_ns or 0) / 1e9))
        return True

    assert until(pose)
    two.link.break_()
    broken = time.monotonic()
    assert until(lambda: not pose())
    assert time.monotonic() - broken < 3.0
    before = len(poses)
    while time.monotonic() - broken < broken_s:
        pose()
        time.sleep(0.05)
    assert len(poses) == before, "none while it was broken"
    two.link.mend()
    assert until(pose)
    assert until(lambda: pose() and poses[-1][1] < 1.0)
    assert max(age_s for _, age_s in poses) < 3.0, "and none of those that the link had held back"
    assert {edge.state for edge in observer.status()} == {"live"}


def test_what_a_link_held_back_is_as_old_as_it_is(
    observe: Callable[[dict[str, str]], FleetObserver],
) -> None:
    router = f"tcp/127.0.0.1:{free_port()}"
    with session("router", listen=[router]), session("client", connect=[router]) as robot:
        observer = observe({"r1": router})
        assert until(lambda: [edge.state for edge in observer.status()] == ["silent"])
        before = datetime.fromtimestamp(time.time() - 30, timezone.utc)
        sent = zenoh.Timestamp.parse_rfc3339(f"{before:%Y-%m-%dT%H:%M:%SZ}/{robot.zid()}")

        def came() -> bool:
            robot.put(
                "tfcompose/fleet/tests/r1/tf",
                tf(("r1/odom", "r1/base_link")),
                timestamp=sent,
            )
            return observer.status()[0].state != "silent"

        assert until(came)
        (status,) = observer.status()
        assert (status.state, status.edges[1].stale) == ("stale", True)
        with pytest.raises(StaleError, match="r1"):
            observer.pose("r1/odom", "r1/base_link")
        assert [finding.code for finding in observer.findings()] == ["TF883"]


def test_a_router_that_is_not_there_is_named_and_found_when_it_comes(
    observe: Callable[[dict[str, str]], FleetObserver],
) -> None:
    router = f"tcp/127.0.0.1:{free_port()}"
    observer = observe({"r1": router})
    assert [finding.code for finding in observer.findings()] == ["TF882"]
    with pytest.raises(StaleError, match="r1 is unreachable"):
        observer.pose("map", "r1/base_link")
    with pytest.raises(TransformException):
        observer.pose("map", "r1/nothing")
    with session("router", listen=[router]):
        assert until(lambda: [finding.code for finding in observer.findings()] == ["TF883"])
        robot = SimulatedRobot(fleet_of({"r1": router}), "r1", 0.0)
        try:
            assert until(lambda: list(observer.findings()) == [])
        finally:
            robot.close()


def tf(*edges: tuple[str, str], stamp_ns: int = 0) -> bytes:
    return encode(
        [
            SentTransform(stamp_ns, parent, child, (1.0, 2.0, 3.0), IDENTITY)
            for parent, child in edges
        ]
    )


def test_only_shared_edges_leave_with_fleet_names_once_per_period() -> None:
    edges = SharedEdges(fleet_of({"r1": "tcp/localhost:1"}, rate="5 Hz"), "r1")
    message = tf(("odom", "base_link"), ("base_link", "laser"), stamp_ns=7)
    period_ns = 200_000_000
    sent = edges.take(message, static=False, now_ns=10 * period_ns)
    assert sent is not None
    assert decode(sent) == [SentTransform(7, "r1/odom", "r1/base_link", (1.0, 2.0, 3.0), IDENTITY)]
    assert edges.take(message, static=False, now_ns=11 * period_ns - 1) is None
    assert edges.take(message, static=False, now_ns=11 * period_ns) is not None
    assert edges.take(tf(("base_link", "laser")), static=False, now_ns=0) is None
    assert decode(edges.fixed_message()) == []
    assert edges.take(tf(("map", "odom"), ("map", "dock")), static=True, now_ns=0) is None
    assert [
        (transform.parent, transform.child) for transform in decode(edges.fixed_message())
    ] == [("map", "r1/odom")]


def test_the_command_lists_robots_prints_poses_and_says_what_is_wrong(
    two: Two, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_text(two.routers), encoding="utf-8")

    def fleet(*words: str) -> tuple[int, str]:
        done = processes.run([sys.executable, "-m", "tfcompose", "fleet", *words], cwd=tmp_path)
        return done.returncode, done.stdout + done.stderr

    code, output = fleet("ps", "--format", "json", "--for", "2")
    assert (code, [robot["state"] for robot in json.loads(output)["robots"]]) == (
        0,
        ["live", "live"],
    )
    code, output = fleet("echo", "r1/base_link", "r2/base_link", "--once", "--format", "json")
    assert code == 0, output
    assert json.loads(output)["xyz"] == pytest.approx([1.0, 0.0, 0.0])
    code, output = fleet("echo", "r1/base_link", "r2/nothing", "--for", "1")
    assert code == 1
    assert "r2/nothing" in output, "it says why there is no pose, however soon it ends"
    assert fleet("doctor", str(file), "--for", "2")[0] == 0
    two.link.break_()
    code, output = fleet("doctor")
    assert code == 1
    assert "TF882" in output or "TF883" in output
    assert "r2" in output


@pytest.mark.slow
def test_of_twenty_robots_all_are_listed_and_the_one_that_dies_is_stale(tmp_path: Path) -> None:
    with RobotProcesses(20, "5 Hz") as robots:
        names = list(robots.fleet.robots)
        (tmp_path / "fleet.yaml").write_text(robots.text, encoding="utf-8")
        observer = FleetObserver(robots.fleet)
        try:
            assert observer.wait(2 * TIMEOUT_S)

            def poses(pairs: list[tuple[str, str]]) -> list[tuple[str, str]]:
                """Return the pairs between which there is no pose."""
                missing = []
                for first, second in pairs:
                    try:
                        observer.pose(f"{first}/base_link", f"{second}/base_link")
                    except (StaleError, TransformException):
                        missing.append((first, second))
                return missing

            pairs = [(first, second) for first in names for second in names]
            assert until(lambda: not poses(pairs))
            command = [sys.executable, "-m", "tfcompose", "fleet", "ps", "--format", "json"]

            def listed() -> dict[str, str]:
                done = processes.run([*command, "--for", "5"], cwd=tmp_path)
                return {
                    robot["robot"]: robot["state"] for robot in json.loads(done.stdout)["robots"]
                }

            assert listed() == dict.fromkeys(names, "live")
            robots.kill("r7")
            assert until(lambda: [finding.code for finding in observer.findings()] == ["TF883"])
            assert [edge.robot for edge in observer.status() if edge.state != "live"] == ["r7"]
            assert until(lambda: not poses([pair for pair in pairs if "r7" not in pair]))
            assert poses(pairs) == [
                pair for pair in pairs if "r7" in pair and pair != ("r7", "r7")
            ]
            assert listed() == dict.fromkeys(names, "live") | {"r7": "silent"}
        finally:
            observer.close()
