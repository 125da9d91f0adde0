"""The guard's process, which watches TF topics until it receives a signal.

It writes events to the launcher as lines of JSON on the descriptor in ``TFCOMPOSE_EVENTS_FD``.
Without a launcher it writes to its standard output. ``TFCOMPOSE_SETTLE_S`` is the duration of the
observation before the other processes start. Robots with separate TF topics share a guard, which
has a judge for each pair of topics. Pairs are judged separately, because an edge may be correct on
its own robot's topics and a violation on another robot's topics.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.text import plural
from tfcompose.guard.channel import (
    EventWriter,
    FindingsReport,
    Memory,
    OrderReader,
    SilentEdges,
    SwitchMemory,
    recall_memory,
)
from tfcompose.guard.components import ComponentDriver, Components
from tfcompose.guard.descriptions import Descriptions
from tfcompose.guard.diagnostics import DiagnosticsPage
from tfcompose.guard.flood import WAIT_S, FloodReader
from tfcompose.guard.gates import Gates, LifecycleDriver, Switches
from tfcompose.guard.joint_watch import JointWatch
from tfcompose.guard.judge import FINDING_S, Judge, JudgeMemory
from tfcompose.guard.ledger import MOST_UNDECLARED
from tfcompose.guard.losses import LossWatch
from tfcompose.guard.plan_parameters import PlanParameters
from tfcompose.guard.relay import Feedback, Relay
from tfcompose.model.messages import Clear, TreeComplete
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.middleware import IMPLEMENTATIONS
from tfcompose.model.plan.topics import GLOBAL, parts_of, private_topics
from tfcompose.model.variables import (
    JOINS,
    LAUNCHER,
    ORDERS_FD,
    PROCESS,
    REMAPPED,
    RUN_ID,
    SETTLE,
)
from tfcompose.tf.live.publishers import MessageReader, forget_oldest
from tfcompose.tf.live.topics import RunMarks, TFGraph, TFTopics
from tfcompose.tf.process import ready, say
from tfcompose.tf.ros.clock import ClockWatch, SimClock
from tfcompose.tf.ros.environment import PROFILE_VARIABLES
from tfcompose.tf.ros.graph import gid_identifies_node
from tfcompose.tf.ros.node import DEEP, WaitSet, middleware, open_node
from tfcompose.tf.ros.tf_codec import number_of_transforms

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import Any

    from rclpy.node import Node

    from tfcompose.foundation.signals import Stop
    from tfcompose.guard.ledger import JudgedMessage
    from tfcompose.model.messages import GuardEvent
    from tfcompose.model.plan import Plan, PlanProcess
    from tfcompose.tf.live.publishers import Message
    from tfcompose.tf.live.topics import TFData
    from tfcompose.tf.process import OwnProcess

    Topics = tuple[str, str]


CHECK_EVERY_S = 0.1
#: Extra delay of a check, in seconds, while messages that must be forwarded arrive.
LATE_S = 0.05
#: If the guard forwards nothing, messages gather for this time between two steps, in seconds,
#: because a wake-up costs more than a message. After a step with this many messages the guard does
#: not wait, because readers keep only a thousand.
GATHER_S, GATHER_BELOW = 0.05, 100
#: Interval at which a strict guard reports blocked messages, in seconds.
REPORT_EVERY_S = 10.0


class TopicWatch:
    """Passes messages and publishers of a pair of topics (moving, fixed) to a judge.

    In a strict plan, it forwards the admitted edges. If remappings isolate the plan's processes,
    ``private`` holds their topics.
    """

    def __init__(
        self,
        node: Node,
        topics: Topics,
        judge: Judge,
        emit: Callable[[GuardEvent], None],
        private: Mapping[str, Topics] | None = None,
    ) -> None:
        strict = judge.plan.guard.mode == "strict"
        self._by_partition = strict and private is None
        self.data = TFTopics(node, topics, private or ("partition" if strict else ""), deep=True)
        self._clock = SimClock(node) if judge.clocks.simulated else None
        self._reader = MessageReader(judge.compared)
        profile = PROFILE_VARIABLES[0] if self._by_partition else ""
        marks = _run_marks(judge.plan, profile) if RUN_ID in os.environ else None
        self._graph = TFGraph(
            node, topics, None if private is None else tuple(private.values()), ours=marks
        )
        feedback = None if private is None else Feedback(node, private, self.data.own_gids)
        self.relay = Relay(node, self._graph, self.data.own_gids, feedback) if strict else None
        self.judge = judge
        self._emit = emit
        self._leaks_to: tuple[str, str] | None = None
        self._due = self._report_due = 0.0
        self._malformed: dict[bytes | None, None] = {}
        self._gids: dict[bytes | None, None] = {}
        self._number_taken = 0
        self._decoder = self._reader.decoder
        self._flood = FloodReader(frozenset(edge.child for edge in judge.plan.edges))
        self._most = (
            len(judge.plan.edges) + MOST_UNDECLARED
        )  # a publisher with more edges floods the tree

    def watch_global_topics(self) -> None:
        """Also report nodes of the plan that use the global topics by mistake."""
        self._leaks_to = self._graph.topics

    def begin(self, now: float, memory: dict[str, Any] | None) -> None:
        """Skip the observation before the start, because the plan started long ago."""
        self._pass_on(
            self.judge.tick(now)
            if memory is None
            else self.judge.recall(msgspec.convert(memory, JudgeMemory), now)
        )
        if self.relay and memory:
            self.relay.recall(
                memory, lambda message: self.judge.admits(message, now), now + FINDING_S
            )

    @property
    def wait_s(self) -> float:
        """Maximum time until the next step, in seconds."""
        due_s = max(0.0, self._due - time.monotonic())
        return min(due_s, WAIT_S) if self._flood.is_reading else due_s

    @property
    def gather_s(self) -> float:
        """Time for which messages may gather before the next step, in seconds."""
        is_prompt = self.relay is not None or self._flood.is_reading
        is_prompt = is_prompt or self.judge.is_starting(time.monotonic())
        return gather_s(self._number_taken, is_prompt=is_prompt)

    def close(self) -> None:
        """Close the readers and publishers that must end before the node."""
        self.data.close()

    def step(self) -> None:
        """Process new messages and, periodically, the ROS graph."""
        now = time.monotonic()
        if self._clock:
            self.judge.clock(self._clock.now_ns(), now)
        fenced = list(self.data.take_fenced())
        strangers = self._take(fenced, now)  # first, because these are forwarded
        public = list(self.data.take_public())
        if len(fenced if self.relay else public) >= DEEP:  # messages of owners may be lost
            self.judge.live.note_lost_messages(now)
        self._number_taken = len(fenced) + len(public)
        if self._by_partition:
            self._graph.hear_public(
                message.received.gid for message in public if message.received.gid
            )
        strangers |= self._take(public, now)
        declared = self._flood.read(now)  # last, because it can wait
        if declared is not None:
            self._judge(self._read(declared, now), now)
        # A check should delay messages in transit as little as possible.
        if now >= self._due + (LATE_S if fenced else 0.0):
            self._due = self.judge.next_tick(now, CHECK_EVERY_S)
            if not strangers:  # otherwise ``_take`` has already read it
                self._ask_graph(now)
            if self._clock:
                self.judge.clocks.sent = self._graph.sends_clock()
            self._pass_on(self.judge.tick(now))
            if self._leaks_to:
                self._pass_on(self.judge.leaks(self._graph.global_publishers(), self._leaks_to))

    def report(self, every_s: float = REPORT_EVERY_S) -> None:
        """Report blocked edges periodically."""
        if self.relay and (not every_s or time.monotonic() >= self._report_due):
            self._report_due = time.monotonic() + every_s
            if held := self.relay.held.report():
                say(f"held back: {held}")

    def _take(self, data: Iterable[TFData], now: float) -> bool:
        """Process messages. Return whether the graph was read to identify unknown senders."""
        messages = [_with_id(message) for message in data]
        strangers = {message.received.gid for message in messages} - self._gids.keys()
        self._gids |= dict.fromkeys(strangers)
        if strangers:  # a short-lived sender is in the graph only briefly
            self._ask_graph(now)
        self._judge([sent for message in messages for sent in self._take_one(message, now)], now)
        return bool(strangers)

    def _judge(self, read: Iterable[tuple[JudgedMessage, Message]], now: float) -> None:
        """Judge the arrivals of messages, after all messages have been forwarded."""
        for judged, message in read:
            self._pass_on(self.judge.judge_arrival(judged, message, now))

    def _take_one(self, data: TFData, now: float) -> Iterator[tuple[JudgedMessage, Message]]:
        """Process a message.

        Long or unfamiliar messages of a flooding publisher are read in parts.
        """
        received, judge = data.received, self.judge
        number = number_of_transforms(received.data)
        if number > self._most or judge.is_flooded_by(received.gid):
            judge.report_flood(received.gid, number, now)
            if not self._decoder.knows(received.data):
                self._flood.add(data)
                return
        yield from self._read(data, now)

    def _read(self, data: TFData, now: float) -> Iterator[tuple[JudgedMessage, Message]]:
        """Decode a message and forward it. Yield the parts to judge afterwards."""
        received = data.received
        try:
            message = self._reader.read(received, static=data.static)
        except ValueError as error:
            if received.gid not in self._malformed:
                self._malformed[received.gid] = None
                say(f"dropped a TF message: {error} (reported once for each publisher)")
            return
        judged = self.judge.take(message, now)
        if self.relay:
            self.relay.pass_on(data, message, judged.admitted, self.judge.name_of(received.gid))
        yield judged, message

    def _ask_graph(self, now: float) -> None:
        """Read the current publishers. Messages that waited for a name may then pass."""
        publishers = self._graph.publishers()
        present = {publisher.gid for publisher in publishers}
        forget_oldest(self._gids, present)
        forget_oldest(self._malformed, present)
        self._pass_on(self.judge.graph(publishers, now))
        if self.relay:
            waiting, self.relay.waiting = self.relay.waiting, []
            for data, message in waiting:
                admitted = self.judge.admits(message, now)
                self.relay.pass_on(data, message, admitted, self.judge.name_of(data.received.gid))
            self.relay.update(publishers, now)

    def _pass_on(self, events: list[GuardEvent]) -> None:
        for event in events:
            self._emit(event)


def gather_s(taken: int, *, is_prompt: bool) -> float:
    """Return the time for which messages may gather after a step, in seconds.

    ``is_prompt``: messages must not wait.
    """
    return 0.0 if is_prompt or taken >= GATHER_BELOW else GATHER_S


def _run_marks(plan: Plan, profile: str) -> RunMarks:
    """Return the marks by which processes of this run are recognised in their environments.

    A component has the environment of its container.
    """
    inside = {
        (process.component.container, node): process.name
        for process in plan.components
        if process.component
        for node in process.nodes
    }
    return RunMarks(
        RUN_ID,
        os.environ[RUN_ID],
        PROCESS,
        profile=profile,
        launcher=LAUNCHER,
        components=inside,
        launcher_pid=int(os.environ.get(LAUNCHER, "0").partition(":")[0]),
    )


def _with_id(data: TFData) -> TFData:
    """Return the data with a substitute id if the rmw does not identify the sender.

    The substitute only distinguishes senders.
    """
    received = data.received
    return (
        data if received.gid else replace(data, received=replace(received, gid=received.raw_gid))
    )


def count_held_back(watches: list[TopicWatch]) -> dict[tuple[str, str, str], int] | None:
    """Return counts of blocked transforms, None if the guard blocks none."""
    relays = [watch.relay for watch in watches if watch.relay]
    return (
        {key: count for relay in relays for key, count in relay.held.counts.items()}
        if relays
        else None
    )


def plans_by_topics(plan: Plan, guard: PlanProcess) -> dict[Topics, Plan]:
    """Return the plan for each pair of topics, with the edges published on these topics.

    The guard's own topics are always included.
    """
    parts = parts_of(plan)
    plan_of_robot = parts.pop(guard.topics, None) or replace(plan, edges=())
    return {guard.topics: plan_of_robot, **parts}


def together(
    emit: Callable[[GuardEvent], None], plans: Sequence[Plan]
) -> Callable[[GuardEvent], None]:
    """Return the receiver of events from the judges of these plans.

    It passes on "all clear" and "tree complete" only once, after the last judge has reported them.
    """
    waiting = {Clear: len(plans), TreeComplete: sum(bool(plan.edges) for plan in plans)}

    def pass_on(event: GuardEvent) -> None:
        if isinstance(event, TreeComplete):
            waiting[TreeComplete] -= event.edges > 0
            if waiting[TreeComplete] == 0 and event.edges:
                emit(TreeComplete(sum(len(plan.edges) for plan in plans)))
            return
        if isinstance(event, Clear):
            waiting[Clear] -= 1
            if waiting[Clear]:
                return
        emit(event)

    return pass_on


DEFAULT_SETTLE_S = 0.5


def guard(own_process: OwnProcess, stop: Stop) -> None:
    """Watch /tf and /tf_static until a signal arrives."""
    judges = own_process.plan.guard.mode != "off"
    plans = plans_by_topics(own_process.plan, own_process.process)
    events = EventWriter(judges=judges)
    emit = together(events.emit, list(plans.values()))
    left = recall_memory(os.environ)
    with open_node(
        own_process.node_name, own_process.namespace, args=own_process.ros_args
    ) as node:
        if not gid_identifies_node(node):
            say(
                "this rmw does not identify the sender of a message: if several nodes may have"
                " sent it, findings name all of them"
            )
            if middleware() == IMPLEMENTATIONS["zenoh"]:
                say("pip install 'tfcompose[zenoh]' reads it from Zenoh's liveliness tokens")
        watches = _watches(own_process, node, plans, emit, left)
        judged = [watch.judge for watch in watches]
        switches = Switches(node, own_process.plan, emit) if judges else None
        memories: list[Memory | SwitchMemory] = [
            Memory(" ".join(topics), watch.judge, watch.relay, events.emit)
            for topics, watch in zip(plans, watches, strict=True)
        ]
        if switches:
            memories.append(SwitchMemory(switches, events.emit, left))
        judging = "" if judges else ", without checks"
        say(
            f"watching {plural(len(own_process.plan.edges), 'edge')}{judging}"
            f"{' again' if left else ''}"
        )
        events.flush()
        ready()
        CATALOGUE.load()
        diagnostics = DiagnosticsPage(node, own_process.plan.robot)
        parameters = PlanParameters(node, own_process.plan)
        joints = JointWatch(node, own_process.plan, emit)
        losses = LossWatch(judged, emit)
        wrong = [losses.wrong, joints.wrong, *(judge.wrong for judge in judged)]
        silence = [judge.live.wrong for judge in judged]
        reread = partial(_reread, own_process, judged, switches, parameters)
        descriptions = Descriptions(node, emit)
        orders = OrderReader(
            judged, Gates(node, emit), Components(node, emit), descriptions, reread
        )
        steps = [orders.take, losses.check, *(watch.step for watch in watches)]
        steps += [memory.hand_on for memory in memories]
        steps += [
            joints.check,
            SilentEdges(judged, emit).report,
            FindingsReport([*wrong, *silence], emit).report,
            events.heartbeat,
            events.flush,
            lambda: diagnostics.publish(judged, wrong, lambda: count_held_back(watches)),
            lambda: parameters.check(judged, time.monotonic()),
        ]
        steps += [switches.check] if switches else []
        if ORDERS_FD not in os.environ:
            steps += [LifecycleDriver(node, own_process.plan).check]
            steps += (
                [ComponentDriver(node, own_process, private=REMAPPED in os.environ).check]
                if own_process.plan.components
                else []
            )
        steps += [
            ClockWatch(node, say, sim=own_process.plan.ros.clock == "sim").check,
            *(watch.report for watch in watches),
        ]
        wait_set = WaitSet(node, [each for watch in watches for each in watch.data.readers], stop)
        while not stop.requested:
            wait_set.wait(min(watch.wait_s for watch in watches))
            for step in steps:
                step()
            if gathering_s := min(watch.gather_s for watch in watches):
                stop.wait(gathering_s)
        for watch in watches:
            watch.report(0.0)
            watch.close()


def _reread(
    own_process: OwnProcess,
    judges: Sequence[Judge],
    switches: Switches | None,
    parameters: PlanParameters,
    file: str,
) -> None:
    """Switch the judges to the plan in the file, without restarting the guard."""
    try:
        plan = read_plan(Path(file).read_text(encoding="utf-8"), file)
    except (OSError, ValueError, RejectedError) as error:
        say(f"findings still name lines of the previous plan: {error}")
        return
    for judge, part in zip(
        judges, plans_by_topics(plan, own_process.process).values(), strict=True
    ):
        judge.follow(part)
    if switches:
        switches.follow(plan)
    parameters.follow(plan)


def _watches(
    own_process: OwnProcess,
    node: Node,
    plans: dict[Topics, Plan],
    emit: Callable[[GuardEvent], None],
    left: dict[str, Any],
) -> list[TopicWatch]:
    """Return the watch for each pair of topics.

    A watch that follows a previous guard, or is in mode ``off``, skips the observation.
    """
    judges, joins = own_process.plan.guard.mode != "off", bool(os.environ.get(JOINS))
    settle_s = float(os.environ.get(SETTLE, DEFAULT_SETTLE_S)) if judges and not joins else 0.0
    private = private_topics(own_process.plan) if REMAPPED in os.environ else None
    now = time.monotonic()
    identifies_node = gid_identifies_node(node)
    watches = []
    for topics, plan in plans.items():
        # A guard that joins a running plan, or does not judge, accepts every owner as the plan's
        # owner, even if the owner began earlier.
        begun_ns = 0 if joins or not judges else time.time_ns()
        judge = Judge(
            plan,
            settle_s,
            now,
            begun_ns,
            gid_identifies_node=identifies_node,
            remapped=private is not None,
        )
        watches.append(
            TopicWatch(node, topics, judge, emit, _of(private, own_process.plan, topics))
        )
        if joins or not judges:
            watches[-1].begin(now, left.get(" ".join(topics)))
    if GLOBAL not in plans:
        watches[0].watch_global_topics()
    return watches


def _of(private: dict[str, Topics] | None, plan: Plan, topics: Topics) -> dict[str, Topics] | None:
    """Return the remapped topics of the plan's processes that would publish on these topics."""
    if private is None:
        return None
    return {name: pair for name, pair in private.items() if plan.process(name).topics == topics}
