"""Writing of bags: a folder as rosbag2 writes it, or a single .mcap file, with rosbags."""

from __future__ import annotations

import tempfile
from errno import EEXIST
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from tfcompose.foundation.reading import exists

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

#: The ending of a bag that is a single file.
FILE = ".mcap"
#: Jazzy's, as ros2 bag record writes it.
_METADATA_VERSION: Literal[9] = 9


class BagWriter:
    """Writes messages to a new bag, within its ``with`` block.

    The bag is at its path once the block has ended without an exception; until then it is next to
    it, in a hidden folder.

    Args:
        path: ends in .mcap for a single file; else it becomes a folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        #: The number of messages by topic.
        self.counts: dict[str, int] = {}
        self._connections: dict[str, Any] = {}

    def __enter__(self) -> Self:
        """Create the bag.

        Raises:
            OSError: if the folder cannot be written to.
        """
        self._scratch = tempfile.TemporaryDirectory(
            dir=self.path.parent, prefix=f".{self.path.name}."
        )
        try:
            self._writer = Writer(
                Path(self._scratch.name, self.path.stem),
                version=_METADATA_VERSION,
                storage_plugin=StoragePlugin.MCAP,
            )
            self._writer.open()
        except BaseException:
            self._scratch.cleanup()
            raise
        self._types = get_typestore(Stores.ROS2_JAZZY)
        return self

    def write(
        self, topic: str, type_: str, data: bytes, received_ns: int, *, latched: bool = False
    ) -> None:
        """Write a message, as bytes in CDR.

        Args:
            topic: its topic.
            type_: its type, one of ROS's own: ``sensor_msgs/msg/JointState``.
            data: the message.
            received_ns: its arrival, in nanoseconds of the system clock.
            latched: whether its publisher keeps the last message for late subscribers.
        """
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, type_, typestore=self._types, offered_qos_profiles=[_qos(latched=latched)]
            )
        self._writer.write(self._connections[topic], received_ns, data)
        self.counts[topic] = self.counts.get(topic, 0) + 1

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Complete the bag and move it to its place; after an exception, remove it."""
        with self._scratch:
            self._writer.__exit__(error_type, error, traceback)
            if error_type is None:
                self._move()

    def _move(self) -> None:
        """Move the complete bag to its place.

        Raises:
            FileExistsError: if another program has put something there.
        """
        if exists(self.path):
            raise FileExistsError(EEXIST, "exists", str(self.path))
        bag = self._writer.path
        (file,) = bag.glob(f"*{FILE}")
        (file if self.path.suffix == FILE else bag).rename(self.path)


def _qos(*, latched: bool) -> Qos:
    never = QosTime(9223372036, 854775807)
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1 if latched else 100,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        deadline=never,
        lifespan=never,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=never,
        avoid_ros_namespace_conventions=False,
    )
