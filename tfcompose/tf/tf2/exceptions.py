"""tf2's exceptions and rejections of transforms, and their messages.

The exceptions have tf2's names and hierarchy. Their messages begin like tf2's, because programs
search for those words. Then they name the missing edge, or tell by how many milliseconds a time is
too early or too late. The source of the wording is geometry2's buffer_core.cpp and cache.cpp
(Jazzy).
"""

# ruff: noqa: N818 - the names are tf2's

from __future__ import annotations

from difflib import get_close_matches
from enum import Enum
from math import isfinite
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from tfcompose.tf.tf2.poses import PoseTuple

#: A quaternion is rejected if its squared length differs from 1 by more than this.
DENORMALISED = 0.01


class TransformException(Exception):
    """There is no pose of a frame in another frame.

    Args:
        text: tf2's message.
        detail: further explanation, which tfcompose's commands print without the message.
    """

    def __init__(self, text: str = "", detail: object = None) -> None:
        super().__init__(text)
        self.detail = text if detail is None else detail

    def __str__(self) -> str:
        text = super().__str__()
        if self.detail is text:
            return text
        return f"{text}: {self.detail}"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({str(self)!r})"


class LookupException(TransformException):
    """A frame is unknown, or the frames above a frame form a loop."""


class ConnectivityException(TransformException):
    """Two frames are in two trees."""


class ExtrapolationException(TransformException):
    """An edge has no sample before, or after, the requested time."""


class InvalidArgumentException(TransformException):
    """A frame name is empty or has a leading slash, or a message cannot be transformed."""


class TimeoutException(TransformException):
    """``BufferClient`` got no answer in time. ``Buffer`` never raises it."""


class TypeException(Exception):
    """A message of this type cannot be transformed.

    As in tf2, it is not a TransformException.
    """


class NotImplementedException(Exception):
    """A ``BufferInterface`` does not implement lookups."""

    def __init__(self) -> None:
        super().__init__(
            "this buffer does not look up: a subclass of BufferInterface defines lookup_transform"
        )


class Rejection(Enum):
    """The reason why a transform was rejected. The values are the texts of tf2's log."""

    SELF = "TF_SELF_TRANSFORM"
    NO_CHILD = "TF_NO_CHILD_FRAME_ID"
    NO_PARENT = "TF_NO_FRAME_ID"
    NOT_FINITE = "TF_NAN_INPUT"
    DENORMALISED = "TF_DENORMALIZED_QUATERNION"
    OLD = "TF_OLD_DATA"

    @property
    def text(self) -> str:
        """The reason as plain text."""
        return _REJECTIONS[self]


_REJECTIONS = {
    Rejection.SELF: "it is its own parent",
    Rejection.NO_CHILD: "its child_frame_id is empty",
    Rejection.NO_PARENT: "its frame_id is empty",
    Rejection.NOT_FINITE: "a value is not a finite number",
    Rejection.DENORMALISED: "its quaternion is not of length 1",
    Rejection.OLD: "it is older than all that is kept of its frame",
}


def rejection_of(parent: str, child: str, pose: PoseTuple) -> Rejection | None:
    """Return the first reason why tf2 rejects a transform, regardless of earlier transforms.

    The order of reasons is tf2's.
    """
    if parent == child:
        return Rejection.SELF
    if not child:
        return Rejection.NO_CHILD
    if not parent:
        return Rejection.NO_PARENT
    if not all(map(isfinite, pose)):
        return Rejection.NOT_FINITE
    x, y, z, w = pose[3:]
    return (
        None if abs(x * x + y * y + z * z + w * w - 1) < DENORMALISED else Rejection.DENORMALISED
    )


# Messages of the exceptions.


class UnknownFrame:
    """Message for an unknown frame, with the nearest known name.

    It is computed only when it is read. With thousands of names, that takes longer than all
    lookups of a second, and a program that waits for a frame gets the exception with every
    message.
    """

    __slots__ = ("_frame", "_known")

    def __init__(self, frame: str, frames: Collection[str]) -> None:
        self._frame = frame
        self._known = tuple(frames)

    def __str__(self) -> str:
        lowered = {name.lower(): name for name in sorted(self._known, reverse=True)}
        near = get_close_matches(self._frame.lower(), lowered, n=1)
        if near:
            return f"no frame {self._frame}; did you mean {lowered[near[0]]}?"
        return f"no frame {self._frame} among {len(self._known)} frames"

    def __repr__(self) -> str:
        return repr(str(self))


def unknown_frame(frame: str, argument: str, frames: Collection[str]) -> LookupException:
    """Return the exception for a frame that has never appeared."""
    return LookupException(
        f'"{frame}" passed to lookupTransform argument {argument} does not exist',
        UnknownFrame(frame, frames),
    )


def unusable_name(frame: str, argument: str) -> InvalidArgumentException:
    """Return the exception for a name that tf2 rejects in lookups."""
    text = f'Invalid argument "{frame}" passed to lookupTransform argument {argument}'
    if not frame:
        return InvalidArgumentException(f"{text} - in tf2 frame_ids cannot be empty")
    return InvalidArgumentException(
        f"{text} - in tf2 frame_ids cannot start with a '/'", f"it is known as {frame[1:]}"
    )


def connectivity_error(
    frames: Collection[str], target: str, source: str, tops: Sequence[str]
) -> ConnectivityException:
    """Return the exception for two frames whose ancestors end at different ``tops``."""
    return ConnectivityException(
        f"Could not find a connection between '{target}' and '{source}' because they are not part"
        " of the same tree",
        two_trees(frames, target, source, *tops),
    )


def two_trees(frames: Collection[str], a: str, b: str, top_a: str, top_b: str) -> str:
    """Return a sentence with the trees of the two frames."""
    cleared = [top for top in (top_a, top_b) if top in frames]
    if cleared:
        return (
            f"{a} and {b} are not connected: {cleared[0]} has had no parent since the buffer was"
            " cleared"
        )
    return (
        f"{a} and {b} are in two trees: one begins at {top_a}, the other at {top_b}; no edge joins"
        f" them, such as {top_a} → {top_b}"
    )


def loop(frame: str, children: Sequence[str]) -> LookupException:
    """Return the exception for the loop that begins and ends at ``frame``.

    ``children`` are the frames along its parents.
    """
    around = children[children.index(frame) :]
    return LookupException(
        "The tf tree is invalid because it contains a loop",
        f"the live tree has a loop: {' → '.join([frame, *reversed(around)])}",
    )


def tf2_time(stamp_ns: int) -> str:
    """Return a time in seconds as tf2 prints it."""
    return f"{stamp_ns / 1e9:.6f}"


def seconds(stamp_ns: int) -> str:
    """Return a time in seconds with all nine decimals."""
    sign = "-" if stamp_ns < 0 else ""
    seconds, rest = divmod(abs(stamp_ns), 1_000_000_000)
    return f"{sign}{seconds}.{rest:09d} s"


def milliseconds(nanoseconds: int) -> str:
    """Return a duration in milliseconds."""
    return f"{nanoseconds / 1e6:.6g} ms" if nanoseconds < 10**9 else f"{nanoseconds / 1e6:.0f} ms"
