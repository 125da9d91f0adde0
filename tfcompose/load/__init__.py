"""Stage ``load``: YAML text becomes a Source that knows where everything stands.

Calibration files and URDF are read by modules of their own, which are loaded where they are used.
"""

from tfcompose.load.include import set_value, with_includes
from tfcompose.load.overlay import composed
from tfcompose.load.source import Path, Source, load

__all__ = ["Path", "Source", "composed", "load", "set_value", "with_includes"]
