"""Show a robot in the browser, and edit its mounts.

Show the robot of FILE (a robot file or a built plan.json) in 3-D in the browser: bodies, frames,
owners, joints. With --edit, drag mounts or type their poses, and save the values to the file. With
--live, show frames at their published poses; if a frame is elsewhere than in the robot file, show
a transparent copy at the expected pose, and show edges that are silent or from another publisher
in red. With --live and --edit, the running robot follows each move, as with nudge. With --bag,
show the recorded poses at the time of a slider.
"""

from __future__ import annotations

import os
import sys
from argparse import ArgumentTypeError
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.options import (
    DEFAULT_FILE,
    TOLERANCE,
    add_bag,
    add_tolerance,
    add_variant,
    changes_robot,
    tolerance,
)
from tfcompose.cli.terminal import UNREADABLE, fail, warn
from tfcompose.foundation.signals import take_interrupt

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Iterator, Sequence

    from tfcompose.tools.view.reload import WatchedFiles
    from tfcompose.tools.view.session import Session
    from tfcompose.tools.view.windows import SceneSource

_HOST, _PORT = "127.0.0.1", 8080
_EVERYWHERE = frozenset({"0.0.0.0", "::"})  # noqa: S104 (what a user may give)
_LATEST_S = 1e11
_LAST_PORT = 65_535


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of ``view``."""
    parser.add_argument(
        "file",
        nargs="?",
        metavar="FILE|PLAN",
        help="default: robot.yaml; with --live the robot that runs here, if any",
    )
    add_variant(parser)
    parser.add_argument(
        "--live", action="store_true", help="show the running tree and its findings"
    )
    parser.add_argument(
        "--joints",
        action="store_true",
        help="with --live: sliders publish /joint_states, unless another node does",
    )
    add_bag(parser)
    parser.add_argument(
        "--at",
        type=_seconds,
        metavar="S",
        help=(
            "with --bag: the initial time, in seconds after the first transform or since the "
            "epoch; default: 0"
        ),
    )
    add_tolerance(parser)
    parser.set_defaults(tolerance=None)
    parser.add_argument(
        "--edit",
        action="store_true",
        help="move mounts, and save them in the file; with --live the running robot follows",
    )
    parser.add_argument(
        "--html", metavar="FILE", help="write one self-contained HTML file, and exit"
    )
    parser.add_argument(
        "--host",
        default=_HOST,
        metavar="ADDRESS",
        help=f"listen there; access needs the token in the printed address (default: {_HOST})",
    )
    parser.add_argument("--port", type=int, default=_PORT, help=f"the port (default: {_PORT})")
    parser.add_argument("--open", action="store_true", help="open the browser")


def run(arguments: Namespace) -> int:
    """Serve the view until Ctrl-C, or write it to a file.

    Return exit code 1 if the file has errors, 2 if the robot cannot be shown.
    """
    try:
        from tfcompose.tools.view.reload import WatchedFiles
    except ImportError as error:
        fail(f"{error.name} is not installed: pip install 'tfcompose[view]'", UNREADABLE)
    from tfcompose.cli.reading import read_text
    from tfcompose.tools.view.view_session import session_of

    _refuse_options(arguments)
    file = arguments.file or _running_plan(arguments) or DEFAULT_FILE
    if arguments.html:
        _check_output(Path(arguments.html), [file, *arguments.overlays])
    files = WatchedFiles(read_text)
    session = session_of(file, arguments, files)
    if arguments.html:
        _write(session, Path(arguments.html))
        return 0
    return _serve(session, files, arguments)


def _refuse_options(arguments: Namespace) -> None:
    """Exit if the arguments contain options that exclude each other."""
    is_published = arguments.live or bool(arguments.bag)
    source = "--live" if arguments.live else "--bag"
    refusals = (
        (
            arguments.live and arguments.bag,
            "--live uses the running tree and --bag a recording: give one of them",
        ),
        (
            arguments.joints and not arguments.live,
            (
                "--joints publishes for a running robot: give --live, too; without it sliders move"
                " what is shown"
            ),
        ),
        (
            is_published and arguments.html,
            f"{source} shows what is published: leave out --html",
        ),
        (
            arguments.bag and arguments.edit,
            "--bag shows what was published: leave out --edit",
        ),
        (
            arguments.at is not None and not arguments.bag,
            "--at is a time of a recording: give --bag, too",
        ),
        (
            arguments.tolerance is not None and not is_published,
            "--tolerance compares with what is published: give --live or --bag, too",
        ),
        (
            arguments.edit and arguments.html,
            "--html writes a page, in which nothing is moved: leave out --edit",
        ),
    )
    for is_refused, message in refusals:
        if is_refused:
            fail(message, UNREADABLE)


def _serve(session: Session, files: WatchedFiles, arguments: Namespace) -> int:
    """Show the session in the browser until Ctrl-C; return the exit code."""
    from tfcompose.tools.view.reload import Watcher
    from tfcompose.tools.view.server import new_token, start_server, stop_server
    from tfcompose.tools.view.windows import Windows

    source = _source_of(session, arguments)
    token = new_token()
    server = start_server(
        arguments.host, _free(arguments.host, arguments.port), session.robot.name, token
    )
    windows: Windows | None = None
    try:
        windows = Windows(server, session, files, source)
        with (
            _announce(_address(arguments.host, server.get_port(), token), arguments),
            Watcher(files) as watcher,
        ):
            return source.run(windows, watcher.changed)
    finally:
        if windows is not None:
            windows.end()
        stop_server(server)


def _source_of(session: Session, arguments: Namespace) -> SceneSource:
    """Return the source of poses: the robot file, a running tree, or a recording.

    For a running tree, set this process up for the ROS settings of the robot.
    """
    tolerated = arguments.tolerance or tolerance(TOLERANCE)
    if arguments.bag:
        from tfcompose.tools.view.bag_source import BagSource

        return BagSource(arguments.bag, arguments.at or 0.0, session, tolerated)
    if arguments.live:
        from tfcompose.cli.live import set_up_ros
        from tfcompose.tools.view.view_session import plan_of_session

        plan = plan_of_session(session)
        set_up_ros(plan.ros)
        from tfcompose.tools.view.live_source import LiveSource, observers_of

        return LiveSource(
            observers_of(plan), tolerated, joints=arguments.joints, edit=arguments.edit
        )
    from tfcompose.tools.view.windows import SceneSource

    return SceneSource(has_edit=arguments.edit)


def _write(session: Session, path: Path) -> None:
    """Write the scene as a single file; exit if it cannot be written."""
    from tfcompose.cli.writing import replace_file
    from tfcompose.tools.view.page import page_of

    page = page_of(session.robot, session.state.sources)
    try:
        replace_file(path, page.encode())
    except OSError as error:
        fail(f"{path} cannot be written: {error.strerror}", UNREADABLE)


def _running_plan(arguments: Namespace) -> str | None:
    """Return the path of the plan of the robot that runs in this ROS domain.

    Return None if no robot runs, or if the arguments name a file.
    """
    if not arguments.live or arguments.edit or changes_robot(arguments):
        return None
    from tfcompose.cli.runs import plan_file, run_of_domain

    run = run_of_domain()
    if run is None:
        return None
    warn(f"{run[0].name} runs here, so it is shown")
    return str(plan_file(run[0]))


def _check_output(path: Path, files: Sequence[str]) -> None:
    """Exit if the page cannot be written, or would replace a file of the robot."""
    from tfcompose.foundation.reading import is_folder

    if not is_folder(path.parent):
        fail(f"{path} cannot be written: no folder {path.parent}", UNREADABLE)
    if os.path.realpath(path) in {os.path.realpath(file) for file in files}:
        fail(f"--html {path} would replace a file of the robot", UNREADABLE)


def _free(host: str, port: int) -> int:
    """Return the port; if it is in use, print the next free port and exit."""
    if not 0 <= port <= _LAST_PORT:
        fail(
            f"port {port} does not exist: --port takes 0 to {_LAST_PORT}, 0 for any free port",
            UNREADABLE,
        )
    if trouble := _trouble(host, 0):
        fail(f"--host {host} is not an address of this machine: {trouble}", UNREADABLE)
    following = next(
        (candidate for candidate in range(port, _LAST_PORT + 1) if not _trouble(host, candidate)),
        None,
    )
    if following != port:
        fail(
            f"port {port} is taken" + (f"; --port {following} is free" if following else ""),
            UNREADABLE,
        )
    return port


def _trouble(host: str, port: int) -> str:
    """Return why the view cannot listen on an address; empty if it can."""
    import socket

    try:
        family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _address(host: str, port: int, token: str) -> str:
    """Return the URL of the view.

    If the server listens on all addresses, the URL contains the host name.
    """
    import socket

    name = socket.gethostname() if host in _EVERYWHERE else f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}/?token={token}"


def _seconds(text: str) -> float:
    """Parse a time in seconds; raise ArgumentTypeError if it is invalid."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < _LATEST_S:
        raise ArgumentTypeError(f"{text} is not a time in seconds")
    return value


@contextmanager
def _announce(address: str, arguments: Namespace) -> Iterator[None]:
    """Print the URL of the view, and open the browser unless an option says not to.

    Every user of the machine can read the arguments of a process, and the URL contains the token.
    Therefore the browser is started with a file that only this user can read and that redirects to
    the URL.
    """
    sys.stdout.write(f"{address}\nCtrl-C ends it\n")
    sys.stdout.flush()
    with ExitStack() as stack:
        if arguments.open:
            import tempfile
            import webbrowser

            page = stack.enter_context(
                tempfile.NamedTemporaryFile("w", encoding="utf-8", suffix=".html")
            )
            page.write(f'<meta http-equiv="refresh" content="0; url={address}">\n')
            page.flush()
            webbrowser.open(Path(page.name).as_uri())
        if take_interrupt():
            raise KeyboardInterrupt  # optional imports of trimesh swallow the exception
        yield
