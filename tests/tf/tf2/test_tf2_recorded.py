"""The buffer answers as tf2's BufferCore did to the same histories and questions.

``tf2_answers.jsonl`` holds them, a step a line, since PyPI has no tf2. Where ``tf2_py`` is
installed, ``python tests/tf/tf2/test_tf2_recorded.py`` asks it anew.
"""

import json
import random
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import pytest

from tfcompose.foundation.geometry import angle_between, normalise
from tfcompose.tf.tf2 import Buffer, TransformException

FILE = Path(__file__).with_name("tf2_answers.jsonl")
S = 1_000_000_000
HISTORIES, STEPS = 12, 80

#: A step: what is done, with what, and tf2's answer: the time and seven numbers, or the
#: exception's name.
Step = tuple[str, list[Any], Any]


def histories() -> list[list[Step]]:
    steps = [json.loads(line) for line in FILE.read_text("utf-8").splitlines()]
    return [
        [tuple(step) for step in some]
        for new, some in groupby(steps, lambda step: step[0] == "new")
        if not new
    ]


@pytest.mark.parametrize("index", range(HISTORIES))
def test_a_recorded_history_has_the_recorded_answers(index: int) -> None:
    buffer = Buffer()
    for what, arguments, answer in histories()[index]:
        if what == "set":
            stamp_ns, static, *row = arguments
            buffer.insert([(row[0], row[1], *divmod(stamp_ns, S), *row[2:])], static=static)
        elif what == "clear":
            buffer.clear()
        else:
            assert_same(ask(buffer, what, arguments), answer)


def ask(buffer: Buffer, what: str, arguments: list[Any]) -> Any:
    try:
        call = buffer.lookup_transform if what == "lookup" else buffer.lookup_transform_full
        return packed(call(*arguments))
    except TransformException as error:
        return type(error).__name__


def packed(stamped: Any) -> list[float]:
    to, rotated, stamp = (
        stamped.transform.translation,
        stamped.transform.rotation,
        stamped.header.stamp,
    )
    return [
        stamp.sec * S + stamp.nanosec,
        to.x,
        to.y,
        to.z,
        rotated.x,
        rotated.y,
        rotated.z,
        rotated.w,
    ]


def assert_same(ours: Any, theirs: Any) -> None:
    if isinstance(ours, str) or isinstance(theirs, str):
        assert ours == theirs
        return
    assert ours[0] == theirs[0], "the time of the answer"
    assert ours[1:4] == pytest.approx(theirs[1:4], abs=1e-5)
    assert angle_between(normalise(ours[4:]), normalise(theirs[4:])) < 1e-4


def made(rng: random.Random) -> list[tuple[str, list[Any]]]:
    """Return random steps; some histories have times that come twice, some have loops."""
    frames = [f"f{index}" for index in range(rng.choice([3, 5, 7]))]
    grid_ns, loops = rng.choice([1000, S]), rng.random() < 0.3
    steps: list[tuple[str, list[Any]]] = []
    for _ in range(STEPS):
        parent, child, fixed = (rng.choice(frames) for _ in range(3))
        stamps = [
            rng.randrange(S, 16 * S) // grid_ns * grid_ns if rng.random() < 0.9 else 0
            for _ in range(2)
        ]
        what = rng.random()
        if what < 0.5:
            parent, child = (parent, child) if loops else sorted((parent, child))
            quat = normalise((rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1)))
            pose = [rng.uniform(-5, 5), rng.uniform(-5, 5), 0.0, *quat]
            static = (frames.index(child) % 3 == 0) is not (rng.random() < 0.02)
            names = [rng.choice(["", "", "", "/"]) + parent, child if rng.random() < 0.98 else ""]
            steps.append(
                ("set", [stamps[0], static, *names, *(round(number, 5) for number in pose)])
            )
        elif what < 0.51:
            steps.append(("clear", []))
        elif what < 0.9:
            steps.append(
                ("lookup", [rng.choice([*[parent] * 9, "nobody", "", "/f0"]), child, stamps[0]])
            )
        else:
            steps.append(("lookup_full", [parent, stamps[0], child, stamps[1], fixed]))
    return steps


def record() -> None:
    """Write the file anew, with tf2's answers."""
    import tf2_py as tf2  # noqa: PLC0415 (it is only needed here)
    from geometry_msgs.msg import TransformStamped  # noqa: PLC0415 (the same)
    from rclpy.time import Time  # noqa: PLC0415 (the same)

    def answer(buffer: Any, what: str, arguments: list[Any]) -> Any:
        if what == "clear":
            return buffer.clear()
        if what == "set":
            stamp_ns, static, *row = arguments
            message = TransformStamped()
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, S)
            message.header.frame_id, message.child_frame_id = row[:2]
            to, rotated = message.transform.translation, message.transform.rotation
            to.x, to.y, to.z, rotated.x, rotated.y, rotated.z, rotated.w = row[2:]
            return (buffer.set_transform_static if static else buffer.set_transform)(
                message, "recorded"
            )
        times = [Time(nanoseconds=each) if isinstance(each, int) else each for each in arguments]
        try:
            numbers = packed(
                getattr(buffer, f"{what}_core".replace("lookup", "lookup_transform"))(*times)
            )
        except tf2.TransformException as error:
            return type(error).__name__
        return [round(number, 6) for number in numbers]

    lines = []
    for seed in range(HISTORIES):
        buffer = tf2.BufferCore()
        lines.append(["new", [seed], None])
        lines += [
            [what, arguments, answer(buffer, what, arguments)]
            for what, arguments in made(random.Random(seed))
        ]
    FILE.write_text(
        "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines), "utf-8"
    )
    sys.stdout.write(f"{len(lines)} steps in {FILE.name}\n")


if __name__ == "__main__":
    record()
