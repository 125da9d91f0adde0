"""rcl reads from the built file what it reads from the user's own, value by value."""

import json
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain

pytestmark = pytest.mark.ros

FILE = """
/planner:
  ros__parameters:
    flag: on
    off_flag: no
    count: 012
    mask: 0x1F
    gain: 1e-3
    far: .inf
    half: .5
    word: hello
    quoted: "on"
    digits: "7"
    names: [base, "7", tail]
    numbers: [1, 2, 3]
    floats: [1.5, 2.0]
    deep: {inner: {value: yes}}
costmap/costmap:
  ros__parameters: {radius: 0.3, both: 1}
/**:
  ros__parameters: {both: 2}
"""
READER = """
import json, rclpy, sys

from tests.support import processes
rclpy.init(args=["--ros-args", "--params-file", sys.argv[1]])
given = {"allow_undeclared_parameters": True, "automatically_declare_parameters_from_overrides": True}
node = rclpy.create_node(sys.argv[2], namespace=sys.argv[3], **given)
read = {name: repr(p.value) for name, p in node.get_parameters_by_prefix("").items() if name != "use_sim_time"}
print(json.dumps(read, sort_keys=True))
node.destroy_node()
rclpy.shutdown()
"""  # noqa: E501 (a text as its reader has it)
ROBOT = """
tfcompose: 1
robot: r
frames: {base_link: {}}
processes: {planner: {run: {package: p, executable: e}, params: {file: mine.yaml}}}
"""


def test_rcl_reads_the_same_values_from_the_built_file(tmp_path: Path, domain: Domain) -> None:
    (tmp_path / "mine.yaml").write_text(FILE, encoding="utf-8")
    (tmp_path / "r.yaml").write_text(ROBOT, encoding="utf-8")
    build = [sys.executable, "-m", "tfcompose", "build", "r.yaml", "-o", "out"]
    processes.run(build, cwd=tmp_path, check=True)

    def read(file: Path, name: str = "planner", namespace: str = "/") -> dict[str, str]:
        command = [sys.executable, "-W", "ignore", "-c", READER, str(file), name, namespace]
        done = processes.run(command, env=dict(domain.environment), check=True)
        values: dict[str, str] = json.loads(done.stdout.splitlines()[-1])
        return values

    mine = read(tmp_path / "mine.yaml")
    assert mine["flag"] == "True"
    built = tmp_path / "out" / "params" / "planner.yaml"
    assert read(built) == mine
    node = ("costmap", "/costmap")
    assert read(built, *node) == read(tmp_path / "mine.yaml", *node)
    assert read(built, *node)["radius"] == "0.3"
