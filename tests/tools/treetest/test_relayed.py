"""Relays of a started robot: plans, commands and messages, without ROS."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in
from tfcompose.launcher.preflight import LAUNCH
from tfcompose.model.plan import Plan
from tfcompose.tf.bags import RecordedMessage
from tfcompose.tf.ros.tf_codec import Row
from tfcompose.tools.treetest.case import Case
from tfcompose.tools.treetest.cases import CaseLoader
from tfcompose.tools.treetest.faults import RecordedFaults
from tfcompose.tools.treetest.relay_request import RelayRequest, published_topics, redirect
from tfcompose.tools.treetest.relayed_messages import RelayedMessages
from tfcompose.tools.treetest.relayed_plan import relayed_processes, with_relays
from tfcompose.tools.treetest.setup import LiveSetup

ROBOT = """\
tfcompose: 1
robot: cart
links: {base_link: {}, arm: {}}
joints:
  arm_joint:
    {type: revolute, parent: base_link, child: arm, axis: [0, 0, 1],
     limit: {lower: -90 deg, upper: 90 deg, velocity: 1 rad/s, effort: 1}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 50 Hz}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3]}
  lamp: {parent: laser}
  tag: {parent: odom, owner: finder, rate: 5 Hz}
  cloud: {parent: odom, owner: mapper, rate: 5 Hz}
  gps: {parent: odom, owner: receiver, rate: 5 Hz}
containers: {loader: {}}
processes:
  drive: {simulate: {circle: {radius: 1 m, speed: 0.5 rad/s}, rate: 50 Hz}}
  arm_joints: {simulate: {joints: zero, rate: 50 Hz}}
  finder: {external: true, node: finder}
  mapper: {run: "mapper | tee log", shell: true, node: mapper}
  receiver: {component: gps/Receiver, container: loader}
