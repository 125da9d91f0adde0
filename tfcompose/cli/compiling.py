"""Compilation of the files on the command line, with presets and overlays.

The module also gives the compiler access to this machine: files, packages, and volumes of meshes.
"""

from __future__ import annotations

import contextlib
import os
import sys
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.cli.reading import read_text
from tfcompose.cli.ros_arguments import ros_arguments
from tfcompose.cli.terminal import (
    MOST_OF_ONE_CODE,
    fail,
    plain,
    print_findings,
    printable,
    reject,
)
from tfcompose.compiler.compile import Compiled, compile_source
from tfcompose.compiler.resolve import Library
from tfcompose.compiler.urdf.inertia import UnmeasurableError
from tfcompose.compiler.urdf.packages import FETCH, Disk
from tfcompose.foundation.findings import RejectedError, Span, did_you_mean, finding
from tfcompose.foundation.reach import Reach
from tfcompose.foundation.reading import is_file, is_folder, names_in
from tfcompose.spec.language import (
    ArgValue,
    BuildInputs,
    find_overlay,
    load_robot_overlay,
    overlay_files,
    robots_with_overlay,
    set_value,
    with_includes,
)
from tfcompose.spec.load import load

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Mapping, Sequence
    from datetime import date

    from tfcompose.compiler.urdf.inertia import Moments
    from tfcompose.compiler.urdf.packages import Packages
    from tfcompose.compiler.urdf.xacro import Expansion, Use
    from tfcompose.foundation.findings import Finding
    from tfcompose.foundation.geometry import Vector
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.load import Source


PRESETS = Path(__file__).parents[1] / "data" / "presets"
#: The entry point group for packages with presets. An entry point names the module whose folder
#: contains the presets.
PRESET_GROUP = "tfcompose.presets"
#: The resource type in the ament index under which a ROS package registers its presets.
PRESET_INDEX = "share/ament_index/resource_index/tfcompose_presets"


def library(read: Callable[[str], str] = read_text) -> Library:
    """Return the presets that need no robot file: tfcompose's own, then the packages' presets."""
    return Library((str(PRESETS),), PresetFolders(read), str(PRESETS))


@dataclass(frozen=True, slots=True)
class PresetFolders:
    """Presets in folders of this machine."""

    #: Returns the text of a file or raises RejectedError.
    open_text: Callable[[str], str] = read_text
    #: Returns whether a path may be accessed.
    allows: Callable[[str], bool] = lambda _: True

    def has(self, path: str) -> bool:
        """Return whether the file exists."""
        return self.allows(path) and is_file(path)

    def is_folder(self, path: str) -> bool:
        """Return whether the folder exists."""
        return self.allows(path) and is_folder(path)

    def read(self, path: str) -> str:
        """Return the text of a file. Raises RejectedError."""
        return self.open_text(path)

    def models(self, folder: str) -> list[str]:
        """Return the names (vendor/model) of the presets in the folder."""
        files = sorted(
            (file.parent.name, file.stem)
            for file in Path(folder).glob("*/*.yaml")
            if self.allows(str(file))
        )
        return [f"{vendor}/{model}" for vendor, model in files if vendor != "nodes"]

    def packages(self) -> list[str]:
        """Return the preset folders of installed Python and ROS packages."""
        return _preset_packages()


@cache
def _preset_packages() -> list[str]:
    """Return the preset folders of Python packages, then of ROS packages, sorted by name."""
    from importlib.metadata import entry_points  # needed only if no other folder has the preset

    folders: list[str] = []
    for entry in sorted(entry_points(group=PRESET_GROUP), key=lambda entry: entry.name):
        try:
            spec = find_spec(entry.value)
        except ImportError:
            continue
        folders += (spec.submodule_search_locations or []) if spec else []
    return [*dict.fromkeys(folders), *_ros_preset_packages()]


def _ros_preset_packages() -> list[str]:
    """Return the folders that ROS packages register in the ament index of the sourced workspaces.

    The file in the index names the folder, relative to the workspace's prefix. An empty file means
    ``share/NAME/presets``. If several workspaces have a package, the first workspace counts, as in
    ROS.
    """
    folders: dict[str, str] = {}
    for prefix in _ament_prefixes():
        for marker in sorted(Path(prefix, PRESET_INDEX).glob("*")):
            with contextlib.suppress(OSError, UnicodeDecodeError):
                named = marker.read_text("utf-8").strip() or f"share/{marker.name}/presets"
                folders.setdefault(marker.name, str(Path(prefix, named)))
    return [folders[name] for name in sorted(folders)]


