"""Publishers on rmw_zenoh, from liveliness tokens and attachments, without rclpy.

Facts about rmw_zenoh_cpp (docs/design.md, liveliness_utils.cpp, attachment_helpers.cpp), the same
in Jazzy, Kilted and Rolling: Every publisher declares the liveliness token
``@ros2_lv/DOMAIN/SESSION/NODE_ID/ID/MP/ENCLAVE/NAMESPACE/NODE/TOPIC/TYPE/TYPE_HASH/QOS``. In its
parts ``%`` replaces a slash. ``MP`` means a publisher. The publisher's id (gid) is the XXH3 hash
of the token, 128 bits, least significant byte first. It publishes on the key
``DOMAIN/TOPIC/TYPE/TYPE_HASH`` with an attachment of 33 bytes: its count of messages and the time,
int64 each, and the id preceded by its length. In older releases, the name of each value preceded
it. ``QOS`` is ``RELIABILITY:DURABILITY:HISTORY,DEPTH:…`` in rmw's numbers; an empty part means the
default, reliable and volatile.

Only robots on Zenoh need this module. It imports eclipse-zenoh and xxhash from the extra
``zenoh``.
"""

from __future__ import annotations

import os
import re
import struct
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import xxhash
import zenoh
from zenoh import ext

from tfcompose.model.plan.middleware import ZENOH_FILES, ZENOH_OVERRIDE
from tfcompose.tf.ros.environment import DOMAIN, RosError

if TYPE_CHECKING:
    from collections.abc import Mapping

_SPACE, _PUBLISHER = "@ros2_lv", "MP"
#: Number of parts of a publisher's token. Later releases may add parts.
_PARTS = 13
_BEST_EFFORT, _TRANSIENT_LOCAL = "2", "1"
_TYPE = re.compile(r"(.+)::dds_::(\w+)_")
_ATTACHMENT = struct.Struct("<qqB16s")
#: The attachment of older releases, with names, each preceded by its length.
_NAMED = struct.Struct("<16sq17sq11sB16s")
_NAMES = (b"\x0fsequence_number", b"\x10source_timestamp", b"\x0asource_gid")
_GID_BYTES = 16
_ROUTER = '["tcp/localhost:7447"]'
_TF_TYPE = "tf2_msgs::msg::dds_::TFMessage_"
#: Maximum number of messages that wait to be taken.
_MOST_WAITING = 20_000
#: Maximum number of changed tokens that wait until publishers are requested.
_MOST_TOKENS = 100_000
#: Number of latched messages to request from a publisher.
_LATCHED = 100


@dataclass(frozen=True, slots=True)
class TokenOfPublisher:
    """A publisher as described by its token. Names are as in ROS."""

    #: The publisher's id, 16 bytes.
    gid: bytes
    #: The full name of the publisher's node.
    node: str
    topic: str
    type: str
    durability: Literal["volatile", "transient_local"]
    reliability: Literal["reliable", "best_effort"]


@dataclass(frozen=True, slots=True)
class Attachment:
    """The attachment of a message: count of messages, time of sending, and publisher's id.

    The id has 16 bytes.
    """

    sequence: int
    source_ns: int
    gid: bytes


@dataclass(frozen=True, slots=True)
class ZenohMessage:
    """A message of a TF topic as bytes. Without an attachment, its sender is unknown."""

    data: bytes
    static: bool
    received_ns: int
    attachment: Attachment | None


def gid_of_token(token: str) -> bytes:
    """Return the id of the publisher that declared the token, as in its messages."""
    return xxhash.xxh3_128_intdigest(token.encode()).to_bytes(_GID_BYTES, "little")


def publisher_of(token: str) -> TokenOfPublisher | None:
    """Return the publisher that declared the token.

    None if another entity or an unknown release declared it.
    """
    parts = token.split("/")
    if len(parts) < _PARTS or parts[0] != _SPACE or parts[5] != _PUBLISHER:
        return None
    namespace, node, topic, kind, qos = (
        parts[index].replace("%", "/") for index in (7, 8, 9, 10, 12)
    )
    reliability, _, rest = qos.partition(":")
    match = _TYPE.fullmatch(kind)
    return TokenOfPublisher(
        gid_of_token(token),
        f"{namespace.rstrip('/')}/{node}",
        topic,
        type=f"{match[1].replace('::', '/')}/{match[2]}" if match else kind,
        durability="transient_local" if rest.partition(":")[0] == _TRANSIENT_LOCAL else "volatile",
        reliability="best_effort" if reliability == _BEST_EFFORT else "reliable",
    )


def attachment_of(data: bytes) -> Attachment | None:
    """Return the parsed attachment, None if it is not from rmw_zenoh."""
    if len(data) == _ATTACHMENT.size:
        sequence, source_ns, length, gid = _ATTACHMENT.unpack(data)
        return Attachment(sequence, source_ns, gid) if length == _GID_BYTES else None
    if len(data) == _NAMED.size:
        first, sequence, second, source_ns, third, length, gid = _NAMED.unpack(data)
        is_right = ((first, second, third), length) == (_NAMES, _GID_BYTES)
        return Attachment(sequence, source_ns, gid) if is_right else None
    return None


