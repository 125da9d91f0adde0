"""A publisher of TF of another vendor's DDS, and no ROS node.

``python -m tests.support.foreign_dds X EDGE…``.

It sends the edges, each ``parent child``, at 20 Hz, with X as x. TOPIC and PARTITION are taken
from the environment.
"""

import os
import signal
import sys
import time
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.topic import Topic
from cyclonedds.util import duration

#: Discovery as ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST has it: by unicast, on this machine alone.
LOCALHOST = """
<CycloneDDS><Domain id="any">
  <General>
    <Interfaces><NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
    <Peers><Peer address="127.0.0.1"/></Peers>
    <LeaseDuration>1 s</LeaseDuration>
  </Discovery>
</Domain></CycloneDDS>
"""


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]  # type: ignore[type-arg]


def main(x: float, *edges: str) -> None:
    over: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: over.append(number))
    number = int(os.environ["ROS_DOMAIN_ID"])
    domain = Domain(number, LOCALHOST)
    participant = DomainParticipant(number)
    qos = Qos(
        Policy.Reliability.Reliable(duration(seconds=1)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(100),
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
    topic = Topic(participant, f"rt{os.environ.get('TOPIC', '/tf')}", TFMessage, qos=qos)
    partition = os.environ.get("PARTITION", "")
    publisher = Publisher(participant, Qos(Policy.Partition([partition])) if partition else None)
    writer = DataWriter(publisher, topic, qos=qos)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while not over:
        stamp = Time(*divmod(time.time_ns(), 1_000_000_000))
        pose = Transform(Vector3(x, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        pairs = [edge.split() for edge in edges]
        transforms: Any = [
            TransformStamped(Header(stamp, parent), child, pose) for parent, child in pairs
        ]
        writer.write(TFMessage(transforms))
        time.sleep(0.05)
    del writer, publisher, topic, participant, domain  # it takes its leave


if __name__ == "__main__":
    main(float(sys.argv[1]), *sys.argv[2:])
