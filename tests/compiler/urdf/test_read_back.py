"""``build --read-back``: a description that differs from the robot is not written."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.random_robot import spec
from tests.support.robots import EVERYTHING
from tests.support.texts import robot_in
from tfcompose.cli import main
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.urdf.read_back import differences
from tfcompose.model.files import Target
from tfcompose.model.robot import Robot

ROBOTS = Path(__file__).parents[3] / "robots"
PRESETS = library()
TARGET = Target()
MORE = """tfcompose: 1
robot: more
links:
  base_link: {visual: [{capsule: {radius: 0.1, length: 0.5}}, {cylinder: {radius: 1, length: 2}, xyz: [1, 0, 0]}]}
  a: {visual: {mesh: {uri: "http://here/a.stl", scale: [1, 2, 3]}, material: {name: m, texture: "http://here/a.png"}}}
  b:
    collision: {sphere: {radius: 0.1}}
    inertial: {mass: 2, inertia: {ixx: 1, iyy: 2, izz: 2, ixy: 0.1}, rpy: [0.1, 0, 0]}
  c: {}
joints:
  j: {type: revolute, parent: base_link, child: a, rpy: [0.1, 0.2, 0.3], limit: {lower: -1, upper: 1, effort: 1},
      dynamics: {damping: 1}, safety_controller: {k_velocity: 1}, calibration: {rising: 0.5}}
  k: {type: prismatic, parent: a, child: b, mimic: {joint: j, offset: 1}, axis: [0, 1, 0],
      limit: {lower: 0, upper: 1}}
  turns: {type: continuous, parent: b, child: c, limit: {effort: 2, velocity: 3}}
