"""Contents of a release: what was built, and the files it names."""

import io
import re
import shlex
import tarfile
from pathlib import Path

import pytest

from tfcompose.cli.compiling import disk, library
from tfcompose.cli.reading import read_text
from tfcompose.compiler.compile import compile_robot
from tfcompose.foundation.findings import RejectedError
from tfcompose.launcher.program import anywhere
from tfcompose.model.plan.file import read_plan
from tfcompose.model.robot import Robot
from tfcompose.tools.deploy.agent import UNIT
from tfcompose.tools.deploy.release import Release, pack_release
from tfcompose.tools.deploy.unit import Unit

ROBOT = """
tfcompose: 1
robot: rover
hosts: {brain: {ssh: ADDRESS}}
links:
  base_link: {visual: {mesh: ../meshes/wheel.dae}}
frames: {lidar: {parent: base_link, xyz: [0, 0, 0.3]}}
processes:
  static: {host: brain}
  map: {run: {package: nav2_map_server, executable: map_server, args: ["map:=${file(maps/office.yaml)}"]}, cwd: maps}
"""  # noqa: E501 (a text as its reader has it)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in {
        "meshes/wheel.dae": (
            "<init_from>textures/rubber.png</init_from> ../../etc/passwd /etc/hostname"
        ),
        "meshes/textures/rubber.png": "png",
        "meshes/unused.png": "png",
        "robots/maps/office.yaml": "image: office.pgm\n",
        "robots/maps/office.pgm": "pgm",
        "robots/maps/.hidden": "x",
    }.items():
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.chdir(tmp_path / "robots")
    return tmp_path


def release(text: str = ROBOT, wheels: Path | None = None) -> Release:
    return pack_release(robot(text), wheels)


def robot(text: str = ROBOT) -> Robot:
    compiled = compile_robot(text, "robot.yaml", library(), read=read_text, disk=disk())
    assert compiled.robot
    assert not compiled.errors, compiled.errors
    return compiled.robot


def unpacked(made: Release, folder: Path) -> Path:
    with tarfile.open(fileobj=io.BytesIO(b"".join(made.archive()))) as tar:
        # Debian 12's Python 3.11.2 has neither filters nor the argument.
        tar.extraction_filter = getattr(tarfile, "data_filter", None)
        tar.extractall(folder)  # noqa: S202 (made by ``release.Release``)
    return folder


def test_files_are_with_what_they_name_and_every_address_leads_to_them(folder: Path) -> None:
    made = release()
    unpacked_folder = unpacked(made, folder / "there")
    assert {
        path.relative_to(unpacked_folder).as_posix()
        for path in unpacked_folder.rglob("*")
        if path.is_file()
    } == made.manifest.keys()
    copied = {path for path in made.manifest if path.startswith("files/")}
    assert {Path(path).name for path in copied} == {
        "wheel.dae",
        "rubber.png",
        "office.yaml",
        "office.pgm",
    }
    for description in ("robot.state_publisher.urdf", "robot.urdf"):
        (mesh,) = re.findall(r'filename="([^"]+)"', (unpacked_folder / description).read_text())
        assert (unpacked_folder / mesh).is_file()
        assert (unpacked_folder / mesh).parent.joinpath("textures/rubber.png").is_file()
    process = read_plan((unpacked_folder / "plan.json").read_text(), "plan.json").process("map")
    assert process.cwd
    (map_file,) = [word for word in process.argv if word.endswith(".yaml")]
    for named in (process.cwd, map_file.removeprefix("map:=")):
        assert named.startswith("${build_dir}/files/")
        assert Path(named.replace("${build_dir}", str(unpacked_folder))).exists(), named


def test_its_name_is_that_of_the_content_wherever_it_is_built(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = release().name
    moved = folder.with_name("moved")
    folder.rename(moved)
    monkeypatch.chdir(moved / "robots")
    assert release().name == name
    (moved / "robots/maps/office.pgm").write_text("another")
    assert release().name != name
    assert release().with_text(UNIT, "x").manifest.keys() == {*release().manifest, UNIT}


def test_what_is_named_and_is_not_there_is_found(folder: Path) -> None:
    compiled = robot()
    (folder / "robots/maps/office.yaml").unlink()
    with pytest.raises(RejectedError, match=r"office\.yaml") as refused:
        pack_release(compiled)
    assert refused.value.findings[0].code == "TF912"


def test_wheels_bring_a_python_of_their_own(folder: Path) -> None:
    (folder / "a-1-py3-none-any.whl").write_bytes(b"x")
    made = release(wheels=folder)
    assert made.has_wheels
    assert "wheels/a-1-py3-none-any.whl" in made.manifest
    unit = Unit("rover.brain", "rover", "brain", "/srv/x", "/usr/bin/python3", has_wheels=True)
    (command,) = re.findall(r"^ExecStart=(.*)$", unit.text(), re.MULTILINE)
    start = anywhere("/srv/x/current/venv/bin/python")
    assert shlex.split(command)[:5] == [*start, "up", "/srv/x/current/plan.json"]


def test_the_unit_sources_setup_files_and_is_the_users_or_the_systems() -> None:
    unit = Unit(
        "rover.brain",
        "rover",
        "brain",
        "/home/a b/x",
        "/usr/bin/python3",
        ("/opt/ros/jazzy/setup.bash",),
    )
    text = unit.text()
    assert "/opt/ros/jazzy/setup.bash -- /usr/bin/python3" in text
    assert '"/home/a b/x/current/plan.json" --host brain' in text
    assert "$$1" in text
    assert "WantedBy=default.target" in text
    system = Unit(
        "rover.brain", "rover", "brain", "/var/lib/x", "/usr/bin/python3", system=True
    ).text()
    assert "WantedBy=multi-user.target" in system
    assert "RuntimeDirectory=tfcompose/rover.brain" in system


def test_the_fleet_of_a_robot_is_carried_with_it(folder: Path) -> None:
    fleet = "fleet: 1\nshare: [base_link → lidar]\nrobots: {rover: {router: tcp/10.0.0.11:7447}}\n"
    (folder / "fleets").mkdir()
    (folder / "fleets/warehouse.yaml").write_text(fleet)
    made = release(ROBOT.replace("robot: rover", "robot: rover\nfleet: ../fleets/warehouse.yaml"))
    unpacked_folder = unpacked(made, folder / "there")
    share = read_plan((unpacked_folder / "plan.json").read_text(), "plan.json").process(
        "fleet_share"
    )
    file = share.argv[-1].replace("${build_dir}", str(unpacked_folder))
    assert Path(file).read_text() == fleet
    assert (share.host, share.argv[-2]) == ("brain", "rover")
