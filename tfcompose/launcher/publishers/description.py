"""The robot description: published latched, and compared with descriptions from other nodes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from tfcompose.model.files import with_absolute_addresses
from tfcompose.tf.process import say
from tfcompose.tf.ros.graph import BARE_DDS, UNKNOWN_NODE, gid_of, writers
from tfcompose.tf.ros.node import LATCHED, TextSubscription, latch, send_text

if TYPE_CHECKING:
    from rclpy.node import Node

    from tfcompose.tf.process import OwnProcess
    from tfcompose.tf.ros.node import Received

TOPIC = "robot_description"
#: Interval between checks while a process waits, in seconds.
CHECK_EVERY_S = 0.5
_MOST_NAMED = 16
_NAMED_WITHIN_S = 3.0


class DescriptionPublisher:
    """Publisher of the plan's robot description, for as long as the object exists.

    Publishers of TF follow the plan, so another description on the topic does not affect them. But
    subscribers use the newest description, so the process warns about other publishers.
    """

    def __init__(self, own_process: OwnProcess, node: Node) -> None:
        self._node = node
        self._publisher: Any = None
        self._named: set[bytes | None] = set()
        self._unnamed: dict[bytes | None, float] = {}
        self._text = ""
        self.follow(own_process)
        self.subscription = TextSubscription(node, TOPIC, LATCHED)

    def follow(self, own_process: OwnProcess) -> None:
        """Publish the description of the process's plan, if it differs from the last one."""
        try:
            text = own_process.description.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            say(f"no robot_description: {error}")
            return
        before, self._text = (
            self._text,
            with_absolute_addresses(text, own_process.description.parent),
        )
        if self._publisher is None:
            self._publisher = latch(self._node, TOPIC, self._text)
        elif self._text != before:
            send_text(self._publisher, self._text)

    @property
    def is_waiting(self) -> bool:
        """Whether ``check`` should be called again soon.

        The name of a publisher's node is discovered later than the publisher.
        """
        return bool(self._unnamed)

    def check(self) -> None:
        """Read new messages. Warn once about each publisher of a different description."""
        for received, text in self.subscription.take_texts():
            if (
                text != self._text
                and not self._is_own(received)
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

    def _is_own(self, received: Received) -> bool:
        """Return whether this object published it: the text before the current one."""
        return self._publisher is not None and received.raw_gid == gid_of(self._publisher)

    def _name(self, gid: bytes | None) -> str | None:
        names = [
            writer.node
            for writer in writers(self._node, self.subscription.topic)
            if writer.gid == gid
        ]
        return names[0] if names and names[0] not in {UNKNOWN_NODE, BARE_DDS} else None
