"""Stage ``load``: text becomes plain data with the place of every key and value.

Calibration files are read by a module of their own, which is loaded where it is used.
"""

from tfcompose.load.nodes import DEEPEST, Path, Place
from tfcompose.load.source import MOST_VALUES, Source, allows_in_xml, load, path_named, refuse_unreadable

__all__ = [
    "DEEPEST",
    "MOST_VALUES",
    "Path",
    "Place",
    "Source",
    "allows_in_xml",
    "load",
    "path_named",
    "refuse_unreadable",
]
