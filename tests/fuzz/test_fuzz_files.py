"""Robots of many files, each in turn damaged: findings or a robot, never a traceback.

A process of its own does the work: its memory is bounded by the system to 500 MB, and no damage
makes a compilation take more than twenty times the processor time of the undamaged robot's.
"""

import sys
from pathlib import Path

import pytest

from tests.support import processes

ROOT = Path(__file__).parents[2]
WORK = r"""
import random, resource, sys, time
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.compiler.emit import emit
from tfcompose.compiler.urdf.packages import Disk

resource.setrlimit(resource.RLIMIT_DATA, (500_000_000, 500_000_000))
seed, count = map(int, sys.argv[1:])
robot = '''
tfcompose: 1
robot: cell
vars: {high: 30 cm}
calibrations: [lidar.yaml]
packages: {arm: .}
ros: {shared_frames: [map], isolate: topics, namespace: site}
links: {table: {parent: map, visual: {mesh: a.stl}, inertial: {mass: 3, inertia: {ixx: 1, iyy: 1, izz: 1}}}}
frames:
  map: {}
  spot: {parent: table, look: {down: 20 deg}}
  tip: {parent: spot, relative_to: left_base, xyz: [0, 0, 1]}
sensors:
  eye: {preset: generic/lidar3d, parent: table, xyz: [0, 0, "${high}"]}
  cam: {preset: realsense/d435i, parent: spot, tf: tfcompose, driver: none, calibration: {file: kit.yaml}}
processes:
  slam: {run: {package: p, executable: e}, params: {file: nav.yaml, odom: "${frame(map)}"}}
parts:
  left: {urdf: arm.urdf, prefix: left_, parent: table, root: base, xyz: [0, 0.3, 0]}
  other: {spec: other.yaml, prefix: o_, namespace: other, vars: {reach: 0.5}, parent: map}
'''
arm = '''<robot name="arm"><link name="world"/><link name="base"><visual><geometry><box size="1 1 1"/></geometry>
<material name="m"><color rgba="1 0 0 1"/></material></visual></link><link name="tool"/>
<joint name="a" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 1" rpy="0 0 0"/></joint>
<joint name="b" type="revolute"><parent link="base"/><child link="tool"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<gazebo reference="tool"><x>1</x></gazebo></robot>'''
other = '''
tfcompose: 1
robot: other
vars: {reach: 1 m}
frames: {root: {}, hand: {parent: root, xyz: ["${reach}", 0, 0], axis_angle: {axis: [0, 0, 1], angle: 30 deg}}}
profiles: {a: {frames: {hand: null}}}
'''
files = {
    "r.yaml": robot, "arm.urdf": arm, "other.yaml": other,
    "lidar.yaml": "table:\n  eye_link: {x: 0, y: 0.01, z: 0.3, roll: 0, pitch: 0, yaw: 0.01}\n", "a.stl": "",
    "kit.yaml": "spot:\n  cam_color_optical_frame: {x: 0.1, y: 0, z: 1, roll: 0, pitch: !degrees 5, yaw: 0}\n",
    "nav.yaml": "/**: {ros__parameters: {a: 012}}\nslam:\n  ros__parameters: {alpha: [1, 2], deep: {b: on}}\n",
}
pieces = ["{", "}", "[", "]", ": ", "\n", "  ", "- ", "&a ", "*a", "<<: *a", "${", "}", "null", "~", "1e999",
          "-0.0", "!x ",
          '"', "'",
          "\x00", "\ufeff", "é", "<", ">", "/>", "<!--", "&amp;", "&x;",
          "9" * 400, "nan", "inf", "map", "table", "a: " * 200, "\t", "|", ">"]
rng = random.Random(seed)

def damaged(text):
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(text) + 1)
        end = min(len(text), at + rng.choice([0, 0, 1, 3, 10, 40]))
        begin = rng.randrange(len(text) + 1)
        what = rng.choice(pieces) if rng.random() < 0.7 else text[begin : begin + rng.randint(0, 60)]
        text = text[:at] + what + text[end:]
    return text

def compiled_in_s(now):
    def read(path):
        if path not in now:
            raise RejectedError([finding("TF001", "cannot be read: no such file", Span(path))])
        return now[path]
    disk = Disk(read, now.__contains__, lambda path: path == ".")
    shelves = library()
    begun = time.process_time()
    result = compile_robot(now["r.yaml"], "r.yaml", shelves, read=read, disk=disk)
    if result.robot and not result.errors:
        emit(result.robot)
    crashed = [one.message for one in result.findings if one.code == "TF903"]
    assert not crashed, crashed
    return time.process_time() - begun

compiled_in_s(files)  # what it imports
undamaged_s = compiled_in_s(files)
for number in range(count):
    name = rng.choice(list(files))
    now = files | {name: damaged(files[name])}
    try:
        taken_s = compiled_in_s(now)
        assert taken_s < 20 * undamaged_s, f"{taken_s:.3f} s, and {undamaged_s:.3f} s undamaged"
    except BaseException as error:
        print(f"{type(error).__name__}: {error}\nseed {seed}, number {number}, in {name}:\n{now[name]}")
        raise
print("done")
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.parametrize("seed", range(2))
def test_a_robot_of_many_files_survives_damage_to_any_of_them(seed: int, tmp_path: Path) -> None:
    script = tmp_path / "work.py"
    script.write_text(WORK, encoding="utf-8")
    command = [sys.executable, str(script), str(seed), "80"]
    done = processes.run(command, cwd=ROOT, timeout_s=300)
    assert done.stdout.endswith("done\n"), done.stdout[-3000:] + done.stderr[-3000:]
