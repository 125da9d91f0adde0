"""Robots as people build them: what the rules must not cry wolf about."""

from pathlib import Path

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.spec.language import profiles_in
from tfcompose.spec.load import load

HERE = Path(__file__).parent
FILES = [
    *sorted((HERE / "sound").glob("*.yaml")),
    *sorted((HERE.parents[2] / "robots").glob("*.yaml")),
]


def findings(text: str, *profiles: str, file: str = "robot.yaml") -> list[str]:
    findings = compile_robot(
        text, file, library(), profiles, read=lambda name: Path(name).read_text("utf-8")
    ).findings
    return [f"{finding.code} {finding.message}" for finding in findings]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_sound_robot_has_no_findings_with_any_of_its_profiles(file: Path) -> None:
    text = file.read_text("utf-8")
    assert findings(text, file=str(file)) == []
    for profile in profiles_in(load(text, "robot.yaml")):
        assert findings(text, profile, file=str(file)) == []


IDLE = """
tfcompose: 1
robot: idle
vars: {mast: 1 m, spare: 2 m}
links: {base_link: {}}
sensors:
  camera: {preset: realsense/d435i, parent: base_link, xyz: [0, 0, "${mast}"], tf: driver, driver: cameras}
processes: {cameras: {external: true}}
profiles:
  low: {sensors: {camera: {xyz: [0, 0, "${spare}"]}}}
  alone: {sensors: {camera: {driver: none, tf: tfcompose}}}
"""  # noqa: E501 (a text as its reader has it)


@pytest.mark.parametrize("profiles", [(), ("low",), ("alone",), ("low", "alone")])
def test_what_only_some_profiles_use_is_not_idle(profiles: tuple[str, ...]) -> None:
    assert findings(IDLE, *profiles) == []


def test_a_misspelt_owner_is_reported_once() -> None:
    text = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\nframes:\n  odom: {}\n"
    text += "  base_link: {parent: odom, owner: driv}\nprocesses: {drive: {external: true}}\n"
    assert [finding[:5] for finding in findings(text)] == ["TF302"]
