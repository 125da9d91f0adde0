"""Exported launch files in Python, XML and YAML start the same, as ROS's launch reads them."""

import json
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in

pytest.importorskip("launch_ros", reason="launch comes with a distribution only")

SCRIPT = Path(__file__).parents[2] / "support/real_launch.py"
ROBOTS = sorted((Path(__file__).parents[3] / "robots").glob("*.yaml"))
#: Each setting of a process, and texts with all that a shell, YAML, XML and launch treat apart.
ROBOT = r"""
tfcompose: 1
robot: rover
ros: {domain_id: 5, clock: sim}
args:
  sim: {type: bool, default: false, description: 'a "simulator" \ $(not) <one>'}
  speed: {type: float, default: 1.5}
  mode: {type: string, default: it's, choices: [it's, "fa$(st)", 'b\ack']}
  host: {type: string, default: 'he"re', env: MY_HOST}
links: {base_link: {}, lidar_link: {parent: base_link, xyz: [0, 0, 0.3]}}
frames:
  map: {}
  odom: {parent: map, owner: drive, rate: 20 Hz}
  base_link: {parent: odom, xyz: [1, 2, 3]}
processes:
  drive:
    run:
      package: demo
      executable: drive
      args: [--name, two words, "${args.mode}", "a ${args.host} b", '', 'q"q', $(x), 'b\s', ü]
    params: {speed: "${args.speed}", text: "5", n: 5, list: [1, 2], names: [a, "b,c"]}
    remap: {scan: "/${args.host}/scan", a: b}
    env: {A: "x  y", B: "${args.host}", C: '$(env X)', D: 'a\b'}
    restart: on-failure
    max_restarts: 4
    restart_delay: 2 s
    prefix: [nice, -n, "5"]
    stop: {timeout: 3 s, kill_timeout: 1500 ms}
    required: true
    log_level: debug
  tool:
    run: [sh, -c, 'echo "$HOME" > "$0"', x y]
    when: ${args.sim and args.speed > 1}
    output: screen
    cwd: maps
  fast:
    run: {package: demo, executable: fast}
    node: /other/fast
    when: ${not args.sim or args.mode == 'fa$(st)'}
    emulate_tty: true
  slow: {run: {package: demo, executable: slow}, when: "${not args.sim}"}
  late: {run: {package: demo, executable: late}, after: {planned: ready}}
  camera:
    run: {launch: camera_driver/camera.launch.xml, args: {name: front, mode: "${args.mode}"}}
    remap: {scan: rays}
    namespace: eyes
    env: {E: e}
  talker:
    component: demo/demo::Talker
    container: box
    params: {a: 5, b: [x, "y, z"], c: "7", d: 1.0, e: true, f: [1.0, 2.5], g: '$(x)'}
    remap: {chatter: "/${args.host}/chatter"}
    extra_arguments: {use_intra_process_comms: true}
  listener: {component: demo/demo::Listener, container: box, when: "${args.sim}"}
  later: {component: demo/demo::Later, container: box, after: {planned: ready}}
  planned:
    run: {package: demo, executable: planned}
    schedule: {cpus: [0]}
    ready: {time: 2 s}
containers: {box: {}}
"""
INCLUDED = """
<launch>
  <arg name="name"/>
  <arg name="mode"/>
  <node pkg="demo" exec="camera" name="$(var name)" args="$(var mode)"/>
</launch>
"""


def export(folder: Path, file: Path, form: str, code: int = 0) -> Path:
    """Return the launch file in a format; with code 1 none is written."""
    words = ("export", "launch", str(file), "-o", str(folder / "out"), "--format", form)
    done = tfcompose_in(folder, *words)
    assert done.returncode == code, done.stderr
    ending = "py" if form == "python" else form
    files = list((folder / "out/launch").glob(f"*.launch.{ending}"))
    assert len(files) == 1 - code
    assert ("TF928" in done.stderr) == bool(code)
    return next(iter(files), folder)


def started(file: Path, *arguments: str) -> dict[str, dict[str, Any]]:
    """Return what launch starts, with all settings, by component or command."""
    out = file.with_name(f"{file.name}.json")
    env = {**os.environ, "MY_HOST": "my'host"}
    done = processes.run([sys.executable, str(SCRIPT), str(out), str(file), *arguments], env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    by_name: dict[str, dict[str, Any]] = {}
    for process in map(normal, json.loads(out.read_text())):
        name = process.get("component") or " ".join(process["words"])
        assert name not in by_name
        by_name[name] = process
    return by_name


def normal(process: dict[str, Any]) -> dict[str, Any]:
    """Return a process with its parameters in one mapping, and no names of temporary files."""
    text = re.sub(r'/[^" ]*/out/launch/\.\.', "OUT", json.dumps(process))
    result: dict[str, Any] = json.loads(
        re.sub(r'(?<!launch/\.\.)/[^" ]*/out(?=[/"])', "OUT", text)
    )
    result.pop("texts", None)
    params: dict[str, Any] = {}
    for file in result.get("params", []) if "words" in result else []:
        for node in file.values():
            params |= node["ros__parameters"]
    if "words" in result:
        words = [word for word in result["words"] if "launch_params_" not in word]
        result["words"] = [word for word in words if word != "--params-file"]
        result["params"] = params
        supervision = result["supervision"]
        if supervision["output"] == "screen":
            supervision["output"] = {"both": "screen"}  # the same
        for signal in ("sigterm", "sigkill"):
            supervision[f"{signal}_timeout"] = float(supervision[f"{signal}_timeout"])
    return result


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Path]]:
    folder = tmp_path_factory.mktemp("formats")
    (folder / "maps").mkdir()
    share = folder / "prefix/share"
    (share / "camera_driver/deep").mkdir(parents=True)
    (share / "camera_driver/deep/camera.launch.xml").write_text(INCLUDED)
    (share / "ament_index/resource_index/packages").mkdir(parents=True)
    (share / "ament_index/resource_index/packages/camera_driver").touch()
    (folder / "robot.yaml").write_text(ROBOT, "utf-8")
    before = os.environ["AMENT_PREFIX_PATH"]
    os.environ["AMENT_PREFIX_PATH"] = f"{folder / 'prefix'}{os.pathsep}{before}"
    yield [export(folder, folder / "robot.yaml", form) for form in ("python", "xml", "yaml")]
    os.environ["AMENT_PREFIX_PATH"] = before


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("sim:=true", "speed:=2.5"),
        ("sim:=true", "mode:=fa$(st)", "host:=a b"),
        ("mode:=b\\ack", "speed:=3"),
    ],
    ids=" ".join,
)
def test_all_formats_start_the_same(files: list[Path], arguments: tuple[str, ...]) -> None:
    python, xml, yaml = (started(file, *arguments) for file in files)
    assert len(python) >= 8
    assert xml == python
    assert yaml == python


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.stem)
def test_example_robots_start_the_same_or_need_python(robot: Path, tmp_path: Path) -> None:
    """XML and YAML have no lifecycle nodes."""
    python = export(tmp_path, robot, "python")
    if "*managed(" in python.read_text("utf-8"):
        for form in ("xml", "yaml"):
            export(tmp_path, robot, form, code=1)
        return
    expected = started(python)
    assert expected
    assert started(export(tmp_path, robot, "xml")) == expected
    assert started(export(tmp_path, robot, "yaml")) == expected
