import struct
import tracemalloc
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.foundation.geometry import Pose
from tfcompose.tf.ros.tf_codec import SentTransform, Template, decode, encode

doubles = st.floats(allow_nan=False)
names = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20)
transforms = st.builds(
    SentTransform,
    stamp_ns=st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1),
    parent=names,
    child=names,
    xyz=st.tuples(doubles, doubles, doubles),
    quat_xyzw=st.tuples(doubles, doubles, doubles, doubles),
)
messages = st.lists(transforms, max_size=5)

ONE = SentTransform(3_000_000_007, "odom", "base", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))


def test_a_message_has_the_layout_of_cdr() -> None:
    expected = b"".join(
        [
            bytes([0, 1, 0, 0]),
            struct.pack("<I", 1),
            struct.pack("<iI", 3, 7),
            struct.pack("<I", 5) + b"odom\0",
            bytes(3),
            struct.pack("<I", 5) + b"base\0",
            bytes(7),  # 41 bytes behind the header; doubles stand at multiples of 8
            struct.pack("<7d", 1, 2, 3, 0, 0, 0, 1),
        ]
    )
    assert encode([ONE]) == expected


@given(messages)
def test_what_is_encoded_is_decoded(sent: list[SentTransform]) -> None:
    assert decode(encode(sent)) == sent


def test_big_endian_messages_are_read() -> None:
    body = (
        struct.pack(">IiII", 1, 3, 7, 5)
        + b"odom\0"
        + bytes(3)
        + struct.pack(">I", 5)
        + b"base\0"
        + bytes(7)
    )
    assert decode(bytes(4) + body + struct.pack(">7d", 1, 2, 3, 0, 0, 0, 1)) == [ONE]


@given(st.binary(max_size=300))
def test_any_bytes_give_transforms_or_a_value_error(data: bytes) -> None:
    _read_or_refuse(data)
    _read_or_refuse(b"\0\1\0\0" + data)


@given(messages, st.data())
def test_a_damaged_message_gives_transforms_or_a_value_error(
    sent: list[SentTransform], data: st.DataObject
) -> None:
    damaged = bytearray(encode(sent))
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    _read_or_refuse(bytes(damaged))


@given(st.lists(transforms, min_size=1, max_size=3), st.data())
def test_a_truncated_message_is_refused(sent: list[SentTransform], data: st.DataObject) -> None:
    full = encode(sent)
    with pytest.raises(ValueError, match="message"):
        decode(full[: data.draw(st.integers(0, len(full) - 1))])


def test_a_huge_count_costs_no_memory() -> None:
    tracemalloc.start()
    with pytest.raises(ValueError, match="claims 4294967295 transforms"):
        decode(b"\0\1\0\0\xff\xff\xff\xff" + bytes(1000))
    assert tracemalloc.get_traced_memory()[1] < 100_000
    tracemalloc.stop()


def test_a_name_that_is_longer_than_the_message_is_refused_as_such() -> None:
    with pytest.raises(ValueError, match="inside a name of 4294967295 bytes"):
        decode(encode([ONE]).replace(b"\x05\0\0\0odom", b"\xff\xff\xff\xffodom"))


def test_a_name_with_a_nul_is_not_encoded() -> None:
    with pytest.raises(ValueError, match="NUL"):
        encode([SentTransform(0, "a\0b", "c", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])


@given(st.lists(transforms, min_size=1, max_size=5))
def test_a_template_gives_the_bytes_of_a_fresh_message(sent: list[SentTransform]) -> None:
    template = Template([(each.parent, each.child) for each in sent])
    template.set_stamp(sent[0].stamp_ns)
    for index, each in enumerate(sent):
        template.set_pose(index, Pose(each.xyz, each.quat_xyzw))
    same_time = [
        SentTransform(sent[0].stamp_ns, t.parent, t.child, t.xyz, t.quat_xyzw) for t in sent
    ]
    assert template.data == encode(same_time)


def _read_or_refuse(data: bytes) -> None:
    transforms: list[SentTransform] = []
    with suppress(ValueError):
        transforms = decode(data)
    assert all(isinstance(each, SentTransform) for each in transforms)
