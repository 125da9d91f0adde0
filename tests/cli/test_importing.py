"""``tfcompose import``: building what it writes gives the URDF that it was written from."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.cli.same_urdf import same
from tfcompose.cli import main
from tfcompose.cli.disk import disk
from tfcompose.cli.shelves import library
from tfcompose.cli.terminal import read_text
from tfcompose.compile import compile_robot
from tfcompose.emit import Target, emit

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Folders of installed packages that hold URDFs; nothing of them is kept here.
PACKAGES = ("cmeel.prefix/share/example-robot-data/robots", "pybullet_data", "pydrake/share/drake/examples", "mujoco")


def shipped() -> list[Path]:
    """Return the URDFs that installed packages bring, but for the many of one kind."""
    folders = [Path(entry) / package for entry in sys.path for package in PACKAGES]
    return sorted(file for folder in folders for file in folder.rglob("*.urdf") if "random_urdfs" not in file.parts)


def built(file: Path) -> str:
    compiled = compile_robot(read_text(str(file)), str(file), library(), read=read_text, disk=disk())
    assert compiled.robot, compiled.found
    assert not compiled.errors, [str(one) for one in compiled.errors][:3]
    files = {one.path: one.text for one in emit(compiled.robot, Target(folder=str(file.parent)))}
    return files["robot.full.urdf"]


@pytest.mark.parametrize("file", shipped(), ids=lambda file: file.stem)
def test_building_what_import_writes_gives_the_robot_of_the_source(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where the source has errors, import refuses it as lint does, and writes nothing."""
    out = tmp_path / "robot.yaml"
    code = main(["import", str(file), "-o", str(out)])
    if code:
        assert not out.exists()
        assert "error[TF" in capsys.readouterr().err
        pytest.skip("has errors of its own")
    assert not same(file.read_text("utf-8"), file.parent, built(out), tmp_path)