"""  # noqa: E501 (a text as its reader has it)
#: What yourdfpy takes an axis for that is not there.
AXIS_OF_ITSELF = '    <axis xyz="1 0 0"/>\n'
SPECS = [
    pytest.param(json.dumps(spec(60, links=5)), id="family_60"),
    pytest.param(json.dumps(spec(61, links=9)), id="family_61", marks=pytest.mark.slow),
]
SPECS += [pytest.param(EVERYTHING, id="everything"), pytest.param(MORE, id="more")]


def robot_of(text: str) -> Robot:
    return robot_in(
        compile_robot(
            text, "r.yaml", PRESETS, read=lambda name: (ROBOTS / name).read_text("utf-8")
        )
    )


def texts(robot: Robot) -> dict[str, str]:
    return {file.path: file.text for file in emit(robot, TARGET)}


@pytest.mark.parametrize("file", sorted(ROBOTS.glob("*.yaml")), ids=lambda file: file.stem)
def test_what_build_writes_reads_back(file: Path, tmp_path: Path) -> None:
    assert main(["build", str(file), "-o", str(tmp_path / "out"), "--read-back"]) == 0
    assert (tmp_path / "out" / "plan.json").exists()


def changed(text: str, joints: set[str]) -> Iterator[tuple[str, str]]:
    """Yield the text with one value of a link or joint changed, and what was changed.

    ``joints`` are the names that joints have in the robot file.
    """
    root = ET.fromstring(text)  # noqa: S314 (our own text)
    for top in (*root.iterfind("link"), *root.iterfind("joint")):
        for element in top.iter():
            for key, value in element.attrib.items():
                if (top.tag, element, key) == ("joint", top, "name") and value not in joints:
                    continue  # of a frame that is no joint in the robot file
                element.set(key, changed_value(key, value))
                yield (
                    ET.tostring(root, "unicode"),
                    f"{top.get('name')}: {element.tag} {key}={value}",
                )
                element.set(key, value)


def changed_value(key: str, value: str) -> str:
    if key in {"name", "link", "joint", "filename", "type"}:
        return "floating" if value == "planar" else "planar" if key == "type" else f"{value}x"
    first, *rest = value.split()
    return " ".join([str(float(first) + 0.25), *rest])


@pytest.mark.parametrize("text", SPECS)
def test_whatever_value_is_another_one_is_noticed(text: str) -> None:
    robot = robot_of(text)
    files, observed = texts(robot), 0
    joints = {edge.joint_name for edge in robot.edges if edge.joint_name}
    for name, full in (("robot.urdf", True), ("robot.state_publisher.urdf", False)):
        assert not list(differences(robot, files[name], TARGET, full=full))
        for again, what in changed(files[name], joints):
            assert list(differences(robot, again, TARGET, full=full)), what
            observed += 1
    assert observed > 40


@pytest.mark.parametrize("text", SPECS)
def test_whatever_is_missing_or_there_twice_is_noticed(text: str) -> None:
    robot = robot_of(text)
    complete = texts(robot)["robot.urdf"]
    pieces = re.findall(
        r"^  <(?:link|joint) (?:[^>]*/>|.*?^  </(?:link|joint)>)\n",
        complete,
        re.MULTILINE | re.DOTALL,
    )
    pieces += re.findall(
        r"^    <(?:visual|inertial|axis|limit|mimic|origin).*?(?:/>|>)\n", complete, re.MULTILINE
    )
    pieces = [piece for piece in pieces if piece != AXIS_OF_ITSELF]
    for piece in dict.fromkeys(pieces):
        if piece.endswith("/>\n") or "\n  </" in piece:
            assert list(differences(robot, complete.replace(piece, "", 1), TARGET, full=True)), (
                piece
            )
        if piece.startswith(("  <link", "  <joint")):
            assert list(
                differences(robot, complete.replace(piece, piece * 2), TARGET, full=True)
            ), piece


UNSEEN = {
    "an axis that is URDF's default is missing": (AXIS_OF_ITSELF, ""),
    "a factor that is the default is missing": (' multiplier="1" offset="1"', ' offset="1"'),
    "a second limit": (
        'upper="1" effort="1"',
        'upper="1" effort="1" velocity="0"/><limit effort="3"',
    ),
    "another element in a joint": ("    <calibration", "    <brake/><calibration"),
    "another element in the robot": ("</robot>", '<transmission name="t"/></robot>'),
}


@pytest.mark.parametrize("case", UNSEEN)
def test_what_yourdfpy_does_not_read_is_not_claimed(case: str) -> None:
    """The option's help and the README leave these out.

    Where a new yourdfpy sees more, they can say so.
    """
    robot = robot_of(MORE)
    complete = texts(robot)["robot.urdf"]
    changed_text = complete.replace(*UNSEEN[case], 1)
    assert changed_text != complete
    assert not list(differences(robot, changed_text, TARGET, full=True))


def test_nothing_is_emitted_that_is_not_the_robot(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def wrong(*values: Any, **more: Any) -> Any:
        kept = work_emit(*values, **more)
        return tuple(
            type(file)(
                file.path,
                (
                    file.text.replace('xyz="0 0 ', 'xyz="0 1e-9 ')
                    if file.path.endswith("urdf")
                    else file.text
                ),
            )
            for file in kept
        )

    work_emit = emit
    monkeypatch.setattr("tfcompose.cli.writing.emit", wrong)
    words = ["build", str(ROBOTS / "rover.yaml"), "-o", str(tmp_path / "out")]
    assert main([*words, "--read-back"]) == 1
    assert "error[TF910] robot.urdf: the joint " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert main(words) == 0


def test_without_yourdfpy_that_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        "tfcompose.cli.writing.find_spec", lambda name: None if name == "yourdfpy" else name
    )
    words = ["build", str(ROBOTS / "rover.yaml"), "-o", str(tmp_path / "out")]
    assert main([*words, "--read-back"]) == 2
    output = capsys.readouterr().err
    assert "pip install 'tfcompose[view]'" in output
    assert output.count("\n") == 1
    assert not (tmp_path / "out").exists()
    assert main(words) == 0


@pytest.mark.parametrize(
    "text", ["", "<robot", "<robot/>", "<robot name='r'><joint name='a'/></robot>"]
)
def test_what_is_no_robot_is_reported_and_is_no_traceback(text: str) -> None:
    assert list(differences(robot_of(MORE), text, TARGET, full=True))


@pytest.mark.parametrize(("key", "by"), [("xyz", 1e-9), ("rpy", 1e-9)])
def test_a_pose_is_compared_to_the_last_digits_of_its_text(key: str, by: float) -> None:
    robot = robot_of(MORE.replace("rpy: [0.1, 0.2, 0.3]", "xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]"))
    text = texts(robot)["robot.urdf"]
    numbers = re.search(f'{key}="([^"]+)"', text[text.index('<joint name="j"') :])
    assert numbers
    first, *rest = numbers[1].split()
    moved = f'{key}="{float(first) + by} {" ".join(rest)}"'
    assert not list(differences(robot, text, TARGET, full=True))
    assert list(differences(robot, text.replace(numbers[0], moved), TARGET, full=True))