def _ament_prefixes() -> tuple[str, ...]:
    """Return the prefixes of the sourced workspaces, overlays first."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return tuple(prefix for prefix in prefixes if prefix)


def load_robot(file: str, read: Callable[[str], str] = read_text) -> Source:
    """Return a robot file with its includes. ``read`` returns a file's text.

    Raises:
        RejectedError: if a file cannot be read or is not YAML.
    """
    return with_includes(load(read(file), file), read)


def overlays_of(
    arguments: Namespace, source: Source, read: Callable[[str], str] = read_text
) -> list[Source]:
    """Return the overlays of --robot, --overlay and --set, in that order.

    ``source`` is the robot file, which names the folder with an overlay for each robot. ``read``
    returns a file's text.

    Raises:
        RejectedError: if a file cannot be read or is not YAML, or a setting is malformed.
    """
    files = [with_includes(load(read(file), file), read) for file in arguments.overlays]
    overlays = [*files, *(set_value(setting) for setting in arguments.settings)]
    path = robot_overlay(arguments, source)
    return [load_robot_overlay(path, read), *overlays] if path else overlays


def robot_overlay(arguments: Namespace, source: Source) -> str | None:
    """Return the overlay file for --robot, None without an overlay.

    For a command that starts robots, the default of --robot is this computer's name.

    Raises:
        RejectedError: if the named robot has no overlay, or the folder is missing.
    """
    robot, here = getattr(arguments, "overlay_robot", None), os.uname().nodename
    if robot is None and not getattr(arguments, "by_hostname", False):
        return None
    files = _overlay_files(source)
    if robot is None and here not in robots_with_overlay(files):
        return None
    return find_overlay(source, here if robot is None else robot, files)


def robots_of(source: Source) -> list[str]:
    """Return the robots that have an overlay.

    Raises:
        RejectedError: if the folder of the overlays is missing.
    """
    return robots_with_overlay(_overlay_files(source))


def _overlay_files(source: Source) -> list[str]:
    return overlay_files(source, lambda folder: names_in(folder) if is_folder(folder) else None)


def disk_of(file: str, arguments: Namespace) -> Disk:
    """Return access to this machine's files for a robot file on the command line."""
    return disk(trusts_files=arguments.trust, sources=[file])


def inputs_of(arguments: Namespace, day: date | None = None) -> BuildInputs:
    """Return the robot's inputs from command line and environment.

    ``day`` selects the calibrations that were valid on that day. None selects those that are still
    valid.

    Raises:
        SystemExit: after wrong ROS arguments are reported.
    """
    args = {
        name: ArgValue(value, Span(f"{name}:={value}"))
        for name, value in arguments.arg_values.items()
    }
    return BuildInputs(args, os.environ, ros_arguments(getattr(arguments, "ros_args", ())), day)


def compile_or_exit(file: str, arguments: Namespace, day: date | None = None) -> Robot:
    """Print warnings and return the robot, compiled without errors for the day.

    Raises:
        SystemExit: after the robot's errors are printed.
    """
    return compile_without_errors(file, arguments, day)[0]


def compile_file(
    file: str,
    arguments: Namespace,
    day: date | None = None,
    read: Callable[[str], str] = read_text,
) -> Compiled:
    """Return the compiled robot file. ``read`` returns a file's text.

    Raises:
        RejectedError: if a file cannot be read.
    """
    source = load_robot(file, read)
    return compile_loaded(source, overlays_of(arguments, source, read), arguments, day, read)


def compile_loaded(
    source: Source,
    overlays: Sequence[Source],
    arguments: Namespace,
    day: date | None = None,
    read: Callable[[str], str] = read_text,
) -> Compiled:
    """Return the compiled robot file that is loaded, with these overlays merged over it."""
    return compile_source(
        source,
        library(),
        arguments.profiles,
        overlays,
        read,
        disk_of(source.file, arguments),
        inputs_of(arguments, day),
    )


def compile_without_errors(
    file: str, arguments: Namespace, day: date | None = None
) -> tuple[Robot, Compiled]:
    """Print warnings and return the robot with its compiled files.

    Raises:
        SystemExit: after the robot's errors are printed.
    """
    try:
        compiled = compile_file(file, arguments, day)
    except RejectedError as error:
        reject(error.findings)
    if compiled.robot is None or compiled.errors:
        reject(compiled.findings)
    print_findings(compiled.findings, sys.stderr, most=MOST_OF_ONE_CODE)
    return compiled.robot, compiled


