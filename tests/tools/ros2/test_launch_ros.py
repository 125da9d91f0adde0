"""Robots in real ``ros2 launch``: robot files, actions in launch files, events, and their ends."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.support import processes
from tests.support.adoption import PUBLISHERS, hand_over_first
from tests.support.domains import Domain
from tests.support.processes import Started
from tests.support.ros2_launch import Ros2Launch, needs_ros2_launch
from tests.support.ros2_launch import ros2_launch as _fixture
from tests.support.waiting import gone, until
from tfcompose.launcher.program import HERE

pytestmark = [pytest.mark.ros, needs_ros2_launch]
ros2_launch = _fixture

ROVER = """
tfcompose: 1
robot: rover
args:
  height: {default: 0.3, description: how high the lidar is}
  mode: {default: fast, choices: [fast, slow]}
ros: {discovery: localhost, namespace: inner}
frames: {base_link: {}, lidar: {parent: base_link, xyz: [0, 0, "${args.height}"]}}
profiles:
  demo: {frames: {mast: {parent: base_link, xyz: [1, 0, 0]}}, processes: {say: {run: [echo, "${args.mode}"]}}}
"""  # noqa: E501 (a text as its reader has it)
TALKER = f"""
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(String, "chatter", 1)
print("I am", node.get_fully_qualified_name(), publisher.topic_name, node.get_parameter("use_sim_time").value)
rclpy.spin(node)
"""  # noqa: E501, F541 (as above)
COMPLETE = "tree complete"


def end(launch: Started, number: int = signal.SIGINT) -> int:
    """Send the signal and return the exit code; everything below has to end."""
    below = psutil.Process(launch.process.pid).children(recursive=True)
    code = launch.end(number)
    assert until(lambda: all(map(gone, below))), [process.cmdline() for process in below]
    return code


def test_a_robot_file_is_a_launch_file_of_the_same_robot(
    ros2_launch: Ros2Launch, domain: Domain
) -> None:
    ros2_launch.write("rover.tfc.yaml", ROVER)
    variant = ("--profile", "demo", "height:=0.5")
    build = (*HERE, "build", "rover.tfc.yaml", "-o", "build", *variant)
    processes.run(build, cwd=ros2_launch.folder, check=True)
    launch = ros2_launch("rover.tfc.yaml", "demo:=true", "height:=0.5")
    launch.until_says(COMPLETE)
    (plan,) = ros2_launch.plans()
    assert json.loads(plan.read_text("utf-8")) == json.loads(
        (ros2_launch.folder / "build/plan.json").read_text("utf-8")
    )
    verify = (*HERE, "verify", "rover.tfc.yaml", *variant, "--for", "2")
    verified = processes.run(verify, cwd=ros2_launch.folder, env=domain.environment)
    assert verified.returncode == 0, verified.stdout + verified.stderr
    assert end(launch) == 0
    assert "say" in launch.output


#: Sends an edge, and records the process, its node and the tree as it finds them.
RECORDER = """
import json, os, sys
from pathlib import Path
import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

rclpy.init()
node = rclpy.create_node("unnamed", automatically_declare_parameters_from_overrides=True)
publisher = node.create_publisher(TFMessage, "/tf", 10)
edge = TransformStamped()
edge.header.frame_id, edge.child_frame_id = "odom", "base_link"
edge.transform.translation.x = 2.5
edge.transform.rotation.w = 1.0
edges = {}

def send():
    edge.header.stamp = node.get_clock().now().to_msg()
    publisher.publish(TFMessage(transforms=[edge]))

def record(message):
    for item in message.transforms:
        at, turned = item.transform.translation, item.transform.rotation
        pose = [at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w]
        edges[item.child_frame_id] = [item.header.frame_id, *pose]
    if len(edges) == 3:
        values = {name: found.value for name, found in node.get_parameters_by_prefix("").items()}
        data = {
            "argv": sys.argv,
            "cwd": os.getcwd(),
            "edges": edges,
            "env": dict(os.environ),
            "niceness": os.nice(0),
            "node": node.get_fully_qualified_name(),
            "params": {name: value if isinstance(value, str) else repr(value) for name, value in values.items()},
            "topic": node.resolve_topic_name("scan"),
        }
        file = Path(__file__).with_suffix(".json")
        file.with_suffix(".new").write_text(json.dumps(data))
        file.with_suffix(".new").rename(file)

latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_subscription(TFMessage, "/tf", record, 10)
node.create_subscription(TFMessage, "/tf_static", record, latched)
node.create_timer(0.05, send)
rclpy.spin(node)
"""  # noqa: E501 (as above)
RECORDED = """
tfcompose: 1
robot: rover
args: {height: {type: float, default: 0.3}, mode: {type: string, default: fast}}
ros: {discovery: localhost, namespace: inner}
links: {base_link: {}, lidar: {parent: base_link, xyz: [0, 0, "${args.height}"], rpy: [10 deg, 0, 90 deg]}}
frames:
  odom: {}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
  mast: {parent: base_link, xyz: [1, 0, 0]}
profiles:
  demo: {frames: {mast: {xyz: [1, 2, 0]}}, processes: {drive: {env: {C: demo}}}}
processes:
  drive:
    run: [PYTHON, recorder.py, two words, "${args.mode}", '', $HOME, --ros-args]
    params: {height: "${args.height}", n: 5, text: "5", names: [a, "b, c"], numbers: [1.0, 2.5], deep: {on: true}}
    remap: {scan: /other/scan}
    env: {A: "x  y", B: "${args.mode}"}
    prefix: [nice, -n, "1"]
    log_level: debug
  beside: {run: [sleep, "1000"]}
"""  # noqa: E501 (as above)


def test_ros2_launch_starts_the_same_processes_and_edges_as_up(
    ros2_launch: Ros2Launch, domain: Domain
) -> None:
    folder = ros2_launch.folder
    ros2_launch.write("recorder.py", RECORDER)
    ros2_launch.write("rover.tfc.yaml", RECORDED.replace("PYTHON", sys.executable))
    values = ("height:=0.5", "mode:=it's slow")
    process = processes.start(
        (*HERE, "up", "rover.tfc.yaml", "--profile", "demo", *values),
        cwd=folder,
        env={**domain.environment, "ROS_LOG_DIR": str(folder / "log")},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    by_up = ended_robot(Started(process), folder)
    by_launch = ended_robot(ros2_launch("rover.tfc.yaml", "demo:=true", *values), folder)
    assert by_launch == by_up
    assert len(by_up["commands"]) >= 3
    assert by_up["edges"]["mast"][:3] == ["base_link", 1, 2]
    assert by_up["params"]["height"] == "0.5"
    assert by_up["env"]["B"] == by_up["argv"][2] == "it's slow"
    assert by_up["env"]["C"] == "demo"


def ended_robot(started: Started, folder: Path) -> dict[str, Any]:
    """Return what a robot that has started recorded, and its commands; end it.

    The id of its run, which no other has, is RUN in it.
    """
    file = folder / "recorder.json"
    try:
        started.until_says(COMPLETE)
        assert until(file.exists), started.output
        root = psutil.Process(started.process.pid)
        (up,) = [each for each in (root, *root.children(recursive=True)) if "up" in each.cmdline()]
        commands = sorted(command_of(each) for each in up.children(recursive=True))
        assert end(started) == 0
    finally:
        started.close()
    record = json.loads(file.read_text("utf-8"))
    file.unlink()
    run = record["env"]["TFCOMPOSE_RUN"]
    del record["env"]["TFCOMPOSE_LAUNCHER"]  # its pid and start
    result: dict[str, Any] = json.loads(
        json.dumps({**record, "commands": commands}).replace(run, "RUN")
    )
    return result


def command_of(process: psutil.Process) -> list[str]:
    """Return a command, with the program that a link such as python3 leads to."""
    program, *arguments = process.cmdline()
    return [os.path.realpath(program), *arguments]


def test_ros2_launch_shows_arguments_and_profiles(ros2_launch: Ros2Launch) -> None:
    required = ROVER.replace("{default: 0.3, description", "{type: float, description")
    file = ros2_launch.write("rover.tfc.yaml", required)
    launch = ros2_launch(file, "--show-args")
    assert launch.process.wait() == 0
    launch.close()
    output = " ".join(launch.output.split())
    assert "error" not in output
    assert "'height': how high the lidar is 'mode'" in output
    assert "'mode': One of: ['fast', 'slow'] (default: 'fast')" in output
    assert "'demo': apply the profile demo (default: 'false')" in output


@pytest.mark.parametrize(
    ("text", "place", "code"),
    [
        (
            ROVER.replace("parent: base_link, xyz: [0", "parent: bas_link, xyz: [0"),
            "8:41",
            "TF203",
        ),
        ("tfcompose: 1\nrobot: [rover\n", "2:8", "TF002"),
    ],
    ids=["a wrong name", "no YAML"],
)
def test_findings_end_launch_and_are_printed_once(
    ros2_launch: Ros2Launch, text: str, place: str, code: str
) -> None:
    ros2_launch.write("rover.tfc.yaml", text)
    launch = ros2_launch("rover.tfc.yaml")
    assert launch.process.wait() == 1
    launch.close()
    assert launch.output.count(f"rover.tfc.yaml:{place}: error[{code}]") == 1
    assert launch.output.count("[ERROR]") == 1  # launch's own: of its exit code 1
    assert "Traceback" not in launch.output
    listing = ros2_launch("rover.tfc.yaml", "--show-args")
    assert listing.process.wait() == 0
    listing.close()
    assert listing.output.count(f"rover.tfc.yaml:{place}: error[{code}]") == 1


def test_files_of_other_names_are_refused(ros2_launch: Ros2Launch) -> None:
    file = ros2_launch.write("other.yaml", ROVER)
    code = "from tfcompose.tools.ros2.frontend import RobotFileParser as Parser; "
    done = processes.run([sys.executable, "-c", f"{code}Parser.load(open({str(file)!r}))"])
    assert "ValueError" in done.stderr
    assert "other.yaml" in done.stderr


@pytest.mark.parametrize("language", ["xml", "yaml"])
def test_namespace_and_remappings_reach_nodes_and_topics_but_no_frame(
    ros2_launch: Ros2Launch, language: str
) -> None:
    talker = ros2_launch.write("talker.py", TALKER)
    node = f"{{run: [{sys.executable}, {talker}, --ros-args], ready: {{topic: chatter}}}}"
    ros2_launch.write("rover.yaml", f"{ROVER}processes: {{talker: {node}}}\n")
    texts = {
        "xml": """<launch><group>
