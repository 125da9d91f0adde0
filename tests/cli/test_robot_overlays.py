"""Overlays of single robots: ``overlays: {by: hostname, folder: overlays}`` and ``--robot``."""

import json
import os
import sys
from argparse import Namespace
from pathlib import Path

import pytest

from tfcompose.cli import main, starting
from tfcompose.model.plan import Plan, RosSettings

ROBOT = """\
tfcompose: 1
robot: rover
links: {base_link: {}}
frames: {mast: {parent: base_link, xyz: [0, 0, 0.3]}}
overlays: {by: hostname, folder: units}
"""
ANT = "frames: {mast: {xyz: [0, 0, 0.302]}}\n"
BEE = "frames: {mast: {rpy: [0, 0, 0.5 deg]}}\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "units").mkdir()
    (tmp_path / "robot.yaml").write_text(ROBOT, "utf-8")
    (tmp_path / "units/ant.yaml").write_text(ANT, "utf-8")
    (tmp_path / "units/bee.yaml").write_text(BEE, "utf-8")
    return tmp_path


def height(folder: Path, *options: str) -> float:
    assert main(["build", "-o", "out", *options]) == 0
    plan = json.loads((folder / "out/plan.json").read_text("utf-8"))
    (edge,) = (edge for edge in plan["edges"] if edge["child"] == "mast")
    return float(edge["pose"][0][2])


def codes(capsys: pytest.CaptureFixture[str], *argv: str) -> list[tuple[str, str, int]]:
    main(["lint", "--format", "json", *argv])
    findings = json.loads(capsys.readouterr().out)
    return [(entry["code"], entry["file"], entry["line"]) for entry in findings]


def test_build_merges_the_named_robot_alone_before_other_overlays(folder: Path) -> None:
    (folder / f"units/{os.uname().nodename}.yaml").write_text(ANT, "utf-8")
    assert height(folder) == 0.3
    assert height(folder, "--robot", "ant") == 0.302
    assert height(folder, "--robot", "ant", "--set", "frames.mast.xyz=[0, 0, 1]") == 1


def test_up_merges_the_overlay_of_this_computer(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def edges(*options: str) -> str:
        assert main(["up", "--dry-run", *options]) == 0
        return capsys.readouterr().out

    assert "1 edge," in edges()
    here = folder / f"units/{os.uname().nodename}.yaml"
    here.write_text("frames: {hook: {parent: mast}}\n", "utf-8")
    assert "2 edges," in edges()
    assert "1 edge," in edges("--robot", "ant")


@pytest.mark.parametrize(
    ("options", "overlays"),
    [
        ((), []),
        (("--robot", "ant"), ["units/ant.yaml"]),
        (
            ("--robot", "ant", "--overlay", "units/bee.yaml", "--set", "robot=ant"),
            ["units/ant.yaml", "units/bee.yaml", "--set robot=ant"],
        ),
    ],
)
def test_the_plan_names_its_overlays(
    options: tuple[str, ...], overlays: list[str], folder: Path
) -> None:
    assert main(["build", str(folder / "robot.yaml"), "-o", "out", *options]) == 0
    plan = json.loads((folder / "out/plan.json").read_text("utf-8"))
    assert plan.get("overlays", []) == overlays


def test_up_names_overlays_that_the_command_line_does_not() -> None:
    plan = Plan(
        "rover", "", None, RosSettings(), (), (), overlays=("units/ant.yaml", "night.yaml")
    )
    arguments = Namespace(overlays=["night.yaml"], settings=[], overlay_robot=None)
    (line,) = starting._unnamed_overlays(plan, arguments)
    assert "units/ant.yaml" in line
    assert "night.yaml" not in line
    arguments.overlay_robot = "ant"
    assert starting._unnamed_overlays(plan, arguments) == []


def test_explain_names_the_overlay_of_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "robot.yaml", "base_link", "mast", "--robot", "ant"]) == 0
    assert "units/ant.yaml:1:22, over robot.yaml:4:41" in capsys.readouterr().out


