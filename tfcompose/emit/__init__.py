"""Stage ``emit``: a Robot becomes files, as text."""

from tfcompose.emit.emit import File, emit
from tfcompose.emit.target import Form, Target, unaddressed

__all__ = ["File", "Form", "Target", "emit", "unaddressed"]
