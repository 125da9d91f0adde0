"""A robot runs in a folder whose files are named like modules of Python."""

import os
import re
import shlex
from functools import partial
from pathlib import Path

import pytest

from tests.support import processes
from tests.support.domains import Domain
from tests.support.fleets import fleet_text
from tests.support.user_files import PYTHON_PATH, write_namesakes
from tests.support.waiting import until
from tfcompose.launcher.program import HERE

pytestmark = pytest.mark.ros

ROBOT = """
tfcompose: 1
robot: rover
fleet: {file: fleet.yaml, robot: r1}
ros: {namespace: r1, isolate: topics}
links: {base_link: {}, wheel: {}}
joints: {wheel_joint: {type: continuous, parent: base_link, child: wheel, axis: [0, 1, 0]}}
frames:
  map: {}
  odom: {parent: map, xyz: [1, 0, 0]}
  base_link: {parent: odom, owner: drive, rate: 20 Hz}
rules: {TF708: off}
processes:
  drive: {simulate: {fixed: {xyz: [2, 0, 0]}, rate: 20 Hz}}
  states: {simulate: {joints: {wheel_joint: 0.4}, rate: 50 Hz}}
  program: {run: [sh, -c, 'echo "path is <$PYTHONPATH>"; exec sleep 99']}
"""
OURS = {"static", "joints", "drive", "states", "guard", "fleet_share"}


def says_what_it_does(log: Path) -> bool:
    """Return whether a process of tfcompose's own has said which edges or joints it has."""
    return re.search("edge|joint", log.read_text("utf-8")) is not None


@pytest.fixture
def folder(domain: Domain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a robot file and files that end whoever imports them."""
    assert domain
    (tmp_path / "runtime").mkdir(mode=0o700)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    folder = tmp_path / "scripts"
    folder.mkdir()
    monkeypatch.chdir(folder)
    (folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    (folder / "fleet.yaml").write_text(fleet_text({"r1": "tcp/127.0.0.1:1"}), encoding="utf-8")
    return folder


@pytest.mark.parametrize("python_path", [None, PYTHON_PATH])
def test_a_robot_comes_up_in_a_folder_with_namesakes_of_pythons_modules(
    python_path: str | None, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_namesakes(folder, loaded_first=python_path is None)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    if python_path:
        monkeypatch.setenv("PYTHONPATH", python_path)
    up = processes.run([*HERE, "up", "--wait"])
    logs = processes.run([*HERE, "logs"]).stdout
    done = processes.run([*HERE, "down"])
    assert (up.returncode, done.returncode) == (0, 0), up.stdout + up.stderr + logs
    assert not re.findall(r"the user's .* ran", logs)
    assert {name for name in OURS if f" {name} " in logs} == OURS, logs
    assert f"path is <{python_path or ''}>" in logs


def test_units_start_in_a_folder_with_namesakes_of_pythons_modules(folder: Path) -> None:
    assert processes.run([*HERE, "export", "systemd", "robot.yaml", "-o", "."]).returncode == 0
    write_namesakes(folder, loaded_first=False)
    for name in OURS - {"fleet_share"}:
        unit = (folder / "systemd" / f"rover-{name}.service").read_text("utf-8")
        (line,) = re.findall(r"^ExecStart=(.*)$", unit, re.MULTILINE)
        process = processes.start(
            shlex.split(line),
            stdout=(out := (folder / f"{name}.log").open("w")),
            stderr=out,
            env={**os.environ, "PYTHONPATH": PYTHON_PATH},
        )
        out.close()
        log = folder / f"{name}.log"
        assert until(partial(says_what_it_does, log))
        assert process.poll() is None
