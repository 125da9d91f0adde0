"""Stage ``emit``: a Robot becomes files, as text."""

from tfcompose.emit.emit import described, emit

__all__ = ["described", "emit"]
