"""Interface between the storage formats of bags and the corrections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import yaml

from tfcompose.tf.ros.tf_codec import TF_MESSAGE
from tfcompose.tools.rebag.recorded_topic import (
    QOS_BY_WORDS,
    TF_DEFINITION,
    RecordedTopic,
    qos_profiles,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.foundation.signals import Stop
    from tfcompose.model.plan.topics import Topics
    from tfcompose.tools.rebag.correction import TFCorrection
    from tfcompose.tools.rebag.messages import MessageEditor


class InterruptedRewrite(Exception):  # noqa: N818 (a signal is no error)
    """Raised if a signal ends the work before the bag is complete."""


#: A function from the bytes of a message to the corrected bytes; None removes the message.
Edit = Callable[[bytes], "bytes | None"]


@dataclass
class Rewrite:
    """All changes of a bag, across all its files."""

    corrections: Mapping[Topics, TFCorrection]
    messages: MessageEditor
    #: Text entries for the metadata of the new bag.
    provenance: Mapping[str, str]
    #: Tells if a signal has ended the work.
    stop: Stop
    metadata_version: int = QOS_BY_WORDS
    #: The QoS of each topic's publishers, in the format of the bag.
    qos: dict[str, str] = field(default_factory=dict)
    #: The types of each topic of the bag; an empty one is unknown.
    types: dict[str, set[str]] = field(default_factory=dict)
    #: A function that decompresses a message, if the bag compresses each message separately.
    expand: Callable[[bytes], bytes] | None = None
    #: A function that compresses a message in such a bag.
    compress: Callable[[bytes], bytes] | None = None
    #: The number of messages that could not be decoded, by topic. They are copied without a
    #: change.
    malformed: Counter[str] = field(default_factory=Counter)

    def go_on(self) -> None:
        """Do nothing, unless a signal came.

        Raises:
            InterruptedRewrite: if a signal came.
        """
        if self.stop.requested:
            raise InterruptedRewrite

    def qos_of(self, topic: str) -> str:
        """Return the QoS of a fixed topic's publishers in the bag; if unknown, tf2's QoS."""
        recorded = self.qos.get(topic)
        if recorded is not None:
            return recorded
        return str(yaml.safe_dump(qos_profiles(self.metadata_version), sort_keys=False)).strip()

    def edit_of(self, channel: RecordedTopic) -> Edit | None:
        """Return a function that changes the messages of a channel; None if none changes."""
        edit = self._tf_edit_of(channel) or self.messages.editor_of(channel)
        if edit is None:
            return None
        if self.expand is None or self.compress is None:
            return self._tolerant(edit, channel.topic)
        expand, compress = self.expand, self.compress

        def edit_compressed(data: bytes) -> bytes | None:
            before = expand(data)
            after = edit(before)
            if after is None or after is before:
                return None if after is None else data
            return compress(after)

        return self._tolerant(edit_compressed, channel.topic)

    def _tolerant(self, edit: Edit, topic: str) -> Edit:
        """Return a function that counts a message that cannot be decoded, and keeps it."""

        def tolerant(data: bytes) -> bytes | None:
            try:
                return edit(data)
            except ValueError:
                self.malformed[topic] += 1
                return data

        return tolerant

    def openings(self, stamp_ns: int) -> list[tuple[RecordedTopic, bytes]]:
        """Return the messages with which a file begins, stamped with a time in nanoseconds."""
        messages = []
        for (_, static_topic), correction in self.corrections.items():
            data = correction.opening(stamp_ns)
            if data is not None:
                channel = RecordedTopic(static_topic, TF_MESSAGE, "ros2msg", TF_DEFINITION)
                messages.append((channel, self.compress(data) if self.compress else data))
        return messages

    def tf_edit_of(self, channel: RecordedTopic) -> Edit | None:
        """Return a function that changes the TFMessages of a channel; None if none changes.

        The messages are not compressed.
        """
        edit = self._tf_edit_of(channel)
        return edit and self._tolerant(edit, channel.topic)

    def _tf_edit_of(self, channel: RecordedTopic) -> Edit | None:
        for topics, correction in self.corrections.items():
            if channel.topic in topics and channel.type == TF_MESSAGE:
                return partial(correction.corrected, static=channel.topic == topics[1])
        return None
