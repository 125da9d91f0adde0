"""Expected against seen, replayed.

Each thing that can be wrong with an edge, and nothing where all is right.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.findings import expect
from tfcompose.foundation.findings import Finding
from tfcompose.foundation.geometry import Offset, Pose, offset_of, quat_from_rpy
from tfcompose.guard.verdict.verify import (
    differences,
    group_differences,
    group_finding,
    state_of,
    verify,
)
from tfcompose.model.plan import (
    Driven,
    EdgePattern,
    GuardPolicy,
    Plan,
    PlanEdge,
    PlanJoint,
    PlanProcess,
    RosSettings,
)
from tfcompose.model.plan.topics import parts_of
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.publishers import Publisher
from tfcompose.tf.live.sent_joints import SentJoints
from tfcompose.tf.live.state import NAMELESS

S = 10**9
TOPICS = ("/tf", "/tf_static")
TOLERANCE = Offset(1e-3, math.radians(0.1))
LASER = Pose((0.0, 0.0, 0.3))
DRIVE, STATIC, CAMERA, JOINTS, OTHER = (
    f"/rover/{name}" for name in ("drive", "static", "camera", "joints", "other")
)


@pytest.fixture
def plan(edge: Callable[..., PlanEdge]) -> Plan:
    wheel = PlanJoint("wheel_joint", "continuous", (0.0, 0.0, 1.0))
    lift = PlanJoint("lift_joint", "prismatic", (0.0, 0.0, 1.0))
    edges = (
        replace(edge("odom base", "drive"), rate=10.0),
        edge("base laser", pose=LASER),
        edge("base wheel", "joints", Pose((0.0, 0.2, 0.0)), wheel),
        edge("base lift", "joints", Pose((0.0, 0.0, 0.5)), lift),
        replace(edge("camera lens", "camera", Pose((0.0, 0.015, 0.0))), kind="static"),
        replace(edge("base rack", "other", Pose((1.0, 0.0, 0.0))), kind="static"),
    )
    processes = (
        PlanProcess("drive", "external", nodes=(DRIVE,)),
        PlanProcess("static", "static", nodes=(STATIC,)),
        PlanProcess("joints", "joints", nodes=(JOINTS,)),
        PlanProcess(
            "camera",
            "run",
            nodes=(CAMERA,),
            drives=(Driven("camera", "realsense/d435i", publishes=True),),
        ),
        PlanProcess("other", "external", nodes=(OTHER,)),
    )
    return Plan("rover", "0", "base", RosSettings(), edges, processes)


class Tree:
    """A observer that hears ten seconds of the plan's edges, unless something is changed."""

    def __init__(self) -> None:
        self.observer = TreeObserver()
        self.sent: dict[str, dict[str, Any]] = {
            "base": {"parent": "odom", "node": DRIVE, "rate": 10.0},
            "laser": {"parent": "base", "node": STATIC, "pose": LASER},
            "wheel": {
                "parent": "base",
                "node": JOINTS,
                "rate": 10.0,
                "pose": Pose((0.0, 0.2, 0.0), (0, 0, 1, 0)),
            },
            "lift": {
                "parent": "base",
                "node": JOINTS,
                "rate": 10.0,
                "pose": Pose((0.0, 0.0, 0.9)),
            },
            "lens": {
                "parent": "camera",
                "node": CAMERA,
                "pose": Pose((0.0, 0.0151, 0.0), quat_from_rpy(0.01, 0, 0)),
            },
            "rack": {"parent": "base", "node": OTHER, "pose": Pose((1.0, 0.0, 0.0))},
        }

    def send(
        self,
        child: str,
        parent: str,
        node: str,
        pose: Pose = Pose(),  # noqa: B008
        rate: float = 0.0,
        **more: Any,
    ) -> None:
        static = more.get("static", not rate)
        times = [0.0] if not rate else [i / rate for i in range(round(10 * rate))]
        gid = more.get("gid", node.encode())
        for time_s in times:
            if (
                not more.get("until", 11) > time_s
                or more.get("gap", (11, 11))[0] < time_s < more.get("gap", (11, 11))[1]
            ):
                continue
            received = 100 * S + round(time_s * S)
            stamp = 100 * S + round((time_s * more.get("speed", 1.0) + more.get("ahead", 0.0)) * S)
            stamp = more.get("stamp", stamp)
            row = (parent, child, *divmod(stamp, S), *pose.xyz, *pose.quat_xyzw)
            self.observer.take([row], static=static, gid=gid, received_ns=received)

    def reported(self, plan: Plan, *, graph: bool = True) -> list[Finding]:
        for child, words in self.sent.items():
            self.send(child, **words)
        if graph:
            self.observer.take_graph(
                [
                    Publisher(words["node"].encode(), words["node"], static=False)
                    for words in self.sent.values()
                ]
            )
        self.observer.observed_ns = 110 * S
        verdicts = verify(plan, {TOPICS: self.observer}, TOLERANCE)
        return [finding for verdict in verdicts for finding in verdict.findings]


