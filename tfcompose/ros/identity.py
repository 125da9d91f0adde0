"""Ids of publishers: whether those that come with messages are those of the graph, and which are one's own.

rmw says a publisher's id twice: with each message, and in the graph, where its node's name stands. With rmw_fastrtps
the two are equal. With rmw_cyclonedds that which comes with a message is a number of the receiving process's own
(rmw_cyclonedds#446), and tells senders apart without saying who they are. What a publisher of one's own has in
messages is what ``rmw_get_gid_for_publisher`` returns; by that every rmw can be asked which kind it is.
"""

from __future__ import annotations

import ctypes
import time
from functools import cache
from typing import TYPE_CHECKING, Any

from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import String

from tfcompose.ros.graph import writers

if TYPE_CHECKING:
    from rclpy.node import Node

#: Where the rmw is asked; hidden from lists of topics by its first underscore.
ASKING = "/_tfcompose/who_am_i"

#: How long one's own publisher may take to come into the graph.
SHOWN_WITHIN_S = 0.5

_known: dict[str, bool] = {}


class _Gid(ctypes.Structure):
    """rmw_gid_t, with 16 bytes of storage since Iron, and room behind it."""

    _fields_ = (("implementation", ctypes.c_char_p), ("data", ctypes.c_uint8 * 16), ("room", ctypes.c_uint8 * 64))


def ids_say_who(node: Node) -> bool:
    """Return whether the id of a message is that of its publisher in the graph; asked once for each rmw."""
    rmw: str = get_rmw_implementation_identifier()
    if rmw.startswith("rmw_fastrtps"):
        return True
    if rmw not in _known:
        _known[rmw] = _ask(node)
    return _known[rmw]


def gid_of(publisher: Any) -> bytes:
    """Return the id, 16 bytes, that comes with the messages of this publisher of one's own; empty where none does."""
    rcl, gid = _rcl(), _Gid()
    handle = rcl.rcl_publisher_get_rmw_handle(publisher.handle.pointer)
    return bytes(gid.data) if handle and rcl.rmw_get_gid_for_publisher(handle, ctypes.byref(gid)) == 0 else b""


def _ask(node: Node) -> bool:
    publisher = node.create_publisher(String, ASKING, 1)
    try:
        end = time.monotonic() + SHOWN_WITHIN_S
        while not (shown := writers(node, ASKING)) and time.monotonic() < end:
            time.sleep(0.01)
        return gid_of(publisher) in {one.gid for one in shown}
    finally:
        node.destroy_publisher(publisher)


@cache
def _rcl() -> ctypes.CDLL:
    """Return rcl, which rclpy has loaded; rmw's functions are found with it, as it is linked to them."""
    rcl = ctypes.CDLL("librcl.so")
    rcl.rcl_publisher_get_rmw_handle.restype = ctypes.c_void_p
    rcl.rcl_publisher_get_rmw_handle.argtypes = (ctypes.c_void_p,)
    rcl.rmw_get_gid_for_publisher.restype = ctypes.c_int32
    rcl.rmw_get_gid_for_publisher.argtypes = (ctypes.c_void_p, ctypes.c_void_p)
    return rcl
