import subprocess
import sys

from tests.support import processes

#: Leaves ROS for 2 minutes, in C, with the interpreter's lock kept.
STUCK = """
import ctypes
from tests.support import processes
from tfcompose.tf.ros.node import LEAVE_S, end_unless_done
print("in", flush=True)
with end_unless_done(LEAVE_S):
    ctypes.PyDLL(None).sleep(120)
"""


def test_a_process_that_ros_does_not_let_go_ends_all_the_same() -> None:
    with processes.start([sys.executable, "-c", STUCK], stdout=subprocess.PIPE) as process:
        assert process.stdout
        assert process.stdout.readline() == "in\n"
        assert process.wait(60) == 1


def test_a_process_that_leaves_in_time_is_not_ended() -> None:
    quick = (
        STUCK.replace("sleep(120)", "sleep(0)")
        + "import time; time.sleep(LEAVE_S + 0.5); print('on')\n"
    )
    assert processes.run([sys.executable, "-c", quick]).stdout == "in\non\n"