"""
UP = (0.0, 0.0, 0.0, 1.0)
PRIVATE = ("/_private/tf", "/_private/tf_static")


def case_of(folder: Path, injections: str, robot: str = ROBOT) -> Case:
    (folder / "robot.yaml").write_text(robot, "utf-8")
    text = "robot: robot.yaml\ncases:\n  - name: drives\n    expect: {complete: 1 s}\n"
    (folder / "cart.test.yaml").write_text(f"{text}    inject: {injections}\n", "utf-8")
    (case,) = CaseLoader(trust=False).load(str(folder / "cart.test.yaml"))
    return case


def row(parent: str, child: str, stamp_ns: int = 0, x: float = 0.0) -> Row:
    return (parent, child, *divmod(stamp_ns, 10**9), x, 0.0, 0.0, *UP)


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    return case_of(tmp_path, "[]").plan


def relayed(case: Case) -> RelayedMessages:
    return RelayedMessages(dict(enumerate(case.spec.inject)), case.plan)


def children(messages: list[RecordedMessage]) -> list[tuple[bool, list[str]]]:
    return [(each.static, [row[1] for row in each.rows or ()]) for each in messages]


@pytest.mark.parametrize(
    ("injection", "processes"),
    [
        ("late: {edge: odom → base_link, by: 1 s}", ["drive"]),
        ("rename: {frame: base_link, to: base}", ["joints", "drive", "static"]),
        ("rename: {frame: lamp, to: lump}", ["static"]),
        ("joint: {name: arm_joint, position: 170 deg}", ["joints"]),
        ("kill: finder", []),
        ("publish: {edge: odom → base_link}", []),
    ],
)
def test_only_owners_of_changed_edges_begin_as_relays(
    injection: str, processes: list[str], tmp_path: Path
) -> None:
    case = case_of(tmp_path, f"{{{injection}}}")
    assert sorted(relayed_processes(case.spec.inject[0], case.plan)) == sorted(processes)
    changed = with_relays(case.plan, case.spec.inject, tmp_path / "setup.json")
    prefixed = {each.name: each.prefix for each in changed.processes if each.prefix}
    assert sorted(prefixed) == sorted(processes)
    without = tuple(replace(each, prefix=()) for each in changed.processes)
    assert replace(changed, processes=without) == case.plan
    topics = [json.loads(prefix[-1])["topics"] for prefix in prefixed.values()]
    assert len({topic for pair in topics for topic in pair}) == 2 * len(processes)


@pytest.mark.parametrize("edge", ["odom → tag", "odom → cloud", "odom → gps"])
def test_a_fault_of_an_owner_without_a_relay_is_refused(edge: str, tmp_path: Path) -> None:
    case_of(tmp_path, "[]")
    (tmp_path / "cart.test.yaml").write_text(
        "robot: robot.yaml\ncases:\n  - name: drives\n    expect: {complete: 1 s}\n"
        f"    inject: [{{clock: odom → base_link}}, {{clock: {edge}}}]\n",
        "utf-8",
    )
    done = tfcompose_in(tmp_path, "test")
    assert done.returncode == 2
    (place,) = [line.split()[0] for line in done.stderr.splitlines() if "error[TF932]" in line]
    assert place == "cart.test.yaml:5:49:"
    owner = {"odom → tag": "finder", "odom → cloud": "mapper", "odom → gps": "receiver"}[edge]
    assert owner in done.stderr


def test_a_setup_gives_the_same_case(tmp_path: Path) -> None:
    case = case_of(tmp_path, "[{clock: odom → base_link, at: 300 ms}]")
    setup = LiveSetup.of(case, tmp_path, parent=7, keeps=True)
    setup.write()
    again = LiveSetup.read(str(setup.path))
    assert again == setup
    assert (again.case.spec, again.case.plan) == (case.spec, case.plan)
    place = again.case.value_span("inject", 0, "clock")
    assert place == case.value_span("inject", 0, "clock")


@pytest.mark.parametrize(
    ("argv", "published", "command"),
    [
        (["/bin/node"], ("/tf", "/tf_static"), ["/bin/node", "--ros-args"]),
        (
            ["/bin/node", "x", "--ros-args", "-r", "/tf:=/mine/tf", "-p", "a:=1"],
            ("/mine/tf", "/tf_static"),
            ["/bin/node", "x", "--ros-args"],
        ),
        (  # ROS applies the first
            ["/bin/node", "--ros-args", "-r", "/tf:=/mine/tf", "-r", "/tf:=/last/tf"],
            ("/mine/tf", "/tf_static"),
            ["/bin/node", "--ros-args"],
        ),
    ],
)
def test_a_command_publishes_for_its_relay(
    argv: list[str], published: tuple[str, str], command: list[str]
) -> None:
    assert published_topics(argv, ("/tf", "/tf_static")) == published
    request = RelayRequest("setup.json", "drive", PRIVATE, ("/tf", "/tf_static"))
    new, env = redirect(argv, {"A": "b"}, request)
    rules = ["-r", "/tf:=/_private/tf", "-r", "/tf_static:=/_private/tf_static"]
    assert new == [*command, *rules, *argv[len(command) :]]
    assert env == {"A": "b"}


def test_a_launch_file_publishes_for_its_relay() -> None:
    settings = {"file": "a.launch.py", "remap": {"/tf": "/mine/tf", "scan": "front"}}
    request = RelayRequest("setup.json", "bringup", PRIVATE, ("/mine/tf", "/tf_static"))
    argv, env = redirect(["ros2", "launch"], {LAUNCH: json.dumps(settings)}, request)
    assert argv == ["ros2", "launch"]
    rules = json.loads(env[LAUNCH])["remap"]
    assert list(rules)[-1] == "scan"
    assert (rules["/tf"], rules["/tf_static"]) == PRIVATE


def test_a_relay_changes_messages_as_in_a_recording(tmp_path: Path) -> None:
    case = case_of(
        tmp_path,
        "[{jitter: {edge: odom → base_link, by: 50 ms}},"
        " {drop: {edge: odom → base_link, share: 0.3}},"
        " {rename: {frame: base_link, to: base}}]",
    )
    sent = [
        RecordedMessage(
            ("/tf", "/tf_static"),
            (row("odom", "base_link", tick),),
            static=False,
            received_ns=tick * 10**7,
        )
        for tick in range(1, 100)
    ]
    relay = relayed(case)
    for number in range(3):
        assert not list(relay.begin(number, 0))
    live = [
        changed
        for each in sent
        for changed in relay.take(each.rows or (), static=False, now_ns=each.received_ns)
    ]
    assert live == list(RecordedFaults(case.spec.inject, case.plan).inject(sent))
    assert len({each.received_ns % 10**7 for each in live}) > 20


def test_messages_pass_unchanged_until_a_fault_begins(tmp_path: Path) -> None:
    relay = relayed(case_of(tmp_path, "[{clock: odom → base_link}]"))
    moving = (row("odom", "base_link", 5 * 10**9),)
    (before,) = relay.take(moving, static=False, now_ns=5 * 10**9)
    assert before.rows == moving
    assert not list(relay.begin(0, 6 * 10**9))
    (after,) = relay.take(moving, static=False, now_ns=7 * 10**9)
    assert after.rows == (row("odom", "base_link", 0),)


def test_a_fault_changes_the_fixed_edges_sent_before(tmp_path: Path) -> None:
    relay = relayed(
        case_of(
            tmp_path,
            "[{jump: {edge: base_link → laser, xyz: [1, 0, 0]}},"
            " {rename: {frame: laser, to: lasr}}]",
        )
    )
    list(relay.take([row("base_link", "laser")], static=True, now_ns=1))
    (both,) = relay.take([row("laser", "lamp")], static=True, now_ns=2)
    assert children([both]) == [(True, ["laser", "lamp"])]
    (jumped,) = relay.begin(0, 3)
    assert jumped.rows == (row("base_link", "laser", x=1.0), row("laser", "lamp"))
    (renamed,) = relay.begin(1, 4)
    assert children([renamed]) == [(True, ["lasr", "lamp"])]


def test_no_dropped_or_moving_edge_stays_latched(tmp_path: Path) -> None:
    relay = relayed(case_of(tmp_path, "[{drop: {edge: base_link → laser}}]"))
    list(relay.take([row("base_link", "laser")], static=True, now_ns=1))
    assert children(list(relay.begin(0, 2))) == [(True, [])]
    dynamic = relayed(case_of(tmp_path, "[{dynamic: {edge: base_link → laser, rate: 10 Hz}}]"))
    list(dynamic.take([row("base_link", "laser")], static=True, now_ns=1))
    assert children(list(dynamic.begin(0, 10**9))) == [(False, ["laser"]), (True, [])]
    assert not list(dynamic.pass_time(10**9 + 99 * 10**6))
    assert children(list(dynamic.pass_time(10**9 + 10**8))) == [(False, ["laser"])]
