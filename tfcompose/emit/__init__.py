"""Stage ``emit``: a Robot becomes files, as text."""

from tfcompose.emit.emit import emit

__all__ = ["emit"]
