"""Reading messages by their layout agrees with a plain decoder, whatever changes."""

import pytest
from geometry_msgs.msg import TransformStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message

from tfcompose.tf.live.publishers import MessageReader
from tfcompose.tf.live.snapshot import joints_of
from tfcompose.tf.ros.node import Received
from tfcompose.tf.ros.tf_codec import MessageLayout, SentTransform, decode, encode

NAMES = st.sampled_from(["a", "b", "odom", "base_link", "käse", "", "x" * 9])
TRANSFORMS = st.lists(
    st.builds(
        SentTransform,
        st.integers(0, 2**31 * 10**9 - 1),
        NAMES,
        NAMES,
        st.just((1.0, 2.0, 3.0)),
        st.just((0.0, 0.0, 0.0, 1.0)),
    ),
    max_size=6,
)


def received(data: bytes) -> Received:
    return Received(data, b"g" * 16, 1, 2, 3)


@settings(max_examples=200, deadline=None)
@given(st.lists(TRANSFORMS, max_size=30))
def test_every_message_is_read_as_a_plain_decoder_does(
    messages: list[list[SentTransform]],
) -> None:
    reader = MessageReader()
    for transforms in messages * 2:
        data = encode(transforms)
        message = reader.read(received(data), static=False)
        plain = decode(data)
        assert message.edges == tuple((transform.parent, transform.child) for transform in plain)
        assert list(message.stamps_ns) == [transform.stamp_ns for transform in plain]


@settings(max_examples=300, deadline=None)
@given(TRANSFORMS, st.data())
def test_an_invalid_message_is_refused_like_in_a_plain_decoder(
    transforms: list[SentTransform], data: st.DataObject
) -> None:
    good = encode(transforms)
    index = data.draw(st.integers(0, len(good) - 1))
    bad = data.draw(
        st.sampled_from(
            [
                good[:index],
                good[:index] + b"\xff" + good[index + 1 :],
                good[:index] + b"\0" + good[index:],
            ]
        )
    )
    reader = MessageReader()
    reader.read(received(good), static=False)
    try:
        plain = decode(bad)
    except ValueError:
        plain = None
    try:
        read = reader.read(received(bad), static=False)
    except ValueError:
        read = None
    assert (read is None) == (plain is None)
    if read and plain:
        assert list(read.stamps_ns) == [transform.stamp_ns for transform in plain]


@pytest.mark.parametrize("name", [b"od\xffm\0", b"od\0m\0", b"\xed\xa0\x80m\0", b"odomX"])
def test_names_of_any_bytes_are_those_that_rclpy_takes(name: bytes) -> None:
    data = encode([SentTransform(0, "map", "odom", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])
    (transform,) = decode(data.replace(b"odom\0", name))
    stamped = serialize_message(TransformStamped(child_frame_id="odom"))
    assert (
        transform.child
        == deserialize_message(stamped.replace(b"odom\0", name), TransformStamped).child_frame_id
    )
    assert MessageLayout(data).exact
    assert not MessageLayout(data.replace(b"odom\0", name)).exact


def test_names_are_those_that_tf2_takes_and_can_be_shown() -> None:
    data = encode([SentTransform(0, "/map", "od\x1bom", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])
    assert MessageReader().read(received(data), static=True).edges == (("map", "od\\x1bom"),)


def test_poses_come_from_the_first_message_with_a_frame_to_compare() -> None:
    reader = MessageReader(frozenset({"odom"}))
    message = encode([SentTransform(1, "map", "base_link", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))])
    assert reader.read(received(message), static=True).poses == ()
    data = encode([SentTransform(1, "map", "/odom", (1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8))])
    (pose,) = reader.read(received(data), static=True).poses
    assert pose == ((1.0, 2.0, 3.0), (0.0, 0.6, 0.0, 0.8))
    assert reader.read(received(data), static=True).poses == ()


def test_a_description_gives_its_moving_joints_and_an_invalid_one_none() -> None:
    text = "<robot name='r'><link name='a'/><link name='b'/>"
    text += (
        "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><mimic"
        " joint='k'/></joint>"
    )
    text += "<joint name='f' type='fixed'><parent link='a'/><child link='c'/></joint></robot>"
    joints = joints_of(text)
    assert [(j.name, j.parent, j.child, j.mimic) for j in joints] == [("j", "a", "b", True)]
    assert joints_of("<robot") == joints_of("<!DOCTYPE a [<!ENTITY b 'c'>]><robot/>") == ()