@pytest.fixture
def tree() -> Tree:
    return Tree()


def test_a_tree_as_planned_has_no_findings(plan: Plan, tree: Tree) -> None:
    assert tree.reported(plan) == []


@pytest.mark.parametrize(
    ("sent", "code", "severity"),
    [
        ({"stamp": 0}, "TF825", "error"),
        ({"stamp": 100 * S}, "TF823", "error"),
        ({"ahead": -20.0}, "TF825", "error"),
        ({"ahead": 3.0}, "TF835", "error"),
        ({"ahead": 0.2}, "TF835", "warning"),
        ({"ahead": -0.5}, "TF833", "warning"),
    ],
)
def test_an_edge_that_no_lookup_gets_by_its_stamps_is_not_as_expected(
    sent: dict[str, Any], code: str, severity: str, plan: Plan, tree: Tree
) -> None:
    tree.sent["base"] |= sent
    (finding,) = tree.reported(plan)
    assert (finding.code, finding.severity) == (code, severity)
    assert DRIVE in finding.message


def test_the_stamps_of_simulated_time_are_not_judged(plan: Plan, tree: Tree) -> None:
    tree.sent["base"] |= {"ahead": -20.0}
    assert tree.reported(replace(plan, ros=RosSettings(clock="sim"))) == []


def test_a_loop_is_reported_of_the_tree(plan: Plan, tree: Tree) -> None:
    tree.sent["odom"] = {"parent": "laser", "node": OTHER, "rate": 10.0}
    assert "TF820" in {finding.code for finding in tree.reported(plan)}


def test_two_senders_of_a_joint_and_an_unknown_joint_are_reported_once(
    plan: Plan, tree: Tree
) -> None:
    tree.observer.sent_joints = (
        SentJoints("/joint_states", "/arm", frozenset({"wheel_joint"}), 0, 10 * S),
        SentJoints("/joint_states", OTHER, frozenset({"wheel_joint", "weel"}), 0, 10 * S),
    )
    assert [finding.code for finding in tree.reported(plan)] == ["TF860", "TF861"]


