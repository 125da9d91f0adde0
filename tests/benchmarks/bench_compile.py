"""What building costs, beside xacro.

``python -m tests.benchmarks.bench_compile``, or name the file to pytest.

The same robot is written for both, for xacro as calls of a macro: bodies on moving joints with
inertia that is computed; or plain ones, boxes with a collision and a mass on fixed joints. Whole
processes take turns; the least of the processor's time for each counts, which a busy machine
changes little; compiled files are there before the first one.
"""

from __future__ import annotations

import compileall
import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from tests.benchmarks.results import record

if TYPE_CHECKING:
    from tests.benchmarks.results import Rows

#: What the installed command runs.
STARTED = "import sys; from tfcompose.cli import main; sys.exit(main())"
ROOT = Path(__file__).parents[2]
RUNS = 3
#: Robots: bodies on moving joints, and plain boxes on fixed ones.
KINDS = ("jointed", "plain")
#: Frames, and how many times as long as building xacro has to take. At 1,000 the two are alike:
#: half of a build is starting Python and the language's models. The last record has 1.3 and 1.5
#: times, other runs down to 0.9.
TIMES_FASTER = {1_000: 0.8, 5_000: 5.0}
MOST_GROWTH = 12.0  # from 1,000 frames to 10,000
MOST_MB = 1_000.0
#: What --read-back may add to building, of what yourdfpy alone takes to read both descriptions.
MOST_OF_READING = 1.5
READER = "import sys, yourdfpy\nfor file in sys.argv[1:]:\n"
READER += "    yourdfpy.URDF.load(file, build_scene_graph=False, load_meshes=False)"

XACRO = """<robot name="bench" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="segment" params="name parent length angle">
    <link name="${name}">
      <inertial>
        <mass value="1.5"/>
        <inertia ixx="${1.5 / 12 * 0.02}" ixy="0" ixz="0" iyy="${1.5 / 12 * (length * length + 0.01)}" iyz="0"
          izz="${1.5 / 12 * (length * length + 0.01)}"/>
      </inertial>
      <visual><geometry><box size="${length} 0.1 0.1"/></geometry></visual>
      <collision><geometry><box size="${length} 0.1 0.1"/></geometry></collision>
    </link>
    <joint name="${name}_joint" type="revolute">
      <parent link="${parent}"/><child link="${name}"/>
      <origin xyz="${length / 2} 0 0.1" rpy="0 0 ${radians(angle)}"/>
      <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="1"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
"""  # noqa: E501 (a text as its reader has it)


PLAIN_XACRO = """<robot name="bench" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="segment" params="name parent length">
    <link name="${name}">
      <inertial>
        <mass value="1.5"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
      </inertial>
      <visual><geometry><box size="${length} 0.1 0.1"/></geometry></visual>
      <collision><geometry><box size="${length} 0.1 0.1"/></geometry></collision>
    </link>
    <joint name="${name}_joint" type="fixed">
      <parent link="${parent}"/><child link="${name}"/><origin xyz="0.1 0 0.1" rpy="0 0 0"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
"""


def names(frames: int) -> list[tuple[str, str, int]]:
    """Return each frame with its parent, ten to a branch, and its number."""
    return [(f"l{n}", f"l{n - 1}" if n % 10 else "base_link", n) for n in range(frames)]


def xacro_of(frames: int, kind: str) -> str:
    """Return the robot as calls of the macro."""
    if kind == "plain":
        plain = (
            f'  <xacro:segment name="{name}" parent="{parent}" length="0.{1 + n % 9}"/>\n'
            for name, parent, n in names(frames)
        )
        return PLAIN_XACRO + "".join(plain) + "</robot>\n"
    calls = (
        f'  <xacro:segment name="{name}" parent="{parent}" length="0.{1 + n % 9}"'
        f' angle="{n % 90}"/>\n'
        for name, parent, n in names(frames)
    )
    return XACRO + "".join(calls) + "</robot>\n"


def spec_of(frames: int, kind: str) -> str:
    """Return the same robot as a spec."""
    if kind == "plain":
        plain = (
            f"  {name}: {{parent: {parent}, xyz: [0.1, 0, 0.1], visual: {{box: [0.{1 + n % 9},"
            " 0.1, 0.1]}, collision: same, inertial: {mass: 1.5 kg}}"
            for name, parent, n in names(frames)
        )
        return "\n".join(["tfcompose: 1", "robot: bench", "links:", "  base_link: {}", *plain, ""])
    lines = ["tfcompose: 1", "robot: bench", "x-bodies:"]
    lines += [
        f"  - &body{n} {{visual: {{box: [0.{n}, 0.1, 0.1]}}, collision: same, inertial: {{mass:"
        " 1.5 kg}}"
        for n in range(1, 10)
    ]
    lines += [
        "links:",
        "  base_link: {}",
        *(f"  {name}: *body{1 + n % 9}" for name, _, n in names(frames)),
        "joints:",
    ]
    lines += [
        f"  {name}_joint: {{type: revolute, parent: {parent}, child: {name}, "
        f'xyz: ["${{0.{1 + n % 9} / 2}}", 0, 0.1], rpy: [0, 0, {n % 90} deg], axis: [0, 0, 1],'
        " limit: "
        + ("&limit {lower: -1, upper: 1, effort: 10, velocity: 1}}" if n == 0 else "*limit }")
        for name, parent, n in names(frames)
    ]
    return "\n".join([*lines, ""])


