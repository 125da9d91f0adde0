"""tfcompose's node, with TF as bytes: publish, receive with the sender's id, wait.

The node is cheap. It has no executor, and none of rclpy's parameters, services and signal
handlers. rclpy on Jazzy does not report who published a message, but rcl does
(``rcl_take_serialized_message`` and rmw's ``rmw_message_info_t``). This module calls rcl with
ctypes.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import threading
import weakref
from abc import ABC, abstractmethod
from collections import deque
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from rcl_interfaces.msg import ParameterEvent
from rclpy.context import Context
from rclpy.exceptions import InvalidParameterTypeException, NameValidationException
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.type_support import check_for_type_support
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import String

from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.graph import Allocator, gid_identifies_node, gid_of, rcl
from tfcompose.tf.ros.sockets import widen_buffers
from tfcompose.tf.ros.typesupport import capsule_address, tf_message_type

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.foundation.signals import Stop

T = TypeVar("T", bool, float)

#: Time limit for closing a node, in seconds. It suffices on a busy machine, and is shorter than
#: the time from SIGINT to SIGTERM.
LEAVE_S = 3.0

_OK = 0
_TAKE_FAILED = 401  # RCL_RET_SUBSCRIPTION_TAKE_FAILED: nothing is there
_NO_GID = bytes(16)
_OPTIONALLY = 2  # RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_OPTIONALLY_REQUIRED


def qos(depth: int, durability: DurabilityPolicy, reliability: ReliabilityPolicy) -> QoSProfile:
    """Return the profile that keeps the last ``depth`` messages."""
    profile: Any = QoSProfile  # rclpy does not say the types of its arguments
    return cast(
        "QoSProfile",
        profile(
            history=HistoryPolicy.KEEP_LAST,
            depth=depth,
            durability=durability,
            reliability=reliability,
        ),
    )


def profile_of(qos_or_depth: QoSProfile | int | None, default: QoSProfile) -> QoSProfile:
    """Return the given profile, or the default.

    A depth replaces only the default's depth, so that a latched profile stays latched.
    """
    if isinstance(qos_or_depth, int):
        profile: Any = default
        return qos(qos_or_depth, profile.durability, profile.reliability)
    return qos_or_depth or default


#: tf2_ros ``qos.hpp`` (Jazzy): the QoS that TF's listeners and broadcasters expect of each other.
TF_PUBLISHER = TF_READER = qos(100, DurabilityPolicy.VOLATILE, ReliabilityPolicy.RELIABLE)
TF_STATIC_PUBLISHER = qos(1, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)
TF_STATIC_READER = qos(100, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)
#: Number of messages that a deep reader keeps until they are taken. Beyond it, the oldest are
#: lost.
DEEP = 1000
DEEP_TF_READER = qos(DEEP, DurabilityPolicy.VOLATILE, ReliabilityPolicy.RELIABLE)
DEEP_TF_STATIC_READER = qos(DEEP, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)
#: Matches any publisher of ``joint_states``, like the subscription of robot_state_publisher. That
#: subscription keeps only 5 messages, and loses messages of a fast source if it is suspended for a
#: moment.
JOINT_STATES = qos(50, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)
#: A value for late joiners, such as ``robot_description``.
LATCHED = qos(1, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)


@contextmanager
def open_node(name: str, namespace: str, *, args: Sequence[str] = ()) -> Iterator[Node]:
    """Yield a node in its own context, and end both after the ``with`` block.

    Leaving takes some milliseconds. If ROS does not return, the process is ended after
    ``LEAVE_S``. The node offers no parameters, no services and no /rosout, because nothing here
    would answer requests. ``args`` are the arguments after ``--ros-args``, for example ``["-r",
    "/tf:=tf"]``. The process's own arguments are ignored.

    Raises:
        RosError: if ROS rejects the name, the arguments or its environment.
    """
    context = Context()
    try:
        context.init(args=["--ros-args", *args] if args else [], initialize_logging=False)
        node = _node(context, name, namespace)
        widen_buffers()
    except (RuntimeError, NameValidationException, InvalidParameterTypeException) as error:
        context.try_shutdown()
        unknown = isinstance(error, _rclpy.UnknownROSArgsError)
        what = "unknown ROS arguments " if unknown else ""
        reason = " ".join(str(error).split())
        raise RosError(f"ROS cannot start a node: {what}{reason}") from None
    try:
        yield node
    finally:
        with end_unless_done(LEAVE_S):
            node.destroy_node()
            context.shutdown()
            context.destroy()


@contextmanager
def end_unless_done(seconds: float) -> Iterator[None]:
    """End this process with code 1 if the block takes longer than ``seconds``.

    Fast DDS 2.14 can deadlock when several processes leave at once (one in a hundred times,
    observed on Jazzy). The leaving participant busy-waits for a listener that handles the
    departure of a publisher, and that listener waits for the participant. A Python thread could
    not end the process, because ROS holds the interpreter's lock while it leaves. faulthandler's
    thread can.
    """
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def _node(context: Context, name: str, namespace: str) -> Any:
    parameter: Any = Parameter  # rclpy does not say the types of its arguments
    return Node(
        name,
        context=context,
        namespace=namespace,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[parameter("start_type_description_service", value=False)],
    )


def load_types() -> None:
    """Load the message types of every tfcompose process, as the first publisher would."""
    tf_message_type()
    load: Any = check_for_type_support  # rclpy does not say the types of its arguments
    for message in (String, ParameterEvent):
        load(message)


def middleware() -> str:
    """Return the name of the middleware (rmw) that this process uses."""
    name: str = get_rmw_implementation_identifier()
    return name


def latch(node: Node, topic: str, text: str) -> Any:
    """Publish ``text`` latched as std_msgs/String while the returned publisher lives."""
    publisher = node.create_publisher(String, topic, LATCHED)
    send_text(publisher, text)
    return publisher


def send_text(publisher: Any, text: str) -> None:
    """Publish ``text`` with a publisher of ``latch``, in place of the text before."""
    publisher.publish(String(data=text))


def parameter(node: Node, name: str, default: T) -> T:
    """Return the value of ``-p name:=…`` among the node's arguments, or the default.

    Raises:
        RosError: if the value has another type than the default.
    """
    try:
        value: T = node.declare_parameter(name, default).value
    except InvalidParameterTypeException as error:
        raise RosError(
            f"the parameter {name} is not right: {' '.join(str(error).split())}"
        ) from None
    return value


# Messages as bytes.


class _Bytes(ctypes.Structure):
    """rcutils_uint8_array_t."""

    _fields_ = (
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", Allocator),
    )


class _MessageInfo(ctypes.Structure):
    """rmw_message_info_t with its rmw_gid_t (16 bytes since Iron), and spare room."""

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
    """A message as bytes, with its origin. Times are in nanoseconds of the system clock."""

    data: bytes
    #: Its publisher's id, 16 bytes, as in ``graph.writers``; None if the rmw does not identify
    #: senders.
    gid: bytes | None
    source_ns: int
    received_ns: int
    #: Number of the message among its publisher's messages; the largest uint64 if the rmw does not
    #: count.
    sequence: int
    #: The id from the rmw, which distinguishes senders, and this process's publishers from others.
    raw_gid: bytes | None = None


class TFPublisher:
    """A publisher of TFMessage bytes on /tf, latched on /tf_static, or on another ``topic``.

    ``qos`` is an rclpy profile, a depth, or None for tf2's profile.
    """

    def __init__(
        self,
        node: Node,
        *,
        static: bool,
        topic: str | None = None,
        qos: QoSProfile | int | None = None,
    ) -> None:
        profile = profile_of(qos, TF_STATIC_PUBLISHER if static else TF_PUBLISHER)
        self.publisher: Any = node.create_publisher(
            tf_message_type(), topic or _topic(static=static), profile
        )

    @property
    def raw_gid(self) -> bytes:
        """The id in its messages, as in ``Received.raw_gid``."""
        return gid_of(self.publisher)

    def publish(self, data: bytes) -> None:
        """Publish a message made by ``tf_codec``."""
        self.publisher.publish(data)


class WaitSource(ABC):
    """Something to wait for with ``wait``."""

    @abstractmethod
    def add_to(self, wait_set: Any) -> tuple[str, int]:
        """Add it to rclpy's wait set; return the kind and index of its entity there."""


