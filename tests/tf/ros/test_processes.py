"""Whose process a publisher's id is of, as /proc shows it."""

import os
import subprocess

from tests.support import processes
from tests.support.waiting import until
from tfcompose.tf.ros.processes import descent

#: An id begins with Fast DDS's vendor, the host, and the lower half of the process's number.
HOST = b"\x01\x0f\x12\x34"


def gid_of(pid: int, host: bytes = HOST) -> bytes:
    """Return the id of a publisher of that process."""
    return host + (pid % 65536).to_bytes(2, "little") + bytes(10)


def test_a_publishers_process_is_followed_up_to_the_child_of_its_launcher() -> None:
    code = "env -i setsid sleep 99 & echo $!; wait"
    with processes.start(["sh", "-c", code], stdout=subprocess.PIPE) as shell:
        assert shell.stdout
        pid, own_gid, launcher = int(shell.stdout.readline()), gid_of(os.getpid()), os.getpid()
        assert until(lambda: descent(gid_of(pid), own_gid, launcher)[-1:] == (shell.pid,))
        assert descent(gid_of(pid), own_gid, launcher)[0] == pid
        assert descent(gid_of(shell.pid), own_gid, launcher) == (shell.pid,)
        assert descent(gid_of(pid), own_gid, pid) == ()
        assert descent(gid_of(pid, b"\x01\x0f\x43\x21"), own_gid, launcher) == (), (
            "of another host"
        )
        assert descent(gid_of(pid, b"\x01\x10\x12\x34"), own_gid, launcher) == (), (
            "another vendor's"
        )
        processes.end(shell)
