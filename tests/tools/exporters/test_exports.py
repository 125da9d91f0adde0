"""The plan for other launchers: units, a compose file, a launch file."""

import configparser
import os
import shlex
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, get_args
from xml.etree import ElementTree as ET

import pytest
import yaml

from tests.support import processes
from tests.support.findings import words_of
from tests.support.plans import built, compiled_plan
from tests.support.robots import DRIVEN
from tfcompose.cli import main
from tfcompose.launcher.program import anywhere
from tfcompose.model.plan import Plan, PlanProcess, StopRule
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.stock import stand_ins, static_names
from tfcompose.model.systemd import source_then_run
from tfcompose.tools.exporters.launch import launch
from tfcompose.tools.exporters.launch_frontends import LaunchFile, LaunchFormat
from tfcompose.tools.exporters.supervisors import Machine, compose, systemd

ROBOT = (Path(__file__).parents[3] / "robots" / "autonomous_robot.yaml").read_text("utf-8")


# systemd


def unit(text: str) -> dict[str, dict[str, list[str]]]:
    """Read a unit: sections, and each key's values in order."""
    parser = configparser.RawConfigParser(strict=False, delimiters=("=",), interpolation=None)
    parser.optionxform = str  # type: ignore[assignment]
    lines: dict[str, dict[str, list[str]]] = {}
    section = ""
    for line in text.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
            lines[section] = {}
        elif line:
            key, _, value = line.partition("=")
            lines[section].setdefault(key, []).append(value)
    parser.read_string(text)
    assert set(parser.sections()) == set(lines)
    return lines


def units(
    plan: Plan, machine: Machine | None = None
) -> dict[str, dict[str, dict[str, list[str]]]]:
    machine = machine or Machine("/opt/rover", "/usr/bin/python3")
    return {file.path: unit(file.text) for file in systemd(plan, machine)[0]}


def test_each_started_process_is_a_unit_and_the_target_wants_them_all() -> None:
    made = units(compiled_plan(DRIVEN))
    names = {f"rover-{name}.service" for name in ("static", "drive", "slam", "guard")}
    assert set(made) == {"rover.target", *names}
    assert set(made["rover.target"]["Unit"]["Wants"]) == {"network-online.target", *names}
    for name in names:
        assert (
            made[name]["Unit"]["PartOf"] == made[name]["Install"]["WantedBy"] == ["rover.target"]
        )


def test_own_processes_say_when_they_are_ready_and_others_are_executed() -> None:
    made = units(compiled_plan(DRIVEN))
    assert {name: unit["Service"]["Type"] for name, unit in made.items() if "Service" in unit} == {
        "rover-static.service": ["notify"],
        "rover-guard.service": ["notify"],
        "rover-drive.service": ["exec"],
        "rover-slam.service": ["exec"],
    }


def test_names_that_differ_only_in_a_slash_keep_separate_units() -> None:
    names = ("left/arm", "left-arm", "left arm", "arm")
    waits = PlanProcess("last", "run", argv=("last",), after={"left/arm": "started"})
    processes = (*(PlanProcess(name, "run", argv=(name,)) for name in names), waits)
    plan = replace(compiled_plan(DRIVEN), edges=(), processes=processes)
    units = {file.path: file.text for file in systemd(plan, Machine("/robot"))[0]}
    assert list(units) == [
        "rover.target",
        "rover-left-arm-2.service",
        "rover-left-arm.service",
        "rover-left-arm-3.service",
        "rover-arm.service",
        "rover-last.service",
    ]
    assert "After=rover-left-arm-2.service" in units["rover-last.service"]
    services = yaml.safe_load(compose(plan, Machine("."))[0][0].text)["services"]
    assert list(services) == ["left-arm-2", "left-arm", "left-arm-3", "arm", "last"]
    assert list(services["last"]["depends_on"]) == ["left-arm-2"]


def test_a_unit_restarts_stops_and_waits_as_the_plan_says() -> None:
    made = units(compiled_plan(DRIVEN))
    slam, drive = made["rover-slam.service"], made["rover-drive.service"]
    assert (
        slam["Unit"]["After"]
        == slam["Unit"]["Wants"]
        == ["rover-drive.service rover-static.service"]
    )
    assert (slam["Service"]["Restart"], slam["Unit"]["StartLimitBurst"]) == (["on-failure"], ["4"])
    assert drive["Service"]["Restart"] == ["always"]
    assert (drive["Service"]["KillSignal"], drive["Service"]["TimeoutStopSec"]) == (
        ["SIGTERM"],
        ["2"],
    )
    (command,) = slam["Service"]["ExecStart"]
    assert shlex.split(command) == [
        *anywhere("/usr/bin/python3"),
        "exec",
        "/opt/rover/plan.json",
        "slam",
    ]


