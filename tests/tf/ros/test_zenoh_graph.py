"""Who publishes on rmw_zenoh.

Tokens and attachments, of peers that speak its format over a real router.
"""

import json
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.guard_history import edge
from tests.support.waiting import until
from tests.support.zenoh_peers import RosPeer, free_port, session
from tfcompose.guard.judge import Judge
from tfcompose.model.messages import FindingShown
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.tf.live.publishers import MessageReader, Publisher
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.node import Received
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.zenoh_graph import (
    Attachment,
    TokenOfPublisher,
    ZenohGraph,
    ZenohTF,
    attachment_of,
    gid_of_token,
    open_session,
    publisher_of,
)

PUBLISHER = (
    "@ros2_lv/7/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MP/%/%robot1/slam/%robot1%tf/tf2_msgs::msg::dds_::TFMessage_/"
    "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087/2:1:,100:,:,:,,"
)
GID = bytes(range(16))
IDENTITY = (0.0, 0.0, 0.0, 1.0)


def tf(*edges: str) -> bytes:
    pairs = (names.split() for names in edges)
    return encode(
        [
            SentTransform(time.time_ns(), parent, child, (0.0, 0.0, 0.0), IDENTITY)
            for parent, child in pairs
        ]
    )


def test_a_token_of_a_publisher_names_node_topic_type_and_qos() -> None:
    assert publisher_of(PUBLISHER) == TokenOfPublisher(
        gid_of_token(PUBLISHER),
        "/robot1/slam",
        "/robot1/tf",
        "tf2_msgs/msg/TFMessage",
        "transient_local",
        "best_effort",
    )
    at_the_root = (
        PUBLISHER.replace("%robot1/slam", "%/slam")
        .replace("%robot1%tf", "%tf")
        .replace("2:1:", "::")
    )
    publisher = publisher_of(at_the_root)
    assert publisher is not None
    assert (publisher.node, publisher.topic, publisher.durability, publisher.reliability) == (
        "/slam",
        "/tf",
        "volatile",
        "reliable",
    )
    later_release = publisher_of(f"{PUBLISHER}/more")
    assert later_release is not None
    assert later_release.node == "/robot1/slam"


@pytest.mark.parametrize(
    "token",
    [
        pytest.param(PUBLISHER.replace("/MP/", "/MS/"), id="subscription"),
        pytest.param("@ros2_lv/7/aa/0/0/NN/%/%/slam", id="node"),
        pytest.param("@ros2_lv/7/aa/0/1/MP/%/%/slam", id="no topic"),
        pytest.param("other/7/aa/0/1/MP/%/%/a/b/c/d/e", id="not of ROS"),
    ],
)
def test_what_is_no_publishers_token_is_left_out(token: str) -> None:
    assert publisher_of(token) is None


def test_an_attachment_has_count_time_and_id_in_old_and_new_layouts() -> None:
    numbers = (5).to_bytes(8, "little"), (77).to_bytes(8, "little")
    new = numbers[0] + numbers[1] + b"\x10" + GID
    old = (
        b"\x0fsequence_number"
        + numbers[0]
        + b"\x10source_timestamp"
        + numbers[1]
        + b"\x0asource_gid\x10"
        + GID
    )
    assert attachment_of(new) == attachment_of(old) == Attachment(5, 77, GID)
    for wrong in (
        b"",
        new[:-1],
        new.replace(b"\x10" + GID, b"\x0f" + GID),
        old.replace(b"source_gid", b"source_git"),
    ):
        assert attachment_of(wrong) is None


@dataclass
class Peers:
    """A router and two nodes that publish TF."""

    router: str
    slam: RosPeer
    rogue: RosPeer


@pytest.fixture
def peers() -> Iterator[Peers]:
    with ExitStack() as stack:
        router = f"tcp/127.0.0.1:{free_port()}"
        stack.enter_context(session("router", listen=[router]))
        slam = RosPeer(stack, router, "/robot1/slam")
        slam.advertise("/tf")
        slam.advertise("/tf_static", latched=True)
        slam.send("/tf_static", tf("base_link laser"))
        rogue = RosPeer(stack, router, "/rogue")
        rogue.advertise("/tf")
        yield Peers(router, slam, rogue)


def environment_of(peers: Peers, domain: int = 0) -> dict[str, str]:
    override = f'mode="peer";connect/endpoints=["{peers.router}"]'
    return {
        "ZENOH_CONFIG_OVERRIDE": override,
        "ROS_DOMAIN_ID": str(domain),
        "RMW_IMPLEMENTATION": "rmw_zenoh_cpp",
    }


