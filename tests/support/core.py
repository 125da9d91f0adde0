"""The package without its tools, and packages with tools, each in a folder for ``PYTHONPATH``."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tests.support import processes
from tests.support.house import PACKAGE

if TYPE_CHECKING:
    import subprocess

ACME = Path(__file__).with_name("acme_tool")


def copy_core(folder: Path) -> Path:
    """Copy the package without the folder ``tools``; return the folder that it is in."""
    ignored = shutil.ignore_patterns("__pycache__", "tools")
    shutil.copytree(PACKAGE, folder / "tfcompose", ignore=ignored)
    (folder / "sitecustomize.py").write_text(_WITHOUT_EDITABLE, encoding="utf-8")
    return folder


#: An editable install finds each missing part of the package in the repository; this hides it.
_WITHOUT_EDITABLE = """\
import sys
for finder in list(sys.meta_path):
    if "Editable" in getattr(finder, "__name__", ""):
        sys.meta_path.remove(finder)
"""


def install(source: Path, folder: Path) -> Path:
    """Install a package with pip, offline, into a folder; return that."""
    copy = folder / "source"  # pip builds beside the source
    shutil.copytree(source, copy)
    target = folder / "site"
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--target", target]
    processes.run([sys.executable, "-m", "pip", "install", *map(str, options), copy], check=True)
    return target


def write_tool(folder: Path, name: str, module: str) -> None:
    """Write a package of one module whose ``TOOL`` an entry point names."""
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.py").write_text(module, encoding="utf-8")
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[tfcompose.tools]\n{name} = {name}:TOOL\n")


def run_with(
    path: str | Path, cwd: Path, *arguments: object, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run tfcompose in its own process, with these folders first on Python's path."""
    command = [sys.executable, "-m", "tfcompose", *map(str, arguments)]
    env = os.environ | {"PYTHONPATH": str(path)} | environment
    return processes.run(command, cwd=cwd, env=env)
