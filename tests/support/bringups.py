"""Importing what starts a robot, and compiling what import writes."""

from pathlib import Path
from typing import Any

import pytest

from tests.support.importing import PRESETS
from tfcompose.cli import main
from tfcompose.cli.compiling import disk
from tfcompose.cli.reading import read_text
from tfcompose.compile import Compiled, compile_robot
from tfcompose.load import load


def import_of(source: Path, *words: str, code: int | None = 0) -> tuple[str, dict[str, Any]]:
    """Return the robot file that import writes for a source, and its data."""
    out = source.with_name("imported.yaml")
    got = main(["import", str(source), *words, "-o", str(out), "--force"])
    assert code is None or got == code, out.read_text("utf-8") if out.exists() else got
    text = out.read_text("utf-8")
    return text, load(text, str(out)).data


def compiled(text: str, folder: Path) -> Compiled:
    return compile_robot(text, str(folder / "imported.yaml"), PRESETS, read=read_text, disk=disk())


def places(printed: str, code: str) -> list[str]:
    """Return the files and lines of the findings with a code that a command printed."""
    heads = [line.partition(": ")[0] for line in printed.splitlines() if f"[{code}]" in line]
    return [":".join(Path(head).name.split(":")[:2]) for head in heads]


def printed_errors(capsys: pytest.CaptureFixture[str]) -> str:
    """Return what was printed to stderr since the last call."""
    return capsys.readouterr().err