def test_each_message_is_given_the_node_that_sent_it(peers: Peers) -> None:
    with ExitStack() as stack:
        opened = open_session(environment_of(peers))
        stack.callback(opened.close)
        graph, data = ZenohGraph(opened, 0), ZenohTF(opened, 0, ("/tf", "/tf_static"))
        assert until(lambda: len(graph.publishers("/tf")) == 2)
        senders: dict[bytes, set[str | None]] = {}

        def have_come() -> bool:
            peers.slam.send("/tf", tf("map odom"))
            peers.rogue.send("/tf", tf("odom base_link"))
            messages = data.take()
            nodes = {
                publisher.gid: publisher.node
                for topic in ("/tf", "/tf_static")
                for publisher in graph.publishers(topic)
            }
            for message in messages:
                assert message.attachment is not None
                senders.setdefault(message.attachment.gid, set()).add(
                    nodes.get(message.attachment.gid)
                )
            return len(senders) == 3

        assert until(have_come)
        assert senders == {
            peers.slam.gid("/tf"): {"/robot1/slam"},
            peers.slam.gid("/tf_static"): {"/robot1/slam"},
            peers.rogue.gid("/tf"): {"/rogue"},
        }
        peers.rogue.leave("/tf")
        assert until(
            lambda: [publisher.node for publisher in graph.publishers("/tf")] == ["/robot1/slam"]
        )
        assert [publisher.durability for publisher in graph.publishers("/tf_static")] == [
            "transient_local"
        ]


def test_a_message_without_an_attachment_is_of_nobody_who_is_known(peers: Peers) -> None:
    with ExitStack() as stack:
        opened = open_session(environment_of(peers))
        stack.callback(opened.close)
        data = ZenohTF(opened, 0, ("/tf", "/other"))

        def has_come() -> bool:
            peers.slam.send("/tf", tf("map odom"), attached=False)
            return any(received.attachment is None for received in data.take())

        assert until(has_come)


def test_the_guards_verdict_names_who_took_an_edge(peers: Peers) -> None:
    slam = PlanProcess("slam", "external", nodes=("/robot1/slam",), owns=(("map", "odom"),))
    plan = Plan(
        "rover",
        "",
        None,
        RosSettings(),
        (replace(edge("map odom", "slam"), node="/robot1/slam"),),
        (slam,),
    )
    judge, reader, notices = Judge(plan, 0.0, 0.0, 0), MessageReader(), list[FindingShown]()
    judge.tick(0.0)  # the start is over: who is found before has taken the edge
    with ExitStack() as stack:
        opened = open_session(environment_of(peers))
        stack.callback(opened.close)
        graph, data = ZenohGraph(opened, 0), ZenohTF(opened, 0, ("/tf", "/tf_static"))
        begun = time.monotonic()

        def is_found() -> bool:
            peers.slam.send("/tf", tf("map odom"))
            peers.rogue.send("/tf", tf("map odom"))
            now = time.monotonic() - begun
            present = [
                Publisher(publisher.gid, publisher.node, False, publisher.topic, publisher.type)  # noqa: FBT003 (moving edges)
                for publisher in graph.publishers("/tf")
            ]
            events = judge.graph(present, now)
            for sample in data.take():
                if not sample.static and sample.attachment:
                    sent = sample.attachment
                    received = Received(
                        sample.data, sent.gid, sent.source_ns, sample.received_ns, sent.sequence
                    )
                    message = reader.read(received, static=False)
                    events += judge.judge_arrival(judge.take(message, now), message, now)
            notices.extend(
                event for event in [*events, *judge.tick(now)] if isinstance(event, FindingShown)
            )
            return bool(notices)

        assert until(is_found)
    assert [(event.found.code, "/rogue" in event.found.message) for event in notices] == [
        ("TF801", True)
    ]


def test_without_a_router_one_sentence_says_so() -> None:
    nowhere = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(RosError, match="router") as raised:
        open_session(
            {"ZENOH_CONFIG_OVERRIDE": f'connect/endpoints=["{nowhere}"];connect/timeout_ms=100'}
        )
    assert "\n" not in str(raised.value)
    with pytest.raises(RosError, match="router"):
        open_session({"ZENOH_SESSION_CONFIG_URI": "/no/such.json5"})


def test_monitor_names_publishers_on_zenoh_without_an_installed_rmw_zenoh(
    peers: Peers, tmp_path: Path
) -> None:
    done = threading.Event()

    def publish() -> None:
        while not done.wait(0.02):
            peers.slam.send("/tf", tf("map odom"))
            peers.rogue.send("/tf", tf("map odom"))

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        command = [sys.executable, "-m", "tfcompose", "monitor", "--for", "2", "--format", "json"]
        env = {**os.environ, **environment_of(peers)}
        result = processes.run(command, env=env, cwd=tmp_path)
    finally:
        done.set()
        thread.join()
    assert result.returncode == 0, result.stderr
    nodes = {
        (edge["parent"], edge["child"], edge["publisher"])
        for edge in json.loads(result.stdout)["edges"]
    }
    assert nodes == {
        ("map", "odom", "/robot1/slam"),
        ("map", "odom", "/rogue"),
        ("base_link", "laser", "/robot1/slam"),
    }
