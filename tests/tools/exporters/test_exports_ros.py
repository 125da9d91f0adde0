"""Exports on the real thing.

What their files say is started, and the live tree compared with the plan.

A stand-in does what systemd does with a unit, or docker compose with a service: order,
environment, notification, health checks. The processes are real.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
import yaml

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, offences, until
from tfcompose.launcher.program import HERE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

pytestmark = pytest.mark.ros

#: A lifecycle node that latches its edge when it is activated.
ARM = """
import signal, sys
import rclpy
from rclpy.lifecycle import LifecycleNode
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import TFPublisher

class Arm(LifecycleNode):
    def on_activate(self, state):
        self.sent = TFPublisher(self, static=True)
        self.sent.publish(encode([SentTransform(0, "base_link", "arm", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))]))
        return super().on_activate(state)

signal.signal(signal.SIGINT, lambda *_: sys.exit())  # with 0, also after rclpy's own handler has ended spin
rclpy.init(args=sys.argv)
try:
    rclpy.spin(Arm("arm"))
except BaseException:
    pass
"""  # noqa: E501 (a text as its reader has it)
ROBOT = """
tfcompose: 1
robot: rover
ros: {{discovery: localhost, domain_id: {domain}}}
frames:
  odom: {{}}
  base_link: {{parent: odom, owner: drive, rate: 20 Hz}}
  arm: {{parent: base_link, xyz: [0, 0, 1], owner: arm, static: true}}
  lidar: {{parent: base_link, xyz: [0, 0, 0.3]}}
processes:
  drive: {{simulate: {{fixed: {{xyz: [0, 0, 0]}}, rate: 20 Hz}}, after: {{static: ready}}}}
  arm: {{run: [{python}, {file}], node: /arm, lifecycle: active, restart: on-failure}}
guard: {{mode: {mode}}}
"""
ISOLATED = ", namespace: robot1, isolate: topics"


@dataclass
class Service:
    """A unit or service, as a supervisor knows it."""

    argv: list[str]
    env: dict[str, str]
    folder: Path
    after: list[str] = field(default_factory=list)
    notifies: bool = False
    healthy: list[str] = field(default_factory=list)


class Supervisor:
    """Starts services in their order, with nothing in their environment but what they say."""

    def __init__(self, services: dict[str, Service], output: Path) -> None:
        self.services = services
        self.running: dict[str, subprocess.Popen[str]] = {}
        self._output = output
        self._stack = ExitStack()

    def start_all(self) -> None:
        while missing := [name for name in self.services if name not in self.running]:
            self.start(
                next(name for name in missing if not set(self.services[name].after) & {*missing})
            )

    def start(self, name: str) -> None:
        """Start a service, and wait until it is ready as far as that is known."""
        service = self.services[name]
        out = self._stack.enter_context((self._output / f"{name}.log").open("ab"))
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
            path = tempfile.mktemp(prefix="notify")  # noqa: S306 (an address, not a file)
            manager.bind(path)
            manager.settimeout(60)
            env = service.env | ({"NOTIFY_SOCKET": path} if service.notifies else {})
            self.running[name] = processes.start(
                service.argv, env=env, cwd=service.folder, stdout=out, stderr=out
            )
            try:
                if service.notifies:
                    assert manager.recv(100) == b"READY=1", name
            finally:
                Path(path).unlink()
        if service.healthy:
            assert until(
                lambda: processes.run(service.healthy, env=service.env).returncode == 0
            ), name

    def log(self, name: str) -> str:
        return (self._output / f"{name}.log").read_text("utf-8")

    def end(self) -> dict[str, int]:
        """End all, and return those that did not end with 0, with their exit codes."""
        for process in self.running.values():
            process.send_signal(signal.SIGINT)
        try:
            codes = {name: process.wait(TIMEOUT_S) for name, process in self.running.items()}
            return {name: code for name, code in codes.items() if code}
        finally:
            for process in self.running.values():
                process.kill()
            self._stack.close()


def units(folder: Path) -> dict[str, Service]:
    """Read units as systemd does, as far as they are ours."""
    services = {}
    logs = folder / "log"
    for file in sorted(folder.glob("*.service")):
        lines_of: dict[str, list[str]] = {}
        for line in file.read_text("utf-8").splitlines():
            key, _, value = line.partition("=")
            lines_of.setdefault(key, []).append(value.replace("%%", "%"))
        env = dict(
            word.split("=", 1) for line in lines_of["Environment"] for word in shlex.split(line)
        )
        (logs / lines_of["LogsDirectory"][0]).mkdir(parents=True, exist_ok=True)
        env = {name: value.replace("%L", str(logs)) for name, value in env.items()}
        argv = [word.replace("$$", "$") for word in shlex.split(lines_of["ExecStart"][0])]
        after = [Path(unit).stem for line in lines_of.get("After", []) for unit in line.split()]
        services[file.stem] = Service(
            argv,
            env,
            Path(lines_of["WorkingDirectory"][0]),
            after,
            notifies=lines_of["Type"] == ["notify"],
        )
    return services


def services(folder: Path) -> dict[str, Service]:
    """Read a compose file as docker compose does, with this machine's Python and folder."""
    made = yaml.safe_load((folder / "compose.yaml").read_text("utf-8"))
    image = {name: os.environ[name] for name in ("PATH", "PYTHONPATH") if name in os.environ} | {
        "HOME": str(folder)
    }

    def here(words: list[str]) -> list[str]:
        python = {"python3": sys.executable}
        plain = [python.get(word, word).replace("$$", "$") for word in words]
        return [
            word.replace("/robot/plan.json", str(folder.parent / "plan.json")) for word in plain
        ]

    return {
        name: Service(
            here(service["command"]),
            image | service["environment"],
            (folder / service["volumes"][0]["source"]).resolve(),
            list(service.get("depends_on", ())),
            healthy=here(service["healthcheck"]["test"][1:]) if _is_waited_for(name, made) else [],
        )
        for name, service in made["services"].items()
    }


