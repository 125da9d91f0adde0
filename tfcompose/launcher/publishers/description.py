"""The robot description: latched, and compared with descriptions from other nodes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from tfcompose.model.files import with_absolute_addresses
from tfcompose.tf.process import say
from tfcompose.tf.ros.graph import BARE_DDS, UNKNOWN_NODE, writers
from tfcompose.tf.ros.node import LATCHED, TextSubscription, latch

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.tf.process import Own

TOPIC = "robot_description"
#: Period of a process's checks while it waits for something, in seconds.
CHECK_EVERY_S = 0.5
_MOST_NAMED = 16
_NAMED_WITHIN_S = 3.0


class DescriptionPublisher:
    """The plan's description, published for all subscribers while this object lives.

    The plan says what moves and who publishes it, so another description on the topic changes
    nothing here. But subscribers of the topic take the newest one, so the process warns about it.
    """

    def __init__(self, own: Own, node: Node) -> None:
        self._node = node
        self._publisher: Any = None
        self._named: set[bytes | None] = set()
        self._unnamed: dict[bytes | None, float] = {}
        try:
            text = own.description.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            say(f"no robot_description: {error}")
            self._text = ""
        else:
            self._text = with_absolute_addresses(text, own.description.parent)
            self._publisher = latch(node, TOPIC, self._text)
        self.subscription = TextSubscription(node, TOPIC, LATCHED)

    @property
    def is_waiting(self) -> bool:
        """Whether ``check`` should be called again soon.

        A publisher is discovered before its node's name is.
        """
        return bool(self._unnamed)

    def check(self) -> None:
        """Read new messages, and warn once about each publisher of another description."""
        for received, text in self.subscription.take_texts():
            if (
                text != self._text
                and received.gid not in self._named
                and len(self._named) < _MOST_NAMED
            ):
                self._named.add(received.gid)
                self._unnamed[received.gid] = time.monotonic() + _NAMED_WITHIN_S
        for gid, end in list(self._unnamed.items()):
            name = self._name(gid)
            if name is not None or time.monotonic() > end:
                del self._unnamed[gid]
                say(
                    f"{name or 'a node without a name'} publishes another"
                    f" {self.subscription.topic}, and readers use the newest; TF keeps following"
                    " the plan (to change TF, edit the robot file and restart)"
                )

    def _name(self, gid: bytes | None) -> str | None:
        names = [
            writer.node
            for writer in writers(self._node, self.subscription.topic)
            if writer.gid == gid
        ]
        return names[0] if names and names[0] not in {UNKNOWN_NODE, BARE_DDS} else None
