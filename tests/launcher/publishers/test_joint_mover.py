"""Joint states in, TF messages out, as bytes and without ROS.

Scipy computes the poses a second time.
"""

import math
from collections.abc import Callable, Mapping
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.support.findings import words_of
from tfcompose.foundation.geometry import Pose, angle_between, normalise
from tfcompose.launcher.publishers.joint_mover import JointMover, PublishOptions
from tfcompose.model.plan import JointType, PlanEdge, PlanJoint, SourceLine
from tfcompose.tf.ros.joint_codec import encode_names, fill
from tfcompose.tf.ros.tf_codec import SentTransform, decode

Z = (0.0, 0.0, 1.0)
SECOND_NS = 1_000_000_000
Edge = Callable[..., PlanEdge]
numbers = st.floats(-10, 10)
quaternions = (
    st.tuples(numbers, numbers, numbers, numbers)
    .filter(lambda q: math.hypot(*q) > 0.1)
    .map(normalise)
)


class Robot:
    """A mover, what it said, and messages for it."""

    def __init__(
        self, edges: list[PlanEdge], options: PublishOptions | None = None, now_ns: int | None = 5
    ) -> None:
        self.reports: list[str] = []
        self.mover = JointMover(
            edges, self.reports.append, lambda arrival: now_ns and arrival + now_ns, options
        )

    def hear(
        self, positions: Mapping[str, float], stamp_ns: int = SECOND_NS
    ) -> dict[str, SentTransform]:
        data = encode_names(list(positions))
        fill(data, stamp_ns, list(positions.values()))
        return self.answer(bytes(data))

    def answer(self, data: bytes) -> dict[str, SentTransform]:
        answer = self.mover.tf_message(data, 1000)
        return (
            {transform.child: transform for transform in decode(answer)}
            if answer is not None
            else {}
        )


def joint_edge(joint: PlanJoint, pose: Pose | None = None, child: str = "") -> PlanEdge:
    source = SourceLine("rover.yaml", 1)
    return PlanEdge(
        "base",
        child or joint.name,
        "joint",
        "joints",
        "/joints",
        pose or Pose(),
        None,
        source,
        joint,
    )


def slide(name: str, *mimic: object) -> PlanEdge:
    return joint_edge(PlanJoint(name, "prismatic", Z, *mimic))  # type: ignore[arg-type]


def heights(transforms: dict[str, SentTransform]) -> dict[str, float]:
    return {name: transform.xyz[2] for name, transform in transforms.items()}


@given(
    quaternions,
    quaternions,
    st.tuples(numbers, numbers, numbers),
    numbers,
    st.sampled_from(["revolute", "prismatic"]),
)
def test_a_joint_rotates_about_or_slides_along_its_axis_after_its_pose(
    quat_xyzw: tuple[float, float, float, float],
    towards: tuple[float, float, float, float],
    xyz: tuple[float, float, float],
    q: float,
    kind: JointType,
) -> None:
    turning = kind == "revolute"
    axis = tuple(Rotation.from_quat(towards).apply([0, 0, 1]))
    joint = PlanJoint("j", kind, axis)
    moved = Robot([joint_edge(joint, Pose(xyz, quat_xyzw))]).hear({"j": q})["j"]
    before = Rotation.from_quat(quat_xyzw)
    rotation = before * Rotation.from_rotvec([q * a for a in axis]) if turning else before
    position = (
        xyz
        if turning
        else [x + d for x, d in zip(xyz, before.apply([q * a for a in axis]), strict=True)]
    )
    assert moved.xyz == pytest.approx(position, abs=1e-12)
    assert angle_between(moved.quat_xyzw, tuple(rotation.as_quat())) < 1e-7
    assert math.hypot(*moved.quat_xyzw) == pytest.approx(1, abs=1e-12)