def _is_waited_for(name: str, made: dict[str, Any]) -> bool:
    waits = (service.get("depends_on", {}).get(name, {}) for service in made["services"].values())
    return any(wait.get("condition") == "service_healthy" for wait in waits)


@pytest.fixture
def exported(
    domain: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[..., Supervisor]]:
    """Export a robot, and return who starts it."""
    monkeypatch.delenv("ROS_LOG_DIR")
    running: list[Supervisor] = []

    def export(kind: str, mode: str, more: str = "") -> Supervisor:
        (tmp_path / "arm.py").write_text(ARM, "utf-8")
        text = ROBOT.format(
            domain=domain.id, python=sys.executable, file=tmp_path / "arm.py", mode=mode
        )
        (tmp_path / "robot.yaml").write_text(
            text.replace("localhost", f"localhost{more}", 1), "utf-8"
        )
        command = [sys.executable, "-m", "tfcompose", "export", kind, "robot.yaml", "-o", "build"]
        done = processes.run(command, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        folder = tmp_path / "build" / kind
        running.append(
            Supervisor(units(folder) if kind == "systemd" else services(folder), tmp_path)
        )
        return running[0]

    yield export
    for robot in running:
        robot.end()


def verified(folder: Path, wrong: str = "") -> str:
    """Compare the live tree with the plan, and return what is wrong, if a line of it fits.

    Else nothing.
    """
    command = [
        sys.executable,
        "-m",
        "tfcompose",
        "verify",
        "build/plan.json",
        "--live",
        "--for",
        "3",
    ]
    done = processes.run(command, cwd=folder)
    lines_of = done.stdout + done.stderr
    return lines_of if done.returncode and re.search(wrong, lines_of, re.MULTILINE) else ""


@pytest.mark.parametrize(
    ("kind", "mode", "more"),
    [
        ("systemd", "watch", ""),
        ("compose", "strict", ISOLATED),
    ],
)
def test_an_export_starts_the_tree_of_the_plan_and_drives_lifecycles(
    exported: Callable[..., Supervisor], tmp_path: Path, kind: str, mode: str, more: str
) -> None:
    supervisor = exported(kind, mode, more)
    supervisor.start_all()
    guard = next(name for name in supervisor.services if name.endswith("guard"))
    assert until(lambda: "Complete" in supervisor.log(guard)), supervisor.log(guard)
    assert until(lambda: "/arm is active" in supervisor.log(guard)), supervisor.log(guard)
    assert until(lambda: not verified(tmp_path), 60), verified(tmp_path)
    assert offences(supervisor.log(guard)) == []
    failed = supervisor.end()
    assert failed == {}, [supervisor.log(name) for name in failed]


def test_a_lifecycle_node_that_was_started_again_is_activated_again(
    exported: Callable[..., Supervisor],
) -> None:
    supervisor = exported("systemd", "watch")
    supervisor.start_all()
    assert until(lambda: "/arm is active" in supervisor.log("rover-guard"))
    arm = supervisor.running["rover-arm"]
    arm.send_signal(signal.SIGINT)
    arm.wait(TIMEOUT_S)
    time.sleep(0.5)
    supervisor.start("rover-arm")
    assert until(lambda: len(re.findall("/arm is active", supervisor.log("rover-guard"))) == 2)


#: Stand-ins for stock nodes, of which only the packages are missing here: the URDF's fixed joints,
#: and one fixed edge.
STOCK = """#!{python}
import sys, yaml
import xml.etree.ElementTree as ET
from tfcompose.foundation.geometry import quat_from_rpy
from tfcompose.tf.ros.tf_codec import SentTransform, encode
from tfcompose.tf.ros.node import open_node
from tfcompose.foundation.signals import Stop
from tfcompose.tf.ros.node import TFPublisher
at = sys.argv.index("--ros-args")
own, ros_args = dict(zip(sys.argv[1:at:2], sys.argv[2:at:2])), sys.argv[at + 1 :]
files = [ros_args[n + 1] for n, word in enumerate(ros_args) if word == "--params-file"]
rules = [word for n, word in enumerate(ros_args) if word == "-r" or ros_args[n - 1] == "-r"]
edges = []
if own:
    numbers = [float(own[key]) for key in ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")]
    edges.append(SentTransform(0, own["--frame-id"], own["--child-frame-id"], tuple(numbers[:3]), tuple(numbers[3:])))
for file in files:
    for node in yaml.safe_load(open(file)).values():
        urdf = node["ros__parameters"].get("robot_description")
        for joint in ET.fromstring(urdf).findall("joint[@type='fixed']") if urdf else ():
            origin = joint.find("origin")
            xyz, rpy = ([float(x) for x in origin.get(key, "0 0 0").split()] for key in ("xyz", "rpy"))
            ends = [joint.find(end).get("link") for end in ("parent", "child")]
            edges.append(SentTransform(0, *ends, tuple(xyz), quat_from_rpy(*rpy)))
with Stop() as stop, open_node("stock", "", args=rules) as node:
    TFPublisher(node, static=True).publish(encode(edges))
    stop.wait(None)
"""  # noqa: E501 (a text as its reader has it)
LAUNCHED = """
tfcompose: 1
robot: rover
ros: {{discovery: localhost, domain_id: {domain}}}
links: {{base_link: {{}}, lidar: {{parent: base_link, xyz: [0, 0, 0.3], rpy: [0, 0, 90 deg]}}}}
frames:
  map: {{}}
  dock: {{parent: map, xyz: [1, 2, 0], rpy: [0, 0, 45 deg]}}
  arm: {{parent: base_link, xyz: [0, 0, 1], owner: arm, static: true}}
  base_link: {{parent: map, owner: drive, rate: 20 Hz}}
processes:
  drive: {{simulate: {{fixed: {{}}, rate: 20 Hz}}}}
  arm: {{run: {{package: arm, executable: arm}}, node: arm, lifecycle: active, params: {{speed: 2.5}}}}
"""  # noqa: E501 (a text as its reader has it)


class Action(SimpleNamespace):
    """An action of a launch file: its kind, and what it was given."""


def actions_of(file: Path, monkeypatch: pytest.MonkeyPatch) -> list[Action]:
    """Return what a launch file starts, where there is no launch.

    It is read with stand-ins for what it imports.
    """

    def kind(name: str) -> Any:
        return lambda *words, **options: Action(kind=name, words=words, **options)

    text = file.read_text("utf-8")
    for module in re.findall(r"^from ([a-z_.]+) import", text, re.MULTILINE):
        if module.startswith(("launch", "ament_index_python", "lifecycle_msgs")):
            stand_in = ModuleType(module)
            stand_in.__getattr__ = kind  # type: ignore[method-assign]
            monkeypatch.setitem(sys.modules, module, stand_in)
    names: dict[str, Any] = {"__file__": str(file), "__name__": "launch_file"}
    exec(compile(text, str(file), "exec"), names)  # noqa: S102 (the file under test)
    return list(names["generate_launch_description"]().words[0])


def run_actions(actions: list[Action], folder: Path) -> None:
    """Start what launch would, with stand-ins for stock nodes.

    A launch file's variables hold from then on.
    """
    stock = folder / "stock"
    stock.write_text(STOCK.format(python=sys.executable), "utf-8")
    for number, action in enumerate(actions):
        if action.kind == "SetEnvironmentVariable":
            os.environ.update([action.words])
            continue
        command = getattr(action, "cmd", None)
        if command is None:
            words = [sys.executable, str(stock), *getattr(action, "arguments", ()), "--ros-args"]
            command = [*words, "-r", f"__node:={action.name}", "-r", f"__ns:=/{action.namespace}"]
            for parameters in getattr(action, "parameters", ()):
                values = {
                    name: value.words[0] if isinstance(value, Action) else value
                    for name, value in parameters.items()
                }
                file = folder / f"{number}.yaml"
                file.write_text(yaml.safe_dump({"/**": {"ros__parameters": values}}), "utf-8")
                command += ["--params-file", str(file)]
        with (folder / f"{number}.log").open("wb") as out:
            processes.start(command, stdout=out, stderr=out)


SENT_BY_STOCK = """
tfcompose: 1
robot: rover
ros: {{discovery: localhost, domain_id: {domain}, namespace: r1}}
links: {{base_link: {{}}, lidar: {{parent: base_link, xyz: [0, 0, 0.3], rpy: [0, 0, 90 deg]}}}}
frames:
  map: {{}}
  dock: {{parent: map, xyz: [1, 2, 0], rpy: [0, 0, 45 deg]}}
  base_link: {{parent: map, owner: drive, rate: 20 Hz}}
processes:
  drive: {{simulate: {{fixed: {{}}, rate: 20 Hz}}}}
"""


def test_a_robot_that_its_own_launch_file_started_is_verified(
    domain: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "robot.yaml").write_text(SENT_BY_STOCK.format(domain=domain.id), "utf-8")
    command = [sys.executable, "-m", "tfcompose", "export", "launch", "robot.yaml", "-o", "build"]
    assert processes.run(command, cwd=tmp_path).returncode == 0
    actions = actions_of(tmp_path / "build" / "launch" / "rover.launch.py", monkeypatch)
    run_actions(actions, tmp_path)
    assert until(lambda: not verified(tmp_path), 60), verified(tmp_path)
    # Another state publisher beside tfcompose's own is one too many.
    for name in ("static", "drive"):
        exec_ = [*HERE, "exec", str(tmp_path / "build" / "plan.json"), name]
        processes.start(exec_, stderr=subprocess.DEVNULL)
    assert until(lambda: bool(verified(tmp_path, r"TF801.*robot_state_publisher")), 60)


@pytest.mark.skipif(shutil.which("ros2") is None, reason="ros2 launch is not installed")
def test_ros2_launch_starts_the_tree_of_the_plan_with_stock_nodes(
    domain: Any, start: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stock = STOCK.format(python=sys.executable)
    programs = {
        "tf2_ros": "static_transform_publisher",
        "robot_state_publisher": "robot_state_publisher",
        "arm": "arm",
    }
    for package, program in programs.items():
        file = tmp_path / "lib" / package / program
        file.parent.mkdir(parents=True)
        file.write_text(f"#!{sys.executable}\n{ARM}" if package == "arm" else stock, "utf-8")
        file.chmod(0o755)
        index = tmp_path / "share" / "ament_index" / "resource_index" / "packages" / package
        index.parent.mkdir(parents=True, exist_ok=True)
        index.touch()
    monkeypatch.setenv(
        "AMENT_PREFIX_PATH", f"{tmp_path}:{os.environ.get('AMENT_PREFIX_PATH', sys.prefix)}"
    )
    (tmp_path / "robot.yaml").write_text(LAUNCHED.format(domain=domain.id), "utf-8")
    assert (
        start("export", "launch", tmp_path / "robot.yaml", "-o", tmp_path / "build").process.wait(
            60
        )
        == 0
    )
    command = [
        "ros2",
        "launch",
        "--noninteractive",
        str(tmp_path / "build" / "launch" / "rover.launch.py"),
    ]
    with (tmp_path / "launch.log").open("wb") as out:
        launch = processes.start(command, stdout=out, stderr=out)
    try:
        assert until(lambda: verified(tmp_path) == "", 60), verified(tmp_path)
    finally:
        os.killpg(launch.pid, signal.SIGINT)
        launch.wait(TIMEOUT_S)
