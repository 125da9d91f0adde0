"""The TF topics of the running system: messages, publishers, and the process of each."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from typing import TYPE_CHECKING, NamedTuple

from tfcompose.model.plan.middleware import IMPLEMENTATIONS
from tfcompose.model.plan.topics import GLOBAL, is_fence
from tfcompose.tf.live.publishers import PARTICIPANT, OtherRun, Publisher, forget_oldest
from tfcompose.tf.live.state import NO_NODE
from tfcompose.tf.ros.graph import (
    BARE_DDS,
    UNKNOWN_NODE,
    graph_changes,
    ids_say_who,
    own_gid,
    own_name,
    unmapped_writers,
    writers,
)
from tfcompose.tf.ros.node import PublicTFReader, TFSubscription, middleware
from tfcompose.tf.ros.processes import began_at, descent, environments, origin

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import Literal

    from rclpy.node import Node

    from tfcompose.tf.ros.graph import GraphPublisher
    from tfcompose.tf.ros.node import MessageSource, Received

    Topics = tuple[str, str]
    #: Fence around processes: a partition, or separate topics for each; empty: none.
    Fence = Literal["", "partition"] | Mapping[str, Topics]

_ID_BYTES = 16


def id_of_topic(topic: str) -> bytes:
    """Return a stand-in for the sender's id on a process's own topic."""
    return blake2b(topic.encode(), digest_size=_ID_BYTES).digest()


@dataclass(frozen=True, slots=True)
class TFData:
    """A message as bytes, with its kind of topic."""

    received: Received
    static: bool
    #: True: it came from an isolated process.
    fenced: bool = False
    #: The process whose private topic it came on; empty: a public topic.
    process: str = ""


class TFTopics:
    """Messages on a pair of TF topics (moving, fixed), and from a strict plan's own processes.

    ``deep`` keeps more messages than a listener does. Messages with an id in ``own`` are skipped.
    Call ``close`` before the node ends.
    """

    def __init__(
        self, node: Node, topics: Topics, fence: Fence = "", *, deep: bool = False
    ) -> None:
        self.own: set[bytes | None] = set()
        private = ({"": topics} if fence else {}) if isinstance(fence, str) else fence
        self._fenced = [
            _Readable(
                TFSubscription(node, static=static, topic=pair[static], deep=deep),
                static,
                fenced=True,
                process=process,
            )
            for process, pair in private.items()
            for static in (True, False)
        ]
        # Public messages have their own port, so that a flood of them displaces no fenced message.
        apart = bool(fence) and middleware().startswith("rmw_fastrtps")
        self._public = []
        for static in (True, False):
            reader: PublicTFReader | TFSubscription
            if apart:
                reader = PublicTFReader(node, topics[static], static=static)
            else:
                reader = TFSubscription(node, static=static, topic=topics[static], deep=deep)
            self._public.append(_Readable(reader, static))

    @property
    def readers(self) -> list[MessageSource]:
        """The readers to wait for."""
        return [subscriber.reader for subscriber in (*self._fenced, *self._public)]

    def take(self) -> Iterator[TFData]:
        """Yield pending messages, except one's own."""
        yield from self.take_fenced()
        yield from self.take_public()

    def take_fenced(self) -> Iterator[TFData]:
        """Yield pending messages of isolated processes, except one's own."""
        return self._take(self._fenced)

    def take_public(self) -> Iterator[TFData]:
        """Yield pending messages on public topics, except one's own."""
        return self._take(self._public)

    def close(self) -> None:
        """End the readers that the node does not end."""
        for subscriber in self._public:
            if isinstance(subscriber.reader, PublicTFReader):
                subscriber.reader.close()

    def _take(self, readable: Sequence[_Readable]) -> Iterator[TFData]:
        """Yield pending messages of these readers.

        A message on a process's private topic is from that process, even if the rmw does not
        identify the sender.
        """
        for subscriber in readable:
            for received in subscriber.reader.take():
                if received.raw_gid in self.own and received.raw_gid is not None:
                    continue
                if subscriber.process and received.gid is None:
                    received = replace(received, gid=id_of_topic(subscriber.reader.topic))  # noqa: PLW2901 (the same message)
                yield TFData(received, subscriber.static, subscriber.fenced, subscriber.process)


@dataclass(frozen=True, slots=True)
class _Readable:
    """A reader, and the fields of ``TFData`` for all its messages."""

    reader: MessageSource
    static: bool
    fenced: bool = False
    process: str = ""


