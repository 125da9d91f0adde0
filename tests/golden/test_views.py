"""Golden views: what commands print, one file each.

Other tests assert names, numbers and exit codes.

No process runs: commands that look at recordings stand for those that look at a live tree, and
statuses and notices are given as a launcher would. After an intended change: ``python -m
tests.golden.test_views --write``.
"""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

from tests.golden.test_findings import ROOT
from tests.support.bags import UP, Sent, drive, write_bag
from tests.support.cli import tfcompose_in
from tests.support.goldens import compare, write
from tests.support.robots import ROVER
from tests.support.tree_history import SECOND_NS
from tfcompose.cli.commands import ps
from tfcompose.cli.console import Console
from tfcompose.foundation.findings import Note, finding
from tfcompose.foundation.geometry import Pose
from tfcompose.model.messages import (
    AllReady,
    AllStarted,
    Ended,
    FilesRestored,
    FindingShown,
    LogLine,
    Missing,
    Notice,
    OwnerLive,
    ProcessReady,
    ProcessState,
    ProcessStatus,
    RecoveredShown,
    Replanned,
    RobotStatus,
    StartRow,
    Stopping,
    TreeComplete,
    Waiting,
)
from tfcompose.model.plan import Plan, PlanProcess, RosSettings
from tfcompose.tf.tf2 import Buffer, TransformException, TypeException
from tfcompose.tf.tf2.messages import Header

GOLDEN = Path(__file__).parent / "views"
FIXED: list[Sent] = [("/tf_static", 0.0, "base_link", "lidar", 0.0, (0.0, 0.0, 0.3), UP)]
#: In the repository's folder, and in one with rover.yaml and a recording of it.
COMMANDS = {
    "pose": [
        "pose robots/autonomous_robot.yaml laser_link camera_link",
        "pose rover.yaml odom lidar",
    ],
    "explain": [
        "explain TF301",
        "explain robots/autonomous_robot.yaml base_link laser_link",
        "explain rover.yaml base_link lidar --set frames.lidar.xyz=[0,0,1]",
    ],
    "tree": ["tree robots/two_rovers.yaml", "tree robots/autonomous_robot.yaml --profile demo"],
    "presets": ["presets realsense/d455", "presets ekf", "presets lidar2d"],
    "dry_run": ["up rover.yaml --dry-run"],
    "recording": [
        "monitor --bag bag",
        "tree --bag bag",
        "tree rover.yaml --bag bag",
        "verify rover.yaml --bag bag",
        "echo odom lidar --bag bag --once",
        "echo odom lidr --bag bag --once",
    ],
    "wrong_use": ["lnit", "pose rover.yaml odom lidr", "lint none.yaml", "explain TF999"],
}

PLAN = Plan(
    "rover",
    "0",
    None,
    RosSettings(),
    (),
    tuple(PlanProcess(name, "run") for name in ("static", "drive")),
)
NOTICES: tuple[Notice, ...] = (
    ProcessState("static", "running", 7),
    ProcessState("drive", "expected"),
    LogLine("drive", "stderr", "no device"),
    AllStarted(2, ("drive",), 1.0),
    OwnerLive("static", "/static", ("base_link → lidar", "base_link → imu"), 1.25),
    ProcessReady("drive", "/scan", 1.5),
    Waiting((Missing("drive", "/drive", ("odom → base_link",), 1),)),
    FindingShown(
        finding(
            "TF803",
            "an example",
            None,
            severity="warning",
            notes=[Note("a note")],
            help="a way out",
        )
    ),
    RecoveredShown("an example is over", 3.0),
    TreeComplete(3, 4.5),
    AllReady((StartRow("static", 0.0, 1.25), StartRow("drive", None, 4.5)), 4.5, ("camera",)),
    Replanned(("static",), ("slam",), ("camera",), ("base_link → camera",)),
    ProcessState("drive", "backoff", None, "exit code 1; restart 1 of 5 in 1 s"),
    ProcessState("drive", "exited", None, "exit code 0"),
    ProcessState("drive", "fatal", None, "exit code 1, after 5 restarts"),
    FilesRestored("/run/user/1000/tfcompose/rover@0"),
    FilesRestored("", "No space left on device"),
    Stopping("TF808 process_failed"),
    ProcessState("static", "stopping", 7, "SIGINT"),
    Ended(1, ("drive: no device",)),
)


