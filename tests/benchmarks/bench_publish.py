"""What it costs to publish 500 edges.

``python tests/benchmarks/bench_publish.py``, or name the file to pytest.
"""

from __future__ import annotations

import os
import sys
import time

import pytest

from tfcompose.foundation.geometry import Pose

EDGES = 500
MESSAGES = 2000
LIMIT_US = 50.0
DOMAIN = "101"


def measure() -> dict[str, float]:
    """Return the microseconds that a message of ``EDGES`` edges costs, by step."""
    # After ROS's variables are set.
    from tfcompose.tf.ros.node import TFPublisher, open_node  # noqa: PLC0415
    from tfcompose.tf.ros.tf_codec import Template  # noqa: PLC0415 (after ROS's variables are set)

    pose = Pose((1.0, 2.0, 3.0))
    template = Template([(f"frame_{n}", f"frame_{n + 1}") for n in range(EDGES)])
    with open_node("bench", "/bench") as node:
        publisher = TFPublisher(node, static=False)
        marks = dict.fromkeys(("set_pose", "set_stamp", "data", "publish"), 0.0)
        for stamp in range(MESSAGES):
            times = [time.perf_counter()]
            for index in range(EDGES):
                template.set_pose(index, pose)
            times.append(time.perf_counter())
            template.set_stamp(stamp)
            times.append(time.perf_counter())
            data = template.data
            times.append(time.perf_counter())
            publisher.publish(data)
            times.append(time.perf_counter())
            for index, name in enumerate(marks):
                marks[name] += times[index + 1] - times[index]
    return {name: 1e6 * seconds / MESSAGES for name, seconds in marks.items()}


@pytest.mark.ros
def test_publishing_500_edges_by_template_bytes_costs_under_50_us(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", DOMAIN)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    found = measure()
    assert found["set_stamp"] + found["data"] + found["publish"] < LIMIT_US, found


if __name__ == "__main__":
    os.environ.update(ROS_DOMAIN_ID=DOMAIN, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
    for name, microseconds in measure().items():
        sys.stdout.write(f"{name:10} {microseconds:8.1f} µs for {EDGES} edges\n")
