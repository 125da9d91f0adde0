"""Long messages of a flood are read in pieces, for a bounded share of each second."""

from itertools import count

import pytest

from tfcompose.guard.flood import SLICE_S, FloodReader
from tfcompose.tf.live.flood import BUSY_S
from tfcompose.tf.live.topics import TFData
from tfcompose.tf.ros.node import Received
from tfcompose.tf.ros.tf_codec import SentTransform, decode, encode

LONG = encode(
    [
        SentTransform(0, "map", f"rogue_{n}", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        for n in range(20_000)
    ]
)
DECLARED = encode([SentTransform(0, "map", "odom", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))])


def sent(data: bytes) -> TFData:
    return TFData(Received(data, b"x", 0, 0, 1), static=False)


def test_reading_stops_after_its_slice_of_a_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times = count()
    monkeypatch.setattr("time.thread_time", lambda: next(times) * SLICE_S / 4)
    reader = FloodReader({"odom"})
    reader.add(sent(LONG))
    taken: list[int] = []
    while not taken or taken[-1] > 1:  # ticks of the clock; 1 where the second's time is over
        before = next(times)
        assert reader.read(0.0) is None
        taken.append(next(times) - before)
    assert max(taken) < 10
    assert len(taken) == pytest.approx(BUSY_S / SLICE_S, abs=2)
    assert not reader.is_reading, (
        "the guard does not wake up for what it may not read in this second"
    )
    begun = next(times)
    reader.read(1.0)
    assert next(times) > begun + 2
    assert reader.is_reading


def test_a_flood_keeps_its_declared_edges_and_skips_further_messages() -> None:
    reader = FloodReader({"odom"})
    parts = [decode(LONG), decode(DECLARED)]
    reader.add(sent(encode([*parts[0], *parts[1]])))
    reader.add(sent(DECLARED))
    assert reader.skipped == 1
    seconds = count()
    while reader.is_reading:
        message = reader.read(float(next(seconds)))
    assert message
    assert [transform.child for transform in decode(message.received.data)] == ["odom"]
