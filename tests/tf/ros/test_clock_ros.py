"""Simulated time is read from bytes, and bytes that are none do no harm."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from tests.support.waiting import until
from tfcompose.tf.ros.clock import SimClock, read_clock
from tfcompose.tf.ros.node import open_node


@given(st.integers(-(2**31), 2**31 - 1), st.integers(0, 999_999_999))
def test_what_ros_wrote_is_read(seconds: int, nanoseconds: int) -> None:
    message = Clock()
    message.clock.sec, message.clock.nanosec = seconds, nanoseconds
    data = bytes(serialize_message(message))
    assert read_clock(data) == seconds * 1_000_000_000 + nanoseconds
    swapped = bytes((0, 0, 0, 0)) + data[4:8][::-1] + data[8:12][::-1]
    assert read_clock(swapped) == read_clock(data), "in the other byte order, too"


@given(st.binary(max_size=40))
def test_any_bytes_are_a_time_or_none(data: bytes) -> None:
    time_ns = read_clock(data)
    assert time_ns is None or abs(time_ns) <= 2**31 * 1_000_000_000


@pytest.mark.ros
@pytest.mark.usefixtures("domain")
def test_a_clock_goes_on_after_bytes_that_are_no_time() -> None:
    with open_node("simulator", "") as node:
        publisher, clock = node.create_publisher(Clock, "/clock", 1), SimClock(node)

        def comes(second: int) -> bool:
            publisher.publish(
                bytes((0, 1, 0, 0, second, 0, 0, 0, 0, 0, 0, 0))[: 12 if second else 9]
            )
            return clock.now_ns() == second * 1_000_000_000

        assert until(lambda: comes(7))
        assert not until(lambda: comes(0), 0.3)
        assert clock.now_ns() == 7_000_000_000
        assert until(lambda: comes(8))
