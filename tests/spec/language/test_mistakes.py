"""What people write by mistake or by habit.

Each is found at its place, with help that names what to write.
"""

import re
from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in
from tfcompose.spec.language.key_hints import habit
from tfcompose.spec.language.values import COLOURS

BASE = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
CAM = BASE + "sensors:\n  cam: {preset: realsense/d435i, parent: base_link, %s}\n"
FRAME = BASE + "frames:\n  mast: {parent: base_link, %s}\n"
SHAPE = "tfcompose: 1\nrobot: r\nlinks: {base_link: {visual: {box: [1, 1, 1], %s}}}\n"

#: Texts of one mistake each, separated by ---, behind BASE where they do not begin a file of their
#: own. The mark on a line, or below it, has the code, its column, and words of its help.
FILES = sorted((Path(__file__).parent / "mistakes").glob("*.yaml"))
MISTAKES = [
    pytest.param(text, id=f"{file.stem} {number}")
    for file in FILES
    for number, text in enumerate(file.read_text("utf-8").split("---\n"))
]
MARK = re.compile(r"# expect( above)?: (TF\d{3}) at (\d+)(?:: (.*))?$")
#: Texts on whose lines a mark would be another mistake: place and code, words of the help.
UNMARKED = [
    (
        BASE + "frames:\n  mast:\n    parent base_link\n    xyz: [0, 0, 1]\n",
        "6:5 TF002",
        "parent: base_link",
    ),
    (
        BASE + "frames:\n  mast:\n    parent:base_link\n    xyz: [0, 0, 1]\n",
        "6:5 TF002",
        "parent: base_link",
    ),
    ("tfcompose:1\nrobot: r\n", "1:1 TF002", "tfcompose: 1"),
    (BASE + "frames: {mast: {parent: 'base_link}}\n", "4:25 TF002", "'"),
]


def check_mistake(folder: Path, text: str, place: str, code: str, words: str) -> None:
    (folder / "robot.yaml").write_text(text, "utf-8")
    printed = tfcompose_in(folder, "lint").stdout
    _, begin, rest = printed.partition(f"robot.yaml:{place}: error[{code}]")
    assert begin, printed
    advice = rest.partition("help: ")[2].partition("\n")[0]
    assert all(word in advice for word in words.split()), printed


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_is_found_at_its_place_and_help_shows_the_fix(text: str, tmp_path: Path) -> None:
    text = text if text.startswith("tfcompose") else BASE + text
    marks = [(number, MARK.search(line)) for number, line in enumerate(text.splitlines(), 1)]
    ((number, mark),) = [(number, mark) for number, mark in marks if mark]
    above, code, column, words = mark.groups()
    check_mistake(tmp_path, text, f"{number - bool(above)}:{column}", code, words or "")


@pytest.mark.parametrize(("text", "where", "words"), UNMARKED)
def test_a_mistake_that_no_mark_can_follow_is_found_too(
    text: str, where: str, words: str, tmp_path: Path
) -> None:
    place, code = where.split()
    check_mistake(tmp_path, text, place, code, words)