@dataclass(frozen=True, slots=True)
class Identity:
    """The process of a publisher; None or empty: unknown, or not proven."""

    #: Whether it belongs to this run.
    ours: bool | None = None
    #: The plan's process.
    process: str = ""
    #: Whether it started with its profile of the plan; None also for another run.
    fenced: bool | None = None
    #: The run of another robot that it belongs to.
    run: OtherRun | None = None
    #: The profile file that it started with, if that is not the plan's.
    profile: str = ""
    #: Process id of a descendant of the run's launcher whose environment names no run.
    unmarked: int = 0


@dataclass(frozen=True, slots=True)
class RunMarks:
    """Environment variables that identify runs and their processes."""

    #: The variable with the run's id.
    variable: str
    #: This run's id.
    run: str
    #: The variable with the plan's process.
    process: str
    #: The variable with the profile file that isolates the process; empty: no profile does.
    profile: str = ""
    #: The variable with a run's launcher: its process id, and its start in clock ticks since boot.
    launcher: str = ""
    #: The plan's processes that run inside another one, by its name and their node.
    components: Mapping[tuple[str, str], str] = field(default_factory=dict)
    #: Process id of this run's launcher.
    launcher_pid: int = 0

    def process_of(self, known: Identity, node: str) -> str:
        """Return the plan's process of a node in a known operating system process."""
        return self.components.get((known.process, node), known.process)

    def identify(self, found: Sequence[Mapping[str, str]] | None) -> Identity:
        """Return the identity of a process with one of these environments.

        ``found`` is None if they are unreadable.
        """
        if found is None:
            return Identity()
        own = [variables for variables in found if variables.get(self.variable) == self.run]
        if len(own) != 1:
            others = [variables for variables in found if variables.get(self.variable)]
            return Identity(
                ours=bool(own),
                run=self._other(others[0]) if len(found) == len(others) == 1 else None,
            )
        process = own[0].get(self.process, "")
        profile = own[0].get(self.profile, "") if self.profile and process else ""
        fenced = is_fence(profile, process) if self.profile and process else None
        return Identity(
            ours=True, process=process, fenced=fenced, profile="" if fenced else profile
        )

    def _other(self, environment: Mapping[str, str]) -> OtherRun | None:
        """Return the run that this environment belongs to, unless it is this one."""
        run, (pid, _, ticks) = (
            environment[self.variable],
            environment.get(self.launcher, "").partition(":"),
        )
        if run == self.run or not (pid + ticks).isdecimal():
            return None
        since = time.strftime("%H:%M:%S", time.localtime(began_at(int(ticks))))
        return OtherRun(run.partition(":")[0], int(pid), since)


class _Shown(NamedTuple):
    """The publishers as of a number of graph changes."""

    changes: int
    publishers: list[Publisher]


