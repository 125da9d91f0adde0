"""Publishers and subscribers of the ROS graph, and the sender of each message.

rmw reports a publisher's id in two places: with each message, and in the graph together with the
name of the node. With rmw_fastrtps the two ids are equal. With rmw_cyclonedds, the id of a message
is a number private to the receiving process (rmw_cyclonedds#446). It distinguishes senders but
does not identify them. To find out which kind an rmw is, this module creates a publisher, gets the
id of its messages from ``rmw_get_gid_for_publisher``, and searches for it in the graph. If it is
missing with rmw_zenoh, eclipse-zenoh reads the ids from Zenoh's liveliness tokens.
"""

from __future__ import annotations

import atexit
import ctypes
import time
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal
from weakref import WeakKeyDictionary

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import String

from tfcompose.model.plan.middleware import IMPLEMENTATIONS
from tfcompose.tf.ros.environment import RosError
from tfcompose.tf.ros.processes import has_ended

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rclpy.context import Context
    from rclpy.node import Node
    from rclpy.topic_endpoint_info import TopicEndpointInfo

    from tfcompose.tf.ros.zenoh_graph import RobotGraph

#: Node name that rmw reports until it has discovered a publisher's node.
UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
#: Name and namespace that rmw_fastrtps gives to a publisher without a ROS node.
BARE_DDS = "_CREATED_BY_BARE_DDS_APP_"
#: Topic of the publisher that tests the rmw's ids. Its leading underscore hides it from lists of
#: topics.
ASKING = "/_tfcompose/who_am_i"
#: Time within which the test publisher must appear in the graph, in seconds.
SHOWN_WITHIN_S = 0.5

#: Maximum number of publishers and listeners whose names are remembered.
MOST_NAMES = 10_000

#: Sizes of a wait set: subscriptions, guard conditions, timers, clients, services, events.
_ONE_CONDITION = (0, 1, 0, 0, 0, 0)

_says_who: dict[str, bool] = {}
#: Node names by the id of a publisher or listener, the most recently confirmed last. If DDS drops
#: a participant, for example during a network outage, it returns with the same ids, but
#: rmw_fastrtps does not receive the names of its nodes again.
_names: dict[bytes, str] = {}
#: The graph from rmw_zenoh's liveliness tokens; empty if rclpy's graph is used.
_tokens: list[RobotGraph] = []
_changes: WeakKeyDictionary[Context, GraphChanges] = WeakKeyDictionary()


@dataclass(frozen=True, slots=True)
class GraphPublisher:
    """A publisher of a topic.

    ROS discovers a publisher before the name of its node. Its id, type and QoS are correct from
    the start.
    """

    #: The id, 16 bytes. It equals ``Received.gid`` of its messages if ``gid_identifies_node``.
    gid: bytes
    #: The full name of the node, such as ``/rover/static``, or its last discovered name. Before
    #: the discovery it is ``UNKNOWN_NODE``. A publisher without a ROS node stays ``UNKNOWN_NODE``,
    #: or is ``BARE_DDS`` if the rmw recognises it.
    node: str
    durability: Literal["volatile", "transient_local"]
    reliability: Literal["reliable", "best_effort"]
    #: The message type, such as ``tf2_msgs/msg/TFMessage``.
    type: str


class GraphChanges:
    """Counts the changes of the graph that a node discovers.

    A context has a single guard condition for all changes, and waiting resets it. So only one
    counter for a context works. Get it from ``graph_changes``.
    """

    def __init__(self, node: Node) -> None:
        library = rcl()
        self._condition = library.rcl_node_get_graph_guard_condition(node.handle.pointer)
        self._wait_set = _rclpy.WaitSet(*_ONE_CONDITION, node.context.handle)
        self._add = library.rcl_wait_set_add_guard_condition
        self._count = 0

    def count(self) -> int:
        """Return the number of calls that found a change, including this one, without blocking."""
        self._wait_set.clear_entities()
        if _tokens or self._add(self._wait_set.pointer, self._condition, None):
            self._count += 1  # changes cannot be detected, so assume one
            return self._count
        self._wait_set.wait(0)
        self._count += self._wait_set.is_ready("guard_condition", 0)
        return self._count


def graph_changes(node: Node) -> GraphChanges:
    """Return the counter of graph changes in the node's context."""
    if node.context not in _changes:
        _changes[node.context] = GraphChanges(node)
    return _changes[node.context]


def writers(node: Node, topic: str) -> list[GraphPublisher]:
    """Return the topic's publishers that ``node`` has discovered, sorted by node and id.

    A relative ``topic`` is resolved in the node's namespace, and the node's remappings apply.
    """
    if _tokens:
        publishers = _tokens[0].publishers(node.resolve_topic_name(topic))
        return [
            GraphPublisher(
                endpoint.gid,
                endpoint.node,
                endpoint.durability,
                endpoint.reliability,
                endpoint.type,
            )
            for endpoint in publishers
        ]
    return _sort_publishers(node.get_publishers_info_by_topic(topic))


