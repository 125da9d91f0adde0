"""sensor_msgs/JointState as bytes, without ROS.

What ROS itself writes and reads is in the file with _ros.
"""

import struct
import tracemalloc
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.launcher.publishers.joint_mover import positions_of
from tfcompose.tf.ros.joint_codec import JointNames, encode_names, fill, read_names

names = st.lists(
    st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9),
    max_size=7,
)


def message(joints: list[str], positions: list[float], frame: str = "", order: str = "<") -> bytes:
    """Write a message of 3 s and 7 ns as OMG's CDR says, one value after the other."""
    out = struct.pack(order + "iI", 3, 7)
    for text in (frame, None, *joints):
        out += bytes(-len(out) % 4)
        out += (
            struct.pack(order + "I", len(joints))
            if text is None
            else struct.pack(order + "I", len(text.encode()) + 1)
        )
        out += b"" if text is None else text.encode() + b"\0"
    out += bytes(-len(out) % 4) + struct.pack(order + "I", len(positions))
    if positions:
        out += bytes(-len(out) % 8) + struct.pack(f"{order}{len(positions)}d", *positions)
    return bytes([0, order == "<", 0, 0]) + out + struct.pack(order + "II", 0, 0)


@given(names, st.text("ab/", max_size=9), st.sampled_from("<>"))
def test_names_positions_and_time_are_read_in_either_byte_order(
    joints: list[str], frame: str, order: str
) -> None:
    positions = [0.5 * n for n in range(len(joints))]
    data = message(joints, positions, frame, order)
    joint_names = read_names(data)
    assert joint_names.names == tuple(joints)
    assert joint_names.fit(data)
    assert list(positions_of(joint_names, data)) == positions
    assert joint_names.stamp_ns(data) == 3_000_000_007


def test_a_message_of_the_other_byte_order_does_not_fit() -> None:
    assert not read_names(message([], [], order="<")).fit(message([], [], order=">"))


@given(names)
def test_what_is_encoded_is_cdr(joints: list[str]) -> None:
    positions = [-0.25 * n for n in range(len(joints))]
    data = encode_names(joints)
    fill(data, 3_000_000_007, positions)
    assert bytes(data) == message(joints, positions)


@pytest.mark.parametrize(
    ("positions", "why"),
    [([], "names and no positions"), ([1.0], "different number"), ([1.0] * 3, "different number")],
)
def test_another_number_of_positions_is_refused_with_a_sentence(
    positions: list[float], why: str
) -> None:
    data = message(["left", "right"], positions)
    with pytest.raises(ValueError, match=why):
        positions_of(read_names(data), data)


def test_a_message_that_ends_early_is_refused_wherever_it_ends() -> None:
    data = message(["left", "right"], [1.0, 2.0])[:-8]
    assert list(positions_of(read_names(data), data)) == [1.0, 2.0]
    full = read_names(data)
    for length in range(len(data)):
        with pytest.raises(ValueError, match=r"^it |^its "):
            _read(data[:length])
        if full.fit(data[:length]):
            with pytest.raises(ValueError, match=r"^it "):
                positions_of(full, data[:length])


@given(st.binary(max_size=200))
def test_any_bytes_give_names_or_a_value_error(data: bytes) -> None:
    for head in (b"", b"\0\1\0\0", b"\0\0\0\0"):
        with suppress(ValueError):
            _read(head + data)


@pytest.mark.parametrize("offset", [12, 20])
def test_a_message_that_claims_a_lot_is_refused_at_once(offset: int) -> None:
    data = bytearray(message([], []))
    struct.pack_into("<I", data, offset, 0xFFFFFFFF)
    tracemalloc.start()
    with pytest.raises(ValueError, match="bytes"):
        read_names(bytes(data))
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()


def _read(data: bytes) -> JointNames:
    joint_names = read_names(data)
    positions_of(joint_names, data)
    joint_names.stamp_ns(data)
    return joint_names