#: What is sent of a frame otherwise than planned, None: nothing; and what the finding is and
#: names.
DIFFERENCES: dict[str, tuple[str, dict[str, Any] | None, str, tuple[str, ...]]] = {
    "missing": (
        "laser",
        None,
        "TF811",
        ("base → laser", "static (/rover/static)", "tfcompose ps"),
    ),
    "other parent": (
        "laser",
        {"parent": "odom"},
        "TF802",
        ("static (/rover/static)", "odom → laser", "base → laser"),
    ),
    "elsewhere": (
        "laser",
        {"pose": Pose((0.0, 0.003, 0.304), quat_from_rpy(0, math.radians(2), 0))},
        "TF846",
        (
            "laser",
            "base",
            STATIC,
            "5 mm",
            "2 deg",
            "xyz 0 0.003 0.304 m, rpy 0 2 0 deg",
            "xyz 0 0 0.3 m, rpy 0 0 0 deg",
        ),
    ),
    "moved": ("laser", {"pose": Pose((0.0, 0.003, 0.3))}, "TF846", (" 3 mm: ",)),
    "turned": (
        "laser",
        {"pose": Pose((0.0, 0.0, 0.3), quat_from_rpy(0, 0, -math.pi / 2))},
        "TF846",
        (" 90 deg: ",),
    ),
    "another owner's": ("rack", {"pose": Pose((1.1, 0.0, 0.0))}, "TF846", ("rack", " 100 mm: ")),
    "a joint's place": (
        "wheel",
        {"pose": Pose((0.0, 0.25, 0.0), quat_from_rpy(0, 0, 2))},
        "TF846",
        (" 50 mm:",),
    ),
    "off a joint's axis": (
        "wheel",
        {"pose": Pose((0.0, 0.2, 0.0), quat_from_rpy(math.radians(3), 0, 2))},
        "TF846",
        (" 3 deg:",),
    ),
    "aside of a prismatic joint": (
        "lift",
        {"pose": Pose((0.004, 0.0, 0.9))},
        "TF846",
        (" 4 mm:",),
    ),
    "other topic": (
        "laser",
        {"rate": 1.0, "static": False},
        "TF809",
        ("base → laser", "/tf ", STATIC, "/tf_static"),
    ),
    "falls silent": (
        "base",
        {"until": 5.0},
        "TF804",
        ("drive (/rover/drive)", "odom → base", "fell silent", "5.1 s"),
    ),
    "was silent": (
        "base",
        {"gap": (4.95, 6.95)},
        "TF804",
        ("drive (/rover/drive)", "was silent", "2.1 s"),
    ),
    "too rarely": (
        "base",
        {"rate": 7.0},
        "TF805",
        ("drive (/rover/drive)", "odom → base", "7 Hz", "10 Hz"),
    ),
    "no rotation": (
        "laser",
        {"pose": Pose((0.0, 0.0, 0.3), (0.0,) * 4)},
        "TF831",
        ("base → laser", "0.000"),
    ),
}


@pytest.mark.parametrize("case", DIFFERENCES)
def test_what_differs_from_the_plan_is_one_finding_with_its_code_and_names(
    plan: Plan, tree: Tree, case: str
) -> None:
    child, sent, code, names = DIFFERENCES[case]
    tree.sent[child] = tree.sent[child] | (sent or {})
    if sent is None:
        del tree.sent[child]
    [finding] = tree.reported(plan)
    expect(finding, code, *names)


def test_an_edge_with_a_slip_in_its_name_is_missing_and_named(plan: Plan, tree: Tree) -> None:
    tree.sent["lasr"] = tree.sent.pop("laser")
    missing, extra = tree.reported(plan)
    expect(missing, "TF811", "base → laser", "lasr?")
    assert (extra.code, extra.severity) == ("TF803", "warning")


@pytest.mark.parametrize(
    ("policy", "severity"), [("ignore", None), ("warn", "warning"), ("error", "error")]
)
def test_an_edge_that_nobody_declared_counts_as_the_policy_says(
    plan: Plan, tree: Tree, policy: Any, severity: str | None
) -> None:
    tree.sent["tag_1"] = {"parent": "lens", "node": OTHER, "rate": 10.0}
    plan = replace(plan, guard=GuardPolicy(unknown_edges=policy))
    assert [(finding.code, finding.severity) for finding in tree.reported(plan)] == (
        [("TF803", severity)] if severity else []
    )


def test_an_allowed_edge_is_not_reported(plan: Plan, tree: Tree) -> None:
    tree.sent["tag_1"] = {"parent": "lens", "node": OTHER, "rate": 10.0}
    assert (
        tree.reported(replace(plan, guard=GuardPolicy(allow=(EdgePattern("lens", "tag_*"),))))
        == []
    )


