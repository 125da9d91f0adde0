"""TF as bytes: publish, take with the publisher's id, and wait without an executor.

rclpy on Jazzy does not say who published a message; rcl does (``rcl_take_serialized_message`` and rmw's
``rmw_message_info_t``), and is called here with ctypes.
"""

from __future__ import annotations

import ctypes
import weakref
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from tfcompose.ros.environment import RosError
from tfcompose.ros.identity import gid_of, ids_say_who
from tfcompose.ros.node import (
    DEEP_TF_READER,
    DEEP_TF_STATIC_READER,
    TF_PUBLISHER,
    TF_READER,
    TF_STATIC_PUBLISHER,
    TF_STATIC_READER,
)
from tfcompose.ros.typesupport import tf_message_type

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node
    from rclpy.qos import QoSProfile

    from tfcompose.ros.stop import Stop

_OK = 0
_TAKE_FAILED = 401  # RCL_RET_SUBSCRIPTION_TAKE_FAILED: nothing is there
_NO_GID = bytes(16)
# What one take returns at most, so that a flood does not keep the caller from its signals.
_MOST_AT_ONCE = 1000


class _Allocator(ctypes.Structure):
    _fields_ = (("functions_and_state", ctypes.c_void_p * 5),)


class _Bytes(ctypes.Structure):
    """rcutils_uint8_array_t."""

    _fields_ = (
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    )


class _MessageInfo(ctypes.Structure):
    """rmw_message_info_t with its rmw_gid_t (16 bytes of storage since Iron), and room behind it."""

    _fields_ = (
        ("source_ns", ctypes.c_int64),
        ("received_ns", ctypes.c_int64),
        ("publication_sequence", ctypes.c_uint64),
        ("reception_sequence", ctypes.c_uint64),
        ("gid_implementation", ctypes.c_char_p),
        ("gid", ctypes.c_uint8 * 16),
        ("from_intra_process", ctypes.c_bool),
        ("room", ctypes.c_uint8 * 64),
    )


@dataclass(frozen=True, slots=True)
class Received:
    """A message as bytes, and how it came.

    ``gid`` is its publisher's id, 16 bytes, as in ``graph.writers``, or None where the rmw does not say it with a
    message (``identity``). ``raw_gid`` is what the rmw says instead: it tells one's own publishers from others, and
    senders apart. Times are in nanoseconds of the system clock; ``sequence`` counts the publisher's messages, or is the
    largest uint64 where the rmw does not count.
    """

    data: bytes
    gid: bytes | None
    source_ns: int
    received_ns: int
    sequence: int
    raw_gid: bytes | None = None


class TFPublisher:
    """A publisher of TFMessage bytes on /tf or, latched, on /tf_static, or on another ``topic`` with the same QoS."""

    def __init__(self, node: Node, *, static: bool, topic: str | None = None) -> None:
        qos = TF_STATIC_PUBLISHER if static else TF_PUBLISHER
        self.publisher: Any = node.create_publisher(tf_message_type(), topic or _topic(static=static), qos)

    @property
    def raw_gid(self) -> bytes:
        """The id that its messages come with, as ``Received.raw_gid``."""
        return gid_of(self.publisher)

    def publish(self, data: bytes) -> None:
        """Publish a message that ``message.encode`` or a ``message.Template`` made."""
        self.publisher.publish(data)


class Subscription:
    """A subscription of any type, taken as bytes and never called back."""

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        self.subscription: Any = node.create_subscription(message_type, topic, _ignore, qos, raw=True)
        self._says_who = ids_say_who(node)
        rcl = _rcl()
        self._bytes = _Bytes(allocator=rcl.rcutils_get_default_allocator())
        self._info = _MessageInfo()
        self._take = rcl.rcl_take_serialized_message
        self._arguments = (
            ctypes.c_void_p(self.subscription.handle.pointer),
            ctypes.byref(self._bytes),
            ctypes.byref(self._info),
            None,
        )
        weakref.finalize(self, rcl.rcutils_uint8_array_fini, ctypes.byref(self._bytes))

    @property
    def topic(self) -> str:
        """The topic's full name."""
        name: str = self.subscription.topic_name
        return name

    def take(self) -> list[Received]:
        """Return all that has come since the last time, oldest first, and wait for nothing.

        Raises:
            RosError: if rcl cannot take from this subscription.
        """
        found: list[Received] = []
        while len(found) < _MOST_AT_ONCE:
            result = self._take(*self._arguments)
            if result == _TAKE_FAILED:
                break
            if result != _OK:
                _rcl().rcutils_reset_error()
                raise RosError(f"rcl cannot take a message from {self.subscription.topic_name} (code {result})")
            found.append(self._received())
        return found

    def _received(self) -> Received:
        info = self._info
        gid = None if (raw := bytes(info.gid)) == _NO_GID else raw
        return Received(
            data=ctypes.string_at(self._bytes.buffer, self._bytes.length),
            gid=gid if self._says_who else None,
            source_ns=info.source_ns,
            received_ns=info.received_ns,
            sequence=info.publication_sequence,
            raw_gid=gid,
        )


class TFSubscription(Subscription):
    """A subscription to /tf or /tf_static, or to another ``topic`` with the same QoS, as a tf2 listener's.

    With ``deep`` it keeps ten times as many messages as listeners do, for one that must miss nobody: of a hundred
    latched publishers that it finds at once, or a flood.
    """

    def __init__(self, node: Node, *, static: bool, topic: str | None = None, deep: bool = False) -> None:
        profiles = (TF_READER, TF_STATIC_READER, DEEP_TF_READER, DEEP_TF_STATIC_READER)
        super().__init__(node, tf_message_type(), topic or _topic(static=static), profiles[static + 2 * deep])


def wait(node: Node, subscriptions: Sequence[Subscription], timeout_s: float | None, stop: Stop) -> None:
    """Wait until a subscription has something, the time is over (None: never) or ``stop`` is requested.

    A new publisher or reader in the graph ends no wait. Nothing is taken.
    """
    if stop.requested:
        return
    context = node.context.handle
    wait_set = _rclpy.WaitSet(len(subscriptions), 1, 0, 0, 0, 0, context)
    wait_set.add_guard_condition(stop.waker(context, lambda: _rclpy.GuardCondition(context)))
    for subscription in subscriptions:
        wait_set.add_subscription(subscription.subscription.handle)
    wait_set.wait(-1 if timeout_s is None else max(0, int(timeout_s * 1e9)))


def _topic(*, static: bool) -> str:
    return "/tf_static" if static else "/tf"


def _ignore(_: object) -> None:
    """Stand in for the callback that rclpy asks for."""


@cache
def _rcl() -> ctypes.CDLL:
    """Return rcl, which rclpy has loaded, with what is called here; rcutils comes with it."""
    try:
        rcl = ctypes.CDLL("librcl.so")
    except OSError as error:
        raise RosError(f"rcl's library cannot be opened: {error}") from None
    rcl.rcutils_get_default_allocator.restype = _Allocator
    rcl.rcutils_get_default_allocator.argtypes = ()
    rcl.rcutils_uint8_array_fini.argtypes = (ctypes.c_void_p,)
    rcl.rcutils_reset_error.argtypes = ()
    rcl.rcutils_reset_error.restype = None
    rcl.rcl_take_serialized_message.argtypes = (ctypes.c_void_p,) * 4
    return rcl
