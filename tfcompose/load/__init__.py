"""Stage ``load``: YAML text becomes a Source that knows where everything stands.

Calibration files and URDF are read by modules of their own, which are loaded where they are used.
"""

from tfcompose.load.include import set_value, with_includes
from tfcompose.load.overlay import composed, lay_over
from tfcompose.load.places import Path, Place
from tfcompose.load.source import Source, load

__all__ = ["Path", "Place", "Source", "composed", "lay_over", "load", "set_value", "with_includes"]