def test_a_switched_edge_may_hang_on_each_of_its_parents(plan: Plan, tree: Tree) -> None:
    edges = tuple(
        replace(edge, switched=("rack",)) if edge.child == "base" else edge for edge in plan.edges
    )
    tree.sent["base"]["parent"] = "rack"
    assert tree.reported(replace(plan, edges=edges)) == []


def test_a_value_within_the_tolerance_is_right(plan: Plan, tree: Tree) -> None:
    tree.sent["laser"]["pose"] = Pose((0.0, 0.0009, 0.3), quat_from_rpy(0, math.radians(0.09), 0))
    assert tree.reported(plan) == []


def test_another_owners_fixed_edge_without_a_pose_may_be_anywhere(plan: Plan, tree: Tree) -> None:
    edges = tuple(
        replace(edge, pose=Pose()) if edge.child == "rack" else edge for edge in plan.edges
    )
    assert tree.reported(replace(plan, edges=edges)) == []


def test_another_publisher_is_reported_with_both_names(plan: Plan, tree: Tree) -> None:
    tree.send("base", "odom", "/ekf", rate=10.0)
    tree.observer.take_graph([Publisher(b"/ekf", "/ekf", static=False)])
    [finding] = tree.reported(plan)
    expect(finding, "TF801", "odom → base", "/ekf", "drive (/rover/drive)")


def test_how_far_another_publishers_pose_is_off_is_reported_with_who_it_is(
    plan: Plan, tree: Tree
) -> None:
    tree.send("laser", "base", OTHER, Pose((0.25, 0.0, 0.3)))
    [finding] = tree.reported(plan)
    expect(finding, "TF801", "laser", "base", OTHER, "250 mm")


@pytest.mark.parametrize(
    ("metres", "output"), [(0.0125, "12.5 mm"), (0.9, "900 mm"), (1.0, "1 m"), (12.34, "12.3 m")]
)
def test_a_distance_is_shown_in_the_unit_that_people_use(metres: float, output: str) -> None:
    assert Offset(metres, 0.0).text == output


def test_two_nodes_of_the_owners_name_are_one_too_many(plan: Plan, tree: Tree) -> None:
    tree.send("base", "odom", DRIVE, rate=10.0, gid=b"twin")
    for child, words in tree.sent.items():
        tree.send(child, **words)
    publishers = [
        Publisher(words["node"].encode(), words["node"], static=False)
        for words in tree.sent.values()
    ]
    tree.observer.take_graph([*publishers, Publisher(b"twin", DRIVE, static=False)])
    [finding] = [
        entry
        for verdict in verify(plan, {TOPICS: tree.observer}, TOLERANCE)
        for entry in verdict.findings
    ]
    expect(finding, "TF801", "odom → base", f"another {DRIVE}", f"drive ({DRIVE})")


def test_of_three_nodes_of_the_owners_name_two_are_named_with_one_edge(
    plan: Plan, tree: Tree
) -> None:
    for number in (1, 2):
        tree.send("base", "odom", DRIVE, rate=10.0, gid=b"twin%d" % number)
    for child, options in tree.sent.items():
        tree.send(child, **options)
    where = "on this machine as pid"
    present = [
        Publisher(gid, DRIVE, static=False, where=f"{where} {number}")
        for number, gid in enumerate((DRIVE.encode(), b"twin1", b"twin2"), 10)
    ]
    publishers = [
        Publisher(options["node"].encode(), options["node"], static=False)
        for options in tree.sent.values()
    ]
    tree.observer.take_graph([*publishers, *present])
    state = state_of(tree.observer, TOPICS)
    twice = [each for each in differences(state, plan) if each.code == "TF801"]
    [group] = group_differences(twice)
    finding = group_finding(group, state, plan)
    expect(finding, "TF801", f"odom → base is published by another {DRIVE} (2 processes)")
    pids = [note.message.partition(f"{where} ")[2] for note in finding.notes]
    assert sorted(filter(None, pids)) == ["10", "11", "12"]