def publishing_nodes(node: Node, topic: str) -> list[str]:
    """Return the names of the nodes that publish the topic, sorted, without duplicates."""
    return sorted({writer.node for writer in writers(node, topic)})


def unmapped_writers(node: Node, topic: str) -> list[GraphPublisher]:
    """Return the publishers of this absolute topic, without applying the node's remappings.

    The query uses the DDS name, ``rt/…``; an rmw without DDS returns none.
    """
    return _sort_publishers(node.get_publishers_info_by_topic(f"rt{topic}", no_mangle=True))


def _sort_publishers(infos: Iterable[TopicEndpointInfo]) -> list[GraphPublisher]:
    return sorted(map(_writer, infos), key=lambda writer: (writer.node, writer.gid))


def volatile_readers(node: Node, topic: str) -> list[str]:
    """Return the other nodes that listen to the topic without requesting latched messages."""
    name = own_name(node)
    infos = node.get_subscriptions_info_by_topic(topic)
    volatile = [info for info in infos if info.qos_profile.durability == DurabilityPolicy.VOLATILE]
    return sorted({_name_of(info) for info in volatile} - {name, UNKNOWN_NODE})


def own_gid(node: Node, topic: str) -> bytes:
    """Return the id of the node's own subscription; empty if the graph lacks it."""
    infos = node.get_subscriptions_info_by_topic(topic)
    endpoints = (
        info
        for info in infos
        if (info.node_name, info.node_namespace) == (node.get_name(), node.get_namespace())
    )
    return next((bytes(info.endpoint_gid[:16]) for info in endpoints), b"")


def _writer(info: TopicEndpointInfo) -> GraphPublisher:
    latched = info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    best_effort = info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    return GraphPublisher(
        gid=bytes(info.endpoint_gid[:16]),
        node=_name_of(info),
        durability="transient_local" if latched else "volatile",
        reliability="best_effort" if best_effort else "reliable",
        type=info.topic_type,
    )


def _name_of(info: TopicEndpointInfo) -> str:
    """Return the full name of an endpoint's node, or its last name if the rmw has none now."""
    gid, name = bytes(info.endpoint_gid[:16]), _full_name(info.node_namespace, info.node_name)
    last_name = _names.pop(gid, name)
    if name in {UNKNOWN_NODE, BARE_DDS}:
        name = last_name
    if name not in {UNKNOWN_NODE, BARE_DDS}:
        _names[gid] = name
        if len(_names) > MOST_NAMES:
            del _names[next(iter(_names))]
    return name


def _full_name(namespace: str, name: str) -> str:
    if name == UNKNOWN_NODE:
        return UNKNOWN_NODE
    if name == BARE_DDS:
        return BARE_DDS
    return f"{namespace.rstrip('/')}/{name}"


#: The services that rclpy and rclcpp create for every node.
_OF_EACH_NODE = frozenset(
    {
        "describe_parameters",
        "get_parameter_types",
        "get_parameters",
        "get_type_description",
        "list_parameters",
        "set_parameters",
        "set_parameters_atomically",
    }
)


def is_offered(node: Node, service: str) -> bool:
    """Return whether ``node`` has discovered a server of the service, not only clients.

    A server whose process was killed stays in the graph for many seconds, and does not count.
    """
    if not node.count_services(service):
        return False
    servers = node.get_subscriptions_info_by_topic(
        f"rq{service}Request", no_mangle=True
    )  # its name in DDS
    own_gid = next(
        (
            writer.gid
            for writer in writers(node, "/parameter_events")
            if writer.node == own_name(node)
        ),
        b"",
    )
    return not servers or not all(
        has_ended(bytes(endpoint.endpoint_gid[:16]), own_gid) for endpoint in servers
    )


def own_name(node: Node) -> str:
    """Return the node's own full name."""
    return _full_name(node.get_namespace(), node.get_name())


def services(node: Node) -> list[str]:
    """Return the full names of offered services, except those that every node has."""
    names = [
        name
        for name, _ in node.get_service_names_and_types()
        if name.rpartition("/")[2] not in _OF_EACH_NODE
    ]
    return [name for name in names if is_offered(node, name)]


def topics(node: Node) -> list[tuple[str, tuple[str, ...]]]:
    """Return the topics that ``node`` has discovered with their types, sorted."""
    return sorted((name, tuple(types)) for name, types in node.get_topic_names_and_types())


def ends(node: Node, topic: str) -> list[tuple[str, str, bool]]:
    """Return the endpoints of a topic: node, type, and whether it publishes.

    ``topic`` is a full name. Endpoints without a node name, and those of ``node``, are excluded.
    """
    name = own_name(node)
    infos = [(info, True) for info in node.get_publishers_info_by_topic(topic)]
    infos += [(info, False) for info in node.get_subscriptions_info_by_topic(topic)]
    named = [(_name_of(info), info.topic_type, sends) for info, sends in infos]
    return sorted({node for node in named if node[0] not in {name, UNKNOWN_NODE}})


