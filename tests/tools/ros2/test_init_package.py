"""``tfcompose init --package``: the files that it writes, and when it writes none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest

from tests.support.cli import tfcompose_in
from tfcompose.cli import writing
from tfcompose.cli.templates import TEMPLATES

if TYPE_CHECKING:
    from pathlib import Path

OF_BOTH = {"package.xml", "launch/bringup.launch.xml", "test/test_robots.py"}
OF_PYTHON = OF_BOTH | {"setup.py", "setup.cfg", "resource/rover_bringup"}
OF_CMAKE = OF_BOTH | {"CMakeLists.txt"}


def files_below(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}


def manifest_of(package: Path) -> ET.Element:
    return ET.parse(package / "package.xml").getroot()  # noqa: S314 (our file)


@pytest.mark.parametrize("template", TEMPLATES)
def test_it_holds_each_template_as_a_launch_file_without_findings(
    template: str, tmp_path: Path
) -> None:
    done = tfcompose_in(tmp_path, "init", template, "--package", "rover_bringup")
    assert done.returncode == 0, done.stderr
    package = tmp_path / "rover_bringup"
    robots = {"robots/rover.tfc.yaml"} | {
        f"robots/{file_name}" for file_name in TEMPLATES[template][1]
    }
    assert files_below(package) == OF_PYTHON | robots
    assert "\nrobot: rover\n" in (package / "robots/rover.tfc.yaml").read_text("utf-8")
    linted = tfcompose_in(tmp_path, "lint", "rover_bringup", "--fail-on", "warning")
    assert linted.returncode == 0, linted.stdout


@pytest.mark.parametrize(
    ("options", "files", "build_type", "test_depend"),
    [
        ((), OF_PYTHON, "ament_python", "python3-pytest"),
        (("--cmake",), OF_CMAKE, "ament_cmake", "ament_cmake_pytest"),
    ],
    ids=["python", "cmake"],
)
def test_the_manifest_names_the_build_type_and_what_it_needs(
    options: tuple[str, ...],
    files: set[str],
    build_type: str,
    test_depend: str,
    tmp_path: Path,
) -> None:
    made = ("--package", "rover_bringup", "-o", "src/here", "--name", "mars", "--schema", *options)
    assert tfcompose_in(tmp_path, "init", *made).returncode == 0
    package = tmp_path / "src/here"
    assert files_below(package) == files | {"robots/mars.tfc.yaml", "robots/robot.schema.json"}
    manifest = manifest_of(package)
    assert (manifest.get("format"), manifest.findtext("name")) == ("3", "rover_bringup")
    assert manifest.findtext("export/build_type") == build_type
    assert {depend.text for depend in manifest.findall("exec_depend")} >= {"tfcompose"}
    assert manifest.findtext("test_depend") == test_depend
    tool = "ament_cmake" if build_type == "ament_cmake" else None
    assert manifest.findtext("buildtool_depend") == tool
    assert "@" not in "".join(
        (package / file).read_text("utf-8") for file in files - {"package.xml", *_DECORATED}
    )


_DECORATED = {"test/test_robots.py"}


@pytest.mark.parametrize(
    ("name", "email", "expected"),
    [
        ('Ann "<b>" & Co', "ann@example.org", ('Ann "<b>" & Co', "ann@example.org")),
        ("Ann", "ann@laptop", ("TODO", "user@todo.todo")),
        ("", "", ("TODO", "user@todo.todo")),
    ],
    ids=["of Git", "an address that catkin_pkg refuses", "none"],
)
def test_the_maintainer_is_whom_git_names(
    name: str, email: str, expected: tuple[str, str], tmp_path: Path
) -> None:
    config = tmp_path / "gitconfig"
    quoted = name.replace('"', '\\"')
    config.write_text(f'[user]\nname = "{quoted}"\nemail = "{email}"\n', "utf-8")
    settings = {"GIT_CONFIG_GLOBAL": str(config), "GIT_CONFIG_SYSTEM": "/dev/null"}
    done = tfcompose_in(
        tmp_path, "init", "--package", "rover_bringup", GIT_DIR=str(tmp_path / "none"), **settings
    )
    assert done.returncode == 0, done.stderr
    maintainer = manifest_of(tmp_path / "rover_bringup").find("maintainer")
    assert maintainer is not None
    assert (maintainer.text, maintainer.get("email")) == expected


@pytest.mark.parametrize(
    "name", ["", "r", "Rover", "rover-bringup", "3rover", "_rover", "a/b", "ä_b", "tfcompose"]
)
def test_a_name_that_no_package_can_have_is_refused(name: str, tmp_path: Path) -> None:
    done = tfcompose_in(tmp_path, "init", "--package", name)
    assert (done.returncode, done.stdout) == (2, "")
    assert name in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_refused_name_is_answered_with_a_near_one(tmp_path: Path) -> None:
    done = tfcompose_in(tmp_path, "init", "--package", "Rover-Bringup")
    assert "rover_bringup" in done.stderr


@pytest.mark.parametrize(
    "options",
    [
        ("--cmake",),
        ("--package", "rover", "--name", "3"),
        ("--package", "rover", "--tests", "robot.yaml"),
    ],
    ids=str,
)
def test_options_that_make_no_package_are_refused(
    options: tuple[str, ...], tmp_path: Path
) -> None:
    assert tfcompose_in(tmp_path, "init", *options).returncode == 2
    assert not list(tmp_path.iterdir())


def test_the_list_of_templates_needs_no_package(tmp_path: Path) -> None:
    done = tfcompose_in(tmp_path, "init", "--list", "--package", "rover")
    assert done.stdout == tfcompose_in(tmp_path, "init", "--list").stdout
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("existing", ["rover", "rover/mine", "a link"])
def test_what_is_there_stays_as_it_is(existing: str, tmp_path: Path) -> None:
    path = tmp_path / existing
    if existing == "a link":
        (tmp_path / "rover").symlink_to("nowhere")
    else:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine", "utf-8")
    before = files_below(tmp_path)
    done = tfcompose_in(tmp_path, "init", "--package", "rover")
    assert (done.returncode, "rover exists" in done.stderr) == (2, True)
    assert files_below(tmp_path) == before


def test_an_empty_folder_is_filled(tmp_path: Path) -> None:
    (tmp_path / "rover").mkdir()
    assert tfcompose_in(tmp_path, "init", "--package", "rover").returncode == 0
    assert (tmp_path / "rover/robots/rover.tfc.yaml").is_file()


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_an_interrupted_package_leaves_nothing(
    error: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, begun = writing._write_to_disk, []

    def write_two(path: Path, text: str) -> None:
        begun.append(path)
        if len(begun) == 3:
            raise error
        write(path, text)

    monkeypatch.setattr(writing, "_write_to_disk", write_two)
    done = tfcompose_in(tmp_path, "init", "--package", "rover", "-o", "ws/src/rover")
    assert done.returncode == (130 if error is KeyboardInterrupt else 2)
    assert len(begun) == 3
    assert not list(tmp_path.iterdir())
