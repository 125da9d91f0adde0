"""Running stock publishers of fixed edges: adopted, guarded, and handed over one by one."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.support import processes
from tests.support.adoption import hand_over_first, status_of
from tests.support.doctor import at_last
from tests.support.plans import compiled_plan
from tests.support.processes import Started
from tfcompose.launcher.program import HERE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.support.domains import Domain

PROGRAM = next(
    (
        program
        for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
        if (program := Path(prefix, "lib/tf2_ros/static_transform_publisher")).is_file()
    ),
    None,
)
pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.skipif(PROGRAM is None, reason="there is no static_transform_publisher"),
]
ROBOT = "robot.yaml"
#: The arguments of each publisher, by the child of its edge. That of imu has no name.
PUBLISHED = {
    "gnss": "--x -0.2 --qz 0.6 --qw 0.8 --frame-id base_link --child-frame-id gnss"
    " --ros-args -r __node:=gnss_tf -r __ns:=/front",
    "imu": "--x 0.2 --roll 0.1 --pitch -0.2 --frame-id base_link --child-frame-id imu",
    "lidar": "--z 0.3 --yaw 0.5 --frame-id gnss --child-frame-id lidar"
    " --ros-args -r __node:=lidar_tf",
}
EXACT = ("--tolerance", "0.000001mm,0.0000001deg")


@pytest.fixture
def publishers(domain: Domain) -> Iterator[dict[str, Started]]:
    """The running publishers, by the children of their edges."""
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    running = {
        child: Started(
            processes.start([str(PROGRAM), *text.split()], env=domain.environment, **silent)
        )
        for child, text in PUBLISHED.items()
    }
    yield running
    for publisher in running.values():
        publisher.close()


def test_running_publishers_are_adopted_guarded_and_handed_over(
    publishers: dict[str, Started], domain: Domain, tmp_path: Path
) -> None:
    def run(*arguments: str) -> None:
        done = processes.run([*HERE, *arguments], cwd=tmp_path, env=domain.environment)
        assert done.returncode == 0, done.stdout + done.stderr

    def is_adopted(seconds: float) -> None:
        run("adopt", "--live", "--for", str(seconds), "-o", ROBOT, "--force")
        run("verify", ROBOT, *EXACT, "--for", str(seconds))
        plan = compiled_plan((tmp_path / ROBOT).read_text("utf-8"))
        nodes = {edge.child: edge.node for edge in plan.edges}
        assert nodes.pop("imu").startswith("/static_transform_publisher_")
        assert nodes == {"gnss": "/front/gnss_tf", "lidar": "/lidar_tf"}

    at_last(is_adopted)
    before = tree_of(tmp_path)
    with_each_step = ["guard", "up", "up", "up"]
    for command in with_each_step:
        if command == "up":
            edge = hand_over_first(tmp_path, ROBOT).partition(":")[0]
            publishers.pop(edge.rpartition(" ")[2]).close()
            assert tree_of(tmp_path) == before
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        robot = Started(
            processes.start([*HERE, command, ROBOT], cwd=tmp_path, env=domain.environment, **pipes)
        )
        try:
            robot.until_says("tree complete: 3 edges")
            run("verify", ROBOT, *EXACT, "--for", "3")
            assert robot.end() == 0, robot.output
        finally:
            robot.close()
        assert "error[" not in robot.output
    assert not publishers
    assert len(status_of(tmp_path, ROBOT)) == 1  # and no edit


def tree_of(folder: Path) -> dict[str, tuple[str, object]]:
    plan = compiled_plan((folder / ROBOT).read_text("utf-8"))
    return {edge.child: (edge.parent, edge.pose) for edge in plan.edges}