def test_a_process_that_is_waited_for_until_it_is_done_is_oneshot() -> None:
    plan = compiled_plan(DRIVEN)
    late = replace(plan.process("slam"), after={"drive": "done"})
    plan = replace(
        plan,
        processes=tuple(late if process.name == "slam" else process for process in plan.processes),
    )
    assert units(plan)["rover-drive.service"]["Service"]["Type"] == ["oneshot"]
    assert units(plan)["rover-drive.service"]["Service"]["Restart"] == ["on-failure"]


@pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed"
)
@pytest.mark.parametrize("setup", [(), ("/opt/ros/jazzy/setup.bash", "/opt/ws/setup.bash")])
@pytest.mark.parametrize(("text", "profiles"), [(DRIVEN, ()), (ROBOT, ()), (ROBOT, ("demo",))])
def test_systemd_finds_nothing_wrong_with_the_units(
    text: str, profiles: tuple[str, ...], setup: tuple[str, ...], tmp_path: Path
) -> None:
    odd = {"ROS_HOME": "/home/a b/100 %", "QUOTED": 'a "b" \\ $HOME'}
    machine = Machine(str(tmp_path), sys.executable, setup, odd)
    files = systemd(compiled_plan(text, *profiles), machine)[0]
    for file in files:
        (tmp_path / file.path).write_text(file.text, "utf-8")
    command = [
        "systemd-analyze",
        "verify",
        "--man=no",
        *(str(tmp_path / file.path) for file in files),
    ]
    done = processes.run(command)
    output = [
        line
        for line in done.stderr.splitlines()
        if str(tmp_path) in line or "rover" in line or "robot" in line
    ]
    assert (done.returncode, output) == (0, [])


def test_a_value_stays_what_it_is_whatever_systemd_makes_of_its_characters() -> None:
    """A unit's ``%h`` is a folder, and ``$HOME`` in a command a variable.

    Doubled they are themselves.
    """
    machine = Machine(
        "/opt/100%h", "/usr/bin/python3", ("/opt/$HOME/my setup.bash",), {"A": '%h "b" \\ $C'}
    )
    static = units(compiled_plan(DRIVEN), machine)["rover-static.service"]["Service"]
    assert static["Environment"][:1] == [r'"A=%%h \"b\" \\ $C"']
    assert static["WorkingDirectory"] == ["/opt/100%%h"]
    (command,) = static["ExecStart"]
    assert '"/opt/$$HOME/my setup.bash" -- /usr/bin/python3' in command
    assert "/opt/100%%h/plan.json static" in command
    assert 'exec \\"$$@\\""' in command


# compose


def test_ros_has_somewhere_to_log_to_in_a_service_without_a_home() -> None:
    service = units(compiled_plan(DRIVEN))["rover-drive.service"]["Service"]
    assert (service["LogsDirectory"], service["Environment"]) == (
        ["tfcompose/rover"],
        ["ROS_LOG_DIR=%L/tfcompose/rover"],
    )
    output = Machine("/opt/rover", "/usr/bin/python3", env={"ROS_LOG_DIR": "/data/log"})
    assert (
        "LogsDirectory"
        not in units(compiled_plan(DRIVEN), output)["rover-drive.service"]["Service"]
    )


@pytest.mark.parametrize(("text", "profiles"), [(DRIVEN, ()), (ROBOT, ()), (ROBOT, ("demo",))])
def test_the_schema_of_compose_files_takes_ours(
    text: str, profiles: tuple[str, ...], tmp_path: Path
) -> None:
    """By the schema of the compose specification that check-jsonschema carries."""
    (file,), _ = compose(compiled_plan(text, *profiles), Machine(".."))
    (tmp_path / file.path).write_text(file.text, "utf-8")
    words = [
        "-m",
        "check_jsonschema",
        "--builtin-schema",
        "vendor.compose-spec",
        str(tmp_path / file.path),
    ]
    done = processes.run([sys.executable, *words])
    assert done.returncode == 0, done.stdout


