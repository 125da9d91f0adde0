"""From the plan to what the operating system starts: words that only this machine knows, and where programs are.

``${executable:PACKAGE/NAME}`` as the first word of an ``argv`` is a ROS package's program: ``lib/PACKAGE/NAME`` below
one of the prefixes of AMENT_PREFIX_PATH, else NAME on the PATH.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, did_you_mean, finding

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.plan import PlanProcess

_PLACEHOLDER = re.compile(r"\$\{(python|plan|build_dir|params_file)\}")
_ROS_EXECUTABLE = re.compile(r"\$\{executable:([^/}]+)/([^/}]+)\}")


def folder_of(process: PlanProcess, plan_file: Path, build_dir: Path) -> Path:
    """Return the folder that the process runs in, an absolute path without ``..`` where the plan says one."""
    if process.cwd is None:
        return _here()
    return Path(os.path.normpath(build_dir / _filled(process.cwd, process, plan_file, build_dir)))


def _here() -> Path:
    """Return the folder that this program runs in; where it was removed meanwhile, the one that it was."""
    try:
        return Path.cwd()
    except FileNotFoundError:
        return Path(str(Path("/proc/self/cwd").readlink()).removesuffix(" (deleted)"))


def filled_in(process: PlanProcess, plan_file: Path, build_dir: Path | None = None) -> tuple[str, ...]:
    """Return the process's ``argv`` with the placeholders replaced; both paths are absolute."""
    return tuple(_filled(word, process, plan_file, build_dir) for word in process.argv)


def own_env(process: PlanProcess, plan_file: Path, build_dir: Path | None = None) -> dict[str, str]:
    """Return the variables that the plan gives the process, with the placeholders replaced."""
    return {name: _filled(value, process, plan_file, build_dir) for name, value in process.env.items()}


def _filled(text: str, process: PlanProcess, plan_file: Path, build_dir: Path | None = None) -> str:
    values = {"python": sys.executable, "plan": str(plan_file), "build_dir": str(build_dir or plan_file.parent)}
    if process.params_file is not None:
        values["params_file"] = str(plan_file.parent / process.params_file)
    return _PLACEHOLDER.sub(lambda found: values.get(found[1], found[0]), text)


@dataclass(frozen=True, slots=True)
class NotFound:
    """A program that is not there: whose it is, what it is called, where it was looked for, and what may help."""

    process: str
    program: str
    places: tuple[str, ...]
    path: str = ""
    advice: str = ""


def not_found(missing: Sequence[NotFound]) -> Finding:
    """Return the one finding for all programs that were not found."""
    what = ", ".join(f"{one.program} of {one.process}" for one in missing)
    message = f"{len(missing)} executables were not found: {what}"
    if len(missing) == 1:
        message = f"the executable {what} was not found"
    places = dict.fromkeys(place for one in missing for place in one.places)
    paths = dict.fromkeys(f"looked in the PATH: {one.path}" for one in missing if one.path)
    advice = dict.fromkeys(one.advice for one in missing if one.advice)
    return finding("TF810", message, None, notes=[Note(note) for note in (*places, *paths)], help="; ".join(advice))


def executable_of(process: PlanProcess, word: str, folder: Path, env: Mapping[str, str]) -> str | NotFound:
    """Return the path of the program that ``word`` means, or what is missing.

    A relative path is looked up in ``folder``, a bare name on the PATH of ``env``.
    """
    ros = _ROS_EXECUTABLE.fullmatch(word)
    if ros:
        return _in_package(process, ros[1], ros[2], env)
    if "/" in word:
        path = folder / word
        if _can_run(path):
            return str(path)
        advice = "" if word.startswith("/") else f"${{file({word})}} is beside the robot file, wherever up is called"
        return NotFound(process.name, word, (_why_not(path),), advice=advice)
    path_variable = env.get("PATH", os.defpath)
    return shutil.which(word, path=path_variable) or NotFound(process.name, word, (), path_variable)


def _in_package(process: PlanProcess, package: str, name: str, env: Mapping[str, str]) -> str | NotFound:
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
    otherwise = "source the setup file of your ROS installation first"
    if prefixes:
        debian = f"ros-{env.get('ROS_DISTRO', 'jazzy')}-{package.replace('_', '-')}"
        otherwise = f"install the package {package} (on Ubuntu probably: sudo apt install {debian})"
    advice = did_you_mean(name, known, "" if known else otherwise)
    return NotFound(process.name, f"{package}/{name}", tuple(notes), path_variable, advice)


def _can_run(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


def _why_not(path: Path) -> str:
    if path.is_file():
        return f"{path} may not be executed"
    return f"{path} is a folder" if path.is_dir() else f"{path} is not there"
