"""The TF topics of the running system.

What comes on them, and who publishes there, with the process of each.
"""

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
    #: How processes are fenced off: by a partition, or by topics of each one's own; empty: they
    #: are not.
    Fence = Literal["", "partition"] | Mapping[str, Topics]

_ID_BYTES = 16


def id_of_topic(topic: str) -> bytes:
    """Return a stand-in for the sender's id on a process's own topic."""
    return blake2b(topic.encode(), digest_size=_ID_BYTES).digest()


@dataclass(frozen=True, slots=True)
class TFData:
    """A message as bytes, the kind of its topic, and whether it was sent behind a fence.

    ``process`` is whose own topic it came on; empty: that is everybody's.
    """

    received: Received
    static: bool
    fenced: bool = False
    process: str = ""


class TFTopics:
    """Messages on a pair of TF topics (moving, fixed), and behind a strict guard's fence.

    With ``deep`` more messages are kept than a listener keeps. ``own`` are ids whose messages are
    not taken. Call ``close`` before the node ends.
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
        # What everybody sends has a port of its own, so that a flood there throws out nothing of
        # what is fenced off.
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
        """What is waited for."""
        return [subscriber.reader for subscriber in (*self._fenced, *self._public)]

    def take(self) -> Iterator[TFData]:
        """Yield what has come, but from oneself."""
        yield from self.take_fenced()
        yield from self.take_public()

    def take_fenced(self) -> Iterator[TFData]:
        """Yield what has come behind the fence, but from oneself."""
        return self._take(self._fenced)

    def take_public(self) -> Iterator[TFData]:
        """Yield what has come on everybody's topics, but from oneself."""
        return self._take(self._public)

    def close(self) -> None:
        """End the readers that the node does not end."""
        for subscriber in self._public:
            if isinstance(subscriber.reader, PublicTFReader):
                subscriber.reader.close()

    def _take(self, readable: Sequence[_Readable]) -> Iterator[TFData]:
        """Yield what has come there.

        What comes on a process's own topic is of that process, also where the rmw does not say
        whose it is.
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
    """A reader, and what holds for all that comes there, as in ``TFData``."""

    reader: MessageSource
    static: bool
    fenced: bool = False
    process: str = ""


@dataclass(frozen=True, slots=True)
class Identity:
    """Whose process a publisher is of; what is not known, or not proven, is None or empty.

    Attributes:
        ours: whether it is of one's own run.
        process: the plan's process that it is of.
        fenced: whether it was started with its profile of the fence; None too where it is of
            another run.
        run: the run of another robot that it is of.
        profile: the profile file that it was started with, where that is not the fence's.
        unmarked: the number of the process, where it descends from the run's launcher, and its
            environment says nothing of a run.
    """

    ours: bool | None = None
    process: str = ""
    fenced: bool | None = None
    run: OtherRun | None = None
    profile: str = ""
    unmarked: int = 0


@dataclass(frozen=True, slots=True)
class RunMarks:
    """What the environments of runs say.

    ``variable`` holds one's own ``run``, ``process`` the plan's process.

    ``launcher`` holds a run's launcher: its process number, and when it began, in clock ticks
    since the start of the machine. ``profile`` names the profile file that fences the process off;
    empty: there is no such fence. ``components`` are the plan's processes that run inside of
    another one, by its name and their nodes'. ``launcher_pid`` is one's own launcher.
    """

    variable: str
    run: str
    process: str
    profile: str = ""
    launcher: str = ""
    components: Mapping[tuple[str, str], str] = field(default_factory=dict)
    launcher_pid: int = 0

    def process_of(self, known: Identity, node: str) -> str:
        """Return the plan's process of a node in a known operating system process."""
        return self.components.get((known.process, node), known.process)

    def identify(self, found: Sequence[Mapping[str, str]] | None) -> Identity:
        """Return whose process it is of which one of these is the environment.

        None: nobody can say.
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
        """Return the run that this is the environment of, unless it is one's own."""
        run, (pid, _, ticks) = (
            environment[self.variable],
            environment.get(self.launcher, "").partition(":"),
        )
        if run == self.run or not (pid + ticks).isdecimal():
            return None
        since = time.strftime("%H:%M:%S", time.localtime(began_at(int(ticks))))
        return OtherRun(run.partition(":")[0], int(pid), since)


class _Shown(NamedTuple):
    """The publishers after so many changes of the graph."""

    changes: int
    publishers: list[Publisher]


class TFGraph:
    """The publishers on a pair of TF topics (moving, fixed), and on the global ones.

    The node's own are left out.

    Args:
        node: the node that asks.
        topics: the pair of topics.
        private: the pairs of topics that processes are remapped to, where they are.
        ours: what the environments of one's own run say; None: there is none.
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
        #: What the graph showed on one's own and on the global topics, at which of its changes.
        self._shown: _Shown | None = None
        self._shown_globally: _Shown | None = None

    def hear_public(self, senders: Iterable[bytes]) -> None:
        """Note who is heard outside of the fence, as every listener hears them."""
        newcomers = dict.fromkeys(senders).keys() - self._public.keys()
        if newcomers:
            self._public |= dict.fromkeys(newcomers)
            self._shown = None

    def publishers(self) -> list[Publisher]:
        """Return the current publishers on the topics and on remapped ones.

        rmw is asked again when its graph has changed: of 200 publishers it takes 10 ms.
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
        """Whether what the publisher sends behind the fence is of one's own run.

        None: it is not known yet.

        In the common partition that must be seen; on a topic of a process's own, nobody else is
        expected.
        """
        if gid not in self._ours:
            return None
        known = self._ours[gid]
        if self._private is None:
            return bool(known.ours and known.fenced and gid not in self._public)
        return known.ours is not False

    def where(self, gid: bytes) -> str:
        """Return where the publisher runs, empty where that is not known."""
        return self._where.get(gid, "")

    def sends_clock(self) -> bool:
        """Return whether /clock has a publisher."""
        return bool(writers(self._node, "/clock"))

    def global_publishers(self) -> list[Publisher]:
        """Return who publishes on the global topics now, whatever the node's remappings are."""
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
        """Whether a publisher is of this process.

        By its id, or on Zenoh, whose ids are hashes, by its node's name.
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
        """Return an id of this process's: that of its reader."""
        if not self._own:
            self._own = own_gid(self._node, self.topics[0])
        return self._own


def _node_of(writer: GraphPublisher) -> str | None:
    """Return the node's full name, None while it is not known; a writer of plain DDS has none."""
    if writer.node.endswith(UNKNOWN_NODE):
        return None
    return NO_NODE if writer.node == BARE_DDS else writer.node
