"""A topic of a recording: its type, definition and QoS, as rosbag2 stores them."""

from __future__ import annotations

from typing import NamedTuple

from tfcompose.tf.ros.tf_codec import TF_MESSAGE_HASH

#: The version of metadata.yaml (Jazzy) since which QoS contains names instead of rmw's numbers.
QOS_BY_WORDS = 9


class RecordedTopic(NamedTuple):
    """A topic of a bag."""

    topic: str
    type: str
    #: The language of ``definition``: ros2msg or ros2idl.
    encoding: str = ""
    #: The definition of the type, including the types that it contains; empty if the bag has none.
    definition: str = ""


#: Definition of TFMessage, as ``rosbag2`` stores it, for bags without fixed edges.
TF_DEFINITION = """\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""
TF_HASH = TF_MESSAGE_HASH


def qos_profiles(metadata_version: int) -> list[dict[str, object]]:
    """Return the QoS of /tf_static's publishers as a bag of this version stores it.

    /tf_static is latched: keep last 1, reliable, transient local. Since version 9, the bag stores
    names of these policies, before that rmw's numbers.
    """
    by_words = metadata_version >= QOS_BY_WORDS
    never = {"sec": 9223372036, "nsec": 854775807}
    words: dict[str, object] = {
        "history": "keep_last",
        "depth": 1,
        "reliability": "reliable",
        "durability": "transient_local",
        "deadline": never,
        "lifespan": never,
        "liveliness": "automatic",
        "liveliness_lease_duration": never,
        "avoid_ros_namespace_conventions": False,
    }
    if not by_words:
        words |= {"history": 1, "reliability": 1, "durability": 1, "liveliness": 1}
    return [words]