@pytest.mark.parametrize(
    "words",
    [
        "color: blue",
        "color: [0, 0, 1]",
        "color: [0, 0, 1, 1]",
        "material: blue",
        "material: {rgba: blue}",
    ],
)
def test_a_colour_is_three_parts_four_or_a_name(words: str, tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(SHAPE % words, "utf-8")
    built = tfcompose_in(tmp_path, "build", "-o", "out")
    assert built.returncode == 0, built.stderr
    assert 'rgba="0 0 1 1"' in (tmp_path / "out" / "robot.urdf").read_text("utf-8")


def test_a_material_that_is_defined_wins_over_the_colour_of_its_name(tmp_path: Path) -> None:
    text = (
        "tfcompose: 1\nrobot: r\nlinks:\n  base_link: {visual: {box: [1, 1, 1], material: blue}}\n"
    )
    text += (
        "  arm: {parent: base_link, visual: {box: [1, 1, 1], material: {name: blue, rgba: [0, 0.1,"
        " 0.2]}}}\n"
    )
    (tmp_path / "robot.yaml").write_text(text, "utf-8")
    assert tfcompose_in(tmp_path, "build", "-o", "out").returncode == 0
    urdf = (tmp_path / "out" / "robot.urdf").read_text("utf-8")
    assert urdf.count('rgba="0 0.1 0.2 1"') >= 1
    assert 'rgba="0 0 1 1"' not in urdf


def test_no_habit_names_a_key_that_is_not_there() -> None:
    assert habit("position", {"xyz"})
    assert not habit("position", {"rate"})
    assert not habit("xyz", {"xyz"})
    assert all(len(parts) == 3 for parts in COLOURS.values())


def test_a_second_sensor_of_a_profile_is_not_taken_for_a_slip(tmp_path: Path) -> None:
    profile = "profiles: {demo: {frames: {mast2: {parent: base_link}}}}\n"
    (tmp_path / "robot.yaml").write_text(FRAME % "xyz: [0, 0, 1]" + profile, "utf-8")
    assert tfcompose_in(tmp_path, "lint").returncode == 0


def test_where_a_limit_is_refused_the_default_one_judges_nothing(tmp_path: Path) -> None:
    sensor = "sensors: {cam: {preset: realsense/d435i, parent: base_link, xyz: [0.1, 0, 0]}}\n"
    for rules, code in (
        ("", "TF640"),
        ("rules: {TF640: {limit: 5 kg}}\n", "TF104"),
        ("rules: {TF640: no}\n", "TF106"),
    ):
        (tmp_path / "robot.yaml").write_text(SHAPE % "color: red" + sensor + rules, "utf-8")
        printed = tfcompose_in(tmp_path, "lint").stdout
        assert {
            part.partition("]")[0] for part in printed.split("[")[1:] if part.startswith("TF")
        } == {code}, printed


def test_an_unknown_place_is_found_with_a_part_that_cannot_be_read(tmp_path: Path) -> None:
    part = "parts: {arm: {xacro: gone.xacro, parent: base_link}}\n"
    (tmp_path / "robot.yaml").write_text(CAM % "place: nopes" + part, "utf-8")
    printed = tfcompose_in(tmp_path, "lint").stdout
    assert "robot.yaml:5:60: error[TF203]" in printed
    assert "gone.xacro:1:1: error[TF001]" in printed


def test_an_entry_that_a_profile_misspells_is_one_finding_that_names_it(tmp_path: Path) -> None:
    profile = "profiles: {demo: {sensors: {cmm: {driver: none}}}}\n"
    (tmp_path / "robot.yaml").write_text(CAM % "tf: tfcompose" + profile, "utf-8")
    printed = tfcompose_in(tmp_path, "lint").stdout
    assert printed.count("error[") == 1
    assert "did you mean cam?" in printed


def test_a_process_that_was_refused_is_no_unknown_owner(tmp_path: Path) -> None:
    for way in ("external: yes", "run: {package: a}", "cmd: [a]"):
        text = (
            BASE
            + f"frames: {{mast: {{parent: base_link, owner: a}}}}\nprocesses:\n  a: {{{way}}}\n"
        )
        (tmp_path / "robot.yaml").write_text(text, "utf-8")
        printed = tfcompose_in(tmp_path, "lint").stdout
        assert printed.count("error[") == 1, printed
        assert "TF302" not in printed


def test_the_numbers_of_a_part_are_judged_with_the_robot_that_holds_it(tmp_path: Path) -> None:
    limit = "limit: {lower: -170, upper: 3, velocity: 1, effort: 1}"
    joint = (
        f"joints: {{j: {{type: revolute, parent: base, child: tip, axis: [0, 0, 1], {limit}}}}}\n"
    )
    arm = (
        "tfcompose: 1\nrobot: arm\nlinks: {base: {}, tip: {}}\n"
        + joint
        + "frames: {far: {parent: tip, xyz: [0, 250, 0]}}\n"
    )
    parts = "parts:\n  left: {spec: arm.yaml, prefix: left_, parent: base_link}\n"
    (tmp_path / "arm.yaml").write_text(arm, "utf-8")
    (tmp_path / "robot.yaml").write_text(BASE + parts, "utf-8")
    printed = tfcompose_in(tmp_path, "lint", "robot.yaml").stdout
    assert "arm.yaml:4:88: warning[TF410]" in printed
    assert "arm.yaml:5:38: warning[TF414]" in printed
