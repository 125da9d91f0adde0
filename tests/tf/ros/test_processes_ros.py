"""Processes that have joined ROS, and those that have only loaded it."""

import subprocess
import sys

import pytest

from tests.support import processes
from tfcompose.tf.ros.processes import ros_processes

pytestmark = pytest.mark.ros

#: A launcher has loaded this for those that it forks.
LOADED = "from tfcompose.launcher.program import load_shared\nload_shared()\n"
JOINED = "from tfcompose.tf.ros.node import open_node\nopen_node('joined', '').__enter__()\n"
WAITS = "print('there', flush=True)\nsys.stdin.read()\nos._exit(0)\n"


@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize(("code", "has_joined"), [(LOADED, False), (JOINED, True)])
def test_a_process_that_has_only_loaded_ros_is_none_of_its_processes(
    code: str, *, has_joined: bool
) -> None:
    command = [sys.executable, "-c", f"import os, sys\n{code}{WAITS}"]
    with processes.start(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout
        assert process.stdout.readline() == "there\n"
        assert (process.pid in {pid for pid, _, _ in ros_processes()}) is has_joined
        processes.end(process)
