"""Time that publishing a message of many edges takes."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS
from tfcompose.foundation.geometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tests.benchmarks.benchmark import Sampler, Workspace

EDGES, MESSAGES = 500, 500


@contextmanager
def publisher(workspace: Workspace) -> Iterator[Sampler]:
    """Open a node that publishes ready templates."""
    # After ROS's variables are set.
    from tfcompose.tf.ros.node import TFPublisher, open_node  # noqa: PLC0415
    from tfcompose.tf.ros.tf_codec import Template  # noqa: PLC0415 (the same)

    pose = Pose((1.0, 2.0, 3.0))
    template = Template([(f"frame_{n}", f"frame_{n + 1}") for n in range(EDGES)])
    with workspace.entered(), open_node("bench", "/bench") as node:
        sender = TFPublisher(node, static=False)

        def sample() -> Mapping[str, float]:
            poses_s = publish_s = 0.0
            for stamp_ns in range(MESSAGES):
                began = time.perf_counter()
                for index in range(EDGES):
                    template.set_pose(index, pose)
                filled = time.perf_counter()
                template.set_stamp(stamp_ns)
                sender.publish(template.data)
                poses_s += filled - began
                publish_s += time.perf_counter() - filled
            return {"poses": 1e6 * poses_s / MESSAGES, "publish": 1e6 * publish_s / MESSAGES}

        yield sample


BENCHMARK = Benchmark(
    name="publish",
    about=f"a message of {EDGES} edges whose names are ready as bytes",
    rows={
        "poses": Row(f"{EDGES} poses are filled in within", "µs"),
        "publish": Row(
            "… stamped and handed to the middleware within", "µs", (Limit(50.0, "least"),)
        ),
    },
    contenders={TFCOMPOSE_ON_ROS: publisher},
    runs=9,
)
