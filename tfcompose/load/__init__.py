"""Stage ``load``: YAML text becomes a Source that knows where everything stands.

Calibration files are read by a module of their own, which is loaded where it is used.
"""

from tfcompose.load.comments import allows_in_xml
from tfcompose.load.include import path_named, set_value, with_includes
from tfcompose.load.overlay import composed, lay_over
from tfcompose.load.places import Path, Place
from tfcompose.load.source import MOST_VALUES, Source, load, refuse_unreadable

__all__ = [
    "MOST_VALUES",
    "Path",
    "Place",
    "Source",
    "allows_in_xml",
    "composed",
    "lay_over",
    "load",
    "path_named",
    "refuse_unreadable",
    "set_value",
    "with_includes",
]
