"""A build is written whole or not at all."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.cli import tfcompose_in
from tfcompose.cli.writing import write_all
from tfcompose.model.files import File

ROBOTS = Path(__file__).parents[2] / "robots"
FILES = [File("a.txt", "new a\n"), File("params/b.yaml", "new b\n"), File("c.txt", "new c\n")]


def contents(folder: Path) -> dict[str, bytes | None]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


def earlier_build(folder: Path) -> dict[str, bytes | None]:
    write_all(
        folder, [File("a.txt", "old a\n"), File("c.txt", "old c\n"), File("d.txt", "old d\n")]
    )
    return contents(folder)


def test_the_files_are_emitted_and_nothing_else_is_left(tmp_path: Path) -> None:
    write_all(tmp_path / "x" / "out", FILES)
    assert contents(tmp_path / "x" / "out") == {
        "a.txt": b"new a\n",
        "c.txt": b"new c\n",
        "params": None,
        "params/b.yaml": b"new b\n",
    }


@pytest.mark.parametrize("fails_at", [1, 2, 3])
def test_a_disk_that_fails_while_files_are_moved_leaves_the_earlier_build(
    fails_at: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = earlier_build(tmp_path)
    moved, replace = [], Path.replace

    def failing(self: Path, target: Path) -> Path:
        if "new" in self.parts:
            moved.append(self.name)
            if len(moved) == fails_at:
                raise OSError(errno.EIO, "Input/output error", str(self))
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises(OSError, match="Input/output error"):
        write_all(tmp_path, FILES)
    assert contents(tmp_path) == before


@pytest.mark.parametrize("fails_at", [1, 2, 3])
def test_a_disk_that_is_full_leaves_the_earlier_build_or_no_folder(
    fails_at: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = earlier_build(tmp_path / "old")
    saved = []

    def full(descriptor: int) -> None:
        saved.append(descriptor)
        if len(saved) % 3 == fails_at % 3:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_all(tmp_path / "old", FILES)
    assert contents(tmp_path / "old") == before
    saved.clear()
    with pytest.raises(OSError, match="No space"):
        write_all(tmp_path / "x" / "y", FILES)
    assert not (tmp_path / "x").exists()


def test_a_folder_in_the_way_of_a_file_leaves_everything_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "c.txt").mkdir()
    (tmp_path / "a.txt").write_text("old a\n")
    before = contents(tmp_path)
    with pytest.raises(IsADirectoryError):
        write_all(tmp_path, FILES)
    assert contents(tmp_path) == before


def test_a_file_in_the_way_of_a_folder_leaves_everything_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "params").write_text("mine\n")
    before = contents(tmp_path)
    with pytest.raises(OSError, match=r"exists|directory"):
        write_all(tmp_path, FILES)
    assert contents(tmp_path) == before


def build(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return tfcompose_in(folder, "build", *words)


@pytest.mark.parametrize("output", ["file", "file/below", "/proc/tfcompose", "/dev/null/out"])
def test_an_output_folder_that_cannot_be_is_one_sentence_and_exit_2(
    output: str, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("mine\n")
    done = build(tmp_path, str(ROBOTS / "my_robot.yaml"), "-o", output)
    assert done.returncode == 2
    assert done.stderr.startswith("tfcompose: ")
    assert "Traceback" not in done.stderr
    assert contents(tmp_path) == {"file": b"mine\n"}


def test_parameter_files_of_an_earlier_build_go_and_other_peoples_stay(tmp_path: Path) -> None:
    assert build(tmp_path, str(ROBOTS / "autonomous_robot.yaml"), "-o", "out").returncode == 0
    assert (tmp_path / "out" / "params" / "camera.yaml").exists()
    mine = tmp_path / "out" / "params" / "navigation.yaml"
    mine.write_text("mine\n")
    assert build(tmp_path, str(ROBOTS / "my_robot.yaml"), "-o", "out").returncode == 0
    assert not (tmp_path / "out" / "params" / "camera.yaml").exists()
    assert mine.read_text() == "mine\n"
    mine.unlink()
    assert build(tmp_path, str(ROBOTS / "autonomous_robot.yaml"), "-o", "out").returncode == 0
    assert build(tmp_path, str(ROBOTS / "autonomous_robot.yaml"), "-o", "out").returncode == 0
    assert (tmp_path / "out" / "params" / "camera.yaml").exists()
    assert build(tmp_path, str(ROBOTS / "my_robot.yaml"), "-o", "out").returncode == 0
    assert not (tmp_path / "out" / "params").exists()


def test_a_plan_that_names_files_elsewhere_has_nothing_removed_there(tmp_path: Path) -> None:
    victim = tmp_path / "victim.yaml"
    victim.write_text("mine\n")
    names = [f"params/../../{victim.name}", str(victim), 5, None]
    plan = {"processes": [{"params_file": name} for name in names]}
    write_all(tmp_path / "out", [File("plan.json", json.dumps(plan))])
    write_all(tmp_path / "out", FILES)
    assert victim.exists()


def test_two_builds_at_once_leave_one_complete_build(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "tfcompose",
        "build",
        str(ROBOTS / "autonomous_robot.yaml"),
        "-o",
        "out",
    ]
    both = [processes.start(command, cwd=tmp_path, stdout=subprocess.DEVNULL) for _ in range(4)]
    assert [process.wait(60) for process in both] == [0] * 4
    assert build(tmp_path, str(ROBOTS / "autonomous_robot.yaml"), "-o", "alone").returncode == 0
    assert contents(tmp_path / "out") == contents(tmp_path / "alone")


def test_a_robot_with_errors_leaves_the_earlier_build(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n")
    assert build(tmp_path, "-o", "out").returncode == 0
    before = contents(tmp_path / "out")
    (tmp_path / "robot.yaml").write_text(
        "tfcompose: 1\nrobot: r\nlinks: {base_link: {parent: x}}\n"
    )
    assert build(tmp_path, "-o", "out").returncode == 1
    assert contents(tmp_path / "out") == before


def test_the_default_folder_is_named_after_the_robot(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("tfcompose: 1\nrobot: rover\nlinks: {base_link: {}}\n")
    assert build(tmp_path).stdout.startswith("wrote build/rover: plan.json")
    assert (tmp_path / "build" / "rover" / "plan.json").exists()
