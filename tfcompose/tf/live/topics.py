"""The TF topics of the running system: messages, publishers, and the process of each publisher."""

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
    gid_identifies_node,
    graph_changes,
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
    #: Isolation of processes: a partition, or separate topics for each process; empty for none.
    Fence = Literal["", "partition"] | Mapping[str, Topics]

_ID_BYTES = 16


def id_of_topic(topic: str) -> bytes:
    """Return a substitute for the sender's id on the separate topic of a process."""
    return blake2b(topic.encode(), digest_size=_ID_BYTES).digest()


@dataclass(frozen=True, slots=True)
class TFData:
    """A message as bytes, with its kind of topic."""

    received: Received
    static: bool
    #: Whether it came from an isolated process.
    fenced: bool = False
    #: The process on whose separate topic it arrived; empty for a public topic.
    process: str = ""


class TFTopics:
    """Messages on a pair of TF topics (moving, fixed), and from a strict plan's processes.

    ``deep`` keeps more messages than an ordinary listener. Messages from this process's publishers
    are skipped. Call ``close`` before the node ends.
    """

    def __init__(
        self, node: Node, topics: Topics, fence: Fence = "", *, deep: bool = False
    ) -> None:
        self.own_gids: set[bytes | None] = set()
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
        # Public messages have their own port, so that a flood of them does not displace messages
        # of isolated processes.
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
        """Yield pending messages, except from this process."""
        yield from self.take_fenced()
        yield from self.take_public()

    def take_fenced(self) -> Iterator[TFData]:
        """Yield pending messages of isolated processes, except from this process."""
        return self._take(self._fenced)

    def take_public(self) -> Iterator[TFData]:
        """Yield pending messages on public topics, except from this process."""
        return self._take(self._public)

    def close(self) -> None:
        """Close the readers that the node does not close."""
        for subscriber in self._public:
            if isinstance(subscriber.reader, PublicTFReader):
                subscriber.reader.close()

    def _take(self, readable: Sequence[_Readable]) -> Iterator[TFData]:
        """Yield pending messages of these readers.

        A message on a process's separate topic comes from that process, even if the rmw does not
        identify the sender.
        """
        for subscriber in readable:
            for received in subscriber.reader.take():
                if received.raw_gid in self.own_gids and received.raw_gid is not None:
                    continue
                if subscriber.process and received.gid is None:
                    received = replace(received, gid=id_of_topic(subscriber.reader.topic))  # noqa: PLW2901 (the same message)
                yield TFData(received, subscriber.static, subscriber.fenced, subscriber.process)


@dataclass(frozen=True, slots=True)
class _Readable:
    """A reader, and the fields of ``TFData`` that all its messages share."""

    reader: MessageSource
    static: bool
    fenced: bool = False
    process: str = ""


@dataclass(frozen=True, slots=True)
class Identity:
    """The process of a publisher. None or empty values are unknown or not proven."""

    #: Whether the process belongs to this run.
    ours: bool | None = None
    #: The name of the process in the plan.
    process: str = ""
    #: Whether the process started with its profile from the plan. Also None for another run.
    fenced: bool | None = None
    #: The run of another robot that the process belongs to.
    run: OtherRun | None = None
    #: The profile file with which the process started, if it is not the plan's.
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
    #: The variable with the name of the process in the plan.
    process: str
    #: The variable with the profile file that isolates the process; empty if no profile does.
    profile: str = ""
    #: The variable with a run's launcher: its process id, and its start in clock ticks since boot.
    launcher: str = ""
    #: The plan's processes that run inside another process, by the name of that process and their
    #: node.
    components: Mapping[tuple[str, str], str] = field(default_factory=dict)
    #: Process id of this run's launcher.
    launcher_pid: int = 0

    def process_of(self, processes: Identity, node: str) -> str:
        """Return the plan's process of a node in an identified operating system process."""
        return self.components.get((processes.process, node), processes.process)

    def identify(self, environments: Sequence[Mapping[str, str]] | None) -> Identity:
        """Return the identity of a process with one of these environments, None if unreadable."""
        if environments is None:
            return Identity()
        of_this_run = [
            variables for variables in environments if variables.get(self.variable) == self.run
        ]
        if len(of_this_run) != 1:
            of_any_run = [variables for variables in environments if variables.get(self.variable)]
            return Identity(
                ours=bool(of_this_run),
                run=self._run_of(of_any_run[0])
                if len(environments) == len(of_any_run) == 1
                else None,
            )
        process = of_this_run[0].get(self.process, "")
        profile = of_this_run[0].get(self.profile, "") if self.profile and process else ""
        fenced = is_fence(profile, process) if self.profile and process else None
        return Identity(
            ours=True, process=process, fenced=fenced, profile="" if fenced else profile
        )

    def _run_of(self, environment: Mapping[str, str]) -> OtherRun | None:
        """Return the other run that this environment belongs to.

        Return None if it belongs to this run, or if the launcher is not named in the expected
        form.
        """
        run, (pid, _, ticks) = (
            environment[self.variable],
            environment.get(self.launcher, "").partition(":"),
        )
        if run == self.run or not (pid + ticks).isdecimal():
            return None
        since = time.strftime("%H:%M:%S", time.localtime(began_at(int(ticks))))
        return OtherRun(run.partition(":")[0], int(pid), since)


class _Shown(NamedTuple):
    """The publishers at a number of graph changes."""

    changes: int
    publishers: list[Publisher]


