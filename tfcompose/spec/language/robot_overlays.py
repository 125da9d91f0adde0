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

    from tfcompose.spec.load import Source

#: What ends the name of an overlay's file; before it is the robot's name.
ENDING = ".yaml"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def overlay_folder(source: Source) -> str | None:
    """Return the folder of the overlays; None if the robot file names none."""
    if "overlays" not in source.data:
        return None
    folder = source.mapping("overlays").get("folder", "overlays")
    if not isinstance(folder, str) or not folder:
        return None
    return find_path(folder, source.span_of(("overlays", "folder")))


def overlay_files(source: Source, list_folder: Callable[[str], Iterable[str] | None]) -> list[str]:
    """Return the names of the files in the folder of the overlays; none if there are no overlays.

    ``list_folder`` returns the names in a folder, None if there is no such folder.

    Raises:
        RejectedError: if the folder is missing.
    """
    folder = overlay_folder(source)
    if folder is None:
        return []
    names = list_folder(folder)
    if names is None:
        message = f"there is no folder {folder} for the overlays of single robots"
        span = source.span_of(("overlays", "folder"))
        raise RejectedError([finding("TF023", message, span, help="make it, or correct folder:")])
    return list(names)


def robots_with_overlay(files: Iterable[str]) -> list[str]:
    """Return the robots whose overlays are among a folder's files, sorted."""
    stems = (file.removesuffix(ENDING) for file in files if file.endswith(ENDING))
    return sorted(stem for stem in stems if _NAME.fullmatch(stem))


def find_overlay(source: Source, robot: str, files: Iterable[str]) -> str:
    """Return the path of a robot's overlay; ``files`` are the names in the folder.

    Raises:
        RejectedError: if the robot file has no overlays, or none for this robot.
    """
    folder = overlay_folder(source)
    if folder is None:
        message = f"{source.file} has no overlays of single robots, such as {robot}"
        advice = "overlays: {by: hostname, folder: overlays}"
        span = source.key_span(("overlays",)) if "overlays" in source.data else Span(source.file)
        raise RejectedError([finding("TF023", message, span, help=advice)])
    robots = robots_with_overlay(files)
    if robot not in robots:
        listed = f"there is {', '.join(robots)}" if robots else f"{folder} has no overlays"
        message = f"{folder} has no overlay of the robot {robot}"
        span = source.key_span(("overlays",))
        advice = did_you_mean(robot, robots, listed)
        raise RejectedError([finding("TF023", message, span, help=advice)])
    return f"{folder}/{robot}{ENDING}"


def load_robot_overlay(path: str, read: Callable[[str], str]) -> Source:
    """Return a robot's overlay, with its includes.

    Raises:
        RejectedError: if it cannot be read, is not YAML, or chooses overlays itself.
    """
    source = with_includes(load_named(read(path), path), read)
    if "overlays" in source.data:
        message = "an overlay of a robot cannot choose overlays"
        span = source.key_span(("overlays",))
        raise RejectedError([finding("TF023", message, span, help="write it in the robot file")])
    return source
