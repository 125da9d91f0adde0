"""The import of an exported launch file is the same robot, whatever its arguments are values."""

from itertools import product
from pathlib import Path
from typing import Any

import pytest

from tests.support.bringups import compiled, exported, import_of, needs_launch, started_with
from tfcompose.foundation.geometry import angle_between
from tfcompose.model.robot import Robot

pytestmark = needs_launch
#: All but the fleet: its export starts tfcompose's own publishers, whose edges stand in the plan
#: alone.
ROBOTS = sorted(
    file
    for file in (Path(__file__).parents[3] / "robots").glob("*.yaml")
    if file.stem != "two_rovers"
)
#: Every kind of process, and every place where an argument may stand.
ARGUED = """
tfcompose: 1
robot: argued
ros: {discovery: localhost}
args:
  sim: {default: false, description: "simulated drivers"}
  mode: {default: slam, choices: [slam, fixed]}
  cameras: {default: 2, min: 0, max: 8, env: NO_SUCH_CAMERAS}
  rate: {type: float, default: 20.0}
  height: {default: 0.5}
links: {base_link: {}}
containers:
  box: {isolation: isolated, executor: multi, namespace: front, args: ["--x"], remap: {a: "${args.mode}"},
        params: {k: 1}, restart: always, max_restarts: 4, output: log, emulate_tty: true}
  plain: {executor: multi, node: plain_box, when: "${args.cameras > 1}", stop: {timeout: 3 s, kill_timeout: 9 s}}
  mine: {package: my_package, executable: my_container, output: screen}
  elsewhere: {external: true, namespace: /somewhere}
frames:
  mast: {parent: base_link, xyz: [0, 0, "${args.height}"]}
processes:
  drive:
    when: ${not args.sim}
    run: {package: base, executable: drive_node, args: ["--mode", "${args.mode}", "--n=${args.cameras}"]}
    params: {rate: "${args.rate}", file_name: "/tmp/${args.mode}.txt", who: "${env(NO_SUCH_USER, nobody)}", fixed: 3.0,
             sub: {deep: "${args.cameras}"}, number: "${args.cameras}0"}
    remap: {scan: "${args.mode}/scan", odom: odometry}
    env: {MODE: "${args.mode}"}
    restart: always
    restart_delay: 2 s
    prefix: nice -n 5
  gazebo:
    when: ${args.sim}
    run: [gz, sim, "-r", "${args.mode}"]
  spawn:
    when: ${args.sim and (args.mode == 'slam' or args.cameras > 3)}
    run: {package: ros_gz_sim, executable: create}
    params: {world: a}
  slam:
    when: ${args.mode == "slam"}
    run: {package: slam_toolbox, executable: node}
    node: toolbox
    after: {calibrate: done}
  calibrate: {run: [python3, calibrate.py]}
  late: {run: [python3, late.py], after: {waits: ready}}
  waits: {run: {package: w, executable: w}, ready: {time: 3 s}, required: true}
  rectify:
    component: image_proc/image_proc::RectifyNode
    container: box
    namespace: left
    params: {queue_size: 5, rate: "${args.rate}", a: {b: [1.0, 2.0]}, who: "is ${args.mode}"}
    remap: {image: image_raw, camera_info: "/cam/${args.mode}"}
    extra_arguments: {use_intra_process_comms: true}
    when: ${args.sim}
  crop: {component: image_proc/image_proc::CropNode, container: plain, when: "${args.cameras > 1}"}
  once: {component: a/a::Once, container: mine, after: {calibrate: done}}
  then: {component: a/a::Then, container: mine, after: {waits: ready}}
  talker: {component: demo/demo::Talker, container: elsewhere}
  navigation_launch:
    run: {launch: nav2_bringup/navigation_launch.py, args: {mode: "${args.mode}", n: 3}}
    when: ${args.cameras >= 1 and args.mode != 'slam'}
"""  # noqa: E501 (a text as its reader has it)
COMBINATIONS = [
    {"sim": sim, "mode": mode, "cameras": cameras, "rate": rate}
    for sim, mode, cameras, rate in product(
        ("false", "true"), ("slam", "fixed"), ("0", "4"), ("20.0", "7.5")
    )
]


