"""Stage ``emit``: a Robot becomes files, as text."""

from tfcompose.emit.emit import File, emit

__all__ = ["File", "emit"]
