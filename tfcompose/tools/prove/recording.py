"""Measurements of sensors by topic, and the reader of a bag."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.tf.bags import Recording
from tfcompose.tf.ros.header_codec import read_header
from tfcompose.tools.prove.messages import TYPES, MeasuredTopic, decode

if TYPE_CHECKING:
    from tfcompose.foundation.signals import Stop


class Measurements:
    """The measurements of all sensors, by topic."""

    def __init__(self) -> None:
        self.topics: dict[str, MeasuredTopic] = {}

    def take(self, name: str, type_: str, data: bytes) -> None:
        """Add a message."""
        topic = self.topics.setdefault(name, MeasuredTopic(name, type_))
        header = read_header(data)
        try:
            if header is None or topic.type != type_:
                raise ValueError(type_)  # noqa: TRY301 (as if it could not be decoded)
            decode(topic, header[1], data)
        except Exception:  # noqa: BLE001 (rosbags raises anything for bytes of another type)
            frame = header[0] if header else ""
            topic.unreadable[frame] = topic.unreadable.get(frame, 0) + 1
            return
        topic.frames[header[0]] = topic.frames.get(header[0], 0) + 1


def read_bag(path: str, stop: Stop) -> Measurements:
    """Return the measurements in a bag.

    A signal ends the reading early.

    Raises:
        BagError: if the bag cannot be read.
    """
    measurements = Measurements()
    for message in Recording(path).messages_of_types(TYPES):
        measurements.take(message.topic, message.type, message.data)
        if stop.requested:
            break
    return measurements