def test_a_strict_guard_is_started_before_what_it_passes_on() -> None:
    plan = compiled_plan(DRIVEN.replace("processes:", "guard: {mode: strict}\nprocesses:"))
    made = units(plan)
    for name in ("static", "drive", "slam"):
        assert "rover-guard.service" in made[f"rover-{name}.service"]["Unit"]["After"][0].split()
    assert "After" not in made["rover-guard.service"]["Unit"]
    services = yaml.safe_load(compose(plan, Machine(".."))[0][0].text)["services"]
    assert services["static"]["depends_on"] == {"guard": {"condition": "service_started"}}


def test_each_process_is_a_service_on_the_host_network_with_its_waits() -> None:
    plan = compiled_plan(DRIVEN)
    (file,), output = compose(plan, Machine("..", image="robot:1"))
    made = yaml.safe_load(file.text)
    assert set(made) == {"name", "services"}
    services = made["services"]
    assert set(services) == {"static", "drive", "slam", "guard"}
    for name, service in services.items():
        assert (service["network_mode"], service["ipc"], service["image"]) == (
            "host",
            "host",
            "robot:1",
        )
        assert service["command"][-2:] == ["/robot/plan.json", name]
        assert service["environment"] == {
            "ROS_DOMAIN_ID": "7",
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
    assert services["slam"]["depends_on"] == {
        "drive": {"condition": "service_started"},
        "static": {"condition": "service_healthy"},
    }
    assert "healthcheck" in services["static"], "who waits for healthy waits for ever without it"
    assert (services["slam"]["restart"], services["drive"]["restart"]) == (
        "on-failure:3",
        "always",
    )
    assert (services["drive"]["stop_signal"], services["drive"]["stop_grace_period"]) == (
        "SIGTERM",
        "2000ms",
    )
    assert any("other is external" in line for line in output)


@pytest.mark.parametrize("profiles", [(), ("demo",)])
def test_every_service_that_awaits_health_checks_an_edge_of_the_plan(
    profiles: tuple[str, ...],
) -> None:
    plan = compiled_plan(ROBOT, *profiles)
    services = yaml.safe_load(compose(plan, Machine(".."))[0][0].text)["services"]
    edges = {(edge.parent, edge.child) for edge in plan.edges}
    for service in services.values():
        for awaited, how in service.get("depends_on", {}).items():
            assert awaited in services
            assert how["condition"] != "service_healthy" or "healthcheck" in services[awaited]
        if "healthcheck" in service:
            words = service["healthcheck"]["test"]
            assert words[0] == "CMD"
            assert tuple(words[words.index("echo") + 1 :][:2]) in edges


def test_a_health_check_has_the_ros_environment_of_the_entry_point(
    tmp_path: Path,
) -> None:
    service = yaml.safe_load(compose(compiled_plan(DRIVEN), Machine(".."))[0][0].text)["services"][
        "static"
    ]
    words = [word.replace("$$", "$") for word in service["healthcheck"]["test"][1:]]
    (tmp_path / "rolling").mkdir()
    (tmp_path / "rolling/setup.sh").write_text("export SOURCED=yes\n")
    end = words.index("python3")
    words[end:] = ["sh", "-c", 'echo "$SOURCED $1"', "sh", "two words"]
    words = [word.replace("/opt/ros", str(tmp_path)) for word in words]
    for distro, output in (("rolling", "yes two words"), ("jazzy", " two words")):
        env = {"PATH": os.environ["PATH"], "ROS_DISTRO": distro}
        done = processes.run(words, env=env)
        assert (done.stdout.strip("\n"), done.stderr) == (output, "")


def test_setup_files_with_spaces_are_sourced_in_order_before_the_command(tmp_path: Path) -> None:
    files = [tmp_path / "one more.sh", tmp_path / "-- two.sh"]
    for number, file in enumerate(files):
        file.write_text(f'export SOURCED="${{SOURCED}}{number}"\n')
    done = processes.run(
        source_then_run(
            [str(file) for file in files], ["sh", "-c", 'echo "$SOURCED $1"', "sh", "--"]
        )
    )
    assert (done.stdout, done.stderr) == ("01 --\n", "")
    assert source_then_run((), ["a"]) == ["a"]


def test_a_host_is_a_profile_and_nobody_waits_for_a_service_of_another() -> None:
    text = DRIVEN.replace("drive:\n", "drive:\n    host: rear\n", 1).replace(
        "processes:", "processes:\n  static: {host: brain}"
    )
    plan = compiled_plan(text)
    (file,), gaps = compose(plan, Machine(".."))
    services = yaml.safe_load(file.text)["services"]
    profiles = {name: service.get("profiles") for name, service in services.items()}
    assert (profiles["drive"], profiles["static"], profiles["slam"]) == (
        ["rear"],
        ["brain"],
        ["brain"],
    )
    assert set(services["slam"]["depends_on"]) == {"static"}, (
        "compose refuses one in a profile that is not started"
    )
    assert len([line for line in gaps if "slam" in line and "rear" in line]) == 1


def test_a_folder_that_a_container_does_not_have_is_reported() -> None:
    plan = compiled_plan(DRIVEN)
    folders = {"drive": "${build_dir}/x", "slam": "${build_dir}/../.."}
    processes = tuple(
        replace(process, cwd=folders.get(process.name)) for process in plan.processes
    )
    output = compose(replace(plan, processes=processes), Machine(".."))[1]
    (line,) = [line for line in output if "${build_dir}" in line]
    assert all(name in line for name in ("slam", "${build_dir}/../..", "/robot"))


# launch


class Recorded(SimpleNamespace):
    """What stands in for an action: its kind, and what it was told."""


def load(text: str, file: Path, monkeypatch: pytest.MonkeyPatch) -> list[Recorded]:
    """Return the actions of a launch file, with stand-ins for what it imports of launch."""

    def kind(name: str) -> Any:
        return lambda *words, **options: Recorded(kind=name, words=words, **options)

    for module in (
        "ament_index_python",
        "ament_index_python.packages",
        "launch",
        "launch.actions",
        "launch.conditions",
        "launch.event_handlers",
        "launch.events",
        "launch.launch_description_sources",
        "launch.substitutions",
        "launch_ros",
        "launch_ros.actions",
        "launch_ros.event_handlers",
        "launch_ros.events",
        "launch_ros.events.lifecycle",
        "launch_ros.parameter_descriptions",
    ):
        stand_in = ModuleType(module)
        stand_in.__getattr__ = kind  # type: ignore[method-assign]
        monkeypatch.setitem(sys.modules, module, stand_in)
    shares = sys.modules["ament_index_python.packages"]
    shares.get_package_share_directory = lambda name: str(file.parents[1] / "share" / name)  # type: ignore[attr-defined]
    messages = ModuleType("lifecycle_msgs.msg")
    messages.Transition = SimpleNamespace(TRANSITION_CONFIGURE=1, TRANSITION_ACTIVATE=3)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "lifecycle_msgs.msg", messages)
    names: dict[str, Any] = {"__file__": str(file), "__name__": "launch_file"}
    exec(compile(text, str(file), "exec"), names)  # noqa: S102 (the file under test)
    return list(names["generate_launch_description"]().words[0])


