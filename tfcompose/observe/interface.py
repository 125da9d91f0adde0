"""What tf2_ros calls ``BufferInterface``: whoever can look a transform up can move objects with it."""

from __future__ import annotations

from typing import Any

from tfcompose.observe.exceptions import NotImplementedException
from tfcompose.observe.registration import TransformRegistration, convert


class BufferInterface:
    """Moves objects that have a header; whoever inherits from it looks up.

    ``registration`` says what is done with which type. From the start these messages are known: PointStamped,
    Vector3Stamped, PoseStamped, PoseWithCovarianceStamped, PolygonStamped and PointCloud2, which needs numpy.
    """

    def __init__(self) -> None:
        self.registration = TransformRegistration()

    def transform(self, object_stamped: Any, target_frame: str, timeout: Any = 0, new_type: type | None = None) -> Any:
        """Return an object of the same type in another frame, at the time of its own stamp; or as a ``new_type``.

        Raises:
            TypeException: if its type is not known, or nothing turns it into the new one.
        """
        move = self.registration.get(type(object_stamped))
        header = object_stamped.header
        moved = move(object_stamped, self.lookup_transform(target_frame, header.frame_id, header.stamp, timeout))
        return moved if new_type is None else convert(moved, new_type)

    def transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, object_stamped: Any, target_frame: str, target_time: Any, fixed_frame: str, timeout: Any = 0,
        new_type: type | None = None,
    ) -> Any:  # fmt: skip
        """Return an object in another frame at another time, between which ``fixed_frame`` stands still.

        Raises:
            TypeException: as ``transform`` does.
        """
        move = self.registration.get(type(object_stamped))
        header = object_stamped.header
        found = self.lookup_transform_full(
            target_frame, target_time, header.frame_id, header.stamp, fixed_frame, timeout
        )
        moved = move(object_stamped, found)
        return moved if new_type is None else convert(moved, new_type)

    def lookup_transform(self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0) -> Any:  # noqa: ARG002
        """Return the pose of the source frame in the target frame: for who inherits to say."""
        raise NotImplementedException

    def lookup_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str,  # noqa: ARG002
        timeout: Any = 0,  # noqa: ARG002
    ) -> Any:  # fmt: skip
        """Return the pose of the source frame at one time in the target frame at another: for who inherits to say."""
        raise NotImplementedException

    def can_transform(self, target_frame: str, source_frame: str, time: Any, timeout: Any = 0) -> Any:  # noqa: ARG002
        """Return whether ``lookup_transform`` would answer: for who inherits to say."""
        raise NotImplementedException

    def can_transform_full(  # noqa: PLR0913, PLR0917 (tf2's arguments)
        self, target_frame: str, target_time: Any, source_frame: str, source_time: Any, fixed_frame: str,  # noqa: ARG002
        timeout: Any = 0,  # noqa: ARG002
    ) -> Any:  # fmt: skip
        """Return whether ``lookup_transform_full`` would answer: for who inherits to say."""
        raise NotImplementedException
