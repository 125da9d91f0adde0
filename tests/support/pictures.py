"""The README's pictures: ``tfcompose view`` in a browser and ``tfcompose up`` in a terminal.

``python -m tests.support.pictures --write`` runs both commands on the demo of
``robots/autonomous_robot.yaml`` and writes the pictures. Each PNG holds the hash of that
file, and a test compares it, so the pictures do not outlive the robot they show.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import os
import sys
import tempfile
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image, PngImagePlugin
from rich.console import Console
from rich.style import Style
from rich.text import Text

from tests.support import processes
from tests.support.browser import browser, new_page
from tests.support.domains import entered_domain
from tests.support.shell import PROMPT, Shell
from tests.support.waiting import until

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pyte

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "tests" / "golden" / "pictures"
ROBOT = ROOT / "robots" / "autonomous_robot.yaml"
PROFILE = "demo"
#: The PNG text entry that holds the hash of the robot file.
ROBOT_HASH = "robot"
#: Size of the terminal, in columns and rows.
TERMINAL = (118, 13)
#: A node that a colleague forgot to stop: it publishes an edge of base_drive.
OLD_ODOMETRY = """
import time
from tfcompose.tf.ros.tf_codec import Template
from tfcompose.tf.ros.node import TFPublisher, open_node
template = Template([("odom", "base_link")])
with open_node("old_odometry", "/") as node:
    publisher = TFPublisher(node, static=False)
    while True:
        template.set_stamp(time.time_ns())
        publisher.publish(template.data)
        time.sleep(0.02)
"""


def robot_hash() -> str:
    """Return the hash of the robot file that the pictures show."""
    return hashlib.sha256(ROBOT.read_bytes()).hexdigest()


def write_png(picture: bytes, file: Path, width: int) -> None:
    """Write a screenshot at this width, in 128 colours, with the hash of the robot file."""
    info = PngImagePlugin.PngInfo()
    info.add_text(ROBOT_HASH, robot_hash())
    with Image.open(io.BytesIO(picture)) as image:
        size = (width, round(image.height * width / image.width))
        small = image.convert("RGB").resize(size, Image.Resampling.LANCZOS)
        small.quantize(128, dither=Image.Dither.NONE).save(file, optimize=True, pnginfo=info)


def picture_of_view(folder: Path) -> bytes:
    """Return a screenshot of ``tfcompose view`` with one frame of the camera selected."""
    command = [sys.executable, "-m", "tfcompose", "view", ROBOT.name, "-p", PROFILE, "--port", "0"]
    (folder / ROBOT.name).write_bytes(ROBOT.read_bytes())
    output = folder / "view.txt"
    with output.open("w") as stream:
        server = processes.start(command, stdout=stream, stderr=stream, cwd=folder)
    try:
        assert until(lambda: "http://" in output.read_text("utf-8"))
        words = output.read_text("utf-8").split()
        address = next(word for word in words if word.startswith("http://"))
        with browser() as chromium:
            page = new_page(chromium, 1280, 800, draws=True)
            page.goto(address, wait_until="load")
            page.get_by_role("button", name="camera_color_optical_frame").click()
            page.get_by_text("Software WebGL rendering detected").wait_for()
            page.locator(".mantine-Notification-closeButton").click()
            page.mouse.move(640, 740)
            page.wait_for_timeout(6000)  # nothing tells that the scene is drawn
            return page.screenshot()
    finally:
        processes.end(server)


@contextmanager
def terminal(folder: Path) -> Iterator[Shell]:
    """Open a shell in a terminal of the pictures' size, in a ROS domain of its own."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    with entered_domain(folder):
        shell = Shell(folder, PATH=path, COLORTERM="truecolor")
        try:
            shell.resize(*TERMINAL)
            yield shell
        finally:
            shell.close()


def picture_of_up(folder: Path) -> bytes:
    """Return a screenshot of ``tfcompose up`` while a second node publishes odom → base_link."""
    (folder / "old_odometry.py").write_text(OLD_ODOMETRY, "utf-8")
    with terminal(folder) as shell:
        shell.type(f"clear; tfcompose up {ROBOT.name} -p {PROFILE}\n")
        shell.shows("18/18 edges live")
        second = processes.start([sys.executable, "old_odometry.py"], cwd=folder)
        try:
            shell.shows("TF801", "old_odometry", "%")
            return as_png(screen_text(shell.screen))
        finally:
            processes.end(second)
            shell.type("\x03")
            shell.shows(PROMPT)


def screen_text(screen: pyte.Screen) -> Text:
    """Return what a terminal shows, with its colours."""
    text = Text()
    for row in range(screen.lines):
        cells = [screen.buffer[row][column] for column in range(screen.columns)]
        for (colour, bold, reverse), run in groupby(
            cells, lambda cell: (cell.fg, cell.bold, cell.reverse)
        ):
            style = Style(color=_rich_colour(colour), bold=bold, reverse=reverse)
            text.append("".join(cell.data for cell in run), style)
        text.append("\n")
    text.rstrip()
    return text


def _rich_colour(colour: str) -> str | None:
    """Return rich's name of a colour of pyte: a name, or six hexadecimal digits."""
    if colour == "default":
        return None
    if len(colour) == 6 and not set(colour) - set("0123456789abcdef"):
        return f"#{colour}"
    return "yellow" if colour == "brown" else colour.replace("bright", "bright_")


def as_png(text: Text) -> bytes:
    """Draw a terminal window that shows the text."""
    console = Console(record=True, width=TERMINAL[0], file=io.StringIO(), force_terminal=True)
    console.print(text, end="", no_wrap=True)
    svg = console.export_svg(title=f"tfcompose up {ROBOT.name} -p {PROFILE}")
    with browser() as chromium:
        page = new_page(chromium, 1280, 900, draws=True)
        page.set_content(f"<style>body {{margin: 0}} svg {{width: 1280px}}</style>{svg}")
        return page.locator("svg").screenshot(omit_background=True)


def main() -> int:
    """Write both pictures."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.pictures", description=__doc__)
    parser.add_argument("--write", action="store_true", required=True)
    parser.parse_args()
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        write_png(picture_of_view(Path(folder)), FOLDER / "view.png", 1280)
        write_png(picture_of_up(Path(folder)), FOLDER / "up.png", 1180)
    return 0


if __name__ == "__main__":
    sys.exit(main())
