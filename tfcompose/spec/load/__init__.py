"""Reads text into plain data. A ``Source`` has the data and the span of each key and value.

It reads YAML robot files, calibration files and parameter files of ROS. Callers pass in the text.
Must not import ``language``, ``model``, ``plan``, ``pydantic``: it knows no key of the language.
"""

from tfcompose.spec.load.nodes import DEEPEST, Location, Path
from tfcompose.spec.load.source import (
    MOST_VALUES,
    Source,
    Spans,
    allows_in_xml,
    find_path,
    load,
    refuse_unreadable,
)

__all__ = [
    "DEEPEST",
    "MOST_VALUES",
    "Location",
    "Path",
    "Source",
    "Spans",
    "allows_in_xml",
    "find_path",
    "load",
    "refuse_unreadable",
]