def open_session(environment: Mapping[str, str]) -> zenoh.Session:
    """Return a client session that is connected to the robot's router.

    Close the session, because Python does not exit while it is open. The environment variables of
    rmw_zenoh's sessions apply, except for the mode. A client is necessary, because a router
    forwards messages between peers to clients.

    Raises:
        RosError: with a sentence, if there is no router, or the configuration is missing.
    """
    try:
        file = environment.get(ZENOH_FILES[0])
        config = zenoh.Config.from_file(file) if file else zenoh.Config()
        if not file:
            config.insert_json5("connect/endpoints", _ROUTER)
        for pair in filter(None, environment.get(ZENOH_OVERRIDE, "").split(";")):
            key, _, value = pair.partition("=")
            config.insert_json5(key.strip(), value)
        config.insert_json5("mode", '"client"')
        config.insert_json5("scouting/multicast/enabled", "false")
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise RosError(
            f"Zenoh's router cannot be reached: {str(error).partition(' at /')[0]}"
        ) from None


class ZenohGraph:
    """The publishers of a domain, as long as its session is open.

    Tokens wait in a channel until a query. A callback would have its own thread, and Python would
    wait for that thread before it calls the function that closes the session.
    """

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        self._lock = threading.Lock()
        self._publishers: dict[str, TokenOfPublisher] = {}
        self._subscriber: Any = session.liveliness().declare_subscriber(
            f"{_SPACE}/{domain}/**", zenoh.handlers.FifoChannel(_MOST_TOKENS), history=True
        )

    def publishers(self, topic: str) -> list[TokenOfPublisher]:
        """Return the topic's current publishers, by its full name, sorted by node and id."""
        with self._lock:
            self._take()
            publishers = [
                publisher for publisher in self._publishers.values() if publisher.topic == topic
            ]
        return sorted(publishers, key=lambda publisher: (publisher.node, publisher.gid))

    def close(self) -> None:
        """End the subscription."""
        self._subscriber.undeclare()

    def _take(self) -> None:
        while sample := self._subscriber.try_recv():
            token = str(sample.key_expr)
            if sample.kind == zenoh.SampleKind.DELETE:
                self._publishers.pop(token, None)
            elif publisher := publisher_of(token):
                self._publishers[token] = publisher


class ZenohTF:
    """Messages on a pair of TF topics (moving, fixed), each with its sender.

    Latched messages arrive at once.
    """

    def __init__(self, session: zenoh.Session, domain: int, topics: tuple[str, str]) -> None:
        self._waiting: deque[ZenohMessage] = deque(maxlen=_MOST_WAITING)
        self._came = threading.Event()
        moving, fixed = (f"{domain}/{topic.strip('/')}/{_TF_TYPE}/*" for topic in topics)
        history = ext.HistoryConfig(detect_late_publishers=True, max_samples=_LATCHED)
        self._subscribers: list[Any] = [
            session.declare_subscriber(moving, lambda sample: self._take(sample, static=False)),
            ext.declare_advanced_subscriber(
                session, fixed, lambda sample: self._take(sample, static=True), history=history
            ),
        ]

    def wait(self, timeout_s: float) -> None:
        """Wait up to ``timeout_s`` seconds for a message."""
        self._came.wait(timeout_s)

    def take(self) -> list[ZenohMessage]:
        """Return the messages received since the last call, oldest first."""
        self._came.clear()
        endpoints = []
        with suppress(IndexError):
            while True:
                endpoints.append(self._waiting.popleft())
        return endpoints

    def close(self) -> None:
        """End the subscriptions."""
        for subscriber in self._subscribers:
            subscriber.undeclare()

    def _take(self, sample: zenoh.Sample, *, static: bool) -> None:
        attachment = attachment_of(bytes(sample.attachment)) if sample.attachment else None
        self._waiting.append(
            ZenohMessage(bytes(sample.payload), static, time.time_ns(), attachment)
        )
        self._came.set()


def domain_of(environment: Mapping[str, str]) -> int:
    """Return the ROS domain that the environment sets."""
    return int(environment.get(DOMAIN) or 0)


class RobotGraph:
    """The graph of this process's domain, through a session that is opened on first use."""

    def __init__(self) -> None:
        self._session: Any = open_session(os.environ)
        self._graph = ZenohGraph(self._session, domain_of(os.environ))

    def publishers(self, topic: str) -> list[TokenOfPublisher]:
        """Return the topic's current publishers, sorted by node and id."""
        return self._graph.publishers(topic)

    def close(self) -> None:
        """Close the session. Python does not exit while it is open."""
        self._graph.close()
        self._session.close()
