"""Stage ``load``: YAML text becomes a Source that knows where everything stands."""

from tfcompose.load.overlay import with_profiles
from tfcompose.load.source import Path, Source, load

__all__ = ["Path", "Source", "load", "with_profiles"]