<push_ros_namespace namespace="outer"/><set_remap from="chatter" to="loud"/>
<set_parameter name="use_sim_time" value="true"/>
<tfcompose file="$(dirname)/rover.yaml" profile="demo"><arg name="height" value="0.7"/></tfcompose>
</group></launch>""",
        "yaml": """launch:
- group:
  - push_ros_namespace: {namespace: outer}
  - set_remap: {from: chatter, to: loud}
  - set_parameter: {name: use_sim_time, value: "true"}
  - tfcompose:
      file: $(dirname)/rover.yaml
      profile: demo
      arg: [{name: height, value: "0.7"}]
""",
    }
    file = ros2_launch.write(f"bringup.launch.{language}", texts[language])
    launch = ros2_launch(file)
    launch.until_says("I am /outer/inner/talker /outer/inner/loud True")
    launch.until_says("ready talker")
    (plan,) = ros2_launch.plans()
    edges = json.loads(plan.read_text("utf-8"))["edges"]
    assert [(edge["parent"], edge["child"]) for edge in edges] == [
        ("base_link", "lidar"),
        ("base_link", "mast"),
    ]
    assert edges[0]["pose"][0][2] == 0.7
    assert end(launch) == 0


BRINGUP = """
from launch import LaunchDescription
from launch.actions import *
from launch.event_handlers import OnProcessExit
from tfcompose.tools.ros2.actions import TfCompose
from tfcompose.tools.ros2.event_handlers import OnRobotEnded, OnRobotProcessChanged, OnTreeComplete

def say(*words):
    return ExecuteProcess(cmd=["echo", *words], output="screen")

def generate_launch_description():
    robot = TfCompose(file="rover.yaml", profiles=["demo"], args={"height": "0.4"}, overlays=["over.yaml"])
    return LaunchDescription([
        robot,
        RegisterEventHandler(OnTreeComplete(target_action=robot, on_complete=[say("all", "is", "there")])),
        RegisterEventHandler(OnRobotProcessChanged(on_change=lambda event, _: print("changed", event.process, event.state, event.detail, flush=True))),
        RegisterEventHandler(OnRobotEnded(on_end=lambda event, _: print("robot ended:", event.exit_code, *event.because, flush=True))),
        RegisterEventHandler(OnProcessExit(target_action=robot, on_exit=lambda event, _: print("up exited:", event.returncode, flush=True))),
        ExecuteProcess(cmd=["sleep", "1000"], name="beside"),
    ])
