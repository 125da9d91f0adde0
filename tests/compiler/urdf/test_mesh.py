"""Mesh addresses: as they are written, and for a target.

Found by packages of the robot and of the workspace.
"""

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
import trimesh

from tests.support import processes
from tests.support.cli import tfcompose_in
from tfcompose.cli import main

ROBOT = """tfcompose: 1
robot: r
packages: {named: ../third party/named}
links:
  base_link:
    visual:
      - {mesh: meshes/a b.stl}
      - {mesh: package://named/n.stl}
      - {mesh: package://sourced/meshes/s.stl}
"""
MESHES = (
    "ws/src/robots/meshes/a b.stl",
    "ws/src/third party/named/n.stl",
    "ws/install/share/sourced/meshes/s.stl",
)

CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    for name in MESHES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        trimesh.creation.box((1, 1, 1)).export(tmp_path / name)
    (tmp_path / "ws/src/robots/r.yaml").write_text(ROBOT)
    return tmp_path / "ws"


def build(
    workspace: Path, *words: str, file: str = "src/robots/r.yaml"
) -> subprocess.CompletedProcess[str]:
    return tfcompose_in(
        workspace, "build", file, *words, AMENT_PREFIX_PATH=f"/nowhere:{workspace}/install"
    )


def addresses(folder: Path) -> list[str]:
    both = [
        ET.parse(folder / name).iter("mesh")  # noqa: S314 (our own)
        for name in ("robot.urdf", "robot.state_publisher.urdf")
    ]
    full, short = ([str(mesh.get("filename")) for mesh in meshes] for meshes in both)
    assert full == short
    return full


def test_addresses_stay_and_relative_ones_lead_from_the_build_folder(
    workspace: Path,
) -> None:
    assert build(workspace).returncode == 0
    relative, *packages = addresses(workspace / "build/r")
    assert (workspace / "build/r" / relative).samefile(workspace / "src/robots/meshes/a b.stl")
    assert packages == ["package://named/n.stl", "package://sourced/meshes/s.stl"]
    build(workspace, "-o", "elsewhere/deep/er")
    moved = addresses(workspace / "elsewhere/deep/er")[0]
    assert (workspace / "elsewhere/deep/er" / moved).is_file()


def test_for_readers_without_ros_every_address_is_a_file_that_is_there(workspace: Path) -> None:
    assert build(workspace, "--mesh", "file").returncode == 0
    meshes = addresses(workspace / "build/r")
    assert all(address.startswith("file:///") for address in meshes)
    assert [Path(unquote(address[7:])) for address in meshes] == [
        workspace.parent / name for name in MESHES
    ]
    assert build(workspace, "--mesh", "relative").returncode == 0
    meshes = addresses(workspace / "build/r")
    assert [(workspace / "build/r" / address).resolve() for address in meshes] == [
        workspace.parent / name for name in MESHES
    ]


def test_an_address_keeps_every_character_that_readers_take_as_it_is(workspace: Path) -> None:
    """Libcurl decodes what ROS reads; readers without ROS decode nothing."""
    name = "base (1)+ä,=@&'~.stl"
    (workspace / "src/robots/meshes/a b.stl").rename(workspace / "src/robots/meshes" / name)
    (workspace / "src/robots/r.yaml").write_text(
        ROBOT.replace("meshes/a b.stl", f'"meshes/{name}"')
    )
    assert build(workspace, "--mesh", "file").returncode == 0
    assert addresses(workspace / "build/r")[0].endswith("/meshes/" + name.replace(" ", "%20"))