@given(
    st.lists(st.sampled_from(["revolute", "continuous", "prismatic"]), max_size=12), st.randoms()
)
def test_all_joints_move_as_each_does_alone_in_any_order_of_names(
    kinds: list[JointType], random: Random
) -> None:
    edges = [
        joint_edge(PlanJoint(f"j{n}", kind, Z), Pose((float(n), 0.0, 0.0)))
        for n, kind in enumerate(kinds)
    ]
    names = [f"j{n}" for n in range(len(kinds))]
    random.shuffle(names)
    positions = {name: 0.1 * int(name[1:]) - 0.3 for name in names}
    transforms = Robot(edges).hear(positions)
    assert transforms == {name: Robot(edges).hear({name: positions[name]})[name] for name in names}


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_a_chain_of_mimics_is_followed_in_any_order(order: tuple[int, ...]) -> None:
    edges = [
        slide("z_middle", "master", 2.0, 1.0),
        slide("a_last", "z_middle", -3.0, 0.5),
        slide("master"),
    ]
    transforms = Robot([edges[index] for index in order]).hear({"master": 10.0})
    assert heights(transforms) == {"z_middle": 21.0, "a_last": -62.5, "master": 10.0}


def test_a_position_that_is_sent_for_a_mimic_wins() -> None:
    transforms = Robot([slide("mimic", "master", 2.0), slide("next", "mimic", 1.0, 1.0)]).hear(
        {"master": 10.0, "mimic": 3.0}
    )
    assert heights(transforms) == {"mimic": 3.0, "next": 4.0}


def test_mimics_of_each_other_have_no_position() -> None:
    assert Robot([slide("a", "b"), slide("b", "a"), slide("c", "a")]).hear({"other": 1.0}) == {}


def test_a_message_moves_only_its_joints_and_repeats_no_old_value() -> None:
    robot = Robot([slide("left"), slide("right")])
    assert heights(robot.hear({"left": 1.0}, 10)) == {"left": 1.0}
    assert heights(robot.hear({"right": 2.0}, 11)) == {"right": 2.0}
    assert heights(robot.hear({"left": 3.0}, 12)) == {"left": 3.0}


def test_joints_outside_the_plan_are_left_out_at_any_position() -> None:
    assert heights(Robot([slide("left")]).hear({"grip": math.nan, "left": 1.0})) == {"left": 1.0}
    assert Robot([slide("left")]).hear({"grip": 1.0}) == {}


def test_of_a_name_that_comes_twice_the_first_counts() -> None:
    data = encode_names(["left", "left"])
    fill(data, 1, [1.0, 2.0])
    assert heights(Robot([slide("left")]).answer(bytes(data))) == {"left": 1.0}


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_joint_without_a_single_position_is_reported_once_and_not_sent(
    kind: JointType,
) -> None:
    robot = Robot(
        [
            joint_edge(PlanJoint("float", kind)),
            slide("left"),
            joint_edge(PlanJoint("f", "revolute", Z, "float")),
        ]
    )
    for stamp in (1, 2):
        assert heights(robot.hear({"float": 1.0, "left": 2.0}, stamp)).keys() == {"left", "f"}
    (report,) = robot.reports
    assert words_of(report) >= {"base", "float", kind}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_non_finite_position_drops_the_message_and_names_the_joint_once(
    bad: float,
) -> None:
    robot = Robot([slide("left"), slide("right")])
    for stamp in range(1, 4):
        assert robot.hear({"left": 1.0, "right": bad}, stamp) == {}
    (report,) = robot.reports
    assert "right" in words_of(report)
    assert heights(robot.hear({"left": 1.0, "right": 2.0}, 9)) == {"left": 1.0, "right": 2.0}


def test_messages_that_are_none_are_dropped_with_one_line_for_each_fault() -> None:
    robot = Robot([slide("left")])
    data = encode_names(["left"])
    fill(data, 1, [1.0])
    for _ in range(3):
        for length in (0, 3, 20, len(data) - 12):
            assert robot.answer(bytes(data[:length])) == {}
    assert len(robot.reports) == len(set(robot.reports)) == 2
    assert "positions" in words_of(robot.reports[1])


