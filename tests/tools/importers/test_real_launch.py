"""What is imported of launch files is what ROS's launch would start; where launch is installed."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support import processes
from tests.support.bringups import (
    compiled,
    exported,
    flat,
    import_of,
    needs_launch,
    places,
    printed_errors,
    started_with,
)
from tests.support.composition import can_build, composition_interfaces
from tests.support.domains import Domain
from tests.tools.importers.test_exported import ARGUED, COMBINATIONS
from tests.tools.importers.test_launch import (
    BOXES_IN,
    COMPOSED,
    COMPOSED_XML,
    MORE,
    WITH_ARGUMENTS,
    XML,
    YAML,
)
from tfcompose.compiler.emit import emit
from tfcompose.model.plan.file import read_plan
from tfcompose.model.robot import Robot

pytestmark = needs_launch
SCRIPT = Path(__file__).parents[2] / "support/real_launch.py"
#: Each component has a name of the file's.
NAMED = COMPOSED.replace("early::HTTPServerNode", 'early::HTTPServerNode", name="http_server_node')


def started(file: Path, *words: str) -> dict[str, dict[str, Any]]:
    """Return what launch starts, by the node's name, or by the command.

    Words, names, remappings, parameters.
    """
    records = recorded(file, *words)
    return {record["node"]: _loaded(record) for record in records if "component" in record} | dict(
        one_of(record["words"], record["params"])
        for record in records
        if "component" not in record
    )


def recorded(file: Path, *words: str) -> list[dict[str, Any]]:
    """Return what launch starts, in order, as it is recorded."""
    out = file.with_name("started.json")
    environment = {**os.environ, "ROS_LOG_DIR": str(file.parent)}
    if can_build():
        folder = composition_interfaces(Path(tempfile.gettempdir()) / f"composition_{os.getuid()}")
        environment["PYTHONPATH"] = os.pathsep.join(
            [str(folder), os.environ.get("PYTHONPATH", "")]
        )
    subprocess.run(
        [sys.executable, SCRIPT, out, file, *words],
        check=True,
        env=environment,
        capture_output=True,
    )
    records: list[dict[str, Any]] = json.loads(out.read_text("utf-8"))
    return records


def _loaded(record: dict[str, Any]) -> dict[str, Any]:
    params = {key: repr(value) for key, value in sorted(record["params"].items())}
    return {"program": record["component"], **record, "params": params, "component": True}


def one_of(words: list[str], files: list[dict[str, Any]]) -> tuple[str, dict[str, Any]]:
    program = next((word for word in words if "/" in word and not word.startswith("-")), words[0])
    rest = words[words.index(program) + 1 :]
    split = rest.index("--ros-args") if "--ros-args" in rest else len(rest)
    rules = [
        right for left, right in zip(rest[split:], rest[split + 1 :], strict=False) if left == "-r"
    ]
    remap = dict(reversed([rule.split(":=", 1) for rule in rules]))  # the first one counts
    name, namespace = remap.pop("__node", ""), remap.pop("__ns", "/")
    parameters = [
        right for left, right in zip(rest[split:], rest[split + 1 :], strict=False) if left == "-p"
    ]
    params: dict[str, Any] = {
        name: yaml.safe_load(value) for name, value in (arg.split(":=", 1) for arg in parameters)
    }
    for file in files:
        for node in file.values():
            params |= flat(node["ros__parameters"])
    typed = {
        key: repr(list(value) if isinstance(value, tuple) else value)
        for key, value in sorted(params.items())
    }
    return name or program, {
        "program": program,
        "words": rest[:split],
        "namespace": namespace.strip("/"),
        "remap": remap,
        "params": typed,
    }


def of_robot(robot: Robot) -> dict[str, dict[str, Any]]:
    """Return the same of a robot's processes, by their nodes' names, or by their programs."""
    nodes = {
        process.name: process.ros_nodes[0].name.rpartition("/")[2]
        for process in robot.processes
        if process.package
    }
    return {
        process.get("node") or nodes.get(name, process["program"]): {
            key: value for key, value in process.items() if key not in {"env", "output"}
        }
        | ({"component": True} if "node" in process else {})
        for name, process in started_with(robot).items()
    }


def imported(file: Path, *words: str) -> dict[str, dict[str, Any]]:
    """Return the same of the robot that import makes of the file."""
    text, _ = import_of(file, *words, code=None)
    robot = compiled(text, file.parent).robot
    assert robot
    return of_robot(robot)


def installed(package: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of what a package shares that is installed below the folder."""
    prefix = folder / "install"
    index, share = prefix / "share/ament_index/resource_index/packages", prefix / "share" / package
    index.mkdir(parents=True)
    share.mkdir()
    (index / package).touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{prefix}:{os.environ.get('AMENT_PREFIX_PATH', '')}")
    return share


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("rover.launch.xml", XML, ()),
        ("rover.launch.yaml", YAML, ("name:=left",)),
        ("a.launch.py", WITH_ARGUMENTS, ("loud:=false", "mode:=fixed")),
        ("composed.launch.py", NAMED, ("rectify:=true",)),
        ("composed.launch.xml", COMPOSED_XML, ("rectify:=false",)),
        *((name, text, ()) for name, text in BOXES_IN.items()),
    ],
)
def test_each_process_is_started_as_launch_would(
    name: str,
    text: str,
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    share = installed("rover", tmp_path, monkeypatch)
    (share / "drive.yaml").write_text("/**: {ros__parameters: {speed: 1.5}}\n", encoding="utf-8")
    (tmp_path / "more.launch.xml").write_text(MORE, encoding="utf-8")
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    expected, actual = started(file, *words), imported(file, *words)
    expected = {
        key: value
        for key, value in expected.items()
        if not value["program"].endswith("/static_transform_publisher")
    }
    assert expected
    actual.pop("sleep", None)  # the time of a timer, which launch starts no process for
    assert actual.keys() == expected.keys()
    for key, value in expected.items():
        assert actual[key] == value, key


def test_actions_and_substitutions_of_other_packages_do_what_they_do(tmp_path: Path) -> None:
    file = tmp_path / "a.launch.py"
    file.write_text(OTHERS, encoding="utf-8")
    _, data = import_of(file)
    assert data["processes"]["made"]["params"] == {"speed": 6}
    assert data["processes"]["made"]["namespace"] == "outer/left"
    assert data["processes"]["own"]["run"] == {
        "package": "camera",
        "executable": "camera",
        "args": ["--fast"],
    }
    assert data["args"] == {"half": {"default": 3, "description": "of the speed"}}
    assert data["processes"]["kept"]["params"] == {"half": "${args.half}"}


OTHERS = """
from launch import Action, LaunchDescription, Substitution
from launch.actions import DeclareLaunchArgument, GroupAction, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace
class Twice(Substitution):
    def __init__(self, value):
        super().__init__()
        self.value = value
    def perform(self, context):
        return str(2 * int(context.perform_substitution(self.value)))
class Made(Action):
    def __init__(self, side, **kwargs):
        super().__init__(**kwargs)
        self.side = side
    def execute(self, context):
        return [Node(package="p", executable="e", name="made", namespace=self.side,
                     parameters=[{"speed": Twice(LaunchConfiguration("half"))}])]
def kept(context, params):
    return [Node(package="p", executable="e", name="kept", parameters=[params])]
class Camera(Node):
    def __init__(self, label):
        super().__init__(package="camera", executable="camera", name=label, arguments=["--fast"])
def generate_launch_description():
    return LaunchDescription([
        DeclareLaunchArgument("half", default_value="3", description="of the speed"),
        GroupAction([PushRosNamespace("outer"), Made("left")]),
        Camera("own"),
        OpaqueFunction(function=kept, kwargs={"params": {"half": LaunchConfiguration("half")}}),
    ])
"""


def test_launch_starts_nothing_and_reaches_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.launch.py"
    file.write_text(REACHING.replace("TOUCHED", str(tmp_path / "touched")), encoding="utf-8")
    text, data = import_of(file)
    assert text.splitlines()[0].endswith("read by ROS's launch")
    assert set(data["processes"]) == {"n"}
    assert not (tmp_path / "touched").exists()
    assert set(places(printed_errors(capsys), "TF020")) == {
        f"a.launch.py:{line}" for line in (5, 7, 11, 15)
    }


REACHING = """import os, socket
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_ros.actions import Node
os.system("touch TOUCHED")
try:
    socket.create_connection(("127.0.0.1", 22))
except OSError:
    pass
try:
    open("TOUCHED", "w")
except OSError:
    pass
try:
    os.posix_spawn("/bin/touch", ["touch", "TOUCHED"], {})
except OSError:
    pass
def generate_launch_description():
    return LaunchDescription([Node(package="p", executable="e", name="n")])
"""


@pytest.mark.parametrize("values", COMBINATIONS, ids=lambda values: "-".join(values.values()))
def test_launch_starts_an_export_like_the_plan_with_the_same_arguments(
    values: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for what waits for another one's end: here no process is started."""
    share = installed("nav2_bringup", tmp_path, monkeypatch)
    (share / "navigation_launch.py").write_text(INCLUDED, encoding="utf-8")
    (tmp_path / "argued.yaml").write_text(ARGUED, encoding="utf-8")
    file = exported(tmp_path / "argued.yaml", tmp_path / "out")
    processes = started(file, *(f"{name}:={value}" for name, value in values.items()))
    robot = compiled(ARGUED, tmp_path, **values).robot
    assert robot
    expected = of_robot(robot)
    is_included = expected.pop("nav2_bringup/navigation_launch.py", None) is not None
    assert (processes.pop("included", {}).get("words") == [values["mode"], "3"]) is is_included
    assert processes.pop("robot_state_publisher")["params"].keys() == {
        "publish_frequency",
        "robot_description",
        "use_sim_time",
    }
    for after_another in ("toolbox", "/once"):
        expected.pop(after_another, None)
    assert processes == expected


INCLUDED = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch.substitutions import LaunchConfiguration
def generate_launch_description():
    return LaunchDescription([
        ExecuteProcess(cmd=["included", LaunchConfiguration("mode"), LaunchConfiguration("n")])])
"""


N, ALL = "n: {ros__parameters: {x: 1}}\n", "/**: {ros__parameters: {x: 2}}\n"
#: How launch names the node, and mappings and texts of files in launch's order.
ORDERS: dict[str, tuple[str, list[Any]]] = {
    "a_file_after_what_all_nodes_have": ("name='n',", [N]),
    "a_mapping_after_a_file": ("name='n',", [N, {"x": 3}]),
    "a_mapping_whose_section_is_before": ("name='n',", [ALL + N, {"x": 3}]),
    "a_mapping_of_a_full_name": ("name='n', namespace='',", [ALL + N, {"x": 3}]),
    "a_full_name_that_comes_first": ("name='n', namespace='',", [f"/{N}{ALL}", {"x": 3}]),
    "a_file_after_a_mapping": ("name='n', namespace='',", [{"x": 3, "y": 3}, N]),
    "another_namespace": (
        "name='n', namespace='a',",
        [{"x": 3}, N, "a: {n: {ros__parameters: {y: 1}}}"],
    ),
    "patterns": (
        "name='n', namespace='a',",
        [{"x": 3}, "/*/n: {ros__parameters: {x: 1}}", ALL],
    ),
    "arguments_come_before": (
        "name='n', arguments=['--ros-args', '-p', 'x:=7', '-p', 'y:=8'],",
        [ALL],
    ),
    "arguments_of_a_full_name": (
        "name='n', namespace='', arguments=['--ros-args', '-p', 'x:=7'],",
        [{"y": 3}],
    ),
    "a_text_that_yaml_leaves_bare": ("name='n',", [{"y": "1e5"}]),
    "a_text_that_is_infinite": ("name='n', namespace='',", [{"y": "inf"}]),
    "a_text_that_yaml_quotes": ("name='n',", [{"y": "1.0"}]),
    "no_name": ("", [N, {"x": 3}]),
    "no_name_and_a_mapping_whose_section_is_before": ("", [ALL + N, {"x": 3}]),
    "no_name_and_a_file_for_all": ("", [{"x": 3, "y": 3}, N + ALL]),
}
ORDER = """
from launch import LaunchDescription
from launch_ros.actions import Node, SetParameter
def generate_launch_description():
    node = Node(package="p", executable="e", NAMED parameters=GIVEN)
    return LaunchDescription([SetParameter("x", 9), node])
"""
READER = """
import json, rclpy, sys
rclpy.init(args=sys.argv[1:])
options = {"allow_undeclared_parameters": True, "automatically_declare_parameters_from_overrides": True}
for name in "nm":
    node = rclpy.create_node(name, **options)
    print(json.dumps([node.get_parameter_or(one).value for one in "xy"]))
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.ros
@pytest.mark.parametrize(("named", "parameters"), ORDERS.values(), ids=ORDERS)
def test_a_real_node_has_the_parameters_that_it_has_with_launch(
    named: str, parameters: list[Any], tmp_path: Path, domain: Domain
) -> None:
    def file_of(name: str, text: str) -> str:
        (tmp_path / name).write_text(text, encoding="utf-8")
        return str(tmp_path / name)

    def read(words: list[str]) -> str:
        ros = words[words.index("--ros-args") :]
        command = [sys.executable, "-W", "ignore", "-c", READER, *ros]
        return processes.run(command, env=dict(domain.environment), check=True).stdout

    params = [
        file_of(f"{number}.yaml", arg) if isinstance(arg, str) else arg
        for number, arg in enumerate(parameters)
    ]
    text = ORDER.replace("NAMED", named).replace("GIVEN", repr(params))
    file = Path(file_of("a.launch.py", text))
    (launched,) = recorded(file)
    texts, words = iter(launched["texts"]), launched["words"]
    for index, word in enumerate(words):
        if word == "--params-file":
            words[index + 1] = file_of(f"launched_{index}.yaml", next(texts))
    robot = compiled(import_of(file)[0], tmp_path).robot
    assert robot
    built = {emitted.path: emitted.text for emitted in emit(robot)}
    planned = read_plan(built["plan.json"], "p").processes
    (process,) = (process for process in planned if "p/e" in process.argv[0])
    path = file_of("built.yaml", built.get(f"params/{process.name}.yaml", ""))
    assert read([arg.replace("${params_file}", path) for arg in process.argv]) == read(words)
