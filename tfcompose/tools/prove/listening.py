"""Recording of sensor messages of the running robot."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING

from tfcompose.tf.ros.graph import topics
from tfcompose.tf.ros.node import open_node, wait
from tfcompose.tf.ros.sensor_data import HeaderSubscription
from tfcompose.tools.prove.messages import IMAGES, TYPES
from tfcompose.tools.prove.recording import Measurements

if TYPE_CHECKING:
    from tfcompose.foundation.signals import Stop

#: The interval at which the ROS graph is searched for new topics, in seconds.
_ASK_EVERY_S = 0.5
_WAIT_S = 0.1
#: The depth of the queue of each topic, in messages.
_DEPTH = 100


def listen(duration_s: float, stop: Stop) -> Measurements:
    """Return the sensor messages of the running robot within a time, or until a signal.

    This function does not read images, because their CameraInfo has the same header.

    Raises:
        RosError: if ROS cannot start a node or receive messages.
    """
    measurements, types = Measurements(), set(TYPES) - set(IMAGES[1:])
    readers: dict[str, HeaderSubscription] = {}
    with open_node("tfcompose_prove", "") as node:
        end, due = time.monotonic() + duration_s, 0.0
        while not stop.requested and (now := time.monotonic()) < end:
            if now >= due:
                due = now + _ASK_EVERY_S
                for name, names in topics(node):
                    if name not in readers and len(names) == 1 and names[0] in types:
                        with suppress(ImportError, AttributeError):
                            readers[name] = HeaderSubscription(node, name, names[0], _DEPTH)
            wait(node, list(readers.values()), min(_WAIT_S, end - now), stop)
            for reader in readers.values():
                for received in reader.take():
                    measurements.take(reader.topic, reader.type, received.data)
    return measurements
