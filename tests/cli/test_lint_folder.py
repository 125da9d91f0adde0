"""``tfcompose lint FOLDER``: the robot files below it, and no other YAML."""

from pathlib import Path

from tfcompose.cli import main
from tfcompose.cli.commands.lint import robots_in

ROBOT = "# a robot\ntfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"


def test_a_folder_stands_for_the_robot_files_below_it(tmp_path: Path) -> None:
    for name in ("b/robot.yaml", "a.yml", "b/c/d.yaml", ".hidden/robot.yaml", "notes.txt"):
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(ROBOT, encoding="utf-8")
    (tmp_path / "params.yaml").write_text(
        "node: {ros__parameters: {tfcompose: 1}}\n", encoding="utf-8"
    )
    found = [file.removeprefix(f"{tmp_path}/") for file in robots_in(str(tmp_path))]
    assert found == ["a.yml", "b/robot.yaml", "b/c/d.yaml"]


def test_a_robot_whose_first_key_is_misspelt_and_a_file_that_cannot_be_read_are_not_left_out(
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