def test_a_publisher_that_has_left_is_reported(plan: Plan, tree: Tree) -> None:
    for child, words in tree.sent.items():
        tree.send(child, **words)
    present = [words["node"] for child, words in tree.sent.items() if child != "laser"]
    tree.observer.take_graph([Publisher(STATIC.encode(), STATIC, static=True)])
    tree.observer.take_graph([Publisher(node.encode(), node, static=False) for node in present])
    [finding] = [
        entry
        for verdict in verify(plan, {TOPICS: tree.observer}, TOLERANCE)
        for entry in verdict.findings
    ]
    expect(finding, "TF804", "static (/rover/static)", "base → laser")


def test_an_owner_that_was_started_again_has_not_left(plan: Plan, tree: Tree) -> None:
    tree.send("base", "odom", DRIVE, rate=10.0, gid=b"before", until=1.0)
    tree.observer.take_graph([Publisher(b"before", DRIVE, static=False)])
    assert tree.reported(plan) == []


def test_a_namesake_that_left_last_does_not_make_the_owner_leave(plan: Plan, tree: Tree) -> None:
    tree.send("base", "odom", DRIVE, rate=100.0, gid=b"twin")
    tree.observer.take_graph([Publisher(b"twin", DRIVE, static=False)])
    assert tree.reported(plan) == []


def test_a_slow_simulation_allows_proportionally_rarer_edges(plan: Plan, tree: Tree) -> None:
    tree.sent["base"] |= {"rate": 2.0, "speed": 0.2}
    tree.sent["wheel"] |= {"rate": 2.0, "speed": 0.2}
    assert tree.reported(replace(plan, ros=RosSettings(clock="sim"))) == []
    rarely = Tree()
    rarely.sent["base"] |= {"rate": 5.0}
    findings = rarely.reported(replace(plan, ros=RosSettings(clock="sim")))
    assert [finding.code for finding in findings] == ["TF805"]


def test_a_value_is_compared_also_where_one_before_it_was_refused(plan: Plan, tree: Tree) -> None:
    tree.send("laser", "base", STATIC, Pose((float("nan"), 0.0, 0.0)))
    tree.sent["laser"]["pose"] = Pose((0.0, 0.0, 0.4))
    assert [finding.code for finding in tree.reported(plan)] == ["TF831", "TF846"]


def test_a_planned_frame_that_is_published_in_itself_is_missing(plan: Plan, tree: Tree) -> None:
    tree.sent["laser"]["parent"] = "laser"
    assert [finding.code for finding in tree.reported(plan)] == ["TF821", "TF811"]


