"""Reads messages of publishers that flood the tree, in small steps that delay nothing else."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.tf.live.flood import BUSY_S
from tfcompose.tf.ros.tf_codec import encode, transforms

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from tfcompose.tf.live.topics import TFData
    from tfcompose.tf.ros.tf_codec import SentTransform

#: Maximum duration of a read, and maximum wait of the guard while a message remains to be read; in
#: seconds.
SLICE_S, WAIT_S = 0.001, 0.01
_TOGETHER = 50


class FloodReader:
    """Extracts the declared edges from long messages, as separate messages.

    ``children`` are the child frames of declared edges. A message that arrives while another
    message is being read is skipped, and counted in ``skipped``. Reading takes at most a fixed
    part of each second for all flooding publishers together.
    """

    def __init__(self, children: Collection[str]) -> None:
        self.skipped = 0
        self._children = children
        self._data: TFData | None = None
        self._rest: Iterator[SentTransform] = iter(())
        self._transforms: list[SentTransform] = []
        self._spent_s = self._since = 0.0

    @property
    def is_reading(self) -> bool:
        """Whether a message remains to be read and time is left in this second."""
        return self._data is not None and self._spent_s <= BUSY_S

    def add(self, data: TFData) -> None:
        """Accept a message to read, unless another message is being read."""
        if self._data is not None:
            self.skipped += 1
            return
        self._data, self._rest, self._transforms = data, transforms(data.received.data), []

    def read(self, now: float) -> TFData | None:
        """Continue reading for a short time.

        Return the declared edges of a completely read message.
        """
        if now - self._since >= 1.0:
            self._spent_s, self._since = 0.0, now
        if self._data is None or self._spent_s > BUSY_S:
            return None
        begun = time.thread_time()
        data = self._data
        try:
            while (spent := time.thread_time() - begun) < SLICE_S:
                for _ in range(_TOGETHER):
                    transform = next(self._rest)
                    if transform.child.removeprefix("/") in self._children:
                        self._transforms.append(transform)
        except (StopIteration, ValueError):  # the end, or an unreadable rest
            spent = time.thread_time() - begun
            self._data = None
        self._spent_s += spent
        if self._data is not None or not self._transforms:
            return None
        return replace(data, received=replace(data.received, data=encode(self._transforms)))
