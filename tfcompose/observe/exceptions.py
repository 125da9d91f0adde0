"""Why there is no pose of one frame in another: the exceptions of tf2, with its names and its hierarchy."""

# ruff: noqa: N818 - the names are tf2's

from __future__ import annotations


class TransformException(Exception):
    """Raised when there is no pose of one frame in another; the message says why."""


class LookupException(TransformException):
    """Raised when a frame is not known, or the frames above one lead back to it."""


class ConnectivityException(TransformException):
    """Raised when two frames are in two trees."""


class ExtrapolationException(TransformException):
    """Raised when an edge between two frames has no sample before, or none after, the time that was asked for."""


class InvalidArgumentException(TransformException):
    """Raised when a frame's name is empty or starts with a slash, or a message cannot be transformed."""


class TimeoutException(TransformException):
    """Raised by nothing here; it is there for programs that catch it."""


class TypeException(Exception):
    """Raised when a message of that type cannot be transformed; as in tf2 it is no TransformException."""


class NotImplementedException(Exception):
    """Raised by a ``BufferInterface`` that does not look up."""

    def __init__(self) -> None:
        super().__init__("this buffer does not look up: what inherits from BufferInterface defines lookup_transform")
