"""Real nodes that publish what a test wants."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from tfcompose.tf.ros.node import TFPublisher, open_node
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.typesupport import tf_message_type

IDENTITY = (0.0, 0.0, 0.0, 1.0)


class FakeNodes:
    """Nodes that publish, until the test is over."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._over = threading.Event()
        self._threads: list[threading.Thread] = []

    def node(self, name: str, namespace: str = "") -> Any:
        return self._stack.enter_context(open_node(name, namespace))

    def fixed(self, node: Any, *edges: str, topic: str = "/tf_static", x: float = 0.0) -> None:
        self.keep(TFPublisher(node, static=True, topic=topic)).publish(message(0, edges, x))

    def latched(self, node: Any, *transforms: tuple[str, str, Any, Any]) -> None:
        """Latch (parent, child, xyz, quaternion x y z w) as one message."""
        data = encode([SentTransform(0, *transform) for transform in transforms])
        self.keep(TFPublisher(node, static=True)).publish(data)

    def moving(
        self,
        node: Any,
        *edges: str,
        hz: float = 30.0,
        stamp: Callable[[int], int] = lambda now: now,
        topic: str = "/tf",
        quat: tuple[float, float, float, float] = IDENTITY,
    ) -> None:
        publisher = self.keep(TFPublisher(node, static=False, topic=topic))
        self.every(hz, lambda now: publisher.publish(message(stamp(now), edges, quat=quat)))

    def odd(self, node: Any, *edges: str, topic: str, profile: Any) -> None:
        """Publish with other settings than TF has."""
        publisher = self.keep(node.create_publisher(tf_message_type(), topic, profile))
        self.every(10, lambda now: publisher.publish(message(now, edges)))

    def typed(
        self, node: Any, kind: Any, topic: str, make: Callable[[int], Any], hz: float = 20.0
    ) -> None:
        publisher = self.keep(node.create_publisher(kind, topic, 10))
        self.every(hz, lambda now: publisher.publish(make(now)))

    def every(self, hz: float, job: Callable[[int], None]) -> None:
        def run() -> None:
            while not self._over.wait(1 / hz):
                job(time.time_ns())

        self._threads.append(threading.Thread(target=run))
        self._threads[-1].start()

    def keep(self, thing: Any) -> Any:
        self._stack.callback(lambda: thing)
        return thing

    def close(self) -> None:
        self._over.set()
        for thread in self._threads:
            thread.join()
        self._stack.close()


def message(stamp_ns: int, edges: tuple[str, ...], x: float = 0.0, quat: Any = IDENTITY) -> bytes:
    pairs = [edge.split() for edge in edges]
    return encode(
        [SentTransform(stamp_ns, parent, child, (x, 0.0, 0.0), quat) for parent, child in pairs]
    )


@contextmanager
def sending(  # noqa: PLR0913 (all but three are named)
    name: str,
    parent: str,
    child: str,
    *,
    rate: float,
    late_s: float = 0.0,
    topic: str = "/tf",
    bad: bytes = b"",
) -> Iterator[Callable[[], float]]:
    """Send an edge stamped ``late_s`` ago, and from time to time the ``bad`` message.

    Gives a function that returns the rate at which it was really sent so far.
    """
    over, sent = threading.Event(), 0

    def send() -> None:
        nonlocal sent
        due = begun
        while not over.wait(max(0.0, due - time.monotonic())):
            due += 1 / rate
            sent += 1
            stamp_ns = time.time_ns() - int(late_s * 1e9)
            publisher.publish(
                encode([SentTransform(stamp_ns, parent, child, (1.0, 0.0, 0.0), IDENTITY)])
            )
            if bad:
                publisher.publish(bad)

    with open_node(name, "") as node:
        publisher = TFPublisher(node, static=False, topic=topic)
        thread, begun = threading.Thread(target=send), time.monotonic()
        thread.start()
        try:
            yield lambda: sent / (time.monotonic() - begun)
        finally:
            over.set()
            thread.join()
