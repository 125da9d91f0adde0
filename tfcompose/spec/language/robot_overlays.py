"""Overlays of single robots: ``overlays: {by: hostname, folder: overlays}``."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError, Span, did_you_mean, finding
from tfcompose.spec.language.overlay import with_includes
from tfcompose.spec.language.recognition import load_named
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from tfcompose.foundation.findings import Finding
    from tfcompose.spec.load import Source

#: Ending of the name of an overlay's file. The robot's name precedes it.
ENDING = ".yaml"
#: The other ending of YAML files. A robot would start without an overlay with this ending.
_WRONG_ENDING = ".yml"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def overlay_folder(source: Source) -> str | None:
    """Return the folder of the overlays, None if the robot file names none."""
    if "overlays" not in source.data:
        return None
    folder = source.mapping("overlays").get("folder", "overlays")
    if not isinstance(folder, str) or not folder:
        return None
    return find_path(folder, source.span_of(("overlays", "folder")))


def overlay_files(source: Source, list_folder: Callable[[str], Iterable[str] | None]) -> list[str]:
    """Return the names of the files in the folder of the overlays; empty without overlays.

    ``list_folder`` returns the names in a folder, None for a missing folder.

    Raises:
        RejectedError: if the folder is missing, or a file's ending is ``.yml``.
    """
    folder = overlay_folder(source)
    if folder is None:
        return []
    names = list_folder(folder)
    if names is None:
        message = f"there is no folder {folder} for the overlays of single robots"
        span = source.span_of(("overlays", "folder"))
        raise RejectedError([finding("TF023", message, span, help="make it, or correct folder:")])
    names = list(names)
    misnamed = [name for name in names if name.endswith(_WRONG_ENDING)]
    if misnamed:
        span = source.key_span(("overlays",))
        raise RejectedError([_misnamed(folder, name, span) for name in misnamed])
    return names


def _misnamed(folder: str, name: str, span: Span) -> Finding:
    message = f"{folder}/{name} is not used: the names of overlays end in {ENDING}"
    advice = f"rename it {name.removesuffix(_WRONG_ENDING)}{ENDING}"
    return finding("TF023", message, span, help=advice)


def robots_with_overlay(files: Iterable[str]) -> list[str]:
    """Return the robots that have an overlay in a folder's files, sorted."""
    stems = (file.removesuffix(ENDING) for file in files if file.endswith(ENDING))
    return sorted(stem for stem in stems if _NAME.fullmatch(stem))


def find_overlay(source: Source, robot: str, files: Iterable[str]) -> str:
    """Return the path of a robot's overlay; ``files`` are the names in the folder.

    Raises:
        RejectedError: if the robot file has no overlays, or none for this robot.
    """
    folder = _required_folder(source, robot)
    robots = robots_with_overlay(files)
    if robot not in robots:
        listed = f"there is {', '.join(robots)}" if robots else f"{folder} has no overlays"
        message = f"{folder} has no overlay of the robot {robot}"
        span = source.key_span(("overlays",))
        advice = did_you_mean(robot, robots, listed)
        raise RejectedError([finding("TF023", message, span, help=advice)])
    return f"{folder}/{robot}{ENDING}"


def overlay_path(source: Source, robot: str) -> str:
    """Return the path of a robot's overlay, whether it exists or not.

    Raises:
        RejectedError: if the robot file has no overlays, or the name cannot be one of a robot.
    """
    folder = _required_folder(source, robot)
    if not _NAME.fullmatch(robot):
        message = f"{robot!r} cannot be the name of a robot's overlay"
        advice = "use letters, digits, dots, hyphens and underscores"
        span = source.key_span(("overlays",))
        raise RejectedError([finding("TF023", message, span, help=advice)])
    return f"{folder}/{robot}{ENDING}"


def _required_folder(source: Source, robot: str) -> str:
    folder = overlay_folder(source)
    if folder is None:
        message = f"{source.file} has no overlays of single robots, such as {robot}"
        advice = "overlays: {by: hostname, folder: overlays}"
        span = source.key_span(("overlays",)) if "overlays" in source.data else Span(source.file)
        raise RejectedError([finding("TF023", message, span, help=advice)])
    return folder


def load_robot_overlay(path: str, read: Callable[[str], str]) -> Source:
    """Return a robot's overlay with its includes.

    Raises:
        RejectedError: if it cannot be read or is not YAML.
    """
    return with_includes(load_named(read(path), path), read)
