"""Programs of a strict plan with a cleared environment, outside of its isolation."""

import json
import os
import shlex
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain
from tests.support.waiting import gone, until
from tfcompose.launcher.program import HERE

pytestmark = pytest.mark.ros

NODE = """
import sys, time
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher, open_node
with open_node(sys.argv[1], "/") as node:
    sent = TFPublisher(node, static=False)
    while True:
        edge = SentTransform(time.time_ns(), *sys.argv[2:], (0.1, 0.2, 0.3), (0.0, 0.0, 0.0, 1.0))
        sent.publish(encode([edge]))
        time.sleep(0.05)
"""
ROBOT = """
tfcompose: 1
robot: fenced
ros: {{discovery: localhost}}
frames:
  base_link: {{}}
  hand: {{parent: base_link, owner: replaced, rate: 20 Hz}}
  foot: {{parent: base_link, owner: forked, rate: 20 Hz}}
processes:
  replaced: {{run: [sh, -c, {replaced}], required: false}}
  forked: {{run: [sh, -c, {forked}], required: false}}
guard: {{mode: strict}}
"""


def test_a_process_of_the_plan_is_stopped_and_what_it_forked_is_named(
    domain: Domain, tmp_path: Path
) -> None:
    (tmp_path / "node.py").write_text(NODE, encoding="utf-8")
    words = [f"{key}={value}" for key, value in domain.environment.items() if key[:4] == "ROS_"]
    cleared = shlex.join(["env", "-i", f"HOME={tmp_path}", *words])
    node = shlex.join([sys.executable, str(tmp_path / "node.py")])
    text = ROBOT.format(
        replaced=json.dumps(f"exec {cleared} {node} replaced base_link hand"),
        forked=json.dumps(f"{cleared} {node} forked base_link foot & echo is $!; wait"),
    )
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    output = tmp_path / "output.txt"
    with output.open("wb") as out:
        up = processes.start(
            [*HERE, "up"],
            cwd=tmp_path,
            stdout=out,
            stderr=out,
            env={**os.environ, **domain.environment},
        )

    def says(*texts: str) -> bool:
        return all(text in output.read_text("utf-8") for text in texts)

    assert until(lambda: says("replaced is stopped and not restarted"), 60), output.read_text()
    assert until(lambda: says("nothing is stopped: a process of the plan started it"), 60)
    assert output.read_text("utf-8").count("error[TF852]") == 2
    pid = int(output.read_text("utf-8").partition("| is ")[2].split()[0])
    assert says(f"kill {pid} ends it")
    processes.end(up)
    assert until(lambda: gone(pid))
