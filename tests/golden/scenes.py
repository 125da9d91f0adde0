"""Histories and inputs that provoke grid code of the live tree, for its wording.

No process runs: what judges is given what it would have seen.
"""

import asyncio
import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import replace
from functools import partial
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np

from tests.support import guard_history as guarded
from tests.support.bags import drive, write_bag
from tests.support.cli import inside
from tests.support.deployed import (
    LATE,
    NOWHERE,
    RUNNING,
    STATE,
    STATUS,
    StandInHost,
    release_of,
    rollout_to,
)
from tests.support.deployed import ROBOT as HOSTED
from tests.support.machine_history import GUARD, SLAM, STATIC, begin, run_process
from tests.support.plans import compiled_plan
from tests.support.presets import MAST, WRONG_IN_MAST
from tests.support.robots import ROVER
from tests.support.tree_history import (
    BEGUN_NS,
    END_NS,
    SECOND_NS,
    SECONDS,
    TreeHistory,
    late,
    row,
    since_start,
    sound_plan,
    sound_tree,
)
from tfcompose.cli import live, writing
from tfcompose.cli.adjusting import moved
from tfcompose.cli.commands import echo
from tfcompose.cli.compiling import disk, library, missing_confinement
from tfcompose.cli.parser import main
from tfcompose.compiler.check.check import check
from tfcompose.compiler.check.rule import rule
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.urdf.inertia import UnmeasurableError
from tfcompose.compiler.urdf.lint import lint_urdf
from tfcompose.compiler.urdf.packages import Disk, Packages
from tfcompose.foundation.findings import Finding, RejectedError, Span, finding
from tfcompose.foundation.geometry import Pose
from tfcompose.foundation.signals import Stop
from tfcompose.foundation.tool import Command as ToolCommand
from tfcompose.foundation.tool import Key, Tool, installed_tools
from tfcompose.guard.losses import datagrams_lost
from tfcompose.guard.verdict.doctor import diagnose
from tfcompose.guard.verdict.drivers import SentPoses, not_taken
from tfcompose.launcher.events import Exited, StartFailed, TimeUp
from tfcompose.launcher.kernel_settings import check_settings
from tfcompose.launcher.preflight import commands_of
from tfcompose.model.files import Target
from tfcompose.model.messages import Alive, Clear, FindingShown, GateState, Live, ProcessRequest
from tfcompose.model.plan import (
    Driven,
    EdgePattern,
    GuardPolicy,
    Plan,
    PlanClaim,
    PlanEdge,
    PlanHost,
    PlanProcess,
    Ready,
    RosSettings,
    Schedule,
    SourceLine,
)
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.hosts import share_of
from tfcompose.model.robot import Robot
from tfcompose.model.robot.body import Asset
from tfcompose.spec.language import compose, find_overlay, overlay_files, set_value
from tfcompose.spec.language.tool_keys import problems_with
from tfcompose.spec.load import Source, load
from tfcompose.tf.bags import BagError
from tfcompose.tf.live.publishers import Message, OtherRun, Publisher, Senders
from tfcompose.tf.live.sent_joints import SentJoints
from tfcompose.tf.live.state import (
    NO_NODE,
    MovingJoint,
    RosProcess,
    StampedData,
    TopicState,
    TreeState,
)
from tfcompose.tf.process import read_own
from tfcompose.tf.ros import environment
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.tf_codec import TF_MESSAGE
from tfcompose.tools.adjust import calibrate
from tfcompose.tools.adjust.saving import save_poses
from tfcompose.tools.adjust.selection import select_edges
from tfcompose.tools.deploy.connection import LostError, Settings, connect_host
from tfcompose.tools.deploy.rollout import Rollout, target_of
from tfcompose.tools.exporters import command as exporters
from tfcompose.tools.fleet import command as fleet
from tfcompose.tools.fleet.check import check_fleet
from tfcompose.tools.fleet.observe import EdgeStatus, FleetRobotStatus, LinkState, problems_of
from tfcompose.tools.fleet.spec import validate_fleet
from tfcompose.tools.importers.draft import ImportDraft
from tfcompose.tools.importers.shell import add_script
from tfcompose.tools.prove.clouds import Cloud
from tfcompose.tools.prove.command import findings_of
from tfcompose.tools.prove.messages import CLOUDS, IMAGES, IMU, ODOMETRY, MeasuredTopic
from tfcompose.tools.prove.proof import Proof
from tfcompose.tools.prove.recording import Measurements
from tfcompose.tools.rebag import command as rebag
from tfcompose.tools.rebag import play
from tfcompose.tools.rebag.messages import MessageEditor
from tfcompose.tools.rebag.recorded_topic import RecordedTopic
from tfcompose.tools.treetest import running
from tfcompose.tools.treetest.cases import CaseLoader
from tfcompose.tools.treetest.running import run_case

HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
AN_EXAMPLE = finding("TF801", "an example's", None)
JOINT_STATE, CLOCK = "sensor_msgs/msg/JointState", "rosgraph_msgs/msg/Clock"


# The doctor.


def doctor() -> Iterator[Finding]:
    """Judge trees at the end, without a plan."""
    for state in (*_trees(), *_stamps(), *_graphs(), *_data(), *_setups()):
        yield from diagnose(state)


def _trees() -> Iterator[TreeState]:
    yield sound_tree().fixed("base_lnk camera").observed()
    yield sound_tree().fixed("robot1/base_link camera").observed()
    yield sound_tree().fixed("world table").observed()
    arm = MovingJoint("shoulder", "base_link", "arm")
    yield sound_tree().fixed("arm hand").observed(moving_joints=(arm,))
    yield TreeHistory().moving("a b").moving("b a").observed()
    yield TreeHistory().moving("a b").moving("b a", b"x").fixed("world a").observed()
    yield sound_tree().moving("map base_link", b"x").observed()
    yield (
        TreeHistory()
        .moving("table cup", b"x", parents=lambda tick: ("table", "hand")[tick % 2])
        .observed()
    )
    many = TreeHistory()
    for number in range(60):
        many.fixed(f"parent{number:02} cup")
    yield many.observed()
    yield sound_tree().moving("base_link base_link", b"x").observed()
    yield sound_tree().moving("/odom /gps", b"x").observed()
    for quaternion_w, x in ((0.9, 0.0), (0.0, 0.0), (1.0, float("nan"))):
        yield sound_tree().takes(row("base_link arm", END_NS, x, quaternion_w), b"x").observed()
        yield sound_tree().takes(row("odom base_link", END_NS, x, quaternion_w)).observed()
    yield sound_tree().moving("odom base_link", b"x").observed()
    yield sound_tree().moving("odom base_link", b"e").observed()
    yield sound_tree().fixed("odom base_link", b"x").observed()
    yield TreeHistory().moving("odom base_link", until_s=2.0).observed()
    yield sound_tree().knows(b"s").observed()
    yield sound_tree().knows(b"d").observed()
    yield TreeHistory().moving("odom base_link", hz=4).observed()
    yield TreeHistory().moving("odom base_link", hz=15).observed()
    paused = TreeHistory().moving("odom base_link", until_s=1.0)
    for tick in range(100):
        now = BEGUN_NS + 3 * SECOND_NS + tick * SECOND_NS // 50
        paused.takes(row("odom base_link", now), at_ns=now)
    yield paused.observed()