def launched(
    text: str, folder: Path, monkeypatch: pytest.MonkeyPatch, *profiles: str
) -> tuple[Plan, list[Recorded]]:
    files = built(text, *profiles)
    plan = read_plan(files["plan.json"], "plan.json")
    (folder / "robot.state_publisher.urdf").write_text(
        files["robot.state_publisher.urdf"], "utf-8"
    )
    (folder / "launch").mkdir()
    (file,), _ = launch(plan, LaunchFile(".."), files["robot.state_publisher.urdf"])
    return plan, load(file.text, folder / "launch" / file.path, monkeypatch)


def sent(actions: list[Recorded]) -> dict[tuple[str, str], list[float] | None]:
    """Return the edges that stock nodes send, by what these are told.

    Poses of static_transform_publishers alone.
    """
    edges: dict[tuple[str, str], list[float] | None] = {}
    for action in actions:
        if getattr(action, "executable", "") == "robot_state_publisher":
            urdf = action.parameters[0]["robot_description"].words[0]
            for joint in ET.fromstring(urdf).findall("joint"):  # noqa: S314 (our own)
                if joint.get("type") != "floating":
                    ends = tuple(str(joint.find(end).get("link")) for end in ("parent", "child"))  # type: ignore[union-attr]
                    edges[ends] = None  # type: ignore[index]
        elif getattr(action, "executable", "") == "static_transform_publisher":
            options = dict(zip(action.arguments[::2], action.arguments[1::2], strict=True))
            ends = (options["--frame-id"], options["--child-frame-id"])
            assert ends not in edges
            edges[ends] = [
                float(options[key])
                for key in ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
            ]
    return edges


