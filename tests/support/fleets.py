"""Simulated robots of a fleet on loopback, each with a Zenoh router, and breakable links."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from typing_extensions import Self

from tests.support.zenoh_peers import free_port, session
from tfcompose.spec.load import load
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tools.fleet.share import EdgeSender
from tfcompose.tools.fleet.spec import validate_fleet

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.tools.fleet.spec import FleetSpec

_IDENTITY = (0.0, 0.0, 0.0, 1.0)


def fleet_text(routers: Mapping[str, str], rate: str = "20 Hz") -> str:
    """Return a fleet file whose robots share map → odom, fixed, and odom → base_link."""
    robots = "".join(f"  {name}: {{router: {router}}}\n" for name, router in routers.items())
    share = f"share: [map → odom, {{edge: odom -> base_link, rate: {rate}}}]"
    return f"fleet: 1\nname: tests\n{share}\nrobots:\n{robots}"


def fleet_of(routers: Mapping[str, str], rate: str = "20 Hz") -> FleetSpec:
    """Return that fleet."""
    return validate_fleet(load(fleet_text(routers, rate), "fleet.yaml"))


class SimulatedRobot:
    """What shares a robot's edges, given TF of the robot by a thread instead of ROS.

    It stands at ``x``, in metres.
    """

    def __init__(self, fleet: FleetSpec, name: str, x: float, rate_hz: float = 50.0) -> None:
        self._x = x
        self._period_s = 1 / rate_hz
        self.sender = EdgeSender(fleet, name, lambda _: None)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name)
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._ended.set()
        self._thread.join()
        self.sender.close()

    def _run(self) -> None:
        beat = 0.0
        fixed = SentTransform(0, "map", "odom", (self._x, 0.0, 0.0), _IDENTITY)
        self.sender.on_message(encode([fixed]), True)  # noqa: FBT003 (as the listener calls)
        while not self._ended.wait(self._period_s):
            if time.monotonic() >= beat:
                beat = time.monotonic() + 0.5
                self.sender.beat()
            moving = SentTransform(time.time_ns(), "odom", "base_link", (0.5, 0.0, 0.0), _IDENTITY)
            self.sender.on_message(encode([moving]), False)  # noqa: FBT003 (as the listener calls)


class RobotProcesses:
    """Robots r0, r1, … that are a process each, and one process of all their routers.

    ``text`` is the fleet's file; ``processes`` are the robots' by name.
    """

    def __init__(self, count: int, rate: str) -> None:
        ports = [str(free_port()) for _ in range(count)]
        routers = {f"r{number}": f"tcp/127.0.0.1:{port}" for number, port in enumerate(ports)}
        self.text = fleet_text(routers, rate)
        self.fleet = fleet_of(routers, rate)
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        """Start them."""
        with ExitStack() as stack:
            self._started(stack, "", [robot.router for robot in self.fleet.robots.values()])
            for name in self.fleet.robots:
                self.processes[name] = self._started(stack, name, [self.text])
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """End them; they end with their input."""
        self._stack.close()

    def kill(self, name: str) -> None:
        """Kill a robot."""
        self.processes[name].kill()

    def _started(self, stack: ExitStack, name: str, words: list[str]) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "tests.support.fleets", name, *words]
        return stack.enter_context(subprocess.Popen(command, stdin=subprocess.PIPE))


def _be(name: str, *words: str) -> None:
    """Be one robot of a fleet, or its routers without a name, until the input ends."""
    with ExitStack() as stack:
        if name:
            robot = SimulatedRobot(validate_fleet(load(words[0], "fleet.yaml")), name, 1.0)
            stack.callback(robot.close)
        else:
            for router in words:
                stack.enter_context(session("router", listen=[router]))
        sys.stdin.read()


class Link:
    """A network link to a router, as a port that passes on what comes, until it breaks.

    Then nothing passes.
    """

    def __init__(self, router: str) -> None:
        self._to = router.partition("/")[2].split(":")
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._listener.getsockname()[1]}"
        self._open: list[socket.socket] = []
        self.passes = threading.Event()
        self.passes.set()
        threading.Thread(target=self._accept, daemon=True).start()

    def break_(self) -> None:
        """Let nothing pass any more, and close no connection: as a cable that is pulled out."""
        self.passes.clear()

    def mend(self) -> None:
        """Let everything pass again."""
        self.passes.set()

    def close(self) -> None:
        """End all connections."""
        self.passes.set()
        for connection in (self._listener, *self._open):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            connection.close()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                far = socket.create_connection((self._to[0], int(self._to[1])))
                self._open += [near, far]
                for source, sink in ((near, far), (far, near)):
                    threading.Thread(
                        target=self._pass_on, args=(source, sink), daemon=True
                    ).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                self.passes.wait()
                sink.sendall(data)
        for connection in (source, sink):
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)


if __name__ == "__main__":
    _be(*sys.argv[1:])