def test_for_ros_every_address_is_in_a_package_or_nothing_is_built(workspace: Path) -> None:
    refused = build(workspace, "--mesh", "package")
    assert refused.returncode == 1
    assert "src/robots/r.yaml:7:16: error[TF726] meshes/a b.stl" in refused.stderr
    assert not (workspace / "build").exists()
    (workspace / "src/robots/package.xml").write_text(
        "<package><name>robots_of_ours</name></package>"
    )
    assert build(workspace, "--mesh", "package").returncode == 0
    assert addresses(workspace / "build/r") == [
        "package://robots_of_ours/meshes/a%20b.stl",
        "package://named/n.stl",
        "package://sourced/meshes/s.stl",
    ]


def test_a_package_that_is_nowhere_is_reported_with_the_folders_searched(workspace: Path) -> None:
    robot = workspace / "src/robots/r.yaml"
    robot.write_text(ROBOT.replace("package://sourced", "package://sorced"))
    built = build(workspace)
    assert built.returncode == 0  # on another machine it may be installed
    assert re.search(r"r\.yaml:9:16: warning\[TF724\] .*\bsorced\b", built.stderr)
    assert f" /nowhere/share/sorced, {workspace}/install/share/sorced" in built.stderr
    requested = build(workspace, "--mesh", "file")
    assert requested.returncode == 1
    assert "error[TF724] package://sorced/meshes/s.stl" in requested.stderr


