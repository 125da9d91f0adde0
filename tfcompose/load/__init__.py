"""Stage ``load``: YAML text becomes a Source that knows where everything stands."""

from tfcompose.load.include import set_value, with_includes
from tfcompose.load.overlay import composed
from tfcompose.load.source import Path, Source, load

__all__ = ["Path", "Source", "composed", "load", "set_value", "with_includes"]