def _stamps() -> Iterator[TreeState]:
    yield TreeHistory().moving("odom base_link", stamp=late(0.7)).observed()
    yield TreeHistory().moving("odom base_link", stamp=late(-0.3)).observed()
    yield TreeHistory().moving("odom base_link", stamp=lambda _: BEGUN_NS).observed()
    yield (
        TreeHistory()
        .moving("odom base_link", stamp=lambda now: now - now // 20_000_000 % 2 * SECOND_NS)
        .observed()
    )
    yield TreeHistory().moving("odom base_link", stamp=lambda _: 0).observed()
    yield TreeHistory().moving("odom base_link", stamp=since_start).observed()
    yield TreeHistory().moving("odom base_link", stamp=late(3600)).observed()
    yield (
        sound_tree()
        .moving("base_link arm", b"x", stamp=since_start)
        .observed(clock_ns=5 * SECOND_NS)
    )
    simulated = TreeHistory().moving("odom base_link")
    for edge in ("map odom", "base_link arm"):
        simulated.moving(edge, b"x", stamp=since_start)
    yield simulated.observed(clock_ns=5 * SECOND_NS, clock_moves=True)
    yield sound_tree().observed(skews_s={b"d": 3.2})
    yield sound_tree().observed(skews_s={b"d": -0.4})
    clock = TopicState("/clock", CLOCK, ("/gazebo",), ("/nav",))
    yield sound_tree().observed(graph=(clock,))
    yield sound_tree().observed(graph=(clock,), clock_ns=5 * SECOND_NS)
    yield sound_tree().observed(graph=(replace(clock, publishers=()),))
    plan = sound_plan(ros=RosSettings(clock="sim"))
    yield sound_tree().observed(graph=(replace(clock, publishers=(), readers=()),), plan=plan)
    yield sound_tree().observed(
        graph=(replace(clock, publishers=("/bag", "/gazebo")),), clock_ns=1, clock_moves=True
    )


def _graphs() -> Iterator[TreeState]:
    yield sound_tree().observed(
        publishers=(Publisher(b"s", "/static", static=True, latched=False),), plan=sound_plan()
    )
    yield sound_tree().observed(
        publishers=(Publisher(b"d", "/drive", static=False, reliable=False),)
    )
    yield sound_tree().observed(volatile_readers=("/rviz",))
    yield sound_tree().observed(volatile_readers=("/rviz", "/viewer"))
    yield sound_tree().observed(graph=(TopicState("/tf", "std_msgs/msg/String", ("/old",)),))
    yield sound_tree().observed(malformed={b"d": 3, None: 1})
    both = (
        TopicState("/robot1/tf", TF_MESSAGE, ("/robot1/drive",)),
        TopicState("/tf", TF_MESSAGE, ("/robot1/ekf",)),
    )
    yield sound_tree().observed(graph=both)
    yield sound_tree().observed(
        publishers=tuple(Publisher(bytes([n]), f"/n{n}", static=True) for n in range(101))
    )
    joints = (MovingJoint("shoulder", "base_link", "arm"),)
    states = TopicState("/joint_states", JOINT_STATE, ("/broadcaster",), ())
    yield sound_tree().observed(graph=(states,))
    yield sound_tree().observed(graph=(states,), moving_joints=joints)
    yield sound_tree().observed(
        graph=(replace(states, publishers=(), readers=("/drive",)),), moving_joints=joints
    )
    heard = replace(states, readers=("/drive",))
    yield sound_tree().observed(
        graph=(heard,),
        moving_joints=joints,
        sent_joints=(_sender("/broadcaster", "sholder"),),
    )
    rogue = _sender("/rogue", "shoulder")
    for sender in (_sender("/broadcaster", "shoulder", "elbow"), rogue):
        yield sound_tree().observed(
            graph=(heard,), moving_joints=joints, sent_joints=(sender, rogue)
        )


def _sender(node: str, *joints: str) -> SentJoints:
    return SentJoints("/joint_states", node, frozenset(joints), 0, SECOND_NS)


def _data() -> Iterator[TreeState]:
    def data(frame: str, delay_s: float = 0.0, *stamps: int) -> tuple[StampedData]:
        return (StampedData("/scan", frame, ("/lidar",), (delay_s,) * 5, *stamps),)

    for frame in ("", "lasr", "elsewhere", "/laser"):
        yield sound_tree().observed(stamped=data(frame))
    prefixed = (
        TreeHistory().moving("robot1/odom robot1/base_link").fixed("robot1/base_link robot1/laser")
    )
    yield prefixed.observed(stamped=data("laser"))
    yield (
        TreeHistory().moving("odom base_link", stamp=late(0.4)).observed(stamped=data("base_link"))
    )
    yield sound_tree().observed(stamped=data("laser", 12.0))
    yield sound_tree().observed(stamped=data("laser", -1.0))
    for stamp in (0, 1234 * SECOND_NS, END_NS + 7200 * SECOND_NS):
        yield sound_tree().observed(stamped=data("laser", (END_NS - stamp) / 1e9, stamp, END_NS))
    simulated = TreeHistory().moving("odom base_link", stamp=since_start).fixed("base_link laser")
    yield simulated.observed(
        stamped=data("laser", 0.0, END_NS, END_NS), clock_ns=5 * SECOND_NS, clock_moves=True
    )


def _setups() -> Iterator[TreeState]:
    nothing = TreeState(SECONDS, settings={"ROS_DOMAIN_ID": "7", "RMW_IMPLEMENTATION": "b"})
    yield nothing
    yield replace(nothing, nodes=("/talker",))
    yield replace(nothing, nodes=("/listener", "/talker"), plan=sound_plan())
    yield replace(nothing, plan=sound_plan())
    yield replace(nothing, graph=(TopicState("/robot1/tf", TF_MESSAGE, ("/robot1/drive",)),))
    variables = {"ROS_DOMAIN_ID": "8", "RMW_IMPLEMENTATION": "a"}
    yield replace(nothing, processes=(RosProcess(9, "nav", variables),))
    yield replace(nothing, processes=tuple(RosProcess(pid, "nav", variables) for pid in range(5)))
    for settings in (
        {"ROS_LOCALHOST_ONLY": "1", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LAN"},
        {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"},
    ):
        yield sound_tree().observed(settings=settings)


def with_a_plan() -> Iterator[Finding]:
    """Judge trees at the end by a plan, as verify and the doctor do.

    Both live trees and recordings.
    """
    two = (
        *sound_plan().edges,
        PlanEdge(
            "base_link",
            "imu",
            "static",
            "static",
            "/static",
            Pose(),
            None,
            SourceLine("rover.yaml", 10),
        ),
    )
    for tree, plan in (
        (TreeHistory().moving("odom base_link"), sound_plan()),
        (TreeHistory().moving("odom base_link"), sound_plan(*two)),
        (TreeHistory().moving("odom base_link").fixed("base_link lasr"), sound_plan()),
        (TreeHistory().moving("odom base_link", b"x").fixed("base_link laser"), sound_plan()),
        (sound_tree().fixed("base_link laser", b"x", x=0.25), sound_plan()),
        (sound_tree().moving("map base_link", b"x"), sound_plan()),
        (TreeHistory().moving("map base_link").fixed("base_link laser"), sound_plan()),
        (sound_tree().moving("base_link arm", b"x"), sound_plan()),
        (
            TreeHistory().moving("odom base_link", until_s=3.0).fixed("base_link laser"),
            sound_plan(),
        ),
        (sound_tree().knows(b"s"), sound_plan()),
        (sound_tree().knows(b"d"), sound_plan()),
        (TreeHistory().moving("odom base_link", hz=20.0).fixed("base_link laser"), sound_plan()),
        (TreeHistory().moving("odom base_link").moving("base_link laser", b"s"), sound_plan()),
        (TreeHistory().moving("odom base_link").fixed("base_link laser", x=0.02), sound_plan()),
        (sound_tree().moving("odom base_link", b"e"), sound_plan()),
    ):
        yield from diagnose(tree.observed(plan=plan))
        yield from diagnose(replace(tree.observed(plan=plan), recorded=True))


# The guard.


def guard() -> Iterator[Finding]:
    """Judge message by message."""
    for history in (*_strangers(), *_shapes(), *_settings(), *_clocks(), *_lost()):
        yield from history.findings()
    yield from _drivers()


def _running(**more: Any) -> guarded.History:
    return guarded.History(**more).clear()


def _sent(
    node: str | None, sent: str, times: int = 5, *, static: bool = False, **more: Any
) -> guarded.History:
    """Return the history in which a node sends these edges so often."""
    history = _running(**more)
    return history.repeat(history.joins(node, static=static), sent, times)


def _strangers() -> Iterator[guarded.History]:
    yield _sent("/rogue", "map odom")
    yield _sent("/rogue", "base lidar, base camera", static=True)
    yield _sent("/rogue", "map odom, odom base")
    yield _sent(None, "map odom", 60)
    for fenced in (None, True, False):
        strict = _running(guard=GuardPolicy("strict"))
        rogue = strict.joins("/rogue")
        rogue.fenced = fenced
        yield strict.repeat(rogue, "map odom", 5)
    for profile in ("", "/opt/own.xml"):
        past = _running(guard=GuardPolicy("strict"))
        slam = past.joins("/slam", process="slam")
        slam.fenced, slam.profile = False, profile
        yield past.wait(1)
    yield _sent("/flood", ", ".join(f"f{number} f{number + 1}" for number in range(2000)), 30)
    yield _sent(NO_NODE, "map odom")
    yield _sent(NO_NODE, "map odom", settle_s=9)
    for edges in ("map odom, odom cart", "cart wheel"):
        neighbouring = _running()
        neighbour = neighbouring.joins("/other/slam")
        neighbour.run = OtherRun("other@0", 4711, "14:03:27")
        yield neighbouring.repeat(neighbour, edges, 20)
    stops = GuardPolicy(on_violation="stop-offender")
    yield _sent(
        "/slam",
        "odom base",
        guard=stops,
        processes=(PlanProcess("slam", "run", nodes=("/slam",)),),
    )
    for switch in ("enable_odom_tf: false", ""):
        yield _sent("/diff", "odom base", claims=(PlanClaim("/diff", "odom", "base", switch),))
    nodes = tuple(replace(process, nodes=(f"/{process.name}er",)) for process in guarded.PROCESSES)
    yield _sent("/slamer", "odom base", processes=nodes)
    yield _sent("/slamer", "map base", processes=nodes)
    twice = _running()
    first, second = twice.joins("/slam"), twice.joins("/slam")
    for _ in range(10):
        twice.send(first, "map odom").wait(0.1).send(second, "map odom").wait(0.1)
    yield twice
    unsure = _running(gids=False)
    unsure.joins("/drive")
    yield unsure.repeat(unsure.joins("/rogue"), "map odom, base cup", 10)
    misnamed = _running(
        processes=tuple(
            PlanProcess(name, "run", nodes=(f"/{name}",)) for name in ("slam", "drive")
        )
    )
    second = misnamed.joins("/other")
    misnamed.send(second, "map odom")
    writer = Publisher(
        second.gid,
        "/other",
        static=False,
        ours=True,
        process="slam",
        where="on this machine as pid 7",
    )
    misnamed.events += misnamed.judge.graph([writer], misnamed.now)
    misnamed.events += misnamed.judge.tick(misnamed.now + 0.2)
    yield misnamed
    yield _sent("/tracker", "map person")
    yield _sent("/tracker", "base tag_1, base tag_2", guard=GuardPolicy(unknown_edges="error"))
    for sent in ("/rogue map odom", "/slam map odom", "/rogue world odom", "/rogue base map"):
        early, (node, _, edges) = guarded.History(), sent.partition(" ")
        yield early.repeat(early.joins(node), edges, 20)


def _shapes() -> Iterator[guarded.History]:
    yield _sent("/rogue", "base_footprint base")
    yield _sent("/drive", "odom base, map base")
    yield _sent("/changer", "table tool", edges=(*guarded.EDGES, guarded.TOOL))
    yield _sent("/rogue", "base map")
    yield _sent("/slam", "odom odom")
    yield _sent("/slam", "map odom", static=True)
    for names in (("/a", "/b"), ("/a", "/a")):
        both = _running(guard=GuardPolicy(allow=(EdgePattern("*", "person_*"),)))
        first, second = (both.joins(name) for name in names)
        for _ in range(10):
            both.send(first, "map person_1").send(second, "map person_1").wait(0.1)
        yield both


def _settings() -> Iterator[guarded.History]:
    history = _running()
    history.joins("/static", static=True, volatile=True)
    yield history.wait(5)
    history = _running()
    history.events += history.judge.graph(
        [Publisher(b"w" * 16, "/slam", static=False, reliable=False)], history.now
    )
    yield history
    history = _running()
    writers = [Publisher(b"w" * 16, "/slam", static=static) for static in (False, True)]
    history.judge.plan = replace(history.judge.plan, ros=RosSettings("/rover"))
    inside = [replace(writer, node="/rover/slam") for writer in writers]
    judge = type(history.judge)(history.judge.plan, 1.0, 0.0, 0)
    history.events += judge.leaks(inside, ("/rover/tf", "/rover/tf_static"))
    yield history
    history = _running()
    static = history.joins("/static", static=True)
    static.sent = 1
    yield history.send(static, "base camera").wait(5)


def _clocks() -> Iterator[guarded.History]:
    def stamped(of: Callable[[guarded.History, int], float], **more: Any) -> guarded.History:
        history = _running(**more)
        slam = history.joins("/slam")
        for number in range(30):
            if more:
                history.judge.clock(round((100 + number / 10) * 1e9), history.now)
            history.send(slam, "map odom", stamp_s=of(history, number)).wait(0.1)
        return history

    begun = guarded.wall(_running())
    yield stamped(lambda _, number: 5 + number / 10)
    yield stamped(lambda _, __: 0)
    yield stamped(lambda history, _: guarded.wall(history) + 3600)
    yield stamped(lambda history, _: guarded.wall(history), clock="sim")
    yield stamped(lambda _, number: 70 + number / 10, clock="sim")
    yield stamped(lambda _, number: begun + min(number, 5) / 10)
    yield stamped(lambda history, number: guarded.wall(history) - 3 * (number == 20))


def _lost() -> Iterator[guarded.History]:
    edges = (
        guarded.edge("map odom", "slam", rate=10.0),
        guarded.edge("odom base", "slam", rate=10.0),
    )
    for names in ("map odom", "map odom, odom base"):
        history = _running(edges=edges)
        yield history.repeat(history.joins("/slam"), names, 30).wait(2)
        history = _running(edges=edges)
        yield history.repeat(history.joins("/slam"), names, 30, every=0.2)
    history = _running()
    static = history.joins("/static", static=True)
    history.send(static, guarded.FIXED).wait(1).leaves(static)
    yield history.wait(5)


def _drivers() -> Iterator[Finding]:
    driven = Driven(
        "front",
        "realsense/d435i",
        publishes=True,
        switch={"publish_tf": False},
        frames={"lens": "nominal", "optical": "exact"},
    )
    node, line = "/front/front", SourceLine("rover.yaml", 7)
    edges = tuple(
        PlanEdge(parent, child, "static", "front", node, Pose(), None, line)
        for parent, child in (("link", "lens"), ("lens", "optical"))
    )
    for drives in (driven, replace(driven, publishes=False)):
        process = PlanProcess("front", "run", nodes=(node,), drives=(drives,))
        both = (process, PlanProcess("static", "static"))
        planned = edges if drives.publishes else (guarded.edge("link lens", "static", "static"),)
        for sent in ("link depth", "base lens", "link lens"):
            yield from _sent(node, sent, static=True, edges=planned, processes=both).findings()
    front = PlanProcess("front", "run", nodes=(node,), drives=(driven,))
    plan = Plan("rover", "0", "link", RosSettings(), edges, (front,))
    for count in (1, 2):
        senders = Senders()
        senders.update([Publisher(b"g" * 16, node, static=True)])
        sent_poses = SentPoses(plan, senders)
        sent_edges = tuple((edge.parent, edge.child) for edge in edges[:count])
        off = [Pose((0.0, 0.1, 0.0))] * count
        sent_poses.take(
            Message(sent_edges, static=True, gid=b"g" * 16, source_ns=0, sequence=1, poses=off)
        )
        yield from sent_poses.judge()
    for value in (True, None):
        yield from not_taken(node, {"publish_tf": False}, {"publish_tf": value}, (driven,))


# The launcher.


def launcher() -> Iterator[Finding]:
    """Replay histories to the process machine, and look at plans before a start."""
    for history in _machines():
        yield from (*history.findings(), *history.late)
    with TemporaryDirectory() as folder, inside(folder):
        for plan, env in _unfit():
            base, file = {"PATH": "/nowhere", **env}, Path(folder, "plan.json")
            findings = commands_of(
                plan, list(plan.processes), file, base, environment.child_environment
            )[1]
            yield from (_without(entry, folder) for entry in findings)
    held = PlanProcess("lidar", "run", schedule=Schedule((4095,)))
    yield from check_settings(held) or [AN_EXAMPLE]
    with mock.patch.object(os, "sched_setscheduler", side_effect=PermissionError):
        real_time = replace(held, schedule=Schedule(policy="fifo", priority=80))
        yield from check_settings(real_time) or [AN_EXAMPLE]


def _without(finding: Finding, folder: str) -> Finding:
    """Return the finding with the name of a folder that stays the same."""
    notes = tuple(
        replace(note, message=note.message.replace(folder, "FOLDER")) for note in finding.notes
    )
    return replace(finding, message=finding.message.replace(folder, "FOLDER"), notes=notes)


def _machines() -> Iterator[Any]:
    drive = PlanProcess("drive", "external", owns=(("odom", "base_link"),))
    yield begin(STATIC, SLAM).feed(Exited("slam", 3, ("one", "two")))
    yield begin(STATIC, SLAM).feed(Exited("slam", -11))
    yield begin(STATIC, replace(run_process("a"), required=True)).feed(Exited("a", 0))
    restarted = begin(replace(run_process("a", restart="on-failure"), max_restarts=2))
    for _ in range(3):
        restarted.feed(Exited("a", 1)).wait(20)
    yield restarted
    yield begin(STATIC, run_process("camera", required=False)).feed(
        Exited("camera", 3, ("no device",))
    )
    yield begin(STATIC, SLAM).feed(StartFailed("slam", "Permission denied"))
    yield begin(GUARD, SLAM).wait(20)
    yield begin(GUARD, SLAM).feed(Exited("guard", 1, ("no rclpy",)))
    for mode in ("watch", "strict"):
        policy = GuardPolicy(mode)
        yield begin(GUARD, STATIC, guard=policy).feed(Clear(), Exited("guard", -9))
        hangs = begin(GUARD, STATIC, guard=policy).feed(Clear(), Alive())
        hangs.sleep_until_due()
        hangs.sleep_until_due()
        yield hangs
    stops = GuardPolicy(on_violation="stop-offender")
    offender = begin(GUARD, STATIC, drive, SLAM, guard=stops).feed(
        Clear(), FindingShown(AN_EXAMPLE, "drive"), FindingShown(AN_EXAMPLE, "slam")
    )
    yield offender.feed(Exited("slam", -2), FindingShown(AN_EXAMPLE, "slam"))
    lidar = PlanProcess("lidar", "run", nodes=("/lidar",))
    gates = {
        "topic": "/scan",
        "service": "/reset",
        "lifecycle": "active",
        "log": "ready [0-9]+",
        "exit": "",
    }
    for kind, text in gates.items():
        gate: Any = Ready(kind, text, timeout_s=3.0)  # type: ignore[arg-type]
        yield (
            begin(GUARD, replace(lidar, ready=gate))
            .feed(Clear(), GateState("lidar", "topics /tf", is_open=False))
            .wait(3)
        )
    gate = Ready("edges", timeout_s=3.0)
    shut = GateState("slam", "/tf is published by nobody", is_open=False)
    yield begin(GUARD, STATIC, replace(SLAM, ready=gate)).feed(Clear(), shut).wait(3)
    after = run_process("b", after={"lidar": "ready"})
    yield begin(GUARD, STATIC, replace(lidar, ready=Ready("topic", "/scan")), after).feed(
        Clear(), Exited("lidar", 0)
    )
    slam = replace(SLAM, argv=("slam",))
    yield begin(GUARD, STATIC, slam).feed(Clear(), Live("static", ("laser",)), TimeUp())
    stopped = begin(GUARD, STATIC, slam).feed(
        Clear(), Live("static", ("laser",)), Live("slam", ("odom",))
    )
    yield stopped.feed(ProcessRequest("stop", "slam"), Exited("slam", -2), TimeUp())
    yield begin(GUARD, STATIC, replace(slam, after={"drive": "ready"}), drive).feed(
        Clear(), TimeUp()
    )


def _unfit() -> Iterator[tuple[Plan, dict[str, str]]]:
    def plan(
        *processes: PlanProcess, guard: GuardPolicy | None = None, ros: RosSettings | None = None
    ) -> Plan:
        edges = tuple(
            PlanEdge(
                parent,
                child,
                "dynamic",
                process.name,
                f"/{process.name}",
                Pose(),
                None,
                SourceLine("rover.yaml", 1),
            )
            for process in processes
            for parent, child in process.owns
        )
        return Plan(
            "rover", "", None, ros or RosSettings(), edges, processes, guard or GuardPolicy()
        )

    true = ("/bin/true",)

    def run(name: str, *argv: str, **more: Any) -> PlanProcess:
        return PlanProcess(name, "run", argv=argv or true, **more)

    yield plan(run("lidar", "${executable:sllidar_ros2/sllidar_node}")), {}
    yield (
        plan(run("lidar", "${executable:sllidar_ros2/sllidar_node}")),
        {"AMENT_PREFIX_PATH": "/opt/ros/none"},
    )
    yield plan(run("lidar", "${executable:sllidar_ros2/sllidar_node}"), run("a", "no_a")), {}
    yield plan(run("lidar", "bin/lidar")), {}
    yield plan(run("a", cwd="maps")), {}
    yield plan(PlanProcess("lidar", "run")), {}
    yield plan(run("a", after={"nobody": "started"})), {}
    yield plan(run("a", after={"static": "done"}), PlanProcess("static", "static", argv=true)), {}
    yield plan(run("a", after={"b": "started"}), run("b", after={"a": "started"})), {}
    guard_process = PlanProcess("guard", "guard", argv=true)
    owner = run("slam", owns=(("map", "odom"),), nodes=("/slam",))
    partition, remap = (GuardPolicy("strict", fence=fence) for fence in ("partition", "remap"))
    yield plan(owner, guard_process, guard=partition), {"RMW_IMPLEMENTATION": "rmw_x"}
    yield plan(replace(owner, remap={"/tf": "tf"}), guard_process, guard=partition), {}
    yield (
        plan(owner, guard_process, guard=partition),
        {"FASTRTPS_DEFAULT_PROFILES_FILE": "/no/such.xml"},
    )
    sets = "export FASTRTPS_DEFAULT_PROFILES_FILE=/opt/my.xml; exec slam"
    yield plan(replace(owner, argv=("/bin/sh", "-c", sets)), guard_process, guard=partition), {}
    shell = replace(owner, argv=("/bin/sh", "-c", "slam | tee log"))
    yield (
        plan(
            shell, replace(shell, name="more", owns=(("odom", "a"),)), guard_process, guard=remap
        ),
        {},
    )
    yield plan(run("nav", "${launch:nav2/nav.launch.py}")), {}


# What surrounds them.


def surroundings() -> Iterator[Finding]:
    """Look at plans, hosts, bags and installations that are not as they should be."""
    yield from (datagrams_lost(38, limit) for limit in (212_992, None, 16_777_216))
    yield from _refused(partial(read_own, [], "static"))
    for text in (
        "nonsense",
        "[]",
        '{"version": 0, "edges": [], "processes": []}',
        '{"edges": 1, "processes": []}',
    ):
        yield from _refused(partial(read_plan, text, "plan.json"))
    plan = compiled_plan(ROVER)
    elsewhere = replace(
        plan, processes=tuple(replace(process, host="jetson") for process in plan.processes)
    )
    strict = replace(elsewhere, guard=GuardPolicy("strict"))
    shares = ((plan, "jetson"), (elsewhere, "jetsn"), (elsewhere, None), (strict, None))
    yield from (
        share
        for some, host in shares
        if isinstance(share := share_of(some, host, "laptop"), Finding)
    )
    with mock.patch.object(environment, "find_spec", return_value=None):
        yield environment.no_ros() or AN_EXAMPLE
    with (
        mock.patch.object(environment, "no_ros", return_value=None),
        mock.patch.dict(os.environ, LD_LIBRARY_PATH=""),
    ):
        for settings in ({"ROS_DOMAIN_ID": "300"}, {"RMW_IMPLEMENTATION": "rmw_none_cpp"}):
            yield environment.ros_trouble(settings) or AN_EXAMPLE
        zenoh = RosSettings(rmw="zenoh")
        yield environment.ros_trouble({"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}, zenoh) or AN_EXAMPLE
        yield (
            environment.other_middleware({"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}, zenoh)
            or AN_EXAMPLE
        )
        yield (
            environment.other_distro({"ROS_DISTRO": "jazzy"}, RosSettings(distro="kilted"))
            or AN_EXAMPLE
        )
        with mock.patch("ctypes.CDLL"):
            for name in ("rmw_cyclonedds_cpp", "rmw_zenoh_cpp"):
                session = {
                    "RMW_IMPLEMENTATION": name,
                    "ZENOH_SESSION_CONFIG_URI": "/no/such.json5",
                }
                with mock.patch.object(
                    environment, "find_spec", return_value=None if "dds" in name else True
                ):
                    yield environment.ros_trouble(session) or AN_EXAMPLE
    yield from check(Robot("r", "r.yaml", {}, (), {}, (), None), [two_parents])
    with mock.patch.object(live, "reject", side_effect=_rejected):
        with mock.patch.object(
            live, "missing_rosbags", return_value="rosbags is not installed: pip install it"
        ):
            yield from _refused(partial(live.from_bag, list))
        yield from _refused(partial(live.from_bag, _no_bag))


def fleets() -> Iterator[Finding]:
    """Look at fleets: at files with faults, and at robots that are not as they should be."""
    head = (
        "fleet: 1\nrobots: {r1: {router: tcp/a:7447}, r2: {router: tcp/b:7447, prefix: PREFIX,"
        " share: [EDGE]}}\n"
    )
    text = f"{head}share: [map → odom, odom → base_link]\n"
    for prefix, edge in (
        ("r1/", "map → odom"),
        ("r2/", "odom → base_link"),
        ("r2/", "odom, base_link"),
    ):
        source = load(text.replace("PREFIX", prefix).replace("EDGE", edge), "fleet.yaml")
        yield from _refused(partial(_check_fleet, source))
    source = load(text.replace("PREFIX", "r2/").replace("[EDGE]", "[]"), "fleet.yaml")
    yield from check_fleet(validate_fleet(source), source)
    ages = [(None, None, False), (9.0, 0.1, True), (0.1, -2.0, False)]
    edges = tuple(
        EdgeStatus("r1/odom", f"r1/{age}", age, delay, stale) for age, delay, stale in ages
    )
    states: list[tuple[LinkState, float | None]] = [
        ("unreachable", None),
        ("unreachable", 4.0),
        ("stale", 4.0),
        ("silent", None),
        ("live", 0.1),
    ]
    with mock.patch.multiple(fleet, find_spec=lambda _: None, reject=_rejected):
        yield from _refused(fleet.refuse_without_zenoh)
    for state, age in states:
        for delay_s in (0.0, 1.0):
            yield from problems_of(
                FleetRobotStatus("r1", "tcp/a:7447", state, age, edges, delay_s)
            )


def _check_fleet(source: Source) -> None:
    raise RejectedError(list(check_fleet(validate_fleet(source), source)))


def _no_bag() -> None:
    raise BagError("bag is no bag: it has no metadata.yaml", "ros2 bag reindex bag")


def _rejected(findings: list[Finding], *_: object) -> None:
    raise RejectedError(findings)


@rule("TF201")
def two_parents(robot: Robot) -> list[Finding]:
    """Crash."""
    raise ZeroDivisionError(robot.name)


def _refused(work: Callable[[], object]) -> list[Finding]:
    try:
        work()
    except RejectedError as error:
        return list(error.findings)
    return []


# What the file's findings in ``test_findings`` leave out: presets of one's own, settings, and what
# a build refuses.


def compiled() -> Iterator[Finding]:
    """Compile robots with presets that are wrong, and with what is not installed."""
    for setting in ("a", "=1"):
        yield from _refused(partial(set_value, setting))
    many = load(f"{HEAD}overlays: {{by: hostname, folder: units}}\n", "robot.yaml")
    for file in ([], ["ant.yaml"]):
        yield from _refused(partial(find_overlay, many, "an", file))
    yield from _refused(partial(find_overlay, load(HEAD, "robot.yaml"), "ant", ()))
    yield from _refused(partial(overlay_files, many, lambda _: ["ant.yml"]))
    yield from compose(many, overlays=[load("overlays: {by: hostname}\n", "ant.yaml")]).findings
    in_profile = f"{HEAD}profiles: {{demo: {{overlays: {{by: hostname}}}}}}\n"
    yield from compose(load(in_profile, "robot.yaml")).findings
    robot = f"{HEAD}preset_path: presets\nsensors: {{s: {{preset: %s, parent: base_link}}}}\n"
    with TemporaryDirectory() as folder, inside(folder):
        for name, text in {
            "realsense/d435i": "preset: 1\nextends: realsense/d435i\n",
            "me/mast": MAST,
        }.items():
            yield from _with_preset(name, text, robot % name)
        for old, new in WRONG_IN_MAST:
            yield from _with_preset("me/mast", MAST.replace(old, new, 1), robot % "me/mast")
    mass = (
        "tfcompose: 1\nrobot: r\nlinks: {base_link: {visual: {mesh: a.stl}, inertial: {mass: 6"
        " kg}}}\n"
    )
    for code, why in (
        ("TF905", "trimesh, which computes its volume, is not installed"),
        ("TF725", "it is flat"),
    ):
        moments = mock.Mock(
            side_effect=UnmeasurableError(code, why, "pip install 'tfcompose[mesh]'")
        )
        here = Disk(mock.Mock(return_value=""), lambda _: True, lambda _: True, moments=moments)
        yield from compile_robot(mass, "r.yaml", library(), read=mock.Mock(), disk=here).findings
    for form in ("package", "file"):
        yield writing._without_address(Asset("meshes/a.stl", Span("r.yaml", 7, 16, 7, 29)), form)
    sound = compile_robot(ROVER, "rover.yaml", library()).robot
    assert sound
    files = [replace(file, text=file.text.replace("0 0 0.3", "0 0 0.4")) for file in emit(sound)]
    yield from writing._differences(sound, files, Target())


def _with_preset(name: str, text: str, robot: str) -> Iterator[Finding]:
    file = Path("presets", f"{name}.yaml")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    yield from compile_robot(robot, "r.yaml", library()).findings


def recordings() -> Iterator[Finding]:
    """Read bags that are none, or hold no TF, and ask them for poses that they do not have."""
    refuse = partial(mock.patch.object, attribute="reject", side_effect=_rejected)
    with TemporaryDirectory() as folder, inside(folder), refuse(live), refuse(echo):
        for name, sent in {
            "bag": drive(),
            "below": drive(topic="/robot1/tf"),
            "empty": [],
        }.items():
            write_bag(Path(name), sent)
        Path("folder").mkdir()
        files = ("old.bag", "whole.mcap.zstd", "notes.txt")
        for name in files:
            Path(name).write_bytes(bytes(64))
        for bag in ("none", "folder", "empty", "below", *files):
            yield from _refused(
                partial(main, ["echo", "odom", "base_link", "--bag", bag, "--once"])
            )
        for words in (["odom", "base_lnk"], ["odom", "base_link", "--at", "1000000000.5"]):
            yield from _refused(partial(main, ["echo", *words, "--bag", "bag", "--once"]))


def corrected() -> Iterator[Finding]:
    """Correct a recording where the new one is there already, and with what does not fit it."""
    refuse = partial(mock.patch.object, attribute="reject", side_effect=_rejected)
    with TemporaryDirectory() as folder, inside(folder), refuse(live), refuse(rebag):
        Path("robot.yaml").write_text(ROVER, "utf-8")
        write_bag(Path("bag"), drive())
        Path("text.yaml").write_text("a: 1\n", "utf-8")
        for words in (["bag"], ["new", "--camera-info", "/tf=text.yaml"]):
            command = ["rebag", "bag", *words, "--with", "robot.yaml"]
            yield from _refused(partial(main, command))
    topic = RecordedTopic("/beep", "acme/msg/Beep")
    editor = MessageEditor({"old": "new"}, {})
    editor.editor_of(topic)
    yield from rebag.warnings_of(editor.unknown, {"/tf": 2})
    yield from play.warnings_of(["base_link → bracket"])


#: A lens in the base.
MEASURED = """\
header: {frame_id: base_link}
child_frame_id: lidar
transform: {translation: {x: 0, y: 0, z: 0.31}, rotation: {x: 0, y: 0, z: 0, w: 1}}
"""


def calibrated() -> Iterator[Finding]:
    """Calibrate what is no mount, and with an overlay that cannot be written."""
    refuse = mock.patch.object(calibrate, "reject", side_effect=_rejected)
    printed = redirect_stdout(StringIO())
    with TemporaryDirectory() as folder, inside(folder), refuse, printed:
        text = f"{ROVER}overlays: {{by: hostname, folder: units}}\n"
        Path("robot.yaml").write_text(text, "utf-8")
        Path("units").mkdir()
        Path("units/ant.yaml").write_text("{frames: {lidar: {rpy: [0, 0, 0.01]}}}\n", "utf-8")
        Path("new.yaml").write_text(MEASURED, "utf-8")
        for name, robot in (("lidr", "bee"), ("base_link", "bee"), ("lidar", "ant")):
            options = ["--with", "new.yaml", "--robot", robot]
            yield from _refused(partial(main, ["calibrate", name, *options]))
        yield from _refused(partial(main, ["calibrate", "lidar", "--undo", "--robot", "bee"]))
        for file, robot in (("new.yaml", "a/b"), ("kalibr", "bee")):
            options = ["--with", file, "--robot", robot]
            yield from _refused(partial(main, ["calibrate", "lidar", *options]))


#: A recording lacks the laser, and is too slow.
TESTED = """\
robot: robot.yaml
cases:
  - name: drives
    bag: bag
    expect:
      complete: 100 ms
      edges:
        odom → base_link: {owner: static, rate: [10 Hz, 20 Hz], age: 1 ms}
        base_link → laser: {}
      pose:
        odom → base_link: {xyz: [0, 0, 0], within: 1 m}
        base_link → laser: {xyz: [0, 0, 0]}
      lookups: [{from: odom, to: laser, at: [1 s, 9 s]}]
      findings: [{code: TF803, names: arm}]
"""
TESTED_ROBOT = """\
tfcompose: 1
robot: cart
frames:
  odom: {}
  base_link: {parent: odom, owner: drive}
  laser: {parent: base_link, xyz: [0.24, 0, 0.3]}
processes: {drive: {external: true, node: drive}}
"""


def tested() -> Iterator[Finding]:
    """Test a recording that meets no expectation, and with names that the robot lacks."""
    with TemporaryDirectory() as folder, inside(folder), Stop() as stop:
        Path("robot.yaml").write_text(TESTED_ROBOT, "utf-8")
        write_bag(Path("bag"), drive())
        for text in (TESTED, TESTED.replace("base_link → laser: {}", "odom → laser: {}")):
            Path("cart.test.yaml").write_text(text, "utf-8")
            loader = CaseLoader(trust=False)
            try:
                cases = loader.load("cart.test.yaml")
            except RejectedError as error:
                yield from error.findings
            else:
                yield from run_case(cases[0], stop).findings
        Path("cart.test.yaml").write_text(TESTED.replace("    bag: bag\n", ""), "utf-8")
        (case,) = CaseLoader(trust=False).load("cart.test.yaml")
        no_domain = RosError("every ROS domain is in use")
        with (
            mock.patch.object(running, "no_ros", return_value=None),
            mock.patch.object(running, "reserve_domain", side_effect=no_domain),
        ):
            yield from run_case(case, stop).findings


def exported() -> Iterator[Finding]:
    """Export processes that XML launch files cannot start."""
    text = "tfcompose: 1\nrobot: rover\nlinks: {base_link: {}}\nprocesses:\n"
    text += "  map: {run: {package: maps, executable: server}, lifecycle: active}\n"
    text += "  load: {run: [load]}\n  drive: {run: [drive], after: {load: done}}\n"
    with TemporaryDirectory() as folder, inside(folder):
        Path("robot.yaml").write_text(text, "utf-8")
        with mock.patch.object(exporters, "reject", side_effect=_rejected):
            command = ["export", "launch", "robot.yaml", "--format", "xml"]
            yield from _refused(partial(main, command))


def nudged() -> Iterator[Finding]:
    """What `nudge` refuses, of the running plan alone."""
    plan = compiled_plan(
        ROVER.replace("lidar:", "imu: {parent: base_link}\n  lidar:")
        + "joints: {neck: {type: revolute, parent: base_link, child: head, axis: [0, 0, 1],"
        " limit: {lower: -1, upper: 1, effort: 1, velocity: 1}}}\nlinks: {head: {}}\n"
    )
    edges = {edge.child: edge for edge in plan.edges}
    adjusted = {edge.child: moved(edge, Pose()) for edge in (edges["lidar"],)}
    plan = replace(plan, edges=tuple((edges | adjusted).values()))
    for name, restores in (
        ("lidr", False),
        ("camera", False),
        ("base_link", False),
        ("head", False),
        ("imu", True),
    ):
        try:
            select_edges(plan, name, restores=restores)
        except RejectedError as error:
            yield from error.findings


def saved() -> Iterator[Finding]:
    """What `nudge --save` refuses."""
    with TemporaryDirectory() as folder, inside(folder):
        Path("robot.yaml").write_text(ROVER.replace("robot: rover", "robot: cart"))
        try:
            save_poses(compiled_plan(ROVER), (), "robot.yaml", None)
        except RejectedError as error:
            yield from error.findings


def proved() -> Iterator[Finding]:
    """Measure with an IMU that is mounted or read otherwise, and with other frames."""
    text = f"{ROVER}links: {{imu: {{parent: base_link}}, camera: {{parent: base_link}}}}\n"
    compiled = compile_robot(text, "robot.yaml", library())
    assert compiled.robot is not None
    for force, rate in (
        ((1, -1, -1), (1, -1, -1)),
        ((1, 1, 1), (1, 1, -1)),
        ((9, 9, 9), (57, 57, 57)),
    ):
        measurements = Measurements()
        odometry = MeasuredTopic("/odom", ODOMETRY, {"odom": 1}, child_frame="base_link")
        imu = MeasuredTopic("/imu", IMU, {"imu": 1})
        for step in range(400):
            at_s, yaw_rate = step / 20, 0.6 * math.sin(step / 20)
            odometry.rows.append((at_s, 0.0, 0.0, yaw_rate))
            forces = (0.0, 0.0, 9.81 * force[2])
            imu.rows.append((at_s, *forces, 0.0, 0.0, yaw_rate * rate[2]))
        image = MeasuredTopic("/camera/camera_info", IMAGES[0], {"camera": 1})
        scan = MeasuredTopic("/scan", CLOUDS[0], {"lidr": 1})
        topics = (odometry, imu, image, scan)
        measurements.topics.update({topic.name: topic for topic in topics})
        proof = Proof(compiled.robot, compiled.sources[0], {"robot.yaml": text}, measurements)
        yield from findings_of(proof.verdicts())
    yield from _lower_lidar()
    yield from _overlapping_lidars()


def _lower_lidar() -> Iterator[Finding]:
    """Measure with a lidar that is lower than declared, over a floor."""
    text = "tfcompose: 1\nrobot: rover\nlinks: {base_link: {}}\nframes:\n"
    text += "  base_footprint: {parent: base_link, xyz: [0, 0, -0.2]}\n"
    text += "  lidar: {parent: base_link, xyz: [0, 0, 0.3]}\n"
    compiled = compile_robot(text, "robot.yaml", library())
    assert compiled.robot is not None
    x, y = np.meshgrid(np.linspace(-3, 3, 20), np.linspace(-3, 3, 20))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, -0.44)])
    topic = MeasuredTopic("/points", CLOUDS[1], {"lidar": 10})
    topic.clouds += [Cloud(float(at_s), points) for at_s in range(10)]
    measurements = Measurements()
    measurements.topics["/points"] = topic
    proof = Proof(compiled.robot, compiled.sources[0], {"robot.yaml": text}, measurements)
    yield from findings_of(proof.verdicts())


def _overlapping_lidars() -> Iterator[Finding]:
    """Measure a floor and two walls with two lidars, of which one is farther to the left."""
    text = "tfcompose: 1\nrobot: rover\nlinks: {base_link: {}}\nframes:\n"
    text += "  front: {parent: base_link, xyz: [0, 0, 0.3]}\n"
    text += "  rear: {parent: base_link, xyz: [0, 0, 0.3]}\n"
    compiled = compile_robot(text, "robot.yaml", library())
    assert compiled.robot is not None
    a, b = (grid.ravel() for grid in np.meshgrid(np.linspace(-2, 2, 20), np.linspace(0, 2, 20)))
    floor = np.column_stack([a, 2 * b - 2, np.full(a.size, -0.5)])
    walls = [np.column_stack(grid) for grid in ((a, a * 0 + 2, b - 0.5), (a * 0 + 2, a, b - 0.5))]
    points = np.vstack([floor, *walls])
    measurements = Measurements()
    for frame, offset in (("front", 0.0), ("rear", -0.12)):
        shift = np.array([0.0, offset, 0.0])
        topic = MeasuredTopic(f"/{frame}", CLOUDS[1], {frame: 10})
        topic.clouds += [Cloud(float(at_s), points + shift) for at_s in range(10)]
        measurements.topics[topic.name] = topic
    proof = Proof(compiled.robot, compiled.sources[0], {"robot.yaml": text}, measurements)
    yield from findings_of(proof.verdicts())


def imported() -> Iterator[Finding]:
    """A script of which a robot file cannot say all."""
    draft = ImportDraft("rover")
    lines = "sleep 3\nros2 run tf2_ros static_transform_publisher 0 0 0 base_link laser\n"
    add_script(draft, lines, "start.sh", Target())
    yield from draft.findings


# Hosts.


def foreign_tools() -> Iterator[Finding]:
    """Yield what is found about tools of other packages."""
    module = ModuleType("tools_of_others")
    vars(module).update(
        command=Tool("second", "second", commands=(ToolCommand("lint", "Lint", "second"),)),
        key=Tool("third", "third", keys=(Key("fleet", "third:FleetSpec", "a fleet"),)),
        code=Tool("fourth", "fourth", codes="tfcompose.tools.importers"),
        model=Tool("fifth", "fifth", keys=(Key("fifth", "no_such_module:Spec", "nothing"),)),
    )
    entries = [("first", "no_such_module:TOOL"), ("text", "tools_of_others:__name__")]
    entries += [(name, f"tools_of_others:{name}") for name in ("command", "key", "code", "model")]
    with (
        mock.patch.dict(sys.modules, {module.__name__: module}),
        mock.patch("tfcompose.foundation.tool._entry_points", return_value=entries),
    ):
        tools = installed_tools.__wrapped__()
    with mock.patch("tfcompose.spec.language.tool_keys.installed_tools", return_value=tools):
        yield from problems_with({"fifth"})


def confined() -> Iterator[Finding]:
    """Xacro files that reach for what they may not, and kernels that cannot hold them."""
    head = '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><link name="base_link"/>'
    with TemporaryDirectory() as folder, inside(folder):
        for text in (
            '<xacro:include filename="/etc/passwd"/>',
            '<xacro:include filename="/etc/passwd" optional="true"/>',
            "<link name=\"${xacro.load_yaml('/etc/passwd')}\"/>",
            "<link name=\"${(lambda: ''.__class__)()}\"/>",
        ):
            Path("arm.urdf.xacro").write_text(f"{head}{text}</robot>", encoding="utf-8")
            yield from lint_urdf("arm.urdf.xacro", Packages(disk()))
    yield from map(missing_confinement, ("Landlock", "seccomp"))


def deployed() -> Iterator[Finding]:
    """Deploy to hosts that lack something, are apart, are lost or do not come up."""
    hosted = compiled_plan(HOSTED)
    for plan, names in (
        (replace(hosted, hosts={}), []),
        (compiled_plan(NOWHERE), []),
        (hosted, ["jetsn"]),
    ):
        try:
            target_of(plan, names, {})
        except RejectedError as error:
            yield from error.findings
    refused = asyncio.run(
        connect_host("rear", PlanHost("root@127.0.0.1", 1), Settings("x.rear", "x"), None)
    )
    yield refused if isinstance(refused, Finding) else AN_EXAMPLE
    lacks: tuple[dict[str, dict[str, Any]], ...] = (
        {"jetson": {"problems": ["systemd does not run for this user: Failed to connect to bus"]}},
        {"jetson": {"tfcompose": None}},
        {"jetson": {"env": {"ROS_DOMAIN_ID": "7", "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}}},
        {
            "jetson": {"machine": "b"},
            "main": {"env": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}},
        },
    )
    for probes in lacks:
        yield from asyncio.run(
            rollout_to(StandInHost("main"), StandInHost("jetson"), probes=probes).examine()
        )
    yield from asyncio.run(
        rollout_to(StandInHost("main"), StandInHost("jetson", offset_s=2)).examine()
    )
    for answers in (
        {"take_lock": {"holder": "ann@laptop, pid 7, since 12:00:00"}},
        {"state": STATE | STATUS | {"stranger": 4711}},
        {"start": LostError("lost its connection"), "back": LostError("is lost")},
        {
            "wait": STATUS | {"failed": True, "lines": ["tfcompose: error"]},
            "back": {"release": None, "active": False},
        },
        {
            "wait": (
                STATUS | {"robot": RUNNING | {"missing": ["base_link → arm"], "processes": [LATE]}}
            )
        },
        {},
    ):
        yield from asyncio.run(
            _rolled_out(rollout_to(StandInHost("main"), StandInHost("jetson", answers)))
        )


async def _rolled_out(rollout: Rollout) -> list[Finding]:
    """Return what is found when the hosts are deployed to, and then are to go back."""
    try:
        await rollout.lock()
        await rollout.compare(release_of())
        if findings := rollout.strangers():
            return findings
        await rollout.send()
        await rollout.activate()
        await rollout.plan_return()
    except RejectedError as error:
        return list(error.findings)
    return []


SCENES: tuple[Callable[[], Iterator[Finding]], ...] = (
    doctor,
    with_a_plan,
    guard,
    launcher,
    surroundings,
    fleets,
    compiled,
    recordings,
    imported,
    corrected,
    calibrated,
    tested,
    exported,
    nudged,
    saved,
    proved,
    foreign_tools,
    confined,
    deployed,
)
