"""Stage ``load``: YAML text becomes a Source that knows where everything stands."""

from tfcompose.load.calibration import Form, load_calibration
from tfcompose.load.include import set_value, with_includes
from tfcompose.load.overlay import composed
from tfcompose.load.source import Path, Source, load
from tfcompose.load.urdf import Element, load_xml

__all__ = [
    "Element",
    "Form",
    "Path",
    "Source",
    "composed",
    "load",
    "load_calibration",
    "load_xml",
    "set_value",
    "with_includes",
]