class MessageSource(WaitSource):
    """A source of a topic's messages as bytes, for use with ``wait``."""

    def __init__(self, topic: str, *, gid_identifies_node: bool) -> None:
        self._topic, self._says_who = topic, gid_identifies_node
        library = rcl()
        self._bytes = _Bytes(allocator=library.rcutils_get_default_allocator())
        self._info = _MessageInfo()
        weakref.finalize(self, library.rcutils_uint8_array_fini, ctypes.byref(self._bytes))

    @property
    def topic(self) -> str:
        """The topic's full name."""
        return self._topic

    def take(self) -> list[Received]:
        """Return the messages received since the last call, oldest first, without blocking.

        At most ``DEEP`` messages are returned, so that the caller can handle signals during a
        flood.

        Raises:
            RosError: if rcl cannot take from this subscription.
        """
        received: list[Received] = []
        while len(received) < DEEP and self._take_one():
            received.append(self._receive())
        return received

    @abstractmethod
    def _take_one(self) -> bool:
        """Take a message into the buffer, and return whether there was one."""

    def _receive(self) -> Received:
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


class Subscription(MessageSource):
    """A subscription of any type, taken as bytes, without callbacks."""

    def __init__(self, node: Node, message_type: Any, topic: str, qos: QoSProfile) -> None:
        self.subscription: Any = node.create_subscription(
            message_type, topic, _ignore, qos, raw=True
        )
        super().__init__(
            self.subscription.topic_name, gid_identifies_node=gid_identifies_node(node)
        )
        self._take = rcl().rcl_take_serialized_message
        self._arguments = (
            ctypes.c_void_p(self.subscription.handle.pointer),
            ctypes.byref(self._bytes),
            ctypes.byref(self._info),
            None,
        )

    def add_to(self, wait_set: Any) -> tuple[str, int]:
        """Add it to rclpy's wait set; return the kind and index of its entity there."""
        return "subscription", wait_set.add_subscription(self.subscription.handle)

    def _take_one(self) -> bool:
        result = self._take(*self._arguments)
        if result not in (_OK, _TAKE_FAILED):
            rcl().rcutils_reset_error()
            raise RosError(f"rcl cannot take a message from {self.topic} (code {result})")
        return bool(result == _OK)


