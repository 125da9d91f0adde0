"""Arguments shared by several commands, and parsers of their values."""

from __future__ import annotations

import math
import re
from argparse import ArgumentTypeError
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, fail

if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace

    from tfcompose.foundation.geometry import Offset

_UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "deg": math.pi / 180, "rad": 1.0}
_ANGLES = frozenset({"deg", "rad"})
_QUANTITY = re.compile(r"(\d+\.?\d*|\.\d+)\s*([a-z]+)")

DEFAULT_FILE = "robot.yaml"
TF_TOPICS = ("tf", "tf_static")


def add_file(parser: ArgumentParser) -> None:
    """Add FILE."""
    parser.add_argument(
        "file", nargs="?", default=DEFAULT_FILE, metavar="FILE", help="default: robot.yaml"
    )


def add_variant(
    parser: ArgumentParser,
    text: str = "apply this profile",
    robot: str = "none",
    *,
    by_hostname: bool = False,
) -> None:
    """Add the options that change a robot file: --profile, --robot, --overlay, --set, arguments.

    If FILE is a positional argument, add FILE before. ``robot`` describes the default of --robot.
    With ``by_hostname`` this default is the overlay of this computer, if there is one.
    """
    parser.add_argument(
        "-p",
        "--profile",
        action="append",
        default=[],
        metavar="NAME",
        dest="profiles",
        help=f"{text}; repeatable",
    )
    parser.add_argument(
        "--robot",
        metavar="NAME",
        dest="overlay_robot",
        help=f"merge NAME.yaml from the folder under overlays:; default: {robot}",
    )
    parser.set_defaults(by_hostname=by_hostname)
    parser.add_argument(
        "-f",
        "--overlay",
        action="append",
        default=[],
        metavar="FILE",
        dest="overlays",
        help="merge this file over it, after the profiles; repeatable",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        dest="settings",
        help="set one value, applied last: sensors.camera.tf=driver; repeatable",
    )
    parser.add_argument(
        "--show-args", action="store_true", help="print the robot file's arguments and exit"
    )
    parser.add_argument(
        "arg_values",
        nargs="*",
        default=[],
        metavar="NAME:=VALUE",
        help="the value of an argument of the robot file",
    )
    add_trust(parser)


def changes_robot(arguments: Namespace) -> bool:
    """Return whether an option of ``add_variant`` changes the robot file."""
    return bool(
        arguments.profiles
        or arguments.overlay_robot is not None
        or arguments.overlays
        or arguments.settings
        or arguments.arg_values
    )


def add_ros_args(parser: ArgumentParser) -> None:
    """Add --ros-args. It takes the rest of the command line, or the part before ``--``."""
    parser.add_argument(
        "--ros-args",
        nargs=1,
        default=[],
        metavar="…",
        help="for all nodes of the robot: -r __ns:=NS, -r FROM:=TO, -p use_sim_time:=true,"
        " --log-level LEVEL",
    )


def add_trust(parser: ArgumentParser) -> None:
    """Add --trust."""
    parser.add_argument(
        "--trust",
        action="store_true",
        help="run your own xacro and launch files without the sandbox; see help sandbox",
    )


def pairs(arguments: list[str], between: str) -> dict[str, str]:
    """Return arguments of the form NAME:=VALUE, or NAME=VALUE, as values by name.

    Raises:
        SystemExit: after an error message, if an argument has another form.
    """
    wrong = next(
        (
            argument
            for argument in arguments
            if not argument.partition(between)[0] or between not in argument
        ),
        None,
    )
    if wrong is not None:
        fail(f"{wrong} is not NAME{between}VALUE", UNREADABLE)
    return {
        name: value for name, _, value in (argument.partition(between) for argument in arguments)
    }


def add_frames(parser: ArgumentParser) -> None:
    """Add A and B."""
    parser.add_argument("a", metavar="A", help="the frame in which the pose is given")
    parser.add_argument("b", metavar="B", help="the frame whose pose it is")


def add_robot(
    parser: ArgumentParser, default: str = "the one in this ROS domain, or that of ./robot.yaml"
) -> None:
    """Add --robot."""
    parser.add_argument(
        "--robot", metavar="NAME", help=f"the robot, as NAME or NAME@DOMAIN; default: {default}"
    )


def add_processes(parser: ArgumentParser) -> None:
    """Add NAME (names of processes of a running robot) and --robot."""
    parser.add_argument(
        "name", nargs="+", metavar="NAME", help="a process, as listed by tfcompose ps"
    )
    add_robot(parser)


def add_namespace(parser: ArgumentParser, text: str = "use /NS/tf and /NS/tf_static") -> None:
    """Add --namespace."""
    parser.add_argument("--namespace", type=namespace, default="", metavar="NS", help=text)


def add_bag(
    parser: ArgumentParser, text: str = "read a recording instead of the running tree"
) -> None:
    """Add --bag."""
    parser.add_argument("--bag", metavar="BAG", help=f"{text}: a rosbag2 folder, .mcap or .db3")