def edges_of(robot: Robot) -> dict[str, Any]:
    return {edge.name: edge for edge in robot.edges}


def same_tree(before: Robot, after: Robot) -> None:
    """All that tfcompose's own publishers send is there again, to 1e-9."""
    edges_before = {
        name: edge for name, edge in edges_of(before).items() if edge.owner in {"static", "joints"}
    }
    edges_after = edges_of(after)
    assert edges_before.keys() <= edges_after.keys()
    for name, edge in edges_before.items():
        assert (edge.kind, edge.joint_name if edge.joint else "") == (
            edges_after[name].kind,
            edges_after[name].joint_name if edges_after[name].joint else "",
        )
        off = max(
            abs(a - b) for a, b in zip(edge.pose.xyz, edges_after[name].pose.xyz, strict=True)
        )
        assert off < 1e-9
        assert angle_between(edge.pose.quat_xyzw, edges_after[name].pose.quat_xyzw) < 1e-9


@pytest.mark.parametrize("file", ROBOTS, ids=[file.stem for file in ROBOTS])
def test_the_import_of_an_export_is_the_same_robot(file: Path, tmp_path: Path) -> None:
    launch_file = exported(file, tmp_path / "out")
    text, _ = import_of(launch_file, code=None)
    before, after = (
        compiled(source, folder).robot
        for source, folder in ((file.read_text("utf-8"), file.parent), (text, launch_file.parent))
    )
    assert before
    assert after
    same_tree(before, after)
    expected, started = started_with(before), started_with(after)
    assert expected.keys() <= started.keys()
    for name, value in expected.items():
        assert started[name] == value, name


@pytest.fixture(scope="module")
def back(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    folder = tmp_path_factory.mktemp("argued")
    (folder / "argued.yaml").write_text(ARGUED, encoding="utf-8")
    launch_file = exported(folder / "argued.yaml", folder / "out")
    return import_of(launch_file, "--all-branches", code=None)[0], launch_file.parent


@pytest.mark.parametrize("values", COMBINATIONS, ids=lambda values: "-".join(values.values()))
def test_arguments_and_conditions_are_there_again(
    values: dict[str, str], back: tuple[str, Path], tmp_path: Path
) -> None:
    before, after = (
        compiled(ARGUED, tmp_path, **values).robot,
        compiled(back[0], back[1], **values).robot,
    )
    assert before
    assert after
    same_tree(before, after)
    expected, started = started_with(before), started_with(after)
    gates = started.keys() - expected.keys()
    assert all(name.startswith("delay") for name in gates)
    assert {name: started[name] for name in expected} == expected
    assert ("slam" in expected) == ("slam" in started)
    if "slam" in started:
        (slam,) = (process for process in after.processes if process.name == "slam")
        assert (slam.after, slam.node) == ({"calibrate": "done"}, "/toolbox")


def test_an_argument_that_decides_more_than_processes_has_its_value(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "argued.yaml").write_text(ARGUED, encoding="utf-8")
    text = exported(tmp_path / "argued.yaml", tmp_path / "out").read_text("utf-8")
    declared = [
        line.split('"')[1] for line in text.splitlines() if 'DeclareLaunchArgument("' in line
    ]
    assert declared == ["sim", "mode", "rate"], "that of cameras takes several lines"
    assert '"cameras",' in text
    assert "height is 0.5" in capfd.readouterr().out


def test_entry_arguments_that_launch_cannot_compute_keep_their_values(
    tmp_path: Path,
) -> None:
    text = ARGUED.replace('"--n=${args.cameras}"', '"--n=${args.cameras * 2}"')
    (tmp_path / "argued.yaml").write_text(text, encoding="utf-8")
    output = exported(tmp_path / "argued.yaml", tmp_path / "out").read_text("utf-8")
    assert "cameras" not in output
    assert '"--n=4"' in output
    assert '"spawn"' not in output, "its condition is false then"