class TFSubscription(Subscription):
    """A subscription to /tf, /tf_static or ``topic`` with the QoS of a tf2 listener.

    ``deep`` keeps ten times as many messages as listeners do. It is for a subscriber that must
    miss no publisher, even in a flood or if a hundred latched publishers are discovered at once.
    """

    def __init__(
        self, node: Node, *, static: bool, topic: str | None = None, deep: bool = False
    ) -> None:
        profiles = (TF_READER, TF_STATIC_READER, DEEP_TF_READER, DEEP_TF_STATIC_READER)
        super().__init__(
            node, tf_message_type(), topic or _topic(static=static), profiles[static + 2 * deep]
        )


class _Time(ctypes.Structure):
    """rmw_time_t."""

    _fields_ = (("sec", ctypes.c_uint64), ("nsec", ctypes.c_uint64))


class _Qos(ctypes.Structure):
    """rmw_qos_profile_t."""

    _fields_ = (
        ("history", ctypes.c_int),
        ("depth", ctypes.c_size_t),
        ("reliability", ctypes.c_int),
        ("durability", ctypes.c_int),
        ("deadline", _Time),
        ("lifespan", _Time),
        ("liveliness", ctypes.c_int),
        ("liveliness_lease", _Time),
        ("avoid_ros_namespace_conventions", ctypes.c_bool),
    )


class _Options(ctypes.Structure):
    """rmw_subscription_options_t."""

    _fields_ = (
        ("payload", ctypes.c_void_p),
        ("ignore_local_publications", ctypes.c_bool),
        ("unique_network_flow_endpoints", ctypes.c_int),
        ("content_filter", ctypes.c_void_p),
    )


class PublicTFReader(MessageSource):
    """Reads a TF topic outside all partitions, through its own port.

    Fast DDS selects profiles of readers by ROS topic name. This reader has the same DDS topic
    without a ROS name. rmw creates it directly, because rcl accepts only names that begin with a
    slash. If possible, it receives through its own port, so that a flood there drops no messages
    of the process's other readers. It keeps as many messages as a deep ``TFSubscription``. Call
    ``close`` before the node ends.

    Raises:
        RosError: if rmw cannot create such a reader, or does not report arrivals.
    """

    def __init__(self, node: Node, topic: str, *, static: bool) -> None:
        library = rcl()
        super().__init__(
            node.resolve_topic_name(topic), gid_identifies_node=gid_identifies_node(node)
        )
        profile = DEEP_TF_STATIC_READER if static else DEEP_TF_READER
        numbers = (
            int(profile.history),
            profile.depth,
            int(profile.reliability),
            int(profile.durability),
        )
        qos = _Qos(*numbers, avoid_ros_namespace_conventions=True)
        self._type = tf_message_type()
        self._node = ctypes.c_void_p(library.rcl_node_get_rmw_handle(node.handle.pointer))
        support = ctypes.c_void_p(capsule_address(self._type._TYPE_SUPPORT))  # noqa: SLF001 (what rclpy takes of a message's class)
        options = _Options(unique_network_flow_endpoints=_OPTIONALLY)
        named = (f"rt{self.topic}".encode(), ctypes.byref(qos), ctypes.byref(options))
        made = library.rmw_create_subscription(self._node, support, *named)
        if not made:
            library.rcutils_reset_error()
            raise RosError(f"rmw makes no reader of {topic} outside of partitions")
        widen_buffers()
        self._reader: ctypes.c_void_p | None = ctypes.c_void_p(made)
        self._taken = ctypes.c_bool()
        taken, info = ctypes.byref(self._taken), ctypes.byref(self._info)
        self._arguments = (self._reader, ctypes.byref(self._bytes), taken, info, None)
        self._came = _rclpy.GuardCondition(node.context.handle)
        # The DDS thread that received the message calls rcl's function directly, without Python.
        trigger = ctypes.cast(library.rcl_trigger_guard_condition, ctypes.c_void_p)
        condition = ctypes.c_void_p(self._came.pointer)
        if (
            library.rmw_subscription_set_on_new_message_callback(self._reader, trigger, condition)
            != _OK
        ):
            library.rcutils_reset_error()
            self.close()
            raise RosError(f"rmw does not say when something comes on {topic}")

    def add_to(self, wait_set: Any) -> tuple[str, int]:
        """Add it to rclpy's wait set; return the kind and index of its entity there."""
        return "guard_condition", wait_set.add_guard_condition(self._came)

    def close(self) -> None:
        """End the reader."""
        if self._reader:
            rcl().rmw_subscription_set_on_new_message_callback(self._reader, None, None)
            rcl().rmw_destroy_subscription(self._node, self._reader)
            self._reader = None

    def _take_one(self) -> bool:
        if self._reader is None:
            return False
        result = rcl().rmw_take_serialized_message_with_info(*self._arguments)
        return result == _OK and self._taken.value


