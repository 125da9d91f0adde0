"""Importing a URDF with ``tfcompose import``, and building what it writes."""

import json
from pathlib import Path
from typing import Any

from tfcompose.cli import main
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.files import Target

PRESETS = library()


def built(file: Path) -> str:
    compiled = compile_robot(read_text(str(file)), str(file), PRESETS, read=read_text, disk=disk())
    assert compiled.robot, compiled.findings
    assert not compiled.errors, [str(error) for error in compiled.errors][:3]
    files = {
        emitted.path: emitted.text
        for emitted in emit(compiled.robot, Target(folder=str(file.parent)))
    }
    return files["robot.urdf"]


def imported(urdf: str, folder: Path, *words: str) -> str:
    """Return the robot file that import writes for a URDF that it takes."""
    source, out = folder / "source.urdf", folder / "robot.yaml"
    source.write_text(urdf, encoding="utf-8")
    assert main(["import", str(source), "-o", str(out), "--force", *words]) == 0
    return out.read_text("utf-8")


def urdf_of(spec: dict[str, Any], folder: Path) -> str:
    file = folder / "spec.yaml"
    file.write_text(json.dumps(spec), encoding="utf-8")
    return built(file)