@pytest.mark.parametrize(("text", "profiles"), [(DRIVEN, ()), (ROBOT, ()), (ROBOT, ("demo",))])
def test_stock_nodes_send_the_edges_that_our_publishers_send_and_no_other(
    text: str, profiles: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, actions = launched(text, tmp_path, monkeypatch, *profiles)
    own_edges = {
        (edge.parent, edge.child): edge
        for edge in plan.edges
        if edge.owner in ("static", "joints")
    }
    edges = sent(actions)
    assert set(edges) == set(own_edges)
    for ends, pose in edges.items():
        if pose is not None:
            assert pose == pytest.approx(
                [*own_edges[ends].pose.xyz, *own_edges[ends].pose.quat_xyzw], abs=1e-12
            )
    names = [action.name for action in actions if action.kind in ("Node", "LifecycleNode")]
    assert len(names) == len(set(names))


def test_a_launch_file_keeps_prefixes_and_delays_and_schedules_use_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = "restart: always, restart_delay: 2500 ms, prefix: nice -n 5"
    run = "{run: {package: base, executable: drive_node}, %s}"
    text = f"tfcompose: 1\nrobot: r\nlinks: {{base_link: {{}}}}\nprocesses:\n  a: {run % keys}\n"
    text += f"  b: {run % 'schedule: {cpus: [0]}'}\n"
    _, actions = launched(text, tmp_path, monkeypatch)
    (node,) = (action for action in actions if getattr(action, "name", "") == "a")
    assert (node.kind, node.prefix, node.respawn_delay) == ("Node", "nice -n 5", 2.5)
    (held,) = (action for action in actions if getattr(action, "name", "") == "b")
    assert held.cmd[1:] == [*anywhere("")[1:], "exec", str(tmp_path / "plan.json"), "b"]


def test_a_driver_is_a_node_with_its_name_parameters_and_remappings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan, actions = launched(DRIVEN, tmp_path, monkeypatch)
    (drive,) = (action for action in actions if action.kind == "LifecycleNode")
    assert (drive.package, drive.executable, drive.name, drive.namespace) == (
        "base",
        "drive_node",
        "drive",
        "/r1",
    )
    assert drive.arguments == ["--fast"]
    assert not hasattr(drive, "ros_arguments"), "name, remappings and parameters are told once"
    assert drive.parameters == [str(tmp_path / "params" / "drive.yaml")]
    assert ("cmd", "cmd_vel") in drive.remappings
    assert drive.additional_env == {"GREETING": '100 % "sure" $HOME'}
    assert drive.respawn
    (slam,) = (action for action in actions if action.kind == "ExecuteProcess")
    assert (slam.cmd, slam.name) == (list(plan.process("slam").argv), "slam")
    handlers = [action for action in actions if action.kind == "RegisterEventHandler"]
    assert len(handlers) == 2, "configured when it was started, and activated when it is inactive"
    variables = [action.words for action in actions if action.kind == "SetEnvironmentVariable"]
    assert variables == [("ROS_DOMAIN_ID", "7"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")]


JOINTED = """
tfcompose: 1
robot: arm
ros: {{discovery: localhost, namespace: left, clock: sim}}
links:
  base_link: {{}}
  upper: {{}}
joints:
  shoulder: {{type: revolute, parent: base_link, child: upper, axis: [0, 0, 1], limit: {{lower: -1, upper: 1}}}}
processes:
  joints: {joints}
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.parametrize(
    ("joints", "parameters"),
    [
        ("{rate: 50 Hz}", {"publish_frequency": 1000.0}),
        ("{params: {publish_frequency: 50}}", {"publish_frequency": 50.0}),
        (
            "{params: {publish_frequency: 5000, ignore_timestamp: true}}",
            {"publish_frequency": 1000.0},
        ),
    ],
)
def test_a_stock_state_publisher_passes_on_as_many_joint_states_as_ours(
    joints: str, parameters: dict[str, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its own default is 20 Hz, of which 16.7 are left of 50."""
    _, actions = launched(JOINTED.format(joints=joints), tmp_path, monkeypatch)
    (node,) = (
        action
        for action in actions
        if getattr(action, "executable", "") == "robot_state_publisher"
    )
    (passed,) = node.parameters
    assert passed.pop("robot_description").value_type is str
    expected = {**parameters, "use_sim_time": True}
    assert passed == expected | ({"ignore_timestamp": True} if "ignore" in joints else {})


def test_stock_nodes_send_where_ours_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = DRIVEN.replace("namespace: r1,", "namespace: r1, isolate: topics,")
    plan, actions = launched(text, tmp_path, monkeypatch)
    remap = [*plan.process("static").remap.items()]
    assert ("/tf_static", "/r1/tf_static") in remap
    stock = [
        action
        for action in actions
        if getattr(action, "package", "") in {"robot_state_publisher", "tf2_ros"}
    ]
    assert len(stock) > 1
    assert all(node.remappings == remap and node.namespace == "r1" for node in stock)


def test_without_a_joint_in_the_urdf_our_own_publisher_is_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "tfcompose: 1\nrobot: r\nframes: {map: {}, base_link: {parent: map, xyz: [1, 0, 0]}}\n"
    _, actions = launched(text, tmp_path, monkeypatch)
    assert [action.name for action in actions if action.kind == "ExecuteProcess"] == ["static"]
    assert sent(actions) == {}


def test_stock_nodes_stand_in_for_our_own_publishers_alone() -> None:
    plan = compiled_plan(DRIVEN)
    nodes_by_child = stand_ins(plan)
    assert set(nodes_by_child) == {edge.child for edge in plan.edges if edge.owner == "static"}
    assert nodes_by_child["dock"] == {"/r1/robot_state_publisher", "/r1/static_dock"}
    edges = tuple(replace(edge, child=edge.child.replace("lidar", "do/ck")) for edge in plan.edges)
    edges = tuple(replace(edge, child=edge.child.replace("dock", "do_ck")) for edge in edges)
    names = static_names(replace(plan, edges=edges))
    assert len(set(names.values())) == len(names) > 1, "no two nodes have one name"


TIMED = """
tfcompose: 1
robot: delayed
frames:
  base_link: {}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
processes:
  usb: {run: [usb_power], ready: {time: 30 s}}
  camera: {run: {package: camera, executable: node}, node: camera, lifecycle: active, after: {usb: ready}}
  filter: {run: [filter], ready: {time: 0.5 s}, after: {camera: started}}
  last: {run: [last], after: {filter: ready, usb: ready}}
  other: {run: [other], after: {usb: started}}
"""  # noqa: E501 (a text as its reader has it)


def test_a_wait_that_launch_lacks_is_reported_and_a_delay_is_kept() -> None:
    _, gaps = launch(
        compiled_plan(TIMED), LaunchFile(".."), built(TIMED)["robot.state_publisher.urdf"]
    )
    waits = {line.split()[0]: words_of(line) for line in gaps if "does not wait" in line}
    assert set(waits) == {"filter", "other"}
    assert "camera" in waits["filter"]
    assert "usb" in waits["other"]
    assert not [line for line in gaps if "started again" in line], "nobody restarts"


def test_who_waits_for_a_time_is_started_so_much_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, actions = launched(TIMED, tmp_path, monkeypatch)
    late = [
        (action.period, action.actions[0].name)
        for action in actions
        if action.kind == "TimerAction"
    ]
    assert late == [(30.0, "camera"), (30.0, "filter"), (30.5, "last")]
    assert {"usb", "other"} <= {getattr(action, "name", "") for action in actions}, (
        "these are started at once"
    )


def test_a_unit_is_started_for_others_when_its_time_has_passed() -> None:
    made = units(compiled_plan(TIMED))
    settling = {name: unit.get("Service", {}).get("ExecStartPost") for name, unit in made.items()}
    assert {name: words for name, words in settling.items() if words} == {
        "delayed-usb.service": ["/bin/sleep 30"],
        "delayed-filter.service": ["/bin/sleep 0.5"],
    }
    assert made["delayed-usb.service"]["Service"]["TimeoutStartSec"] == ["90"]
    assert made["delayed-camera.service"]["Unit"]["After"] == ["delayed-usb.service"]
    _, gaps = systemd(compiled_plan(TIMED), Machine("/opt/rover"))
    assert not [line for line in gaps if {"usb", "executed"} <= words_of(line)]
    assert [line for line in gaps if line.startswith("other")]


INCLUDING = """
tfcompose: 1
robot: including
ros: {namespace: r1, clock: sim}
frames:
  base_link: {}
  lidar: {parent: base_link, xyz: [0, 0, 0.3]}
processes:
  camera:
    run: {launch: camera_driver/camera.launch.py, args: {camera_name: front, config: "${build_dir}/x.yaml"}}
    namespace: eyes
    env: {LEVEL: debug}
    remap: {image: image_raw}
    restart: always
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.parametrize("below", ["", "launch/", "launch/deeper/"])
def test_a_launch_file_of_the_plan_is_included(
    below: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "share" / "camera_driver" / f"{below}camera.launch.py"
    file.parent.mkdir(parents=True)
    file.touch()
    plan, actions = launched(INCLUDING, tmp_path, monkeypatch)
    assert not [action for action in actions if action.kind == "ExecuteProcess"]
    (group,) = (action for action in actions if action.kind == "GroupAction")
    *settings, opaque = group.words[0]
    (include,) = opaque.function(None)
    assert [(each.kind, each.words) for each in settings] == [
        ("SetEnvironmentVariable", ("LEVEL", "debug")),
        ("PushRosNamespace", ("r1/eyes",)),
        ("SetRemap", ("image", "image_raw")),
        ("SetParameter", ("use_sim_time", True)),
    ]
    assert include.words[0].words == (str(file),)
    assert include.launch_arguments == [("camera_name", "front"), ("config", f"{tmp_path}/x.yaml")]
    _, gaps = launch(plan, LaunchFile(".."), built(INCLUDING)["robot.state_publisher.urdf"])
    assert [words for line in gaps if (words := words_of(line)) >= {"camera", "again"}]


@pytest.mark.parametrize(
    ("text", "profiles"), [(DRIVEN, ()), (ROBOT, ("demo",)), (INCLUDING, ()), (TIMED, ())]
)
def test_no_line_of_a_launch_file_is_long(text: str, profiles: tuple[str, ...]) -> None:
    files = built(text, *profiles)
    (file,), _ = launch(
        read_plan(files["plan.json"], "plan.json"),
        LaunchFile(".."),
        files["robot.state_publisher.urdf"],
    )
    assert max(map(len, file.text.splitlines())) <= 120
    assert all(
        len(line) <= 100
        for line in file.text.partition("return LaunchDescription")[2].splitlines()
    )


def test_what_launch_does_otherwise_with_a_process_is_reported() -> None:
    text = DRIVEN.replace("node: slam,", "node: slam, lifecycle: active,")
    _, output = launch(
        compiled_plan(text), LaunchFile(".."), built(text)["robot.state_publisher.urdf"]
    )
    ours = [words_of(line) for line in output]
    for names in (
        {"drive", "limit"},
        {"drive", "SIGINT", "SIGTERM"},
        {"/r1/slam", "lifecycle"},
        {"slam", "limit"},
    ):
        assert any(words >= names for words in ours), names


def test_own_publishers_start_unless_a_urdf_holds_all_edges(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = ROBOT.replace(
        "ros: {discovery: localhost}", "ros: {discovery: localhost, state_publisher: stock}"
    )
    _, actions = launched(text, tmp_path, monkeypatch, "demo")
    stock = [
        action
        for action in actions
        if getattr(action, "executable", "") == "robot_state_publisher"
    ]
    assert len(stock) == 1, "the plan's own"


def test_a_name_with_a_slash_is_a_name_for_everyone() -> None:
    plan = compiled_plan(DRIVEN)
    part = PlanProcess("arm/ekf", "run", argv=("ekf",), stop=StopRule())
    plan = replace(plan, processes=(*plan.processes, part))
    assert "rover-arm-ekf.service" in units(plan)
    assert "arm-ekf" in yaml.safe_load(compose(plan, Machine(".."))[0][0].text)["services"]


CONTAINER = """tfcompose: 1
robot: r
frames: {base_link: {}}
containers: {box: {}}
processes:
  a: {component: p/C, container: box, after: {first: started}}
  first: {run: [sleep, '9']}
  last: {run: [sleep, '9'], after: {a: ready}}
"""


def test_a_container_is_the_unit_and_what_it_loads_is_none() -> None:
    plan = compiled_plan(CONTAINER)
    files, gaps = systemd(plan, Machine("/opt/r", "/usr/bin/python3"))
    names = {file.path for file in files}
    assert "r-box.service" in names
    assert "r-a.service" not in names
    assert "r-box.service" in " ".join(
        unit(next(f.text for f in files if f.path == "r-last.service"))["Unit"]["After"]
    )
    assert {word for gap in gaps for word in words_of(gap)} >= {"a", "first", "last", "box"}
    services = yaml.safe_load(compose(plan, Machine("/opt/r", "/usr/bin/python3"))[0][0].text)[
        "services"
    ]
    assert "box" in services
    assert "a" not in services


@pytest.mark.parametrize("form", get_args(LaunchFormat))
def test_a_launch_file_starts_no_publisher_without_an_edge(form: LaunchFormat) -> None:
    robot = """
tfcompose: 1
robot: rover
frames: {odom: {}, base_link: {parent: odom, owner: drive}}
processes: {drive: {run: {package: demo, executable: drive}}}
"""
    files = built(robot)
    plan = read_plan(files["plan.json"], "plan.json")
    (file,), gaps = launch(plan, LaunchFile("..", form), files["robot.state_publisher.urdf"])
    assert "static" not in file.text
    assert any("static" in gap for gap in gaps)


# Launch files in XML and YAML; test_launch_formats_ros has what launch makes of them.

CONDITIONAL = """
tfcompose: 1
robot: rover
args: {sim: {type: bool, default: false}}
links: {base_link: {}}
processes:
  drive:
    run: {package: demo, executable: drive, args: [a b, "${args.sim}"]}
    params: {sim: "${args.sim}"}
    env: {A: '$(x)'}
    restart: always
    restart_delay: 2 s
    output: log
  tool: {run: [sh, -c, exit], when: "${not args.sim}"}
  talker: {component: demo/demo::Talker, container: box, params: {b: [x, y], e: true, n: 5}}
containers: {box: {}}
"""
#: Neither has lifecycle nodes, or can wait for an end.
PYTHON_ONLY = """
tfcompose: 1
robot: rover
links: {base_link: {}}
processes:
  map: {run: {package: maps, executable: server}, lifecycle: active}
  load: {run: [load]}
  drive:
    run: [drive]
    after: {load: done}
"""


def exported(folder: Path, text: str, form: str) -> tuple[int, Path]:
    (folder / "robot.yaml").write_text(text, "utf-8")
    code = main(["export", "launch", "robot.yaml", "-o", "out", "--format", form])
    return code, folder / f"out/launch/rover.launch.{form}"


def entities(element: ET.Element) -> list[Any]:
    """Return an element as launch reads YAML: attributes as texts, and entities in lists."""
    children = [entities(child) for child in element]
    return [element.tag, dict(element.attrib), children]


def as_element(name: str, data: dict[str, Any]) -> ET.Element:
    """Return an entity in YAML as an element."""
    element = ET.Element(name)
    for key, value in data.items():
        if key == "children":
            element.extend(as_element(*pair) for child in value for pair in child.items())
        elif isinstance(value, list) and isinstance(value[0], dict):
            element.extend(as_element(key, child) for child in value)
        elif isinstance(value, list):
            element.set(key, ", ".join(value))
            element.set(f"{key}-sep", ", ")
        else:
            element.set(key, str(value).lower() if isinstance(value, bool) else str(value))
    return element


def test_xml_and_yaml_launch_files_have_the_same_entities(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code, xml = exported(tmp_path, CONDITIONAL, "xml")
    assert code == 0
    assert "drive also prints its stderr" in capsys.readouterr().out
    root = ET.fromstring(xml.read_text("utf-8"))  # noqa: S314 (our own)
    code, file = exported(tmp_path, CONDITIONAL, "yaml")
    assert code == 0
    launched = yaml.safe_load(file.read_text("utf-8"))["launch"]
    read = [as_element(*pair) for entity in launched for pair in entity.items()]
    assert [entities(element) for element in read] == [entities(element) for element in root]
    (drive,) = root.findall("node[@exec='drive']")
    assert drive.get("args") == "'a b' $(var sim)"
    assert {env.get("name"): env.get("value") for env in drive.findall("env")} == {"A": "\\$(x)"}
    (tool,) = root.findall("executable")
    assert tool.get("unless") == "$(var sim)"
    types = [param.get("type") for param in root.findall(".//composable_node/param")]
    assert types == ["list_of_str", "bool", "int"]


@pytest.mark.parametrize("form", ["xml", "yaml"])
def test_what_only_python_can_do_is_found_at_its_key(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    code, file = exported(tmp_path, PYTHON_ONLY, form)
    errors = capsys.readouterr().err
    assert (code, file.exists()) == (1, False)
    assert [line.split(" ", 1)[0] for line in errors.splitlines() if "[TF928]" in line] == [
        "robot.yaml:6:62:",
        "robot.yaml:10:12:",
    ]
    assert exported(tmp_path, PYTHON_ONLY, "python")[0] == 0


def test_only_launch_files_have_a_format(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robot.yaml").write_text(PYTHON_ONLY, "utf-8")
    assert main(["export", "systemd", "robot.yaml", "--format", "xml"]) == 2
    assert not (tmp_path / "build").exists()