class PipeReader(WaitSource):
    """Lines from a pipe, for use with ``wait``. A thread reads them, until the other end closes.

    The reader takes over the descriptor.
    """

    def __init__(self, node: Node, fd: int) -> None:
        self._lines: deque[bytes] = deque()
        self._came = _rclpy.GuardCondition(node.context.handle)
        threading.Thread(target=self._read, args=(fd,), name="orders", daemon=True).start()

    def add_to(self, wait_set: Any) -> tuple[str, int]:
        """Add it to rclpy's wait set; return the kind and index of its entity there."""
        return "guard_condition", wait_set.add_guard_condition(self._came)

    def take_lines(self) -> Iterator[bytes]:
        """Yield the lines received since the last call, oldest first, without blocking."""
        while self._lines:
            yield self._lines.popleft()

    def _read(self, fd: int) -> None:
        with os.fdopen(fd, "rb") as pipe:
            for line in pipe:
                self._lines.append(line)
                with suppress(RuntimeError):  # ROS has shut down
                    self._came.trigger_guard_condition()


class WaitSet:
    """Readers to wait for repeatedly, until ``stop`` is requested."""

    def __init__(self, node: Node, readers: Sequence[WaitSource], stop: Stop) -> None:
        self._readers, self._stop = tuple(readers), stop
        self._context = node.context.handle
        self._wait_set = _rclpy.WaitSet(len(readers), 1 + len(readers), 0, 0, 0, 0, self._context)

    def wait(self, timeout_s: float | None) -> list[WaitSource]:
        """Wait for a message, for ``timeout_s`` seconds (None: forever) or until ``stop``.

        Return the readers with messages, without taking any message. A new publisher or reader in
        the graph does not end the wait.
        """
        if self._stop.requested:
            return []
        wait_set, context = self._wait_set, self._context
        wait_set.clear_entities()
        wait_set.add_guard_condition(
            self._stop.waker(context, lambda: _rclpy.GuardCondition(context))
        )
        awaited = [(reader, *reader.add_to(wait_set)) for reader in self._readers]
        wait_set.wait(-1 if timeout_s is None else max(0, int(timeout_s * 1e9)))
        return [reader for reader, kind, index in awaited if wait_set.is_ready(kind, index)]


def wait(node: Node, readers: Sequence[WaitSource], timeout_s: float | None, stop: Stop) -> None:
    """Wait once, as ``WaitSet.wait`` does."""
    WaitSet(node, readers, stop).wait(timeout_s)


def _topic(*, static: bool) -> str:
    return "/tf_static" if static else "/tf"


def _ignore(_: object) -> None:
    """Do nothing, as the callback that rclpy requires."""


class TextSubscription(Subscription):
    """A subscription to std_msgs/String."""

    def __init__(self, node: Node, topic: str, qos: QoSProfile) -> None:
        super().__init__(node, String, topic, qos)

    def take_texts(self) -> list[tuple[Received, str]]:
        """Return the texts received since the last call, oldest first; skip undecodable ones."""
        return [
            (received, text)
            for received in self.take()
            if (text := _text(received.data)) is not None
        ]


def _text(data: bytes) -> str | None:
    try:
        text: str = deserialize_message(data, String).data
    except Exception:  # noqa: BLE001 (rclpy's name for bytes that are no String is not public)
        return None
    return text