def test_a_lasting_unnamed_publisher_is_blamed_and_a_new_one_is_not(
    plan: Plan, tree: Tree
) -> None:
    tree.send("laser", "base", "", LASER, gid=b"raw")
    [finding] = tree.reported(plan)
    expect(finding, "TF801", "base → laser", NAMELESS, "static (/rover/static)")
    fresh = Tree()
    row = ("base", "laser", 109, 0, *LASER.xyz, *LASER.quat_xyzw)
    fresh.observer.take([row], static=True, gid=b"raw", received_ns=110 * S - S // 2)
    assert fresh.reported(plan) == []


def test_where_publishers_have_no_ids_nobody_is_blamed_who_may_be_innocent(plan: Plan) -> None:
    """One of those on the topic sent it, and the owner is among them."""
    tree = Tree()
    tree.sent["laser"] |= {"rate": 1.0, "static": False}
    for words in tree.sent.values():
        words["gid"] = None
    publishers = [
        Publisher(words["node"].encode(), words["node"], static=False)
        for words in tree.sent.values()
    ]
    for child, words in tree.sent.items():
        tree.send(child, **words)
    tree.observer.take_graph(
        [
            *publishers,
            *(
                replace(publisher, static=True, gid=publisher.gid + b"s")
                for publisher in publishers
            ),
        ]
    )
    verdicts = verify(plan, {TOPICS: tree.observer}, TOLERANCE)
    assert [finding.code for verdict in verdicts for finding in verdict.findings] == []


def test_a_driver_far_from_its_preset_is_reported_and_no_stranger_compared(
    plan: Plan, tree: Tree
) -> None:
    driven = replace(plan.process("camera").drives[0], frames={"lens": "nominal"})
    camera = replace(plan.process("camera"), drives=(driven,))
    plan = replace(
        plan, processes=tuple(camera if each.name == "camera" else each for each in plan.processes)
    )
    assert tree.reported(plan) == [], "calibrated"
    tree = Tree()
    tree.sent["lens"]["pose"] = Pose((0.0, 0.06, 0.0))
    [finding] = tree.reported(plan)
    expect(finding, "TF828", "lens", "camera", CAMERA, "45 mm", "realsense/d435i")
    tree = Tree()
    tree.send("lens", "camera", OTHER, Pose((0.0, 0.06, 0.0)))
    assert [entry.code for entry in tree.reported(plan)] == ["TF801"]


def test_advice_for_a_recording_needs_no_running_robot(plan: Plan, tree: Tree) -> None:
    del tree.sent["laser"]
    tree.sent["base"]["until"] = 5.0
    for words in tree.sent.values():
        words["gid"] = None
    advice_by_code = {finding.code: finding.help for finding in tree.reported(plan, graph=False)}
    assert advice_by_code == {"TF804": "", "TF811": ""}


def test_a_bag_knows_no_publishers_and_blames_none(plan: Plan, tree: Tree) -> None:
    for words in tree.sent.values():
        words["gid"] = None
    assert tree.reported(plan, graph=False) == []


def test_edges_are_searched_on_the_topics_of_their_owners(plan: Plan) -> None:
    moved = replace(plan.process("static"), remap={"/tf": "/r1/tf", "/tf_static": "/r1/tf_static"})
    plan = replace(
        plan, processes=tuple(moved if each.name == "static" else each for each in plan.processes)
    )
    topics = {pair: [edge.child for edge in part.edges] for pair, part in parts_of(plan).items()}
    assert topics == {
        TOPICS: ["base", "wheel", "lift", "lens", "rack"],
        ("/r1/tf", "/r1/tf_static"): ["laser"],
    }


angles = st.floats(-3.1, 3.1)


@given(st.tuples(angles, angles, angles), st.tuples(angles, angles, angles), st.floats(0.5, 2))
def test_the_angle_between_two_orientations_is_scipys(
    a: tuple[float, float, float], b: tuple[float, float, float], scale: float
) -> None:
    expected, observed = quat_from_rpy(*a), quat_from_rpy(*b)
    scaled = tuple(-scale * each for each in observed)
    angle = (Rotation.from_quat(expected).inv() * Rotation.from_quat(observed)).magnitude()
    assert offset_of(Pose(a, expected), Pose(b, scaled)).rot_rad == pytest.approx(angle, abs=1e-7)  # type: ignore[arg-type]
    assert offset_of(Pose(a, expected), Pose(b, observed)).xyz_m == pytest.approx(math.dist(a, b))


def test_what_a_strict_guard_passes_on_is_its_owners(plan: Plan) -> None:
    strict = replace(
        plan, processes=(*plan.processes, PlanProcess("guard", "guard", nodes=("/rover/guard",)))
    )
    tree = Tree()
    for sent in tree.sent.values():
        sent["node"] = "/rover/guard"
    assert tree.reported(strict) == []
    assert {finding.code for finding in tree.reported(plan)} == {"TF801"}


@pytest.mark.parametrize("metres", [0.012, 0.1, 0.7, 3.3])
def test_what_is_off_by_the_tolerance_is_within_it(metres: float) -> None:
    off = offset_of(Pose((1.1, 0.2, 0.3)), Pose((1.1 + metres, 0.2, 0.3)))
    assert not off.beyond(Offset(metres, 0.0))
    assert off.beyond(Offset(metres * 0.999, 0.0))