def test_diff_compares_two_robots(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", "robot.yaml", "--robots", "ant", "bee"]) == 1
    assert capsys.readouterr().out == "moved  base_link → mast: 2 mm, 0.5 deg\n"
    assert main(["diff", "robot.yaml", "--robots", "ant", "ant"]) == 0


HEAD = """\
tfcompose: 1
robot: humanoid
overlays: {by: hostname, folder: units}
links: {torso: {}, head: {}, chin: {}}
joints:
  neck: {type: continuous, parent: torso, child: head, axis: [0, 0, 1]}
  jaw:
    {type: prismatic, parent: head, child: chin, axis: [1, 0, 0], limit: {lower: 0, upper: 0.01}}
"""


@pytest.fixture
def heads(folder: Path) -> None:
    """Two humanoids with offsets of joints' zeros."""
    (folder / "robot.yaml").write_text(HEAD, "utf-8")
    (folder / "units/ant.yaml").write_text("joints: {neck: {offset: 0.4 deg}}\n", "utf-8")
    (folder / "units/bee.yaml").write_text(
        "joints: {neck: {offset: -1 deg, xyz: [0, 0, 0.01]}, jaw: {offset: 0.5 mm}}\n", "utf-8"
    )


@pytest.mark.usefixtures("heads")
def test_explain_tells_an_offset_from_a_mount(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "robot.yaml", "torso", "head", "--robot", "ant"]) == 0
    text = capsys.readouterr().out
    assert "offset 0.4 deg of the zero of the joint neck" in text
    assert "offset: 0.4 deg  units/ant.yaml:1:25" in text
    assert "nominal" not in text
    assert main(["explain", "robot.yaml", "torso", "head"]) == 0
    assert "offset" not in capsys.readouterr().out


