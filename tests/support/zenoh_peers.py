"""Zenoh on loopback: routers, and peers that speak rmw_zenoh's format from its source.

rmw_zenoh hashes tokens with a copy of XXH3; PyPI's xxhash is the binding of the original.
"""

from __future__ import annotations

import json
import os
import socket
import time
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from typing import TYPE_CHECKING, Any

import xxhash
import zenoh
from zenoh import ext

from tests.support.domains import own_share

if TYPE_CHECKING:
    from collections.abc import Iterator

HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
#: Below what Linux gives to clients by default, 32768 to 60999.
PORTS = range(20_000, 32_000)
_NEXT_PORT = count(os.getpid())
TYPE = "tf2_msgs::msg::dds_::TFMessage_"


def free_port() -> int:
    """Return a port of loopback that nobody listens on, and that no other test gets.

    The kernel does not give it to a client before the test listens (ip_local_port_range).
    """
    ports = own_share(PORTS)
    while True:
        port = ports[next(_NEXT_PORT) % len(ports)]
        with suppress(OSError), socket.socket() as listener:
            listener.bind(("127.0.0.1", port))
            return port


def config(
    mode: str, *, connect: list[str] | None = None, listen: list[str] | None = None
) -> zenoh.Config:
    """Return the configuration of a loopback session with timestamps, as rmw_zenoh has it."""
    made: zenoh.Config = zenoh.Config()
    settings = {"mode": mode, "timestamping/enabled": True, "scouting/multicast/enabled": False}
    settings |= {"connect/endpoints": connect or [], "listen/endpoints": listen or []}
    for name, value in settings.items():
        made.insert_json5(name, json.dumps(value))
    return made


@contextmanager
def session(
    mode: str, *, connect: list[str] | None = None, listen: list[str] | None = None
) -> Iterator[zenoh.Session]:
    """Give a session on loopback, and close it."""
    opened: Any = zenoh.open(config(mode, connect=connect, listen=listen))
    try:
        yield opened
    finally:
        opened.close()


class RosPeer:
    """A ROS node on rmw_zenoh with TF publishers, in a session of its own."""

    def __init__(self, stack: ExitStack, router: str, node: str, domain: int = 0) -> None:
        self.session = stack.enter_context(
            session("peer", connect=[router], listen=["tcp/127.0.0.1:0"])
        )
        self.namespace, _, self.name = node.rpartition("/")
        self.domain = domain
        self._publishers: dict[str, tuple[Any, bytes, Any]] = {}
        self._sent = 0

    def advertise(self, topic: str, *, latched: bool = False) -> None:
        """Make a publisher of the topic, and declare its token."""
        entity = len(self._publishers) + 1
        mangled = [
            name.replace("/", "%") for name in ("/", self.namespace or "/", self.name, topic)
        ]
        token = "/".join(
            [
                *(
                    "@ros2_lv",
                    str(self.domain),
                    str(self.session.info.zid()),
                    "0",
                    str(entity),
                    "MP",
                ),
                *(*mangled, TYPE, HASH, ":1:,1:,:,:,," if latched else "::,100:,:,:,,"),
            ]
        )
        key = f"{self.domain}/{topic.strip('/')}/{TYPE}/{HASH}"
        cache = ext.CacheConfig(max_samples=1) if latched else None
        publisher: Any = (
            ext.declare_advanced_publisher(
                self.session, key, cache=cache, publisher_detection=True
            )
            if latched
            else self.session.declare_publisher(key)
        )
        gid = xxhash.xxh3_128_intdigest(token.encode()).to_bytes(16, "little")
        self._publishers[topic] = (publisher, gid, self.session.liveliness().declare_token(token))

    def send(self, topic: str, data: bytes, *, attached: bool = True) -> None:
        """Publish a message, with rmw_zenoh's attachment."""
        publisher, gid, _ = self._publishers[topic]
        self._sent += 1
        fields = (ext.Int64(self._sent), ext.Int64(time.time_ns()), gid)
        publisher.put(data, attachment=ext.z_serialize(fields) if attached else None)

    def gid(self, topic: str) -> bytes:
        """Return the id of the publisher of the topic."""
        return self._publishers[topic][1]

    def leave(self, topic: str) -> None:
        """End the publisher of the topic."""
        publisher, _, token = self._publishers.pop(topic)
        token.undeclare()
        publisher.undeclare()
