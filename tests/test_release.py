"""Files of a release: CHANGELOG.rst, the conda recipe and, where bloom is, the debian folder."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest
import yaml
from packaging.requirements import Requirement

from tests.support import processes
from tests.support.house import ROOT

SCRIPT = ROOT / ".ci" / "release" / "generate.py"
BLOOM = shutil.which("bloom-generate")
MANIFEST = ET.parse(ROOT / "package.xml").getroot()  # noqa: S314 (our file)
VERSION = MANIFEST.findtext("version")

if TYPE_CHECKING:
    import subprocess


def load_script() -> Any:
    spec = importlib.util.spec_from_file_location("release", SCRIPT)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SCRIPTED = load_script()
MARKDOWN = """# Changelog

The format.

## Unreleased

### Added

- `up FILE`, with `--set
  A=1`: see [it](https://example.org/page); a_b and *c*.

## 1.2.3 - 2026-01-31

### Fixed

- It.
"""


def test_the_changelog_is_in_the_format_of_rep_132() -> None:
    lines = SCRIPTED.changelog(MARKDOWN, "rover").splitlines()
    assert lines[:3] == ["^" * 27, "Changelog for package rover", "^" * 27]
    assert lines[4:6] == ["Forthcoming", "-----------"]
    rest = r"see it (https://example.org/page); a\_b and \*c\*."
    assert f"- ``up FILE``, with ``--set A=1``: {rest}" in lines
    assert lines[lines.index("1.2.3 (2026-01-31)") + 1] == "-" * 18


def test_a_version_without_a_date_is_refused() -> None:
    with pytest.raises(ValueError, match=r"1\.2\.3"):
        SCRIPTED.changelog(MARKDOWN.replace(" - 2026-01-31", ""), "rover")


def test_the_version_of_the_package_is_in_the_changelog() -> None:
    log = SCRIPTED.changelog((ROOT / "CHANGELOG.md").read_text("utf-8"), "tfcompose")
    assert f"\n{VERSION} (" in log


def test_the_recipe_requires_what_pip_does() -> None:
    project = SCRIPTED.read_project()
    recipe = SCRIPTED.recipe(project, project["requires-python"])
    required = recipe["requirements"]["run"]
    assert required[0] == f"python {project['requires-python']}"
    expected = {
        SCRIPTED.CONDA_NAMES.get(entry.name, entry.name.lower()): entry.specifier
        for entry in map(Requirement, project["dependencies"])
    }
    listed = [Requirement(text) for text in required[1:]]
    assert {entry.name: entry.specifier for entry in listed} == expected


def python_of_bloom(*arguments: str) -> subprocess.CompletedProcess[str]:
    return processes.run([Path(str(BLOOM)).with_name("python3"), *arguments])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("release") / "release"
    done = processes.run([sys.executable, SCRIPT, target], timeout_s=120)
    assert done.returncode == 0, done.stdout + done.stderr
    return target


needs_bloom = pytest.mark.skipif(BLOOM is None, reason="there is no bloom-generate")


@pytest.mark.slow
@needs_bloom
def test_bloom_makes_a_debian_package_that_depends_on_all_of_package_xml(folder: Path) -> None:
    control = (folder / "tfcompose/debian/control").read_text("utf-8")
    (depends,) = [line for line in control.splitlines() if line.startswith("Depends: ")]
    packages = set(depends.removeprefix("Depends: ").split(", "))
    keys = {element.text or "" for element in MANIFEST.findall("exec_depend")}
    assert packages - {"${python3:Depends}", "${misc:Depends}"} == {
        key if key.startswith("python3-") else f"ros-lyrical-{key.replace('_', '-')}"
        for key in keys
    }
    assert "Package: ros-lyrical-tfcompose" in control
    newest = (folder / "tfcompose/debian/changelog").read_text("utf-8").splitlines()[0]
    assert newest.startswith(f"ros-lyrical-tfcompose ({VERSION}-0")


@pytest.mark.slow
@needs_bloom
def test_catkin_pkg_reads_the_changelog_without_a_warning(folder: Path) -> None:
    read = f"""
from catkin_pkg.changelog import get_changelog_from_path
log = get_changelog_from_path({str(folder / "tfcompose")!r})
print([(version, len(content) > 1) for version, _, content in log.foreach_version()])
"""
    done = python_of_bloom("-c", read)
    assert (done.stdout.strip(), done.stderr) == (f"[('{VERSION}', True)]", "")


@pytest.mark.slow
@needs_bloom
def test_rattler_build_renders_the_recipe(folder: Path) -> None:
    render = f"""
import rattler_build
recipe = rattler_build.Stage0Recipe.from_file({str(folder / "recipe.yaml")!r})
print([str(variant.recipe.package.version) for variant in recipe.render()])
"""
    done = python_of_bloom("-c", render)
    if "No module named 'rattler_build'" in done.stderr:
        pytest.skip("there is no rattler_build beside bloom-generate")
    assert done.stdout.strip() == f"['{VERSION}']", done.stderr


@pytest.mark.slow
def test_without_bloom_it_writes_the_rest_and_says_so(tmp_path: Path) -> None:
    target = tmp_path / "release"
    environment = {**os.environ, "PATH": str(tmp_path)}
    done = processes.run([sys.executable, SCRIPT, target], env=environment)
    assert done.returncode == 1
    assert "bloom" in done.stderr
    assert yaml.safe_load((target / "recipe.yaml").read_text("utf-8"))["package"]["version"]
    assert (target / "tfcompose/CHANGELOG.rst").exists()