class TFGraph:
    """The publishers on a pair of TF topics (moving, fixed), and on the global ones.

    The node's own are left out.

    Args:
        node: the node that queries.
        topics: the pair of topics.
        private: the pairs of topics that processes are remapped to; None: they are not.
        ours: environment variables that identify this run; None: there is no run.
    """

    def __init__(
        self,
        node: Node,
        topics: Topics,
        private: Sequence[Topics] | None = None,
        ours: RunMarks | None = None,
    ) -> None:
        self.topics = topics
        self.says_who = ids_say_who(node)
        self._node = node
        self._private = private
        self._marks = ours
        self._where: dict[bytes, str] = {}
        self._ours: dict[bytes, Identity] = {}
        self._own = b""
        #: Those who were heard outside of the fence's partition.
        self._public: dict[bytes, None] = {}
        self._changes = graph_changes(node)
        #: Content of the graph on the robot's own and on the global topics, with its change count.
        self._shown: _Shown | None = None
        self._shown_globally: _Shown | None = None

    def hear_public(self, senders: Iterable[bytes]) -> None:
        """Note senders whose messages bypass the filter, as every listener receives them."""
        newcomers = dict.fromkeys(senders).keys() - self._public.keys()
        if newcomers:
            self._public |= dict.fromkeys(newcomers)
            self._shown = None

    def publishers(self) -> list[Publisher]:
        """Return the current publishers on the topics and on remapped ones.

        The rmw is queried only after its graph has changed: 200 publishers take 10 ms.
        """
        changes = self._changes.count()
        if self._shown is None or self._shown.changes != changes:
            self._shown = _Shown(changes, self._publishers())
            present = {publisher.gid for publisher in self._shown.publishers}
            for known in (self._where, self._ours, self._public):
                forget_oldest(known, present)
        return self._shown.publishers

    def _publishers(self) -> list[Publisher]:
        if self._private is None:
            return self._on(writers, self.topics)
        found = self._on(writers, self.topics, fenced=False)
        for topics in self._private:
            there = self._on(writers, topics, fenced=True)
            found += there if self.says_who else [*there, *self._by_topic(topics, there)]
        return found

    def may_pass(self, gid: bytes) -> bool | None:
        """Return whether an isolated message of this publisher is from this run.

        None: unknown so far. In the common partition that needs proof; on a process's private
        topic, no other publisher is expected.
        """
        if gid not in self._ours:
            return None
        known = self._ours[gid]
        if self._private is None:
            return bool(known.ours and known.fenced and gid not in self._public)
        return known.ours is not False

    def where(self, gid: bytes) -> str:
        """Return where the publisher runs; empty if unknown."""
        return self._where.get(gid, "")

    def sends_clock(self) -> bool:
        """Return whether /clock has a publisher."""
        return bool(writers(self._node, "/clock"))

    def global_publishers(self) -> list[Publisher]:
        """Return the current publishers on the global topics, ignoring the node's remappings."""
        changes = self._changes.count()
        if self._shown_globally is None or self._shown_globally.changes != changes:
            self._shown_globally = _Shown(changes, self._on(unmapped_writers, GLOBAL))
        return self._shown_globally.publishers

    def _on(
        self,
        ask: Callable[[Node, str], list[GraphPublisher]],
        topics: Topics,
        *,
        fenced: bool | None = None,
    ) -> list[Publisher]:
        moving, fixed = topics
        return [
            self._publisher(publisher, topic, static=static, fenced=fenced)
            for static, topic in ((True, fixed), (False, moving))
            for publisher in ask(self._node, topic)
            if not self._is_own(publisher)
        ]

    def _is_own(self, publisher: GraphPublisher) -> bool:
        """Return whether a publisher is of this process.

        By its id, or on Zenoh, where ids are hashes, by its node's name.
        """
        if middleware() == IMPLEMENTATIONS["zenoh"]:
            return publisher.node == own_name(self._node)
        return publisher.gid[:PARTICIPANT] == self._own_gid()[:PARTICIPANT]

    def _by_topic(self, topics: Topics, there: list[Publisher]) -> Iterator[Publisher]:
        """Yield stand-ins for all senders on a topic, as messages do not identify them."""
        for static, topic in zip((False, True), topics, strict=True):
            gid = id_of_topic(topic)
            those = [publisher for publisher in there if publisher.static == static]
            nodes = sorted({publisher.node for publisher in those if publisher.node})
            if nodes:
                proven = {(publisher.ours, publisher.process) for publisher in those}
                ours, process = proven.pop() if len(proven) == 1 else (None, "")
                self._ours[gid] = Identity(ours or None, process)
                others = tuple(nodes[1:])
                yield Publisher(
                    gid,
                    nodes[0],
                    static,
                    topic,
                    ours=ours,
                    fenced=True,
                    others=others,
                    process=process,
                )

    def _publisher(
        self, writer: GraphPublisher, topic: str, *, static: bool, fenced: bool | None
    ) -> Publisher:
        if writer.gid not in self._where:
            own = self._own_gid()
            self._where[writer.gid] = origin(writer.gid, own)
            self._ours[writer.gid] = self._identify(writer.gid, own)
        known = self._ours[writer.gid]
        if fenced is None:
            fenced = known.fenced if writer.gid not in self._public else False
        return Publisher(
            writer.gid,
            _node_of(writer),
            static=static,
            topic=topic,
            type=writer.type,
            latched=writer.durability == "transient_local",
            reliable=writer.reliability == "reliable",
            where=self._where[writer.gid],
            ours=known.ours,
            fenced=fenced,
            process=self._marks.process_of(known, writer.node) if self._marks else "",
            run=known.run,
            profile=known.profile,
            unmarked=known.unmarked,
        )

    def _identify(self, gid: bytes, own: bytes) -> Identity:
        if self._marks is None:
            return Identity()
        found = environments(gid, own)
        known = self._marks.identify(found)
        if found and not any(self._marks.variable in variables for variables in found):
            pids = descent(gid, own, self._marks.launcher_pid)
            return replace(known, unmarked=pids[0] if pids else 0)
        return known

    def _own_gid(self) -> bytes:
        """Return an id of this process: that of its reader."""
        if not self._own:
            self._own = own_gid(self._node, self.topics[0])
        return self._own


def _node_of(writer: GraphPublisher) -> str | None:
    """Return the node's full name, None while unknown; a writer of plain DDS has none."""
    if writer.node.endswith(UNKNOWN_NODE):
        return None
    return NO_NODE if writer.node == BARE_DDS else writer.node
