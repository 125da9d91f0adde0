"""Real nodes on a stage, and the doctor who looks at them."""

from __future__ import annotations

import contextlib
import json
import sys
import threading
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from tests.support import processes
from tfcompose.ros.node import TFPublisher, open_node
from tfcompose.ros.tf_codec import Transform, encode
from tfcompose.ros.typesupport import tf_message_type

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

IDENTITY = (0.0, 0.0, 0.0, 1.0)
#: So long it is looked, again and again: where much else runs, publishers are found late, and late in truth.
LOOKS_S = (3.0, 3.0, 3.0, 6.0, 12.0)


class Stage:
    """Nodes that publish, until the test is over."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._jobs: list[tuple[float, Callable[[int], None]]] = []
        self._over = threading.Event()
        self._threads: list[threading.Thread] = []

    def node(self, name: str, namespace: str = "") -> Any:
        return self._stack.enter_context(open_node(name, namespace))

    def fixed(self, node: Any, *edges: str, topic: str = "/tf_static", x: float = 0.0) -> None:
        self.keep(TFPublisher(node, static=True, topic=topic)).publish(message(0, edges, x))

    def latched(self, node: Any, *transforms: tuple[str, str, Any, Any]) -> None:
        """Latch (parent, child, xyz, quaternion x y z w) as one message."""
        data = encode([Transform(0, *each) for each in transforms])
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

    def typed(self, node: Any, kind: Any, topic: str, make: Callable[[int], Any], hz: float = 20.0) -> None:
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
    return encode([Transform(stamp_ns, parent, child, (x, 0.0, 0.0), quat) for parent, child in pairs])


def doctor(*words: str, seconds: float = 3.0) -> tuple[int, list[dict[str, Any]]]:
    """Run it, and return the exit code and the findings."""
    command = [sys.executable, "-m", "tfcompose", "doctor", "--for", str(seconds), "--format", "json", *words]
    done = processes.run(command)
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, json.loads(done.stdout)


def doctor_finds(code: str, words: Sequence[str], others: set[str], *arguments: str) -> list[dict[str, Any]]:
    """Run it until it finds that code in those words, and no codes but the others; a few times: names may come late."""
    for seconds in LOOKS_S:
        exit_code, found = doctor(*arguments, seconds=seconds)
        if says(found, code, words, others):
            break
    assert exit_code == 1
    return found


def finds_nothing(*words: str) -> bool:
    """Look until nothing is found, a few times."""
    return any(doctor(*words, seconds=seconds) == (0, []) for seconds in LOOKS_S)


def at_last(claim: Callable[[float], None]) -> None:
    """Let the claim about what is seen in so many seconds hold once, of a few times that are longer and longer."""
    for seconds in LOOKS_S[:-1]:
        with contextlib.suppress(AssertionError):
            return claim(seconds)
    return claim(LOOKS_S[-1])


def says(found: list[dict[str, Any]], code: str, words: Sequence[str], others: set[str]) -> bool:
    """Return whether that code was found, said in all these words, and no codes but the others."""
    codes = {one["code"] for one in found}
    return code in codes and codes <= {code, *others} and all(word in said(found, code) for word in words)


def said(found: list[dict[str, Any]], code: str) -> str:
    """Return all that was said of that code."""
    assert code in {one["code"] for one in found}, found
    parts = [one for one in found if one["code"] == code]
    return "\n".join(
        "\n".join([one["message"], *(note["message"] for note in one["notes"]), one["help"]]) for one in parts
    )
