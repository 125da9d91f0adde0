"""From the plan to what the operating system starts: words that only this machine knows, and where programs are.

``${executable:PACKAGE/NAME}`` as the first word of an ``argv`` is a ROS package's program: ``lib/PACKAGE/NAME`` below
one of the prefixes of AMENT_PREFIX_PATH, else NAME on the PATH.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.plan import PlanProcess

_PLACEHOLDER = re.compile(r"\$\{(python|plan|build_dir|params_file)\}")
_ROS_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")


def folder_of(process: PlanProcess, build_dir: Path) -> Path:
    """Return the folder that the process runs in."""
    return build_dir / process.cwd if process.cwd is not None else Path.cwd()


def filled_in(process: PlanProcess, plan_file: Path) -> tuple[str, ...]:
    """Return the process's ``argv`` with the placeholders replaced; ``plan_file`` is absolute."""
    values = {"python": sys.executable, "plan": str(plan_file), "build_dir": str(plan_file.parent)}
    if process.params_file is not None:
        values["params_file"] = str(plan_file.parent / process.params_file)
    return tuple(_PLACEHOLDER.sub(lambda found: values.get(found[1], found[0]), word) for word in process.argv)


def executable_of(process: PlanProcess, word: str, folder: Path, env: Mapping[str, str]) -> str | Diagnostic:
    """Return the path of the program that ``word`` means, or the finding that says where it was looked for.

    A relative path is looked up in ``folder``, a bare name on the PATH of ``env``.
    """
    ros = _ROS_EXECUTABLE.fullmatch(word)
    if ros:
        return _in_package(process, ros[1], ros[2], env)
    if "/" in word:
        path = folder / word
        return str(path) if _can_run(path) else _not_found(process, word, [_why_not(path)])
    path_variable = env.get("PATH", os.defpath)
    return shutil.which(word, path=path_variable) or _not_found(process, word, [_path_note(path_variable)])


def _in_package(process: PlanProcess, package: str, name: str, env: Mapping[str, str]) -> str | Diagnostic:
    prefixes = [prefix for prefix in env.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
    folders = [Path(prefix) / "lib" / package for prefix in prefixes]
    for folder in folders:
        if _can_run(folder / name):
            return str(folder / name)
    path_variable = env.get("PATH", os.defpath)
    on_path = shutil.which(name, path=path_variable)
    if on_path:
        return on_path
    notes = [_why_not(folder / name) for folder in folders] or ["AMENT_PREFIX_PATH names no folder"]
    known = [file.name for folder in folders if folder.is_dir() for file in sorted(folder.iterdir())]
    otherwise = f"install the package {package}" if prefixes else "source the setup file of your ROS installation first"
    advice = did_you_mean(name, known, "" if known else otherwise)
    return _not_found(process, f"{package}/{name}", [*notes, _path_note(path_variable)], advice)


def _can_run(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


def _why_not(path: Path) -> str:
    if path.is_file():
        return f"{path} may not be executed"
    return f"{path} is a folder" if path.is_dir() else f"{path} is not there"


def _path_note(path_variable: str) -> str:
    return f"looked in the PATH: {path_variable}"


def _not_found(process: PlanProcess, word: str, notes: list[str], advice: str = "") -> Diagnostic:
    message = f"the executable {word} of {process.name} was not found"
    return finding("TF810", message, None, notes=[Note(note) for note in notes], help=advice)
