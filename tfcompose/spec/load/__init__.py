"""Reads text into plain data: a ``Source`` has the data, and the span of each key and value.

YAML robot files, calibration files and parameter files of ROS; text comes from the caller. Must
not import ``language``, ``model``, ``plan``, ``pydantic``: it knows no key of the language.
"""

from tfcompose.spec.load.nodes import DEEPEST, Path, Place
from tfcompose.spec.load.source import (
    MOST_VALUES,
    Source,
    Spans,
    allows_in_xml,
    load,
    path_named,
    refuse_unreadable,
)

__all__ = [
    "DEEPEST",
    "MOST_VALUES",
    "Path",
    "Place",
    "Source",
    "Spans",
    "allows_in_xml",
    "load",
    "path_named",
    "refuse_unreadable",
]