def cost(words: list[str], folder: Path) -> tuple[float, float]:
    """Return the processor's seconds and the greatest resident size, in MB, of a whole process."""
    process = subprocess.Popen([sys.executable, *words], cwd=folder, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{words} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000


def measure(runs: int = RUNS) -> dict[str, tuple[float, float]]:
    """Return the least seconds and the most megabytes of each command.

    Those that are compared take turns.
    """
    compileall.compile_dir(ROOT / "tfcompose", quiet=2)
    found = importlib.util.find_spec("xacro")
    if found is None or found.origin is None:
        raise RuntimeError("xacro is not installed")
    compileall.compile_dir(Path(found.origin).parent, quiet=2)
    taken: dict[str, list[tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, frames in ROBOTS:
            (folder / f"{kind}{frames}.yaml").write_text(spec_of(frames, kind), encoding="utf-8")
            (folder / f"{kind}{frames}.xacro").write_text(xacro_of(frames, kind), encoding="utf-8")
        for number in range(runs):
            for kind, frames in ROBOTS:
                one = f"{kind}{frames}"
                # xacro takes tens of seconds for a large robot, and as long each time.
                with_xacro = frames == 1_000 or (frames in TIMES_FASTER and number == 0)
                for command, words in commands(one).items():
                    if (
                        with_xacro
                        if command == "xacro"
                        else command == "tfcompose" or kind == "jointed"
                    ):
                        taken.setdefault(f"{command} {one}", []).append(cost(words, folder))
    return {
        name: (min(t for t, _ in costs), max(m for _, m in costs)) for name, costs in taken.items()
    }


#: What is measured: a kind of robot, and how many frames it has.
ROBOTS = [(kind, frames) for kind in KINDS for frames in TIMES_FASTER] + [("jointed", 10_000)]


def commands(one: str) -> dict[str, list[str]]:
    """Return what is measured of one robot, in this order."""
    build = ["-c", STARTED, "build", f"{one}.yaml", "-o", f"out_{one}"]
    return {
        "tfcompose": build,
        "--read-back": [*build, "--read-back"],
        "yourdfpy": [
            "-c",
            READER,
            f"out_{one}/robot.urdf",
            f"out_{one}/robot.state_publisher.urdf",
        ],
        "xacro": ["-c", f"import xacro; open('x.urdf', 'w').write(xacro.process('{one}.xacro'))"],
    }


def faster(found: dict[str, tuple[float, float]], one: str) -> float:
    """Return how many times as long as tfcompose xacro takes."""
    return found[f"xacro {one}"][0] / found[f"tfcompose {one}"][0]


def reading(found: dict[str, tuple[float, float]], frames: int) -> float:
    """Return what reading the result back costs, as a part of what yourdfpy alone takes."""
    added = found[f"--read-back jointed{frames}"][0] - found[f"tfcompose jointed{frames}"][0]
    return added / found[f"yourdfpy jointed{frames}"][0]


def test_building_stays_within_its_limits_and_grows_with_the_robot() -> None:
    found = measure()
    for frames, times in TIMES_FASTER.items():
        assert faster(found, f"jointed{frames}") >= times, found
        assert faster(found, f"plain{frames}") >= times, found
        assert reading(found, frames) <= MOST_OF_READING, found
    assert found["tfcompose jointed10000"][0] <= MOST_GROWTH * found["tfcompose jointed1000"][0], (
        found
    )
    assert found["tfcompose jointed10000"][1] <= MOST_MB, found


def rows(found: dict[str, tuple[float, float]]) -> Rows:
    """Return what the README prints: both robots, in both sizes."""
    whats = {
        "jointed": "inertia that is computed, on moving joints",
        "plain": "boxes with a mass, on fixed joints",
    }
    made: Rows = {}
    for kind, frames in ROBOTS:
        if frames not in TIMES_FASTER:
            continue
        one = f"{kind}{frames}"
        ours, theirs = found[f"tfcompose {one}"][0], found[f"xacro {one}"][0]
        ratio = faster(found, one)
        made[f"{frames:,} links: {whats[kind]}"] = [
            f"{ours:.2f} s",
            f"{theirs:.2f} s: {ratio:.1f} times as long",
        ]
    return made


if __name__ == "__main__":
    before = os.getloadavg()[0]
    figures = measure()
    for name, (seconds, megabytes) in figures.items():
        sys.stdout.write(f"{name:22} {seconds:7.2f} s {megabytes:6.0f} MB\n")
    for frames in TIMES_FASTER:
        part = reading(figures, frames)
        sys.stdout.write(
            f"reading the result back costs {part:.2f} of yourdfpy alone, at most"
            f" {MOST_OF_READING:g}\n"
        )
    growth = figures["tfcompose jointed10000"][0] / figures["tfcompose jointed1000"][0]
    sys.stdout.write(f"10,000 frames cost {growth:.1f} times 1,000, at most {MOST_GROWTH:g}\n")
    record("compile", rows(figures), before)
