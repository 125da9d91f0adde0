"""The browser view: first scene, a save, pages, and a live tree of many moving frames.

A program that reads what a browser would is connected.
"""

from __future__ import annotations

import re
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from subprocess import PIPE
from typing import TYPE_CHECKING

import msgspec
import psutil
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.benchmarks.benchmark import Benchmark, Limit, Row
from tests.benchmarks.contenders import TFCOMPOSE_ON_ROS
from tests.benchmarks.fixed_robot import PROGRAMS
from tests.benchmarks.measures import cpu_s, pss_mb
from tests.benchmarks.record import ROOT
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.foundation.geometry import Pose
from tfcompose.tools.view.session import Session

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from websockets.sync.client import ClientConnection

    from tests.benchmarks.benchmark import Sampler, Workspace

FRAMES, FRAMES_A_MESSAGE, RATE, DEPTH = 1000, 100, 20, 10
SETTLE_S, ROUND_S = 8.0, 5.0
#: The first message of a browser, at which viser counts it as connected.
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 0.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 480,
    "image_width": 640,
    "look_at": (1.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
ROVER = ROOT / "robots" / "field_rover.yaml"


@contextmanager
def view(workspace: Workspace) -> Iterator[Sampler]:
    """Watch a live tree during all rounds; start the other views anew in each."""
    with _live(workspace) as live:

        def sample() -> Mapping[str, float]:
            return {
                "first": _first_scene_s(workspace),
                "save": 1e3 * _save_s(workspace),
                "page": _page_kb(workspace),
                **live(),
            }

        yield sample


@contextmanager
def _started(workspace: Workspace, *arguments: str | Path) -> Iterator[tuple[int, str]]:
    """Run the view; yield its process number and the address of its websocket."""
    argv = (sys.executable, "-m", "tfcompose", "view", *arguments, "--port", "0")
    with workspace.running(*argv, stdout=PIPE) as process:
        assert process.stdout
        address = re.search(r"http(://\S+)", process.stdout.readline())
        assert address
        yield process.pid, f"ws{address[1]}"


def _connected(address: str) -> ClientConnection:
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    browser = connect(address, subprotocols=[protocol], max_size=None, open_timeout=30)
    browser.send(msgspec.msgpack.encode(CAMERA))
    return browser


@contextmanager
def _live(workspace: Workspace) -> Iterator[Sampler]:
    """Watch an owner's moving frames; yield what measures a round.

    Raises:
        RuntimeError: if a browser gets less than half of the updates.
    """
    parents = ["base" if number % DEPTH == 0 else f"f{number - 1}" for number in range(FRAMES)]
    frames = "".join(
        f"  f{number}: {{parent: {parent}, owner: owner, rate: {RATE} Hz}}\n"
        for number, parent in enumerate(parents)
    )
    file = workspace.folder / "live.yaml"
    file.write_text(
        "tfcompose: 1\nrobot: bench\nprocesses: {owner: {external: true, node: owner}}\n"
        f"frames:\n  base: {{}}\n{frames}",
        encoding="utf-8",
    )
    size = (str(number) for number in (FRAMES, DEPTH, RATE, FRAMES_A_MESSAGE))
    with (
        workspace.running(sys.executable, PROGRAMS / "moving_owner.py", *size),
        _started(workspace, file, "--live") as (pid, address),
        _connected(address) as browser,
    ):
        received = _Counter()
        reader = threading.Thread(target=received.read, args=(browser,), daemon=True)
        reader.start()
        time.sleep(SETTLE_S)  # until it knows all publishers
        process = psutil.Process(pid)

        def sample() -> Mapping[str, float]:
            used, began, before = cpu_s([process]), time.monotonic(), received.messages
            time.sleep(ROUND_S)
            took_s = time.monotonic() - began
            if (updates := received.messages - before) < took_s * RATE / 2:
                raise RuntimeError(f"{updates} updates in {took_s:.1f} s")
            core = 100 * (cpu_s([process]) - used) / took_s
            return {"core": core, "memory": pss_mb([process])}

        yield sample


class _Counter:
    """A count of the messages that a browser is sent."""

    messages = 0

    def read(self, browser: ClientConnection) -> None:
        """Count until the connection ends."""
        with suppress(ConnectionClosed):
            for _ in browser:
                self.messages += 1


def _first_scene_s(workspace: Workspace) -> float:
    """Return the seconds from the command to the last of what a browser is sent at first."""
    began = latest = time.monotonic()
    with (
        _started(workspace, ROVER) as (_, address),
        _connected(address) as browser,
        suppress(TimeoutError),
    ):
        while True:
            browser.recv(timeout=1.0)
            latest = time.monotonic()
    return latest - began


def _save_s(workspace: Workspace) -> float:
    """Return the seconds that saving a moved mount takes, its files compiled and written.

    Raises:
        RuntimeError: if nothing was saved.
    """
    file = workspace.folder / ROVER.name
    file.write_bytes(ROVER.read_bytes())

    def compiled(texts: Mapping[str, str]) -> Compiled:
        return compile_robot(texts[str(file)], str(file), library())

    def write(path: str, _: object, new: str) -> None:
        Path(path).write_text(new, encoding="utf-8")

    session = Session({str(file): file.read_text("utf-8")}, compiled, write)
    mount = session.mount("front_link")
    session.move(mount.edge.child, Pose((0.01 + mount.edge.pose.xyz[0], 0, 0)))
    began = time.monotonic()
    saved = session.save()
    took_s = time.monotonic() - began
    if not saved.diff:
        raise RuntimeError("nothing was saved")
    return took_s


def _page_kb(workspace: Workspace) -> float:
    """Return the size of the largest page of the gallery's robots."""
    page, sizes = workspace.folder / "page.html", []
    for file in sorted(ROVER.parent.glob("*.yaml")):
        workspace.run(sys.executable, "-m", "tfcompose", "view", file, "--html", page)
        sizes.append(page.stat().st_size)
    return max(sizes) / 1e3


BENCHMARK = Benchmark(
    name="view",
    about="one browser is connected; live, an owner sends moving frames in chains of ten",
    rows={
        "first": Row(
            "`view`: until a browser has the scene of `field_rover`", "s", (Limit(3.0, "least"),)
        ),
        "save": Row("`view --edit`: a save", "ms", (Limit(150.0, "least"),)),
        "page": Row("`view --html`: the largest page of `robots/`", "kB", (Limit(100.0),)),
        "core": Row(
            f"`view --live`: {FRAMES:,} frames at {RATE} Hz", "% of a core", (Limit(25.0),)
        ),
        "memory": Row("… memory", "MB", (Limit(400.0),)),
    },
    contenders={TFCOMPOSE_ON_ROS: view},
    runs=3,
    quick_runs=1,
)