"""  # noqa: E501 (as above)


def test_actions_wait_for_the_tree_and_a_required_end_is_an_event(
    ros2_launch: Ros2Launch,
) -> None:
    ros2_launch.write("rover.yaml", ROVER)
    ros2_launch.write("bringup.launch.py", BRINGUP)
    needed = {"run": ["sh", "-c", "until [ -e end ]; do sleep 0.05; done"], "required": True}
    ros2_launch.write("over.yaml", json.dumps({"processes": {"needed": needed}}))
    launch = ros2_launch("bringup.launch.py")
    launch.until_says("all is there")
    assert launch.output.index(COMPLETE) < launch.output.index("all is there")
    below = psutil.Process(launch.process.pid).children(recursive=True)
    (ros2_launch.folder / "end").touch()
    assert launch.process.wait(30) == 1
    launch.close()
    assert "changed needed exited exit code 0" in launch.output
    assert "up exited: 1" in launch.output
    assert "robot ended: 1 needed" in launch.output
    assert all(map(gone, below))


def test_a_lone_guard_watches_launched_nodes_and_one_hands_its_edge_over(
    ros2_launch: Ros2Launch, domain: Domain
) -> None:
    folder = ros2_launch.folder
    file = ros2_launch.write("bringup.launch.xml", PUBLISHERS)
    adopt = (*HERE, "adopt", file.name, "-o", "robot.yaml")
    processes.run(adopt, cwd=folder, check=True)
    exact = ("--tolerance", "0.000001mm,0.0000001deg", "--for", "3")
    verify = (*HERE, "verify", "robot.yaml", *exact)
    for action in ("tfcompose_guard", "tfcompose"):
        text = file.read_text("utf-8")
        ros2_launch.write(
            "all.launch.xml",
            text.replace("</launch>", f'<{action} file="$(dirname)/robot.yaml"/></launch>'),
        )
        launch = ros2_launch("all.launch.xml")
        launch.until_says(COMPLETE)
        verified = processes.run(verify, cwd=folder, env=domain.environment)
        assert verified.returncode == 0, verified.stdout + verified.stderr
        assert end(launch) == 0
        assert launch.output.count("static_transform_publisher") > 0
        hand_over_first(folder, "robot.yaml", file.name)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_nothing_is_left_behind_by_a_launch_that_is_killed(
    ros2_launch: Ros2Launch, number: signal.Signals
) -> None:
    ros2_launch.write("rover.tfc.yaml", ROVER)
    launch = ros2_launch("rover.tfc.yaml")
    launch.until_says(COMPLETE)
    end(launch, number)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_nothing_is_left_behind_whenever_launch_is_killed(
    ros2_launch: Ros2Launch, domain: Domain, number: int
) -> None:
    moment = random.Random(number)
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
    ros2_launch.write("rover.tfc.yaml", ROVER)
    launch = ros2_launch("rover.tfc.yaml", "demo:=true")
    time.sleep(moment.uniform(0, 6))
    launch.process.send_signal(numbers[number % 4])
    launch.process.wait(30)
    mark = f"ROS_DOMAIN_ID={domain.id}\0".encode()

    def left() -> list[int]:
        return [pid for pid in psutil.pids() if pid != os.getpid() and _has(pid, mark)]

    assert until(lambda: not left(), 20), [processes.command_line(pid) for pid in left()]


def _has(pid: int, mark: bytes) -> bool:
    """Return whether a process of the domain runs."""
    try:
        return mark in Path(f"/proc/{pid}/environ").read_bytes()
    except OSError:
        return False


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_a_launch_file_that_fails_ends_its_robot(ros2_launch: Ros2Launch, number: int) -> None:
    delay = random.Random(number).uniform(0, 4)
    ros2_launch.write("rover.yaml", ROVER)
    failures = (
        "OpaqueFunction(function=lambda _: 1 / 0)",
        'ExecuteProcess(cmd=["no_such_program"], on_exit=Shutdown())',
        'ExecuteProcess(cmd=["false"], on_exit=Shutdown())',
        'IncludeLaunchDescription("missing.launch.py")',
    )
    file = ros2_launch.write(
        "bringup.launch.py",
        f"""
from launch import LaunchDescription
from launch.actions import *
from tfcompose.tools.ros2.actions import TfCompose

def generate_launch_description():
    failing = TimerAction(period={delay}, actions=[{failures[number % 4]}, Shutdown()])
    return LaunchDescription([TfCompose(file="rover.yaml"), failing])
""",
    )
    launch = ros2_launch(file)
    assert until(lambda: launch.process.poll() is None and "process started" in launch.output)
    below = psutil.Process(launch.process.pid).children(recursive=True)
    launch.process.wait(40)
    assert until(lambda: all(map(gone, below)), 10)
