"""A node of tfcompose's own: cheap, without executor, parameters, services or signal handlers of rclpy's."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

from rclpy.context import Context
from rclpy.exceptions import NameValidationException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from tfcompose.ros.environment import RosError
from tfcompose.ros.stop import Stop

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

__all__ = ["JOINT_STATES", "LATCHED", "TF_PUBLISHER", "TF_READER", "TF_STATIC_PUBLISHER", "TF_STATIC_READER"]
__all__ += ["Stop", "latch", "open_node", "qos", "remappings"]


def qos(depth: int, durability: DurabilityPolicy, reliability: ReliabilityPolicy) -> QoSProfile:
    """Return the profile that keeps the last ``depth`` messages."""
    profile: Any = QoSProfile  # rclpy does not say the types of its arguments
    return cast(
        "QoSProfile",
        profile(history=HistoryPolicy.KEEP_LAST, depth=depth, durability=durability, reliability=reliability),
    )


#: tf2_ros ``qos.hpp`` (Jazzy): what every listener and broadcaster of TF expects of the other.
TF_PUBLISHER = TF_READER = qos(100, DurabilityPolicy.VOLATILE, ReliabilityPolicy.RELIABLE)
TF_STATIC_PUBLISHER = qos(1, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)
TF_STATIC_READER = qos(100, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)
#: robot_state_publisher's subscription to ``joint_states``: matches any publisher of them.
JOINT_STATES = qos(5, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)
#: A value for late joiners, such as ``robot_description``.
LATCHED = qos(1, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)


@contextmanager
def open_node(name: str, namespace: str, *, args: Sequence[str] = ()) -> Iterator[Node]:
    """Give a node in a context of its own, and end both with the ``with`` block.

    It offers no parameters, no services and no /rosout, since nothing here would answer them. ``args`` are what
    follows ``--ros-args``, for example ``["-r", "/tf:=tf"]``; the process's own arguments are not looked at.

    Raises:
        RosError: if ROS refuses the name, the arguments or its environment.
    """
    context = Context()
    try:
        context.init(args=["--ros-args", *args] if args else [], initialize_logging=False)
        node = _node(context, name, namespace)
    except (RuntimeError, NameValidationException) as error:
        context.try_shutdown()
        raise RosError(f"ROS cannot start a node: {' '.join(str(error).split())}") from None
    try:
        yield node
    finally:
        node.destroy_node()
        context.shutdown()
        context.destroy()


def _node(context: Context, name: str, namespace: str) -> Any:
    parameter: Any = Parameter  # rclpy does not say the types of its arguments
    return Node(
        name,
        context=context,
        namespace=namespace,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[parameter("start_type_description_service", value=False)],
    )


def remappings(remap: Mapping[str, str]) -> list[str]:
    """Return the arguments for ``open_node`` that move those topics."""
    return [word for old, new in remap.items() for word in ("-r", f"{old}:={new}")]


def latch(node: Node, topic: str, text: str) -> Any:
    """Publish ``text`` as std_msgs/String for everybody who joins, while the returned publisher lives."""
    publisher = node.create_publisher(String, topic, LATCHED)
    publisher.publish(String(data=text))
    return publisher
