"""CONTRIBUTING.md says what the code says: its drawing is fresh, and what it names is there."""

from __future__ import annotations

import ast
import re
import struct

import yaml

from tests.support.guard_history import History
from tests.support.house import GUIDE, ROOT, mermaid, with_drawing
from tests.support.machine_history import GUARD, begin
from tests.support.skips import ACCEPTED
from tfcompose.cli.compiling import library
from tfcompose.cli.console import Console
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.compiler.resolve import resolve
from tfcompose.foundation.catalogue import read_code
from tfcompose.model.messages import GUARD_EVENTS, Clear, FindingShown, line_of
from tfcompose.model.plan.file import read_plan, write_plan
from tfcompose.spec.language import validate
from tfcompose.spec.load import load
from tfcompose.tf.ros.tf_codec import SentTransform, encode

TEXT = GUIDE.read_text("utf-8")
#: As many as the way of a mount's xyz may have.
MOST_HANDS = 6
MOUNT = """tfcompose: 1
robot: r
frames: {base_link: {}}
sensors:
  c: {preset: generic/lidar2d, parent: base_link, xyz: [0.2, 0, 30 cm], driver: none}
"""
#: What the examples would add.
NEW = {
    "tfcompose/data/codes/TF506.md",
    "tfcompose/data/presets/hokuyo/uam-05lp.yaml",
    "tfcompose/cli/commands/frames.py",
    "tfcompose/tools/exporters/procfile.py",
    "tests/benchmarks/suite/tree.py",
}


def test_the_drawing_is_that_of_the_imports() -> None:
    assert with_drawing(TEXT) == TEXT, "python -m tests.support.house --write"
    assert "  launcher --> tf\n" in mermaid()


def test_each_function_on_the_way_of_a_file_is_there() -> None:
    names = set(re.findall(r"`(tfcompose(?:\.\w+){2,})`", TEXT))
    assert len(names) > 20
    for name in names:
        module, _, function = name.rpartition(".")
        tree = ast.parse((ROOT / f"{module.replace('.', '/')}.py").read_text("utf-8"))
        assert function in {
            node.name for node in tree.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))
        }, name


def test_a_mounts_xyz_passes_at_most_six_hands_each_to_the_next() -> None:
    section = TEXT.partition("## The way of a mount's xyz\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.*?) \| (`.*?`) \|$", section, re.MULTILINE)
    assert 4 < len(rows) <= MOST_HANDS
    modules = [re.findall(r"`tfcompose\.(\w+)\.", hands)[0] for _, hands in rows]
    assert modules == ["spec", "spec", "compiler", "compiler", "model", "launcher"]


def test_a_mounts_xyz_has_the_forms_of_the_way() -> None:
    xyz = (0.2, 0.0, 0.3)
    source = load(MOUNT, "r.yaml")
    assert source.mapping("sensors", "c")["xyz"] == [0.2, 0, "30 cm"]
    assert source.span_of(("sensors", "c", "xyz", 2)).line == MOUNT.count("\n")
    validated = validate(source)
    assert validated.spec.sensors["c"].xyz == xyz
    draft, _ = resolve(validated, library())
    (edge,) = [edge for edge in draft.robot.edges if edge.declared]
    assert edge.pose.xyz == xyz
    plan = read_plan(write_plan(plan_of(draft.robot)), "plan.json")
    (planned,) = [planned for planned in plan.edges if planned.child == edge.child]
    assert planned.pose.xyz == xyz
    pose = planned.pose
    sent = encode([SentTransform(0, planned.parent, planned.child, pose.xyz, pose.quat_xyzw)])
    assert struct.pack("<3d", *xyz) in sent


def test_tf801_passes_at_most_five_hands() -> None:
    section = TEXT.partition("## The way of TF801\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.*?) \| `tfcompose\.(\w+)\..*?` \|$", section, re.MULTILINE)
    assert [wing for _, wing in rows] == ["tf", "guard", "guard", "launcher", "cli"]


def test_tf801_has_the_forms_of_its_way() -> None:
    guard = History().clear()
    for name in ("/slam", "/old_slam"):
        guard.repeat(guard.joins(name), "map odom", 10)
    (event,) = [event for event in guard.events if isinstance(event, FindingShown)]
    assert event.found.code == "TF801"
    launcher = begin(GUARD).feed(Clear(), GUARD_EVENTS.decode(line_of(event)))
    (notice,) = launcher.all(FindingShown)
    assert notice.found == event.found
    output = Lines()
    Console(launcher.plan, output, colour=False)(notice)
    assert "TF801" in output.text
    assert "/old_slam" in output.text


class Lines:
    """Keeps what a console writes."""

    text = ""

    def write(self, text: str, *, log: bool = False) -> None:
        del log
        self.text += text


def test_each_file_that_it_names_is_there() -> None:
    names = set(re.findall(r"\b(?:tests|tfcompose)/[\w/.-]*\w", TEXT))
    assert len(names) > 15
    assert {name for name in names if not (ROOT / name).exists()} == NEW


def test_the_page_of_a_new_rule_is_understood() -> None:
    (text,) = re.findall(r"^```markdown\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    code = read_code("TF506", text)
    assert f'@rule("{code.code}", of_urdf=True)\ndef {code.name}(' in TEXT


def test_the_fast_tests_are_folders_that_are_there() -> None:
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    hooks = {hook["id"]: hook for repo in config["repos"] for hook in repo["hooks"]}
    folders = [word for word in hooks["fast-tests"]["entry"].split() if word.startswith("tests/")]
    assert len(folders) > 10
    assert all((ROOT / folder).exists() for folder in folders)


def test_tests_that_may_be_skipped_are_there() -> None:
    for name in ACCEPTED:
        file, _, test = name.partition("::")
        assert f"def {test}" in (ROOT / file).read_text("utf-8"), name