@pytest.mark.usefixtures("heads")
def test_diff_tells_offsets_in_degrees_and_mm_from_mounts(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["diff", "robot.yaml", "--robots", "ant", "bee"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "moved  torso → head: 10 mm, 0 deg",
        "offset torso → head: 0.4 deg → -1 deg",
        "offset head → chin: none → 0.5 mm",
    ]


@pytest.mark.parametrize("more", [[], ["robot.yaml", "--robots", "ant", "bee"]])
def test_diff_takes_two_files_or_two_robots(more: list[str]) -> None:
    assert main(["diff", "robot.yaml", *more]) == 2


def test_lint_checks_each_overlay_of_the_folder(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "units/cat.yaml").write_text("frames: {mast: {parent: base_lnk}}\n", "utf-8")
    (folder / "units/dog.yaml").write_text("frames: {mast: [\n", "utf-8")
    (folder / "units/eel.yaml").write_text("overlays: {folder: ., by: hostname}\n", "utf-8")
    findings = codes(capsys)
    assert ("TF203", "units/cat.yaml", 1) in findings
    assert ("TF023", "units/eel.yaml", 1) in findings
    assert {file for _, file, _ in findings} == {
        f"units/{name}.yaml" for name in ("cat", "dog", "eel")
    }
    assert codes(capsys, "--robot", "ant") == []


@pytest.mark.parametrize("robot", ["an", "../units/ant", ""])
def test_a_robot_without_an_overlay_is_a_finding(
    robot: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert codes(capsys, "--robot", robot) == [("TF023", "robot.yaml", 5)]
    assert main(["build", "-o", "out", "--robot", robot]) == 1
    assert not (folder / "out").exists()


@pytest.mark.parametrize(
    "command",
    [
        "diff robot.yaml robot.yaml",
        "doctor robot.yaml",
        "explain robot.yaml base_link mast",
        "export systemd robot.yaml -o out",
        "export launch robot.yaml -o out",
        "graph robot.yaml",
        "pose robot.yaml base_link mast",
        "tree robot.yaml",
        "tree robot.yaml --show-args",
        "verify robot.yaml",
        "view robot.yaml --html out.html",
    ],
)
def test_each_command_for_a_robot_file_takes_robot(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        sys.exit(main([*command.split(), "--robot", "an"]))
    assert end.value.code
    assert "TF023" in capsys.readouterr().err
    assert sorted(path.name for path in folder.iterdir()) == ["robot.yaml", "units"]


def test_the_views_page_has_the_robots_pose(folder: Path) -> None:
    assert main(["view", "robot.yaml", "--html", "out.html", "--robot", "ant"]) == 0
    assert "0.302" in (folder / "out.html").read_text("utf-8")


def test_a_missing_folder_is_a_finding(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Otherwise each robot would start with the nominal mounts."""
    (folder / "robot.yaml").write_text(ROBOT.replace("units", "unit"), "utf-8")
    assert codes(capsys) == [("TF023", "robot.yaml", 5)]
    assert main(["up", "--dry-run"]) == 1
    assert main(["build", "-o", "out"]) == 0


def test_an_overlay_with_another_ending_is_a_finding(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Otherwise its robot would start with the nominal mounts."""
    here = os.uname().nodename
    (folder / f"units/{here}.yml").write_text(ANT, "utf-8")
    assert codes(capsys) == [("TF023", "robot.yaml", 5)]
    assert main(["up", "--dry-run"]) == 1
    assert f"units/{here}.yml" in capsys.readouterr().err
    assert main(["build", "-o", "out"]) == 0


def test_the_robot_file_alone_chooses_overlays(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Profiles and overlays are merged too late to choose a robot's overlay."""
    chosen = "overlays: {by: hostname, folder: units}"
    robot = ROBOT.partition("overlays")[0]
    (folder / "robot.yaml").write_text(f"{robot}profiles: {{p: {{{chosen}}}}}\n", "utf-8")
    assert codes(capsys) == [("TF023", "robot.yaml", 5)]
    (folder / "robot.yaml").write_text(robot, "utf-8")
    (folder / "more.yaml").write_text(chosen + "\n", "utf-8")
    assert codes(capsys, "--overlay", "more.yaml") == [("TF023", "more.yaml", 1)]
    setting = "overlays.folder=units"
    assert ("TF023", f"--set {setting}") in {
        (code, file) for code, file, _ in codes(capsys, "--set", setting)
    }
    (folder / "robot.yaml").write_text(f"{robot}include: more.yaml\n", "utf-8")
    assert height(folder, "--robot", "ant") == 0.302


def test_a_robot_file_without_overlays_refuses_robot(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "robot.yaml").write_text(ROBOT.partition("overlays")[0], "utf-8")
    assert [code for code, *_ in codes(capsys, "--robot", "ant")] == ["TF023"]


def test_untrusted_lint_lists_no_folder_outside_of_the_tree(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    inner = folder / "inner"
    inner.mkdir()
    (inner / ".git").mkdir()
    (inner / "robot.yaml").write_text(ROBOT.replace("units", "../units"), "utf-8")
    (folder / "units/cat.yaml").write_text("frames: {mast: {parent: base_lnk}}\n", "utf-8")
    assert codes(capsys, "inner/robot.yaml") != []
    assert codes(capsys, "--untrusted", "inner/robot.yaml") == [("TF023", "inner/robot.yaml", 5)]


def test_a_built_plan_takes_no_robot(folder: Path) -> None:
    height(folder)
    assert main(["up", "out/plan.json", "--robot", "ant"]) == 2


def test_a_part_gets_no_overlay_of_its_own_file_and_says_so(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Otherwise a team takes the nominal mounts of the part for measured ones."""
    part = "parts: {front: {spec: robot.yaml, namespace: front}}\n"
    (folder / "two.yaml").write_text(f"tfcompose: 1\nrobot: two\n{part}", "utf-8")
    main(["lint", "two.yaml", "--format", "json"])
    (result,) = json.loads(capsys.readouterr().out)
    assert (result["code"], result["severity"], result["line"]) == ("TF023", "warning", 3)
    assert [note["file"] for note in result["notes"]][:1] == ["robot.yaml"]
    (folder / "robot.yaml").write_text(ROBOT.partition("overlays")[0], "utf-8")
    assert codes(capsys, "two.yaml") == []
