"""package.xml says what pyproject.toml says, and names everything that the code imports of ROS."""

from __future__ import annotations

import ast
import os
import re
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest
from packaging.requirements import Requirement

from tests.support.house import PACKAGE, ROOT, nodes_of
from tfcompose import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

tomllib: Any = import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")  # of pytest
MANIFEST = ET.parse(ROOT / "package.xml").getroot()  # noqa: S314 (our file)
PYPROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = PYPROJECT["project"]
#: rosdep's keys and ROS's packages, by what pip calls them. The others are ``python3-NAME``.
KEYS = {"PyYAML": "python3-yaml", "xacro": "xacro"}
#: Packages that come with those that use them: rclpy's generated messages.
WITH_ANOTHER = {"rosidl_generator_py"}
#: Messages that the code imports by names that it computes.
COMPUTED = {"sensor_msgs"}


def depends(kind: str) -> set[str]:
    return {element.text or "" for element in MANIFEST.findall(kind)}


def imports_of(file: Path) -> Iterator[str]:
    for node in nodes_of(file):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def test_versions_and_descriptions_are_one() -> None:
    assert MANIFEST.findtext("name") == PROJECT["name"]
    assert MANIFEST.findtext("version") == PROJECT["version"] == __version__
    assert MANIFEST.findtext("description") == PROJECT["description"]
    assert MANIFEST.findtext("license") == PROJECT["license"]["text"]
    assert (MANIFEST.get("format"), MANIFEST.findtext("export/build_type")) == (
        "3",
        "ament_python",
    )


def test_it_depends_on_pip_packages_and_the_ros_imports_of_the_code() -> None:
    names = [Requirement(text).name for text in PROJECT["dependencies"]]
    installed = {KEYS.get(name, f"python3-{name}") for name in names}
    ours = {*sys.stdlib_module_names, "tfcompose", *_python_packages()}
    imported = {
        name.partition(".")[0] for file in PACKAGE.rglob("*.py") for name in imports_of(file)
    }
    ros = imported - ours - WITH_ANOTHER | COMPUTED
    assert depends("exec_depend") == installed | ros


def _python_packages() -> set[str]:
    """Return the modules of packages that pip installs, also for the extras."""
    extras = PROJECT["optional-dependencies"].values()
    requirements = [*PROJECT["dependencies"], *(text for extra in extras for text in extra)]
    modules = {Requirement(text).name.replace("-", "_") for text in requirements}
    return modules | {"markdown_it", "pydantic_core", "resvg_py", "yaml", "zenoh"}


def test_what_colcon_installs_is_there_and_leaves_no_robot_or_schema_out() -> None:
    data = PYPROJECT["tool"]["setuptools"]["data-files"]
    files = {
        file.relative_to(ROOT).as_posix()
        for patterns in data.values()
        for pattern in patterns
        for file in ROOT.glob(pattern)
    }
    folders = ("robots", "schemas")
    assert files >= {
        file.relative_to(ROOT).as_posix()
        for folder in folders
        for file in (ROOT / folder).rglob("*")
        if file.is_file()
    }
    (marker,) = data["share/ament_index/resource_index/packages"]
    (program,) = data["lib/tfcompose"]
    assert {marker.rpartition("/")[2], program.rpartition("/")[2]} == {"tfcompose"}
    assert os.access(ROOT / program, os.X_OK)
    assert f'PROGRAM = "{program}"' in (ROOT / "setup.py").read_text("utf-8")


@pytest.mark.parametrize("version", ["68.1.2", "79.0.1"])  # Ubuntu 24.04's, and pip's for colcon
def test_the_setuptools_of_ubuntu_and_of_colcon_build_it(version: str) -> None:
    (setuptools,) = map(Requirement, PYPROJECT["build-system"]["requires"])
    assert setuptools.specifier.contains(version)


def test_it_is_released_in_words_that_a_manifest_takes() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+", MANIFEST.findtext("version") or "")