def nodes(node: Node) -> list[str]:
    """Return the full names of the other nodes that ``node`` has discovered, sorted."""
    name = own_name(node)
    names = {
        _full_name(namespace, name) for name, namespace in node.get_node_names_and_namespaces()
    }
    names |= set(
        publishing_nodes(node, "/parameter_events")
    )  # every node has this topic; these names include remembered ones
    return sorted(names - {name, UNKNOWN_NODE, BARE_DDS})


# Ids.


class Allocator(ctypes.Structure):
    """rcutils_allocator_t."""

    _fields_ = (("functions_and_state", ctypes.c_void_p * 5),)


class _Gid(ctypes.Structure):
    """rmw_gid_t, with 16 bytes of storage since Iron, and spare space after it."""

    _fields_ = (
        ("implementation", ctypes.c_char_p),
        ("data", ctypes.c_uint8 * 16),
        ("room", ctypes.c_uint8 * 64),
    )


def gid_identifies_node(node: Node) -> bool:
    """Return whether the id of a message equals the id of its publisher in the graph.

    The result for each rmw is cached.
    """
    rmw: str = get_rmw_implementation_identifier()
    if rmw.startswith("rmw_fastrtps"):
        return True
    if rmw not in _says_who:
        _says_who[rmw] = _ask(node) or _by_tokens(rmw)
    return _says_who[rmw]


def _by_tokens(rmw: str) -> bool:
    """If the rmw is Zenoh's and has a router, use liveliness tokens and return True."""
    if (
        rmw != IMPLEMENTATIONS["zenoh"]
        or find_spec("zenoh") is None
        or find_spec("xxhash") is None
    ):
        return False
    # Only robots on Zenoh need it.
    from tfcompose.tf.ros.zenoh_graph import RobotGraph  # noqa: PLC0415

    try:
        _tokens.append(RobotGraph())
    except RosError:
        return False
    atexit.register(_tokens[0].close)
    return True


def gid_of(publisher: Any) -> bytes:
    """Return the id (16 bytes) in messages of this process's publisher; empty if unknown."""
    library, gid = rcl(), _Gid()
    handle = library.rcl_publisher_get_rmw_handle(publisher.handle.pointer)
    return (
        bytes(gid.data)
        if handle and library.rmw_get_gid_for_publisher(handle, ctypes.byref(gid)) == 0
        else b""
    )


def _ask(node: Node) -> bool:
    publisher = node.create_publisher(String, ASKING, 1)
    try:
        end = time.monotonic() + SHOWN_WITHIN_S
        while not (publishers := writers(node, ASKING)) and time.monotonic() < end:
            time.sleep(0.01)
        return gid_of(publisher) in {endpoint.gid for endpoint in publishers}
    finally:
        node.destroy_publisher(publisher)


@cache
def rcl() -> ctypes.CDLL:
    """Return librcl, which rclpy has loaded, with its functions declared.

    It also provides functions of rmw and rcutils.

    Raises:
        RosError: if the library cannot be opened.
    """
    try:
        library = ctypes.CDLL("librcl.so")
    except OSError as error:
        raise RosError(f"rcl's library cannot be opened: {error}") from None
    library.rcl_publisher_get_rmw_handle.restype = ctypes.c_void_p
    library.rcl_publisher_get_rmw_handle.argtypes = (ctypes.c_void_p,)
    library.rmw_get_gid_for_publisher.restype = ctypes.c_int32
    library.rmw_get_gid_for_publisher.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
    library.rcutils_get_default_allocator.restype = Allocator
    library.rcutils_get_default_allocator.argtypes = ()
    library.rcutils_uint8_array_fini.argtypes = (ctypes.c_void_p,)
    library.rcutils_reset_error.argtypes = ()
    library.rcutils_reset_error.restype = None
    library.rcl_take_serialized_message.argtypes = (ctypes.c_void_p,) * 4
    library.rcl_node_get_graph_guard_condition.restype = ctypes.c_void_p
    library.rcl_node_get_graph_guard_condition.argtypes = (ctypes.c_void_p,)
    library.rcl_wait_set_add_guard_condition.argtypes = (ctypes.c_void_p,) * 3
    library.rcl_node_get_rmw_handle.restype = ctypes.c_void_p
    library.rcl_node_get_rmw_handle.argtypes = (ctypes.c_void_p,)
    library.rmw_create_subscription.restype = ctypes.c_void_p
    library.rmw_create_subscription.argtypes = (
        *(ctypes.c_void_p,) * 2,
        ctypes.c_char_p,
        *(ctypes.c_void_p,) * 2,
    )
    library.rmw_take_serialized_message_with_info.argtypes = (ctypes.c_void_p,) * 5
    library.rmw_destroy_subscription.argtypes = (ctypes.c_void_p,) * 2
    library.rmw_subscription_set_on_new_message_callback.argtypes = (ctypes.c_void_p,) * 3
    return library
