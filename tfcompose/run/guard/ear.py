"""What the guard hears on a pair of TF topics, and on those that processes are remapped to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.ros.node import TFSubscription
from tfcompose.run.guard.neighbours import id_of_topic

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rclpy.node import Node

    from tfcompose.ros.node import Received

    Topics = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Heard:
    """A message, the kind of its topic, and whose own topic that is; empty: it is everybody's."""

    received: Received
    static: bool
    process: str = ""


class Ear:
    """Subscriptions to everybody's topics (moving, fixed), and to the processes' own; ``own`` are ids not to hear."""

    def __init__(self, node: Node, topics: Topics, private: Mapping[str, Topics]) -> None:
        self.own: set[bytes | None] = set()
        self._subscriptions = [
            (TFSubscription(node, static=static, topic=pair[static], deep=True), static, process)
            for process, pair in [("", topics), *private.items()]
            for static in (True, False)
        ]

    @property
    def subscriptions(self) -> list[TFSubscription]:
        """What is waited for."""
        return [subscription for subscription, *_ in self._subscriptions]

    def take(self) -> Iterator[Heard]:
        """Yield what has come, but from oneself.

        What comes on a process's own topic is of that process, also where the rmw does not say whose it is. On others
        the id that it has instead stands for its sender.
        """
        for subscription, static, process in self._subscriptions:
            for received in subscription.take():
                if received.raw_gid in self.own and received.raw_gid is not None:
                    continue
                gid = received.gid or (id_of_topic(subscription.topic) if process else received.raw_gid)
                yield Heard(received if gid == received.gid else replace(received, gid=gid), static, process)
