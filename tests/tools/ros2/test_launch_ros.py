"""Robots in real ``ros2 launch``: robot files, actions in launch files, events, and their ends."""

import json
import os
import random
import signal
import sys
import time
from pathlib import Path

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


def test_ros2_launch_shows_arguments_and_profiles(ros2_launch: Ros2Launch) -> None:
    required = ROVER.replace("{default: 0.3, description", "{type: float, description")
    file = ros2_launch.write("rover.tfc.yaml", required)
    launch = ros2_launch(file, "--show-args")
    assert launch.process.wait() == 0
    launch.close()
    shown = " ".join(launch.output.split())
    assert "error" not in shown
    assert "'height': how high the lidar is 'mode'" in shown
    assert "'mode': One of: ['fast', 'slow'] (default: 'fast')" in shown
    assert "'demo': apply the profile demo (default: 'false')" in shown


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
    other = processes.run([sys.executable, "-c", f"{code}Parser.load(open({str(file)!r}))"])
    assert "ValueError" in other.stderr
    assert "other.yaml" in other.stderr


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


def test_a_guard_alone_watches_nodes_that_keep_their_launch_file_and_one_hands_its_edge_over(
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