def process(name: str, state: str, **more: object) -> ProcessStatus:
    defaults: dict[str, object] = {
        "kind": "run",
        "host": None,
        "detail": "",
        "required": None,
        "failed": False,
        "ready": True,
        "waits": "",
        "seen": "",
        "pid": None,
        "uptime": None,
        "restarts": 0,
        "edges": 0,
        "live": 0,
        "nodes": (),
    }
    return ProcessStatus(name=name, state=state, **{**defaults, **more})  # type: ignore[arg-type]


STATUS = RobotStatus(
    "rover",
    None,
    5,
    "0",
    75.0,
    complete=False,
    ready=False,
    stopping=False,
    missing=(),
    silent=(),
    processes=(
        process("static", "running", pid=7_000_001, uptime=75.0, edges=2, live=2),
        process("slam", "running", pid=7_000_002, uptime=4000.0, edges=1, ready=False),
        process("nav", "stopped", waits="waits for slam to be ready"),
        process(
            "camera", "fatal", detail="exit code 1, after 5 restarts", failed=True, restarts=5
        ),
        process("arm", "expected", host="jetson", edges=1),
    ),
)


def buffer_errors() -> str:
    """Return what the buffer answers where it has no transform, and what moves nothing."""
    buffer = Buffer()
    for second in (1, 3):
        buffer.set(
            "odom", "base", Pose((float(second), 0.0, 0.0)), second * SECOND_NS, static=False
        )
    for parent, child in (
        ("base", "laser"),
        ("world", "table"),
        ("a", "b"),
        ("b", "a"),
        ("a", "tool"),
    ):
        buffer.set(parent, child, Pose(), 0, static=True)
    below_map = Buffer()
    for parent, child, second in (("map", "odom", 9), ("odom", "base", 1)):
        below_map.set(parent, child, Pose(), second * SECOND_NS, static=False)
    cleared = Buffer()
    cleared.set("odom", "base", Pose(), SECOND_NS, static=False)
    cleared.clear()
    questions: tuple[Callable[[], object], ...] = (
        lambda: buffer.lookup("odom", "lasr"),
        lambda: buffer.lookup("/odom", "laser"),
        lambda: buffer.lookup("", "laser"),
        lambda: buffer.lookup("odom", "table"),
        lambda: buffer.lookup("tool", "b"),
        lambda: buffer.lookup("odom", "laser", SECOND_NS // 2),
        lambda: buffer.lookup("odom", "laser", 4 * SECOND_NS),
        lambda: below_map.lookup("map", "odom", 8 * SECOND_NS),
        lambda: below_map.lookup("map", "base"),
        lambda: cleared.lookup("odom", "base"),
        lambda: buffer.lookup_velocity("base", "odom", 2 * SECOND_NS, 0),
        lambda: buffer.lookup_transform("odom", "base", "now"),
        lambda: buffer.transform(Header(), "odom"),
        lambda: buffer.transform_points([1.0, 2.0], "odom", "base"),
    )
    return "".join(map(refusal, questions))


def refusal(ask: Callable[[], object]) -> str:
    try:
        ask()
    except (TransformException, TypeException, TypeError, ValueError) as error:
        return f"{type(error).__name__}: {error}\n"
    return "an answer\n"


class Lines(list[str]):
    """Stands in for the output of ``up``."""

    def write(self, text: str, *, log: bool = False) -> None:
        del log
        self.append(text)


def views() -> dict[str, str]:
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rover.yaml").write_text(ROVER, encoding="utf-8")
        write_bag(folder / "bag", [*FIXED, *drive(rate=20.0)])
        made = {}
        for view, commands in COMMANDS.items():
            rows = [
                printed(ROOT if "robots/" in command else folder, command) for command in commands
            ]
            made[view] = "\n".join(rows)
        with mock.patch.object(ps, "_robots", return_value=({"rover@0": STATUS}, 0)):
            made["ps"] = printed(folder, "ps")
    lines = Lines()
    console = Console(PLAN, lines, colour=False)
    for notice in NOTICES:
        console(notice)
    return made | {"up": "".join(lines), "buffer": buffer_errors()}


def printed(folder: Path, command: str) -> str:
    """Return the command, what it prints, and its exit code, as a terminal shows them."""
    done = tfcompose_in(folder, *command.split(), COLUMNS="100")
    text = (done.stdout + done.stderr).replace(f"{ROOT}/", "")
    return f"$ tfcompose {command}\n{text}[{done.returncode}]\n"


def test_commands_print_what_the_golden_views_say() -> None:
    compare(GOLDEN, views())


if __name__ == "__main__":
    write(GOLDEN, views())