#: The default tolerance of a pose.
TOLERANCE = "1mm,0.1deg"


def add_tolerance(parser: ArgumentParser) -> None:
    """Add --tolerance."""
    parser.add_argument(
        "--tolerance",
        type=tolerance,
        default=TOLERANCE,
        metavar="T",
        help=(f"allowed deviation: 2mm, 0.5deg, or both as 2mm,0.5deg; default: {TOLERANCE}"),
    )


def tolerance(text: str) -> Offset:
    """Parse a distance, an angle, or both.

    Raises:
        ArgumentTypeError: if the text is neither.
    """
    from tfcompose.foundation.geometry import Offset
    from tfcompose.guard.verdict.publishers import SAME_POSE

    bounds: dict[bool, float] = {}
    for part in text.split(","):
        match = _QUANTITY.fullmatch(part.strip())
        if match is None or match[2] not in _UNITS or (match[2] in _ANGLES) in bounds:
            raise ArgumentTypeError(f"{text} is not a tolerance, such as 2mm or 2mm,0.5deg")
        bounds[match[2] in _ANGLES] = float(match[1]) * _UNITS[match[2]]
    return Offset(bounds.get(False, SAME_POSE.xyz_m), bounds.get(True, SAME_POSE.rot_rad))


def add_for(parser: ArgumentParser, text: str, default: float | None = None) -> None:
    """Add --for."""
    parser.add_argument(
        "--for", dest="duration", type=duration, default=default, metavar="S", help=text
    )


def settle_duration(arguments: Namespace, default_s: float, *, is_live: bool) -> None:
    """Set the default of --for. Without a running tree, as with a recording, reject --for.

    Raises:
        SystemExit: after an error message, if --for is rejected.
    """
    if arguments.duration is not None and arguments.bag:
        fail("a recording is always read to its end: leave out --for", UNREADABLE)
    if arguments.duration is not None and not is_live:
        fail(
            "--for says how long to observe the running tree: add --live, or leave out --for",
            UNREADABLE,
        )
    arguments.duration = arguments.duration or default_s


def add_format(parser: ArgumentParser, *choices: str, text: str = "default: text") -> None:
    """Add --format with the choices text and ``others``. The default of ``others`` is json."""
    parser.add_argument(
        "--format", choices=("text", *(choices or ("json",))), default="text", help=text
    )


def namespace(text: str) -> str:
    """Parse a ROS namespace. Return it without leading and trailing slashes.

    The result is empty for the global namespace.

    Raises:
        ArgumentTypeError: if the text is not a valid namespace.
    """
    name = text.strip("/")
    if name in TF_TOPICS or name.endswith(tuple(f"/{topic}" for topic in TF_TOPICS)):
        raise ArgumentTypeError(f"{text} is a topic; give only the namespace before it")
    if name and not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*", name):
        raise ArgumentTypeError(
            f"{text} is not a namespace, such as robot1: letters, digits and _, separated by /"
        )
    return name


def positive(text: str) -> float:
    """Parse a positive number.

    Raises:
        ArgumentTypeError: if the text is not a positive number.
    """
    value = _number(text)
    if value is None or value == 0:
        raise ArgumentTypeError(f"{text} is not a positive number below a billion")
    return value


def duration(text: str) -> float:
    """Parse a positive duration in seconds. A unit may follow: ``30``, ``30 s``, ``2 min``.

    Raises:
        ArgumentTypeError: if the text is not a positive duration.
    """
    from tfcompose.foundation.units import NUMBER, TIME, UnitError, quantity

    try:
        value = quantity(text, TIME)
    except UnitError as error:
        raise ArgumentTypeError(str(error)) from None
    if value.dimension not in {NUMBER, TIME}:
        raise ArgumentTypeError(f"{text} is not a duration, such as 30 s")
    return positive(str(value.value))


def not_negative(text: str) -> float:
    """Parse a number that is 0 or more.

    Raises:
        ArgumentTypeError: if the text is not such a number.
    """
    value = _number(text)
    if value is None:
        raise ArgumentTypeError(f"{text} is not a number of 0 or more, below a billion")
    return value


def count(text: str) -> int:
    """Parse an integer that is 0 or more.

    Raises:
        ArgumentTypeError: if the text is not such an integer.
    """
    if not text.isascii() or not text.isdigit() or len(text) > 9:  # noqa: PLR2004 (a billion lines)
        raise ArgumentTypeError(f"{text} is not a whole number of 0 or more")
    return int(text)


def positive_count(text: str) -> int:
    """Parse an integer that is 1 or more.

    Raises:
        ArgumentTypeError: if the text is not such an integer.
    """
    if not (number := count(text)):
        raise ArgumentTypeError(f"{text} is not a whole number of 1 or more")
    return number


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if 0 <= value < 1e9 else None  # noqa: PLR2004 (in seconds thirty years)
