"""Whether an edge is really late: what a busy machine holds up is rightly blamed."""

import threading
from itertools import pairwise

from typing_extensions import Self

from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import TFSubscription, open_node, wait
from tfcompose.tf.ros.tf_codec import decode


class EdgeListener:
    """Hears a moving edge in a thread of its own, and when transform of its messages was sent."""

    def __init__(self, child: str) -> None:
        self._child = child
        self._stop = Stop()
        self._sent_ns: list[int] = []
        self._thread = threading.Thread(target=self._hear)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.request()
        self._thread.join()

    def longest_gap_s(self) -> float:
        """Return the longest time between two messages; infinite where nothing was heard."""
        return (
            max(
                (after - before for before, after in pairwise(self._sent_ns)), default=float("inf")
            )
            / 1e9
        )

    def _hear(self) -> None:
        with open_node("witness", "") as node:
            subscription = TFSubscription(node, static=False)
            while not self._stop.requested:
                wait(node, [subscription], 1.0, self._stop)
                for received in subscription.take():
                    if any(transform.child == self._child for transform in decode(received.data)):
                        self._sent_ns.append(received.source_ns)