def edges_between(robot: Robot, a: str, b: str) -> tuple[list[Edge], list[Edge]]:
    """Return the edges from ``a`` and from ``b`` up to their common ancestor.

    Raises:
        SystemExit: if a frame is missing, or if the frames are not connected.
    """
    for frame in (a, b):
        if frame not in robot.frames:
            fail(
                f"unknown frame {frame};"
                f" {did_you_mean(frame, robot.frames, f'{robot.file} has other frames')}"
            )
    up, down = _ancestry(robot, a), _ancestry(robot, b)
    shared = {id(edge) for edge in up} & {id(edge) for edge in down}
    rising = [edge for edge in up if id(edge) not in shared]
    falling = [edge for edge in down if id(edge) not in shared]
    if (rising[-1].parent if rising else a) != (falling[-1].parent if falling else b):
        fail(f"{a} and {b} are in separate trees")
    return rising, falling


def _ancestry(robot: Robot, frame: str) -> list[Edge]:
    above = {edge.child: edge for edge in reversed(robot.edges)}  # the first of several parents
    chain = []
    while edge := above.get(frame):
        chain.append(edge)
        frame = edge.parent
    return chain


_POINTER = b"version https://git-lfs.github.com/spec/"


def disk(
    *,
    trusts_files: bool = False,
    sources: Sequence[str] = (),
    folders: Sequence[str] = (),
    is_strict: bool = False,
) -> Disk:
    """Return access to this machine's files and to the packages of the sourced workspaces.

    Xacro files may also read the trees of ``sources`` (see ``Reach.add_tree``), and ``folders``.
    Trusted files may read everything. With ``is_strict``, xacro files are not expanded if the
    kernel cannot confine xacro.
    """
    prefixes = tuple(
        prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix
    )

    def expanded(
        file: str, packages: Packages, arguments: Mapping[str, Any], use: Use | None
    ) -> Expansion:
        reach = Reach(everything=trusts_files)
        for source in sources:
            reach.add_tree(source)
        for folder in folders:
            reach.add_folder(folder)
        if use is None or not use.macro:
            read_text(file)  # rejects a file that cannot be read
        from tfcompose.compiler.urdf.expand import Sandbox, expand  # imports xacro

        sandbox = Sandbox(reach, print_output, report_missing_confinement, is_strict)
        return expand(file, packages, arguments, use, sandbox)

    return Disk(
        read_text,
        is_file,
        is_folder,
        prefixes=prefixes,
        moments=moments,
        expand=expanded,
        is_pointer=_is_pointer,
    )


@cache
def _is_pointer(path: str) -> bool:
    """Return whether the file is a Git LFS pointer (LFS specification v1).

    A checkout without LFS contains such files.
    """
    with contextlib.suppress(OSError), Path(path).open("rb") as file:
        return file.read(len(_POINTER)) == _POINTER
    return False


@cache
def moments(path: str, scale: Vector) -> Moments:
    """Return volume, centre and tensor of a closed mesh at a scale.

    Imports the mesh library only when called.

    Raises:
        UnmeasurableError: as ``tfcompose.urdf.mesh.moments``, and if trimesh is not installed.
    """
    if _is_pointer(path):
        raise UnmeasurableError("TF725", "it is a Git LFS pointer, not the mesh", FETCH)
    try:
        from tfcompose.compiler.urdf import mesh
    except ImportError:
        advice = "pip install 'tfcompose[mesh]', or give inertia: {ixx, iyy, izz}"
        raise UnmeasurableError(
            "TF905", "trimesh, which computes its volume, is not installed", advice
        ) from None
    return mesh.moments(path, scale)


def print_output(file: str, text: str) -> None:
    """Print on stderr what a file printed when it was run.

    Each line begins with the file's name.
    """
    for line in text.splitlines():
        sys.stderr.write(f"{printable(file)}: {plain(line)}\n")


_reported: set[str] = set()
_NOT_HELD = {
    "Landlock": "launch files can read every file that you can read",
    "seccomp": "xacro and launch files can do what you can do",
}


def report_missing_confinement(missing: Sequence[str]) -> None:
    """Print each sandbox feature that the kernel lacks, once."""
    for feature in missing:
        if feature not in _reported:
            _reported.add(feature)
            print_findings([missing_confinement(feature)], sys.stderr)


def missing_confinement(feature: str) -> Finding:
    """Return the finding that the kernel lacks a feature to confine files."""
    message = f"this kernel has no {feature}: {_NOT_HELD[feature]}"
    advice = "see tfcompose help sandbox; read untrusted files on another machine"
    return finding("TF923", message, None, help=advice)
