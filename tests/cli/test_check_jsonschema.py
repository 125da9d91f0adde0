"""The schema as users run it.

``check-jsonschema --schemafile schemas/robot.schema.json robot.yaml``.
"""

import subprocess
import sys
from pathlib import Path

from tests.support import processes

ROOT = Path(__file__).parents[2]
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))
HEAD = "tfcompose: 1\nrobot: r\n"
LINKS = "links: {base_link: {}}\n"

#: What is wrong, and what check-jsonschema names.
BROKEN = {
    "unknown section": (HEAD + LINKS + "gaurd: {mode: watch}\n", "gaurd"),
    "unknown key": (HEAD + "links: {base_link: {}, a: {parnet: base_link}}\n", "parnet"),
    "two numbers": (
        HEAD + "links: {base_link: {}, a: {parent: base_link, xyz: [0, 1]}}\n",
        "$.links.a",
    ),
    "no name": ("tfcompose: 1\n" + LINKS, "robot"),
    "another version": ("tfcompose: 2\nrobot: r\n" + LINKS, "$.tfcompose"),
    "a joint of no type": (
        HEAD + LINKS + "joints: {j: {type: hinge, parent: base_link, child: a}}\n",
        "$.joints.j.type",
    ),
    "a list for a mapping": (HEAD + "links: [base_link]\n", "$.links"),
    "an unknown preset": (
        HEAD + LINKS + "sensors: {c: {preset: realsense/d43, parent: base_link}}\n",
        "$.sensors.c.preset",
    ),
    "an unknown option": (
        HEAD
        + LINKS
        + "sensors: {c: {preset: realsense/d435i, parent: base_link, options: {streem:"
        " [color]}}}\n",
        "streem",
    ),
    "an unknown stream": (
        HEAD
        + LINKS
        + "sensors: {c: {preset: realsense/d435i, parent: base_link, options: {streams:"
        " [colour]}}}\n",
        "$.sensors.c.options.streams",
    ),
    "an unknown preset of a node": (
        HEAD + LINKS + "processes: {a: {run: [a], node: {preset: slam_tool}}}\n",
        "$.processes.a.node",
    ),
    "an unknown unit": (
        HEAD + "links: {base_link: {}, a: {parent: base_link, xyz: [0, 1, 3 cn]}}\n",
        "$.links.a.xyz[2]",
    ),
    "a unit of another dimension": (
        HEAD + "links: {base_link: {}, a: {parent: base_link, rpy: [0, 1, 3 cm]}}\n",
        "$.links.a.rpy[2]",
    ),
    "two rotations": (
        HEAD + "links: {base_link: {}, a: {parent: base_link, rpy: [0, 0, 0], look: up}}\n",
        "$.links.a",
    ),
    "an unknown code": (HEAD + LINKS + "rules: {TF9999: off}\n", "TF9999"),
}


def check(*files: Path) -> subprocess.CompletedProcess[str]:
    schema = ROOT / "schemas" / "robot.schema.json"
    command = [
        sys.executable,
        "-m",
        "check_jsonschema",
        "--schemafile",
        str(schema),
        *map(str, files),
    ]
    return processes.run(command)


def test_the_example_robots_and_presets_of_ones_own_pass(tmp_path: Path) -> None:
    own_file = tmp_path / "own.yaml"
    preset = "sensors: {c: {preset: realsense/mine, parent: base_link, options: {any: 1}}}\n"
    own_file.write_text(f"{HEAD}{LINKS}preset_path: [presets]\n{preset}", encoding="utf-8")
    done = check(*ROBOTS, own_file)
    assert done.returncode == 0, done.stdout + done.stderr


def test_each_broken_robot_is_refused_and_the_wrong_part_named(tmp_path: Path) -> None:
    """The example robots are, too, in which one word is changed: nothing refuses them but that."""
    texts = BROKEN | {
        robot.stem: (robot.read_text("utf-8").replace("\nrobot:", "\nrobt:", 1), "robt")
        for robot in ROBOTS
    }
    files = {name: tmp_path / f"{name}.yaml" for name in texts}
    for name, (text, _) in texts.items():
        files[name].write_text(text, encoding="utf-8")
    done = check(*files.values())
    assert done.returncode == 1
    for name, (_, part) in texts.items():
        output = [line for line in done.stdout.splitlines() if str(files[name]) in line]
        assert output, f"{name} is let through"
        assert any(part in line for line in output), output
