"""Show a robot in the browser, and edit its mounts.

Show the robot of FILE in 3-D in the browser: bodies, frames, owners, joints. With --edit mounts are dragged, or their
poses typed, and saved where the values stand in the file.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import add_file, add_variant
from tfcompose.cli.terminal import UNREADABLE, fail
from tfcompose.signals import take_interrupt

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Mapping, Sequence

    from tfcompose.compile import Compiled
    from tfcompose.view.session import Session

_HOST, _PORT = "127.0.0.1", 8080
_LAST_PORT = 65_535


def arguments(parser: ArgumentParser) -> None:
    """Add the command's arguments."""
    add_file(parser)
    add_variant(parser)
    parser.add_argument("--edit", action="store_true", help="move mounts, and save them in the file")
    parser.add_argument("--html", metavar="FILE", help="write one HTML file that needs nothing else, and end")
    parser.add_argument("--port", type=int, default=_PORT, help=f"the port on this machine (default: {_PORT})")
    parser.add_argument("--open", action="store_true", help="open the browser")


def run(arguments: Namespace) -> int:
    """Serve the view until Ctrl-C, or write it; exit code 1 if the file gives no robot, 2 if it cannot be shown."""
    try:
        from tfcompose.view.panel import Panel
        from tfcompose.view.scene import RobotScene, started, stop
        from tfcompose.view.session import poses_in_roots
    except ImportError as error:
        fail(f"{error.name} is not installed: pip install 'tfcompose[view]'", UNREADABLE)
    from tfcompose.cli.writing import replace_file

    if arguments.html:
        _check_output(Path(arguments.html), [arguments.file, *arguments.overlays])
    session = _session(arguments)
    port = 0 if arguments.html else _free(arguments.port)
    server = started(_HOST, port, session.robot.name)
    try:
        if arguments.html:
            robot, poses = session.robot, poses_in_roots(session.robot, {})
            scene = RobotScene(server.scene, robot)
            scene.update(robot, poses)
            scene.frame_camera(server, poses)
            try:
                replace_file(Path(arguments.html), server.scene.as_html().encode())
            except OSError as error:
                fail(f"{arguments.html} cannot be written: {error.strerror}", UNREADABLE)
            return 0
        Panel(server, session, edit=arguments.edit)
        _serve(f"http://{_HOST}:{server.get_port()}", arguments)
    finally:
        stop(server)
    return 0


def _check_output(path: Path, files: Sequence[str]) -> None:
    """Refuse a page that cannot be written, or that would replace one of the robot's files; ends then."""
    if not path.parent.is_dir():
        fail(f"{path} cannot be written: no folder {path.parent}", UNREADABLE)
    if path.resolve() in {Path(file).resolve() for file in files}:
        fail(f"--html {path} would replace a file of the robot", UNREADABLE)


def _session(arguments: Namespace) -> Session:
    """Return the robot of the file with what is merged over it; ends where it has none to show."""
    from tfcompose.cli.compiling import disk, given_by, library, overlays_of
    from tfcompose.cli.fixing import rewrite
    from tfcompose.cli.reading import read_text
    from tfcompose.cli.terminal import print_findings, reject
    from tfcompose.compile import compile_robot
    from tfcompose.findings import RejectedError
    from tfcompose.view.session import Session

    try:
        texts = {file: read_text(file) for file in (arguments.file, *arguments.overlays)}
        presets, packages = library(), disk()

        def compiled(now: Mapping[str, str]) -> Compiled:
            def read(file: str) -> str:
                return now[file] if file in now else read_text(file)

            overlays = overlays_of(arguments, read)
            return compile_robot(
                now[arguments.file],
                arguments.file,
                presets,
                arguments.profiles,
                overlays=overlays,
                read=read,
                disk=packages,
                given=given_by(arguments),
            )

        session = Session(texts, compiled, lambda file, old, new: rewrite(Path(file), old, new))
    except RejectedError as error:
        reject(error.findings)
    if session.state.robot is None or not session.robot.frames:
        reject(session.state.found)
    print_findings(session.state.found, sys.stderr)
    return session


def _free(port: int) -> int:
    """Return the port; ends with the next free one named where it is taken."""
    if not 0 <= port <= _LAST_PORT:
        fail(f"there is no port {port}: --port takes 0 to {_LAST_PORT}, 0 for any that is free", UNREADABLE)
    following = next((other for other in range(port, _LAST_PORT + 1) if _is_free(other)), None)
    if following != port:
        fail(f"port {port} is taken" + (f"; --port {following} is free" if following else ""), UNREADABLE)
    return port


def _is_free(port: int) -> bool:
    import socket

    with socket.socket() as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            one.bind((_HOST, port))
        except OSError:
            return False
    return True


def _serve(address: str, arguments: Namespace) -> None:
    """Say where it is, and wait for Ctrl-C."""
    sys.stdout.write(f"{address}; Ctrl-C ends it\n")
    sys.stdout.flush()
    if arguments.open:
        import webbrowser

        webbrowser.open(address)
    if take_interrupt():
        raise KeyboardInterrupt  # trimesh's optional imports had swallowed it
    while True:
        time.sleep(1)
