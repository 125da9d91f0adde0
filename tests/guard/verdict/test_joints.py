"""Who sends which joints, judged: two senders of a joint, and joints that nobody has."""

from dataclasses import replace

import pytest

from tests.support.tree_history import SECOND_NS, sound_plan, sound_tree
from tfcompose.foundation.geometry import Pose
from tfcompose.guard.verdict.doctor import diagnose
from tfcompose.guard.verdict.joints import find_sent_twice, unknown_joints
from tfcompose.model.plan import PlanEdge, PlanJoint, SourceLine
from tfcompose.tf.live.sent_joints import SentJoints
from tfcompose.tf.live.state import MovingJoint, TopicState

TOPIC = "/joint_states"


def sender(node: str, *joints: str, first_s: float = 0.0, last_s: float = 10.0) -> SentJoints:
    return SentJoints(
        TOPIC, node, frozenset(joints), int(first_s * SECOND_NS), int(last_s * SECOND_NS)
    )


@pytest.mark.parametrize(
    ("senders", "names"),
    [
        pytest.param(
            [sender("/wheels", "arm", "elbow"), sender("/rogue", "arm")],
            ["arm", "/rogue", "/wheels"],
            id="two nodes",
        ),
        pytest.param(
            [sender("/wheels", "arm"), sender("/wheels", "arm")],
            ["arm", "/wheels"],
            id="two publishers of one name",
        ),
        pytest.param(
            [sender("/wheels", "left"), sender("/arm", "arm")], [], id="different joints"
        ),
        pytest.param(
            [sender("/wheels", "arm", last_s=5.0), sender("/wheels", "arm", first_s=5.1)],
            [],
            id="one that was started again",
        ),
        pytest.param(
            [
                sender("/wheels", "arm", first_s=start, last_s=start + 3.0)
                for start in (0.0, 3.1, 6.2)
            ],
            [],
            id="one that was started again twice",
        ),
        pytest.param(
            [sender("/wheels", "arm"), sender("", "arm")], [], id="one without a name yet"
        ),
    ],
)
def test_a_joint_has_one_sender(senders: list[SentJoints], names: list[str]) -> None:
    findings = list(find_sent_twice(senders))
    assert [finding.code for finding in findings] == ["TF860"] * bool(names)
    assert all(name in finding.message for finding in findings for name in names)
    assert all("elbow" not in finding.message for finding in findings)


def test_a_joint_that_the_robot_lacks_is_named_with_the_nearest() -> None:
    (finding,) = unknown_joints([sender("/rogue", "arm_jiont", "arm_joint")], {"arm_joint"})
    assert (finding.code, "/rogue" in finding.message) == ("TF861", True)
    assert "arm_joint" in finding.help
    assert not list(unknown_joints([sender("/rogue", "anything")], set()))


def test_a_mimic_joint_needs_no_state_even_if_the_plan_describes_it() -> None:
    joint = PlanJoint("arm", "revolute", (0.0, 0.0, 1.0))
    edge = PlanEdge(
        "base_link",
        "arm",
        "joint",
        "drive",
        "/drive",
        Pose(),
        None,
        SourceLine("r.yaml", 1),
        joint,
    )
    heard = TopicState(TOPIC, "sensor_msgs/msg/JointState", ("/wheels",), ("/drive",))
    for mimic, expected in ((None, True), ("wheel", False)):
        plan = sound_plan(replace(edge, joint=replace(joint, mimic=mimic)))
        state = sound_tree().observed(
            graph=(heard,), plan=plan, sent_joints=(sender("/wheels", "wheel"),)
        )
        assert ("TF844" in {finding.code for finding in diagnose(state)}) is expected


def test_doctor_judges_the_topic_of_this_robot_alone() -> None:
    joints = (MovingJoint("arm", "base_link", "arm_link"),)
    senders = (sender("/wheels", "arm"), sender("/rogue", "arm"))
    heard = TopicState(TOPIC, "sensor_msgs/msg/JointState", ("/wheels", "/rogue"), ("/drive",))
    foreign_topic = TopicState("/else/states", heard.type, heard.publishers, heard.readers)
    for topic, expected in ((heard, True), (foreign_topic, False)):
        state = sound_tree().observed(graph=(topic,), moving_joints=joints, sent_joints=senders)
        assert ("TF860" in {finding.code for finding in diagnose(state)}) is expected
