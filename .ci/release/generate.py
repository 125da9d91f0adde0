#!/usr/bin/env python3
"""Generate what a release needs: CHANGELOG.rst, a conda recipe and, with bloom, a debian folder.

``.ci/release/generate.py [FOLDER]``; the folder is written anew, and is build/release by default.
``bloom-generate`` is looked up on PATH. It resolves keys with rosdep, for which the folder gets an
index of distributions and a list of keys, so that nothing comes from the network.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import yaml

ROOT = Path(__file__).resolve().parents[2]
DISTRO, UBUNTU = "lyrical", "resolute"
#: What a package is built from; ``setup.py`` and ``pyproject.toml`` name the files in the folders.
SOURCES = ("package.xml", "setup.py", "pyproject.toml", "README.md", "LICENSE")
FOLDERS = ("tfcompose", "robots", "schemas")
#: conda's names of packages, where they are not pip's in small letters.
CONDA_NAMES = {"xacro": "ros-jazzy-xacro"}
_VERSION = re.compile(r"## (?P<version>\d+\.\d+\.\d+) - (?P<date>\d{4}-\d\d-\d\d)")
_CODE = re.compile(r"(`[^`]+`)")
_REQUIREMENT = re.compile(r"^([\w-]+)(.*)$")
_LINK = re.compile(r"\[([^\]]+)\]\(([^)]+)\)")


def changelog(markdown: str, name: str) -> str:
    """Return CHANGELOG.md in the format of REP-132, which bloom reads.

    Raises:
        ValueError: if a heading is neither ``Unreleased`` nor a version with its date.
    """
    title = f"Changelog for package {name}"
    rule = "^" * len(title)
    lines = [rule, title, rule, ""]
    body = markdown[markdown.index("\n## ") + 1 :]
    for line in _inline(body).splitlines():
        if line.startswith("## "):
            lines += _heading(line)
        elif line.startswith("### "):  # a section below a version would be left out
            lines.append(f"**{line[4:]}**")
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"


def _heading(line: str) -> list[str]:
    match = _VERSION.fullmatch(line)
    if not match and line != "## Unreleased":
        raise ValueError(f"CHANGELOG.md: {line!r} is not '## Unreleased' or '## X.Y.Z - DATE'")
    text = f"{match['version']} ({match['date']})" if match else "Forthcoming"
    return [text, "-" * len(text)]


def _inline(text: str) -> str:
    """Return Markdown with its code and links in reStructuredText."""
    parts = _CODE.split(text)
    for index, part in enumerate(parts):
        if index % 2:
            code = " ".join(part.split())
            parts[index] = f"`{code}`"
        else:
            parts[index] = re.sub(r"([*_|\\])", r"\\\1", _LINK.sub(r"\1 (\2)", part))
    return "".join(parts)


def recipe(project: dict[str, Any], python: str) -> dict[str, Any]:
    """Return the conda recipe of the project table of pyproject.toml, for a noarch package."""
    return {
        "schema_version": 1,
        "package": {"name": project["name"], "version": project["version"]},
        "source": {"path": "tfcompose"},
        "build": {
            "noarch": "python",
            "number": 0,
            "script": "python -m pip install . --no-deps --no-build-isolation -vv",
            "python": {"entry_points": [f"{k} = {v}" for k, v in project["scripts"].items()]},
        },
        "requirements": {
            "host": [f"python {python}", "pip", *_conda_names(["setuptools>=68,<85"])],
            "run": [f"python {python}", *_conda_names(project["dependencies"])],
        },
        "tests": [
            {
                "python": {"imports": ["tfcompose", "tfcompose.compiler", "tfcompose.launcher"]},
            },
            {"script": ["tfcompose --help", "tfcompose lint --help"]},
        ],
        "about": {
            "license": project["license"]["text"],
            "license_file": "LICENSE",
            "summary": project["description"],
        },
    }


def _conda_names(requirements: list[str]) -> list[str]:
    names = []
    for requirement in requirements:
        name, versions = _REQUIREMENT.findall(requirement)[0]
        names.append(f"{CONDA_NAMES.get(name, name.lower())} {versions}")
    return names


def rosdep_keys(manifest: ET.Element) -> dict[str, Any]:
    """Return a rosdep list with every key of package.xml: Debian's packages and ROS's.

    Keys of Python packages are the names of Debian's packages; all others are packages of ROS.
    """
    keys = {element.text or "" for element in manifest.iter() if element.tag.endswith("depend")}
    return {
        key: {"ubuntu": [key if key.startswith("python3-") else _ros_package(key)]}
        for key in sorted(keys)
    }


def _ros_package(name: str) -> str:
    return f"ros-{DISTRO}-{name.replace('_', '-')}"


def write_index(folder: Path, keys: dict[str, Any]) -> dict[str, str]:
    """Write an index of distributions with Lyrical alone; return the variables that name it."""
    folder.mkdir()
    distribution = {
        "type": "distribution",
        "version": 2,
        "release_platforms": {"ubuntu": [UBUNTU]},
        "repositories": {},
    }
    entry = {
        "distribution": [f"{DISTRO}.yaml"],
        "distribution_cache": (folder / f"{DISTRO}-cache.yaml").as_uri(),
        "distribution_status": "active",
        "distribution_type": "ros2",
        "python_version": 3,
    }
    cache = {
        "type": "cache",
        "version": 2,
        "name": DISTRO,
        "distribution_file": [distribution],
        "release_package_xmls": {},
        "source_repo_package_xmls": {},
    }
    _write(folder / f"{DISTRO}.yaml", distribution)
    _write(folder / f"{DISTRO}-cache.yaml", cache)
    index = {"type": "index", "version": 4, "distributions": {DISTRO: entry}}
    _write(folder / "index.yaml", index)
    _write(folder / "keys.yaml", keys)
    sources = folder / "sources.list.d"
    sources.mkdir()
    list_of_keys = sources / "10-tfcompose.list"
    list_of_keys.write_text(f"yaml {(folder / 'keys.yaml').as_uri()}\n", "utf-8")
    return {
        "ROSDISTRO_INDEX_URL": (folder / "index.yaml").as_uri(),
        "ROSDEP_SOURCE_PATH": str(sources),
        "ROS_HOME": str(folder / "home"),  # rosdep's cache
        "HOME": str(folder / "home"),  # bloom writes logs there
    }


def _write(file: Path, data: dict[str, Any]) -> None:
    file.write_text(yaml.safe_dump(data, sort_keys=False), "utf-8")


def copy_sources(target: Path) -> None:
    """Copy what the package is built from."""
    target.mkdir(parents=True)
    for name in SOURCES:
        shutil.copy2(ROOT / name, target)
    for name in FOLDERS:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, target / name, ignore=ignored)


def main() -> int:
    """Write the folder; return 1 if bloom is missing or fails."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build" / "release").resolve()
    shutil.rmtree(folder, ignore_errors=True)
    package = folder / "tfcompose"
    copy_sources(package)
    manifest = ET.parse(ROOT / "package.xml").getroot()  # noqa: S314 (our file)
    name = manifest.findtext("name") or ""
    log = changelog((ROOT / "CHANGELOG.md").read_text("utf-8"), name)
    (package / "CHANGELOG.rst").write_text(log, "utf-8")
    project = read_project()
    _write(folder / "recipe.yaml", recipe(project, project["requires-python"]))
    variables = os.environ | write_index(folder / "rosdistro", rosdep_keys(manifest))
    bloom = shutil.which("bloom-generate")
    if bloom is None:
        sys.stderr.write("no debian folder: bloom-generate is not installed (pip install bloom)\n")
        return 1
    rosdep = str(Path(bloom).with_name("rosdep"))
    platform = ("--os-name", "ubuntu", "--os-version", UBUNTU, "--ros-distro", DISTRO)
    for command in ([rosdep, "update", "--rosdistro", DISTRO], [bloom, "rosdebian", *platform]):
        if subprocess.run(command, cwd=package, env=variables, check=False).returncode:
            return 1
    return 0


def read_project() -> dict[str, Any]:
    """Return the project table of pyproject.toml."""
    parser = import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")
    table: dict[str, Any] = parser.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return table


if __name__ == "__main__":
    sys.exit(main())
