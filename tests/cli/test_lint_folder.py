"""``tfcompose lint FOLDER``: the robot files below it, and no other YAML."""

import os
from pathlib import Path

import pytest

from tfcompose.cli import main
from tfcompose.cli.robot_search import robots_in
from tfcompose.foundation.reading import MOST_BYTES

ROBOT = "# a robot\ntfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"


def test_a_folder_stands_for_the_robot_files_below_it(tmp_path: Path) -> None:
    for name in ("b/robot.yaml", "a.yml", "b/c/d.yaml", ".hidden/robot.yaml", "notes.txt"):
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(ROBOT, encoding="utf-8")
    (tmp_path / "params.yaml").write_text(
        "node: {ros__parameters: {tfcompose: 1}}\n", encoding="utf-8"
    )
    files = [file.removeprefix(f"{tmp_path}/") for file in robots_in(str(tmp_path))]
    assert files == ["a.yml", "b/robot.yaml", "b/c/d.yaml"]


def test_a_misspelt_first_key_or_an_unreadable_file_is_not_left_out(
    tmp_path: Path,
) -> None:
    (tmp_path / "a.yaml").write_text(ROBOT.replace("tfcompose", "tfcompos"), encoding="utf-8")
    (tmp_path / "b.yaml").symlink_to("/proc/self/mem")
    (tmp_path / "c.yaml").write_text("robot: r\nrate: 7\n", encoding="utf-8")
    assert [file.removeprefix(f"{tmp_path}/") for file in robots_in(str(tmp_path))] == [
        "a.yaml",
        "b.yaml",
    ]
    assert main(["lint", str(tmp_path)]) == 2


def test_a_file_stands_for_itself_and_a_folder_without_robots_too(tmp_path: Path) -> None:
    assert robots_in("nothing.yaml") == ["nothing.yaml"]
    assert robots_in(str(tmp_path)) == [str(tmp_path)], "so that it is said that it is a folder"


def test_what_is_larger_than_a_robot_can_be_is_none(tmp_path: Path) -> None:
    (tmp_path / "data.yaml").write_bytes(b"- 1\n" * (MOST_BYTES // 4 + 1))
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    assert robots_in(str(tmp_path)) == [str(tmp_path / "robot.yaml")]


def test_lint_searches_no_other_file_system_and_no_kernel_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("here", "mounted", "proc"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    real = os.stat

    def stat(path: str) -> os.stat_result:
        """Return what is there, the folder ``mounted`` being another file system."""
        fields = list(real(path))
        fields[2] += path.endswith("mounted")
        return os.stat_result(fields)

    monkeypatch.setattr("tfcompose.cli.robot_search._OF_KERNEL", {str(tmp_path / "proc")})
    monkeypatch.setattr("tfcompose.cli.robot_search.os.stat", stat)
    assert robots_in(str(tmp_path)) == [str(tmp_path / "here" / "robot.yaml")]
    assert robots_in(str(tmp_path / "mounted")) == [str(tmp_path / "mounted" / "robot.yaml")]


def test_a_long_search_says_once_what_it_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    robots_in(str(tmp_path))
    assert not capsys.readouterr().err
    monkeypatch.setattr("tfcompose.cli.robot_search.SAY_AFTER_S", 0.0)
    robots_in(str(tmp_path))
    text = capsys.readouterr().err
    assert text.count(str(tmp_path)) == 1