class TFGraph:
    """The publishers on a pair of TF topics (moving, fixed), and on the global topics.

    Publishers of the querying node are excluded.

    Args:
        node: the querying node.
        topics: the pair of topics.
        private: pairs of topics to which processes are remapped, None without remapping.
        ours: environment variables that identify this run, None without a run.
    """

    def __init__(
        self,
        node: Node,
        topics: Topics,
        private: Sequence[Topics] | None = None,
        ours: RunMarks | None = None,
    ) -> None:
        self.topics = topics
        self.gid_identifies_node = gid_identifies_node(node)
        self._node = node
        self._private = private
        self._marks = ours
        self._where: dict[bytes, str] = {}
        self._ours: dict[bytes, Identity] = {}
        self._own = b""
        #: Ids of senders whose messages arrived outside the partition.
        self._public: dict[bytes, None] = {}
        self._changes = graph_changes(node)
        #: Publishers on the robot's topics and the global topics, with the count of graph changes.
        self._shown: _Shown | None = None
        self._shown_globally: _Shown | None = None

    def hear_public(self, senders: Iterable[bytes]) -> None:
        """Record senders whose messages bypass the filter.

        Every listener receives these messages.
        """
        newcomers = dict.fromkeys(senders).keys() - self._public.keys()
        if newcomers:
            self._public |= dict.fromkeys(newcomers)
            self._shown = None

    def publishers(self) -> list[Publisher]:
        """Return the current publishers on the topics, including remapped topics.

        The rmw is queried only after a change of its graph, because 200 publishers take 10 ms.
        """
        changes = self._changes.count()
        if self._shown is None or self._shown.changes != changes:
            self._shown = _Shown(changes, self._publishers())
            present = {publisher.gid for publisher in self._shown.publishers}
            for cache in (self._where, self._ours, self._public):
                forget_oldest(cache, present)
        return self._shown.publishers

    def _publishers(self) -> list[Publisher]:
        if self._private is None:
            return self._on(writers, self.topics)
        publishers = self._on(writers, self.topics, fenced=False)
        for topics in self._private:
            fenced = self._on(writers, topics, fenced=True)
            publishers += (
                fenced if self.gid_identifies_node else [*fenced, *self._by_topic(topics, fenced)]
            )
        return publishers

    def may_pass(self, gid: bytes) -> bool | None:
        """Return whether an isolated message of this publisher comes from this run, None: unknown.

        In the common partition this requires proof. On the separate topic of a process, no other
        publisher is expected.
        """
        if gid not in self._ours:
            return None
        entry = self._ours[gid]
        if self._private is None:
            return bool(entry.ours and entry.fenced and gid not in self._public)
        return entry.ours is not False

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
        """Return whether a publisher belongs to this process.

        The id tells, or on Zenoh, where ids are hashes, the name of the node.
        """
        if middleware() == IMPLEMENTATIONS["zenoh"]:
            return publisher.node == own_name(self._node)
        return publisher.gid[:PARTICIPANT] == self._own_gid()[:PARTICIPANT]

    def _by_topic(self, topics: Topics, fenced: list[Publisher]) -> Iterator[Publisher]:
        """Yield substitutes for all senders on a topic, because messages do not identify them."""
        for static, topic in zip((False, True), topics, strict=True):
            gid = id_of_topic(topic)
            those = [publisher for publisher in fenced if publisher.static == static]
            nodes = sorted({publisher.node for publisher in those if publisher.node})
            if nodes:
                proven = {(publisher.ours, publisher.process) for publisher in those}
                ours, process = proven.pop() if len(proven) == 1 else (None, "")
                self._ours[gid] = Identity(ours or None, process)
                further_nodes = tuple(nodes[1:])
                yield Publisher(
                    gid,
                    nodes[0],
                    static,
                    topic,
                    ours=ours,
                    fenced=True,
                    further_nodes=further_nodes,
                    process=process,
                )

    def _publisher(
        self, writer: GraphPublisher, topic: str, *, static: bool, fenced: bool | None
    ) -> Publisher:
        if writer.gid not in self._where:
            own_gid = self._own_gid()
            self._where[writer.gid] = origin(writer.gid, own_gid)
            self._ours[writer.gid] = self._identify(writer.gid, own_gid)
        entry = self._ours[writer.gid]
        if fenced is None:
            fenced = entry.fenced if writer.gid not in self._public else False
        return Publisher(
            writer.gid,
            _node_of(writer),
            static=static,
            topic=topic,
            type=writer.type,
            latched=writer.durability == "transient_local",
            reliable=writer.reliability == "reliable",
            where=self._where[writer.gid],
            ours=entry.ours,
            fenced=fenced,
            process=self._marks.process_of(entry, writer.node) if self._marks else "",
            run=entry.run,
            profile=entry.profile,
            unmarked=entry.unmarked,
        )

    def _identify(self, gid: bytes, own_gid: bytes) -> Identity:
        if self._marks is None:
            return Identity()
        environments_of_owner = environments(gid, own_gid)
        mark = self._marks.identify(environments_of_owner)
        if environments_of_owner and not any(
            self._marks.variable in variables for variables in environments_of_owner
        ):
            pids = descent(gid, own_gid, self._marks.launcher_pid)
            return replace(mark, unmarked=pids[0] if pids else 0)
        return mark

    def _own_gid(self) -> bytes:
        """Return an id of this process, the id of its reader."""
        if not self._own:
            self._own = own_gid(self._node, self.topics[0])
        return self._own


def _node_of(writer: GraphPublisher) -> str | None:
    """Return the node's full name, None while unknown. A publisher of plain DDS has no node."""
    if writer.node.endswith(UNKNOWN_NODE):
        return None
    return NO_NODE if writer.node == BARE_DDS else writer.node
