from __future__ import annotations

import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.ros

#: Leaves a node whose leaving takes 30 s, in C, with the interpreter's lock kept.
STUCK = """
import ctypes
from contextlib import contextmanager
from pathlib import Path
from tfcompose.plan import Plan, PlanProcess, RosSettings
from tfcompose.run import leave
from tfcompose.run.own import Own
@contextmanager
def stuck(*_, **__):
    yield None
    ctypes.PyDLL(None).sleep(30)
leave.open_node = stuck
process = PlanProcess("static", "static")
with leave.node_of(Own(Plan("r", "0", None, RosSettings(), (), (process,)), process, Path("plan.json"), ())):
    print("in", flush=True)
"""


def test_a_process_that_ros_does_not_let_go_ends_all_the_same() -> None:
    with subprocess.Popen([sys.executable, "-c", STUCK], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        assert process.stdout.readline() == "in\n"
        began = time.monotonic()
        assert process.wait(20) == 1
        assert time.monotonic() - began < 10


def test_a_process_that_leaves_in_time_is_not_ended() -> None:
    quick = STUCK.replace("sleep(30)", "sleep(0)") + "import time; time.sleep(leave.LEAVE_S + 0.5); print('on')\n"
    assert subprocess.check_output([sys.executable, "-c", quick], text=True, timeout=30) == "in\non\n"
