"""Options ``--package`` and ``--cmake`` of ``init``: write a ROS package with a robot file."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.tools.ros2.package import Maintainer

#: Valid names of packages: at least two characters (REP 144).
_NAME = re.compile(r"[a-z][a-z0-9_]+")
#: Valid email addresses, as catkin_pkg checks them, with which colcon reads manifests.
_EMAIL = re.compile(r"[-\w%+]+(\.[-\w%+]+)*@[-\w%]+(\.[-\w%]+)*\.[a-zA-Z]{2,}", re.ASCII)
#: The usual suffix of packages that start a robot.
_SUFFIX = "_bringup"
_GIT_TIMEOUT_S = 5


def arguments(parser: ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "--package",
        metavar="NAME",
        help=(
            "write a ROS package with the robot file, a launch file and a test for colcon; the"
            f" robot's name is then NAME without {_SUFFIX}, and -o DIR the package's folder"
        ),
    )
    parser.add_argument(
        "--cmake", action="store_true", help="with --package: ament_cmake instead of ament_python"
    )


def run(command: str, arguments: Namespace) -> int | None:
    """Write the package; return exit code 2 if that fails, None without ``--package``."""
    del command
    if arguments.list:
        return None
    if arguments.package is None:
        if arguments.cmake:
            fail("--cmake goes with --package NAME", UNREADABLE)
        return None
    from tfcompose.cli.templates import has_demo, print_next, template_files
    from tfcompose.cli.writing import create_folder
    from tfcompose.model.files import File
    from tfcompose.tools.ros2.package import AMENT_CMAKE, AMENT_PYTHON, package_files

    package = arguments.package
    _check_name(package)
    robot = arguments.name or package.removesuffix(_SUFFIX)
    robot_file = Path("robots", f"{robot}.tfc.yaml")
    folder = Path(arguments.output or package)
    if getattr(arguments, "tests", None) is not None:  # an option of another tool
        fail(
            "--package writes a robot file and --tests reads one: write the package first, then"
            f" its tests with tfcompose init --tests {folder / robot_file}",
            UNREADABLE,
        )
    texts = template_files(arguments, robot, robot_file)
    build_type = AMENT_CMAKE if arguments.cmake else AMENT_PYTHON
    files = [
        *package_files(package, robot, build_type, _maintainer()),
        *(File(path.as_posix(), text) for path, text in texts.items()),
    ]
    try:
        create_folder(folder, files)
    except FileExistsError:
        fail(f"nothing was written: {folder} exists; -o DIR names another", UNREADABLE)
    except OSError as error:
        fail(f"{folder} cannot be written: {error.strerror}", UNREADABLE)
    print(f"wrote {folder}: {', '.join(sorted(file.path for file in files))}")
    profile = " demo:=true" if has_demo(texts[robot_file]) else ""
    print_next(
        {
            "colcon build && source install/setup.bash": "in the folder of the workspace",
            f"ros2 launch {package} {robot_file.name}{profile}": (
                "start it, without hardware; Ctrl-C ends it"
            ),
            "colcon test && colcon test-result --verbose": "everything that is wrong with it",
        }
    )
    return 0


def _check_name(package: str) -> None:
    """Refuse an invalid name of a package.

    Raises:
        SystemExit: after reporting why.
    """
    if not _NAME.fullmatch(package):
        near = re.sub(r"[^a-z0-9]+", "_", package.lower()).strip("_0123456789")
        advice = f"; for example {near}" if _NAME.fullmatch(near) else ""
        fail(
            f"{package} is not a package's name: a lower case letter, then lower case letters,"
            f" digits and _ (REP 144){advice}",
            UNREADABLE,
        )
    if package == "tfcompose":
        fail(f"{package} is the package that this one depends on: use another name", UNREADABLE)


def _maintainer() -> Maintainer:
    """Return the author of Git's settings, as ``ros2 pkg create`` does."""
    from tfcompose.tools.ros2.package import UNKNOWN, Maintainer

    name, email = (" ".join(_git_setting(key).split()) for key in ("user.name", "user.email"))
    if not (name and name.isprintable() and _EMAIL.fullmatch(email)):
        return UNKNOWN
    return Maintainer(name, email)


def _git_setting(key: str) -> str:
    """Return a setting of Git; empty if it is not set or Git is not installed."""
    git = shutil.which("git")
    if git is None:
        return ""
    command = [git, "config", "--get", key]
    try:
        done = subprocess.run(
            command, capture_output=True, check=False, timeout=_GIT_TIMEOUT_S, text=True
        )
    except (OSError, ValueError, subprocess.TimeoutExpired):
        return ""
    return done.stdout
