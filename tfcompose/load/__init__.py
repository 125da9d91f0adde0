"""Stage ``load``: YAML text becomes a Source that knows where everything stands.

Calibration files and URDF are read by modules of their own, which are loaded where they are used.
"""

from tfcompose.load.include import set_value, with_includes
from tfcompose.load.overlay import composed
from tfcompose.load.places import Path
from tfcompose.load.source import Source, load

__all__ = ["Path", "Source", "composed", "load", "set_value", "with_includes"]
