"""Overlays of single robots: ``overlays: {by: hostname, folder: overlays}`` and ``--robot``."""

import json
import os
from pathlib import Path

import pytest

from tfcompose.cli import main

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


def test_explain_names_the_overlay_of_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "robot.yaml", "base_link", "mast", "--robot", "ant"]) == 0
    assert "units/ant.yaml:1:22, over robot.yaml:4:41" in capsys.readouterr().out


def test_diff_compares_two_robots(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diff", "robot.yaml", "--robots", "ant", "bee"]) == 1
    assert capsys.readouterr().out == "moved  base_link → mast: 2 mm, 0.5 deg\n"
    assert main(["diff", "robot.yaml", "--robots", "ant", "ant"]) == 0


@pytest.mark.parametrize("more", [[], ["robot.yaml", "--robots", "ant", "bee"]])
def test_diff_takes_two_files_or_two_robots(more: list[str]) -> None:
    assert main(["diff", "robot.yaml", *more]) == 2


def test_lint_checks_each_overlay_of_the_folder(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "units/cat.yaml").write_text("frames: {mast: {parent: base_lnk}}\n", "utf-8")
    (folder / "units/dog.yaml").write_text("frames: {mast: [\n", "utf-8")
    (folder / "units/eel.yaml").write_text("overlays: {folder: ., by: hostname}\n", "utf-8")
    found = codes(capsys)
    assert ("TF203", "units/cat.yaml", 1) in found
    assert ("TF023", "units/eel.yaml", 1) in found
    assert {file for _, file, _ in found} == {
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


def test_a_missing_folder_is_a_finding(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Otherwise each robot would start with the nominal mounts."""
    (folder / "robot.yaml").write_text(ROBOT.replace("units", "unit"), "utf-8")
    assert codes(capsys) == [("TF023", "robot.yaml", 5)]
    assert main(["up", "--dry-run"]) == 1
    assert main(["build", "-o", "out"]) == 0


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