def test_a_source_of_ever_new_names_fills_neither_memory_nor_output() -> None:
    robot = Robot([slide("left"), slide("right")])
    for stamp in range(300):
        assert heights(
            robot.hear({f"other{stamp}": 1.0, "left": math.nan if stamp % 3 else 1.0}, stamp + 1)
        ) in (
            {},
            {"left": 1.0},
        )
    assert len(robot.mover._sources) <= 64
    assert len(robot.reports) == 1


def test_transforms_take_the_messages_time_or_else_that_of_its_arrival() -> None:
    robot = Robot([slide("left"), slide("right")])
    assert {
        t.stamp_ns for t in robot.hear({"left": 1.0, "right": 1.0}, 12 * SECOND_NS + 34).values()
    } == {12000000034}
    assert robot.hear({"left": 1.0}, 0)["left"].stamp_ns == 1005


def test_a_message_without_a_time_waits_for_simulated_time() -> None:
    assert Robot([slide("left")], now_ns=None).hear({"left": 1.0}, 0) == {}


def test_a_time_that_comes_twice_is_left_out_as_tf2_would_with_one_line() -> None:
    robot = Robot([slide("left"), slide("right")])
    assert robot.hear({"left": 1.0}, 10)
    assert robot.hear({"left": 1.0}, 10) == {}
    assert robot.hear({"left": 1.0}, 10) == {}
    assert robot.hear({"right": 1.0}, 10), "another driver's joints"
    assert robot.hear({"left": 1.0}, 11)
    assert len(robot.reports) == 1


def test_a_recording_that_starts_anew_is_published() -> None:
    robot = Robot([slide("left")], PublishOptions(publish_frequency=10))
    stamps = [20 * SECOND_NS, 21 * SECOND_NS, 3 * SECOND_NS, 3 * SECOND_NS + 1, 4 * SECOND_NS]
    assert [bool(robot.hear({"left": 1.0}, stamp)) for stamp in stamps] == [
        True,
        True,
        True,
        False,
        True,
    ]


def test_a_time_that_no_transform_can_hold_is_dropped() -> None:
    robot = Robot([slide("left")], now_ns=2**31 * SECOND_NS)
    assert robot.hear({"left": 1.0}, 0) == {}
    assert "does not fit" in robot.reports[0]


@pytest.mark.parametrize(
    ("source", "most"), [(100, 30), (100, 100), (100, 50), (500, 20), (50, 100)]
)
@given(seed=st.integers(0, 10**6))
@settings(max_examples=25)
def test_publish_frequency_sets_the_rate_and_reports_omitted_messages(
    source: int, most: int, seed: int
) -> None:
    jitter = Random(seed)
    robot = Robot([slide("left")], PublishOptions(publish_frequency=most))
    stamps = [
        SECOND_NS + int(SECOND_NS * (n + jitter.uniform(-0.2, 0.2)) / source) for n in range(500)
    ]
    published = sum(bool(robot.hear({"left": 1.0}, stamp)) for stamp in stamps)
    assert published == pytest.approx(500 * min(1, most / source), rel=0.02, abs=2)
    assert [f"{most} Hz" in report for report in robot.reports] == [True] * (most < source)


def test_without_publish_frequency_everything_is_published() -> None:
    robot = Robot([slide("left")])
    assert all(robot.hear({"left": 1.0}, stamp) for stamp in range(1, 1001))


def test_ignore_timestamp_publishes_whatever_the_time_is() -> None:
    robot = Robot([slide("left")], PublishOptions(publish_frequency=1, ignore_timestamp=True))
    assert all(robot.hear({"left": 1.0}, stamp) for stamp in (10, 10, 9, 11))
    assert robot.reports == []


def test_joints_without_states_are_missing_but_their_mimics_are_not() -> None:
    robot = Robot(
        [slide("left"), slide("right"), slide("finger", "right"), slide("thumb", "elsewhere")]
    )
    assert robot.mover.missing == ["left", "right", "thumb"]
    robot.hear({"right": 1.0})
    assert robot.mover.missing == ["left", "thumb"]
