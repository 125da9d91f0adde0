"""What is decoded by a remembered layout is what ``decode`` reads."""

import random
import struct
import time
import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.tf.ros.tf_codec import Decoder, Row, SentTransform, decode, encode

S = 1_000_000_000

names = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=12)
numbers = st.floats(allow_nan=False, width=64)
stamps = st.integers(-(2**31) * S, (2**31 - 1) * S)
transforms = st.builds(
    SentTransform, stamps, names, names, st.tuples(*[numbers] * 3), st.tuples(*[numbers] * 4)
)


def rows_of(data: bytes) -> list[Row]:
    return [
        (t.parent, t.child, *divmod(t.stamp_ns, S), *t.xyz, *t.quat_xyzw) for t in decode(data)
    ]


@given(st.lists(transforms, max_size=6), st.lists(numbers, min_size=7, max_size=7), stamps)
def test_a_second_message_of_the_same_layout_gives_its_own_numbers(
    sent: list[SentTransform], moved: list[float], stamp_ns: int
) -> None:
    decoder = Decoder()
    first = encode(sent)
    x, y, z, *quat = moved
    second = encode(
        [
            SentTransform(
                stamp_ns, t.parent, t.child, (x, y, z), (quat[0], quat[1], quat[2], quat[3])
            )
            for t in sent
        ]
    )
    for data in (first, second, first):
        assert list(decoder.rows(data)) == rows_of(data)


@given(transforms, transforms)
def test_messages_of_one_length_and_different_names_are_distinguished(
    a: SentTransform, b: SentTransform
) -> None:
    decoder = Decoder()
    swapped = [[a, b], [b, a], [a, a], [b, b], [a, b]]
    for sent in swapped:
        assert list(decoder.rows(encode(sent))) == rows_of(encode(sent))


@pytest.mark.parametrize("changed", [("q", "cc"), ("p", "qq")])
def test_a_later_name_that_differs_is_not_taken_for_the_remembered_one(
    changed: tuple[str, str],
) -> None:
    decoder = Decoder()
    first = SentTransform(S, "odom", "base", (1, 2, 3), (0, 0, 0, 1))
    for parent, child in (("p", "cc"), changed):
        data = encode([first, SentTransform(S, parent, child, (4, 5, 6), (0, 0, 0, 1))])
        assert list(decoder.rows(data)) == rows_of(data)


def test_padding_may_hold_anything() -> None:
    decoder = Decoder()
    data = encode(
        [
            SentTransform(S, "ab", "cde", (1, 2, 3), (0, 0, 0, 1)),
            SentTransform(S, "ab", "c", (4, 5, 6), (0, 0, 0, 1)),
        ]
    )
    expected = list(decoder.rows(data))
    dirty = bytearray(data)
    dirty[4 + 4 + 8 + 4 + 3] = 0xAA  # behind "ab" and its NUL
    assert bytes(dirty) != data
    assert list(decoder.rows(bytes(dirty))) == expected


@given(st.binary(max_size=300))
def test_random_bytes_are_refused_or_read_as_by_decode(noise: bytes) -> None:
    for data in (noise, b"\x00\x01\x00\x00" + noise):
        decoder = Decoder()
        try:
            expected = repr(rows_of(data))
        except ValueError:
            with pytest.raises(ValueError, match="message"):
                decoder.rows(data)
        else:
            assert repr(list(decoder.rows(data))) == expected
            assert repr(list(decoder.rows(data))) == expected


def test_truncations_and_huge_counts_are_refused_after_a_full_message() -> None:
    decoder = Decoder()
    data = encode(
        [SentTransform(S, "odom", f"f{index}", (1, 2, 3), (0, 0, 0, 1)) for index in range(4)]
    )
    decoder.rows(data)
    for end in range(len(data)):
        with pytest.raises(ValueError, match="message"):
            decoder.rows(data[:end])
    for count in (5, 1000, 2**31, 2**32 - 1):
        huge = data[:4] + struct.pack("<I", count) + data[8:]
        with pytest.raises(ValueError, match="message"):
            decoder.rows(huge)
        for offset in (16, 28) if count > 5 else ():  # the lengths of the first two names
            with pytest.raises(ValueError, match="message"):
                decoder.rows(data[:offset] + struct.pack("<I", count) + data[offset + 4 :])


def test_a_flood_of_new_layouts_takes_bounded_memory_and_time() -> None:
    rng = random.Random(3)
    decoder = Decoder()

    def seconds() -> float:
        begun = time.process_time()
        for _ in range(250):
            sent = [
                SentTransform(S, "odom", str(rng.random()), (1, 2, 3), (0, 0, 0, 1))
                for _ in range(10)
            ]
            decoder.rows(encode(sent))
        return time.process_time() - begun

    tracemalloc.start()
    first, *_, last = (seconds() for _ in range(4))
    assert last < 4 * first
    for index in range(300):
        decoder.rows(
            encode([SentTransform(S, "odom", f"{index}" * 50_000, (1, 2, 3), (0, 0, 0, 1))])
        )
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 30e6