def test_an_otherwise_unknown_package_is_the_one_around_the_asking_file(
    workspace: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A checkout of a vendor's package is read before it is built and sourced.

    What is sourced comes first.
    """
    source = workspace / "src/third party/named"
    (source / "package.xml").write_text("<package><name>named</name></package>")
    (source / "urdf").mkdir()
    (source / "urdf/height.xacro").write_text(
        '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:property name="size"'
        ' value="2"/></robot>'
    )
    (source / "urdf/arm.xacro").write_text(
        '<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro"><link'
        ' name="base"><visual><geometry><xacro:include filename="$(find'
        ' named)/urdf/height.xacro"/><mesh filename="package://named/n.stl" scale="1 1'
        ' ${size}"/></geometry></visual></link></robot>'
    )
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/nowhere")
    monkeypatch.chdir(workspace)
    complete = (
        "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\nparts:\n  arm: {xacro: ../ARM, parent:"
        " base_link}\n"
    )
    (workspace / "src/robots/r.yaml").write_text(
        complete.replace("ARM", "third party/named/urdf/arm.xacro")
    )
    assert main(["build", "src/robots/r.yaml", "--mesh", "file"]) == 0
    assert unquote(addresses(workspace / "build/r")[0]) == f"file://{source}/n.stl"
    assert (
        main(["import", "src/third party/named/urdf/arm.xacro", "-o", "src/robots/imported.yaml"])
        == 0
    )
    assert "  named: ../third party/named\n" in (
        workspace / "src/robots/imported.yaml"
    ).read_text().replace('"', "")
    assert main(["lint", "src/robots/imported.yaml", "src/third party/named/urdf/arm.xacro"]) == 0
    assert "TF724" not in capsys.readouterr().err
    (workspace / "install/share/named").mkdir()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{workspace}/install")
    assert main(["build", "src/robots/r.yaml"]) == 1
    assert f"{workspace}/install/share/named/urdf/height.xacro" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "way"), [("import", "--package nmd=FOLDER"), ("lint", "source")]
)
def test_what_to_do_about_a_package_is_what_the_command_can_do(
    workspace: Path,
    capsys: pytest.CaptureFixture[str],
    command: str,
    way: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    file = workspace / "a.xacro"
    file.write_text(
        '<robot name="a" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:include filename="$(find'
        ' nmd)/x"/></robot>'
    )
    assert main([command, str(file)]) != 0
    output = capsys.readouterr()
    (line,) = [
        line for line in (output.err + output.out).splitlines() if "AMENT_PREFIX_PATH" in line
    ]
    assert (way in line, "--package" in line) == (True, command == "import")


def test_a_build_is_the_same_wherever_the_workspace_is(workspace: Path) -> None:
    build(workspace)
    first = {
        file.name: file.read_bytes()
        for file in (workspace / "build/r").rglob("*")
        if file.is_file()
    }
    moved = workspace.rename(workspace.parent / "moved")
    build(moved, "-o", "again/r")
    assert {
        file.name: file.read_bytes() for file in (moved / "again/r").rglob("*") if file.is_file()
    } == first


def test_only_the_mass_of_a_mesh_loads_trimesh_and_triangles_spread_it(
    workspace: Path,
) -> None:
    names = (
        "import sys, tfcompose.cli as c; c.main(['lint', 'src/robots/r.yaml']); print('trimesh' in"
        " sys.modules)"
    )
    env = os.environ | {"AMENT_PREFIX_PATH": f"{workspace}/install"}

    def loaded() -> str:
        done = processes.run([sys.executable, "-c", names], cwd=workspace, env=env)
        return done.stdout.splitlines()[-1]

    assert loaded() == "False"
    robot = workspace / "src/robots/r.yaml"
    robot.write_text(ROBOT + "    inertial: {mass: 6 kg}\n")
    assert loaded() == "True"


#: What a checkout without Git LFS has in a file's place.
POINTER = f"version https://git-lfs.github.com/spec/v1\noid sha256:{'0' * 64}\nsize 12345\n"


def test_a_mesh_that_is_yet_to_be_fetched_is_a_warning(workspace: Path) -> None:
    mesh = workspace / "src/robots/meshes/a b.stl"
    before = mesh.read_bytes()
    mesh.write_text(POINTER)
    done = build(workspace)
    assert (done.returncode, "warning[TF723]" in done.stderr) == (0, True)
    assert re.search(r"\ba b\.stl\b.*Git LFS", done.stderr)
    assert "git lfs pull" in done.stderr
    mesh.write_bytes(before)
    assert "TF723" not in build(workspace).stderr


def test_a_mass_over_a_mesh_without_trimesh_says_what_to_install(workspace: Path) -> None:
    robot = workspace / "src/robots/r.yaml"
    robot.write_text(ROBOT + "    inertial: {mass: 6 kg}\n")
    code = (
        "import sys; sys.modules['trimesh'] = None; import tfcompose.cli as c;"
        " sys.exit(c.main(['build', 'src/robots/r.yaml']))"
    )
    env = os.environ | {"AMENT_PREFIX_PATH": f"{workspace}/install"}
    done = processes.run([sys.executable, "-c", code], cwd=workspace, env=env)
    assert done.returncode == 2
    assert "r.yaml:10:5: error[TF905] meshes/a b.stl: " in done.stderr
    assert "pip install 'tfcompose[mesh]'" in done.stderr
    assert not (workspace / "build").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (POINTER, "Git LFS"),
        ("no mesh at all", "it has no triangles"),
        ((((0, 0, 0), (1, 0, 0), (0, 1, 1)), ((0, 1, 2), (0, 2, 1))), "it is flat"),
        ((CORNERS, ((0, 2, 1), (0, 1, 3), (1, 2, 3))), "it is not closed"),
        (
            (CORNERS, ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 3, 2))),
            "some of its triangles face inwards",
        ),
    ],
)
def test_a_mass_that_cannot_be_spread_is_a_finding(
    workspace: Path, content: str | tuple[Any, Any], words: str
) -> None:
    """A mesh whose volume is only a sum of its triangles builds nothing, without warnings."""
    robot = workspace / "src/robots/r.yaml"
    robot.write_text(ROBOT + "    inertial: {mass: 6 kg}\n")
    mesh_file = workspace / "src/robots/meshes/a b.stl"
    if isinstance(content, str):
        mesh_file.write_text(content)
    else:
        trimesh.Trimesh(*content, process=False).export(mesh_file)
    done = build(workspace)
    assert done.returncode == 1
    assert "r.yaml:10:5: error[TF725] meshes/a b.stl: " in done.stderr
    assert words in done.stderr
    assert not (workspace / "build").exists()
