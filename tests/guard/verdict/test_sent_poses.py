"""Where drivers say that their frames are, against nominal and exact values."""

from math import nan

import pytest

from tests.support.findings import expect
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.geometry import OPTICAL_XYZW, Pose, multiply, quat_from_rpy
from tfcompose.guard.verdict.drivers import SentPoses
from tfcompose.model.plan import Driven, Plan, PlanEdge, PlanProcess, RosSettings, SourceLine
from tfcompose.tf.live.publishers import Message, Publisher, Senders

LENS, OPTICAL = Pose((0.0, -0.05, 0.0)), Pose((0.0, 0.0, 0.0), OPTICAL_XYZW)
DRIVEN = Driven(
    "front", "realsense/d435i", publishes=True, frames={"lens": "nominal", "optical": "exact"}
)
PLAN = Plan(
    "rover",
    "0",
    "base",
    RosSettings(),
    (
        PlanEdge(
            "link", "lens", "static", "front", "/front/front", LENS, None, SourceLine("r.yaml", 1)
        ),
        PlanEdge(
            "lens",
            "optical",
            "static",
            "front",
            "/front/front",
            OPTICAL,
            None,
            SourceLine("r.yaml", 1),
        ),
        PlanEdge(
            "base",
            "arm",
            "static",
            "arm",
            "/arm",
            Pose((1.0, 0.0, 0.0)),
            None,
            SourceLine("r.yaml", 2),
        ),
        PlanEdge("arm", "tool", "static", "arm", "/arm", Pose(), None, SourceLine("r.yaml", 3)),
        PlanEdge(
            "base",
            "laser",
            "static",
            "static",
            "/static",
            Pose((1.0, 0.0, 0.0)),
            None,
            SourceLine("r.yaml", 4),
        ),
    ),
    (
        PlanProcess("front", "run", nodes=("/front/front",), drives=(DRIVEN,)),
        PlanProcess("arm", "run", nodes=("/arm",)),
        PlanProcess("static", "static", nodes=("/static",)),
    ),
)
GID = b"g" * 16


class Guard:
    """The comparison, with publishers that are sent for by name."""

    def __init__(self) -> None:
        self.senders = Senders()
        self.poses = SentPoses(PLAN, self.senders)

    def hears(self, *sent: tuple[str, str, Pose], gid: bytes | None = GID) -> None:
        edges = tuple((parent, child) for parent, child, _ in sent)
        self.poses.take(
            Message(
                edges,
                static=True,
                gid=gid,
                source_ns=0,
                sequence=1,
                poses=[pose for _, _, pose in sent],
            )
        )

    def knows(self, node: str, gid: bytes = GID) -> None:
        self.senders.update([*self.senders.present.values(), Publisher(gid, node, static=True)])

    def says(self) -> list[Finding]:
        return list(self.poses.judge())


def moved(pose: Pose, metres: float = 0.0, angle_deg: float = 0.0) -> Pose:
    x, y, z = pose.xyz
    rotation = quat_from_rpy(0.0, angle_deg * 0.017453292519943295, 0.0)
    return Pose((x, y, z + metres), multiply(rotation, pose.quat_xyzw))


@pytest.mark.parametrize(
    ("names", "metres", "angle_deg", "reported"),
    [
        ("link lens", 0.019, 4.9, False),
        ("link lens", 0.021, 0.0, True),
        ("link lens", 0.0, 5.1, True),
        ("lens optical", 0.0009, 0.19, False),
        ("lens optical", 0.0011, 0.0, True),
        ("lens optical", 0.0, 0.21, True),
    ],
)
def test_a_nominal_frame_may_be_calibrated_and_an_exact_one_only_rounded(
    names: str, metres: float, angle_deg: float, *, reported: bool
) -> None:
    guard = Guard()
    guard.knows("/front/front")
    parent, child = names.split()
    guard.hears((parent, child, moved(LENS if child == "lens" else OPTICAL, metres, angle_deg)))
    assert [finding.code for finding in guard.says()] == ["TF828"] * reported


def test_all_frames_of_one_driver_are_one_finding_that_is_reported_once() -> None:
    guard = Guard()
    guard.knows("/front/front")
    for _ in range(3):
        guard.hears(("link", "lens", moved(LENS, 0.1)), ("lens", "optical", moved(OPTICAL, 0.1)))
    (finding,) = guard.says()
    expect(
        finding,
        "TF828",
        "lens in link",
        "/front/front",
        "100 mm",
        "realsense/d435i",
        "1 more",
        "optical in lens",
    )
    assert (
        "xyz 0 -0.05 0.1 m" in finding.message,
        "xyz 0 0 0.1 m" in finding.notes[0].message,
    ) == (
        True,
        True,
    )
    assert finding.severity == "warning"
    guard.hears(("link", "lens", moved(LENS, 0.2)))
    assert guard.says() == []


def test_a_driver_that_was_started_again_is_compared_again() -> None:
    guard = Guard()
    guard.knows("/front/front")
    guard.hears(("link", "lens", LENS))
    assert guard.says() == []
    guard.knows("/front/front", b"h" * 16)
    guard.hears(("link", "lens", moved(LENS, 0.1)), gid=b"h" * 16)
    assert len(guard.says()) == 1


def test_a_sender_without_a_name_is_awaited_and_a_stranger_not_compared() -> None:
    """Whoever else sends the edge is told that it is not theirs."""
    guard = Guard()
    guard.hears(("link", "lens", moved(LENS, 0.1)))
    assert guard.says() == []
    guard.knows("/front/front")
    assert len(guard.says()) == 1
    second_guard = Guard()
    second_guard.knows("/stranger")
    second_guard.hears(("link", "lens", moved(LENS, 0.1)))
    assert second_guard.says() == []


@pytest.mark.parametrize(
    "pose",
    [
        Pose((nan, 0.0, 0.0)),
        Pose(LENS.xyz, (0.0, 0.0, 0.0, 0.0)),
        Pose(LENS.xyz, (0.0, 0.0, 0.0, nan)),
    ],
)
def test_what_tf2_drops_is_no_pose_to_compare(pose: Pose) -> None:
    guard = Guard()
    guard.knows("/front/front")
    guard.hears(("link", "lens", pose))
    assert guard.says() == []


def test_without_an_id_or_below_another_parent_nothing_is_compared() -> None:
    guard = Guard()
    guard.knows("/front/front")
    guard.hears(("link", "lens", moved(LENS, 0.1)), gid=None)
    guard.hears(("other", "lens", moved(LENS, 0.1)))
    assert guard.says() == []


@pytest.mark.parametrize(
    ("node", "names", "metres", "codes"),
    [
        ("/arm", "base arm", 0.0, []),
        ("/arm", "base arm", 0.0009, []),
        ("/arm", "base arm", 1.0, ["TF846"]),
        ("/arm", "arm tool", 1.0, []),  # the robot says nothing of where it is
        ("/static", "base laser", 1.0, []),  # who reads the plan sends what it says
    ],
)
def test_a_fixed_frame_of_another_owner_is_where_the_robot_declares_it(
    node: str, names: str, metres: float, codes: list[str]
) -> None:
    guard = Guard()
    guard.knows(node)
    parent, child = names.split()
    declared = next(edge.pose for edge in PLAN.edges if edge.child == child)
    guard.hears((parent, child, moved(declared, metres)))
    findings = guard.says()
    assert [finding.code for finding in findings] == codes
    for finding in findings:
        expect(finding, "TF846", "arm in base", "/arm", "1 m")
