"""Process that relays the TF messages of another one, with the faults of a case.

It begins as the process of the robot: it forks, and one of the two becomes the process's program,
which publishes on topics that only the other, the relay, reads. So the launcher and the guard see
the process with its name, its node and its topics. The relay gets the signals to the process's
group, and ends with the program.
"""

from __future__ import annotations

import os
import signal
import sys

from tfcompose.foundation.signals import SIGNALS, Stop
from tfcompose.launcher.child import end_with
from tfcompose.launcher.forking import show_as
from tfcompose.tools.treetest.relay_request import RelayRequest, published_topics, redirect


def main() -> int:
    """Fork the relay that the command line requests, and become the command that follows."""
    request = RelayRequest.read(sys.argv[1])
    argv = sys.argv[2:]
    program = os.getpid()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    if os.fork():
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        command, env = redirect(argv, os.environ, request)
        os.execvpe(command[0], command, env)  # noqa: S606 (the command of the plan)
    end_with(program, signal.SIGTERM)
    show_as(argv, os.environ)  # findings print the command of the process that they blame
    with Stop() as stop:
        # ROS, once signals are handled.
        from tfcompose.tools.treetest.relaying import relay  # noqa: PLC0415

        relay(request, published_topics(argv, request.published), stop)
    return 0
