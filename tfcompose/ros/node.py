"""A node of tfcompose's own: cheap, without executor, parameters, services or signal handlers of rclpy's."""

from __future__ import annotations

import faulthandler
import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from rclpy.context import Context
from rclpy.exceptions import InvalidParameterTypeException, NameValidationException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import String

from tfcompose.ros.environment import RosError
from tfcompose.ros.stop import Stop

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

T = TypeVar("T", bool, float)

__all__ = ["JOINT_STATES", "LATCHED", "TF_PUBLISHER", "TF_READER", "TF_STATIC_PUBLISHER", "TF_STATIC_READER"]
__all__ += ["Stop", "latch", "open_node", "parameter", "qos"]


#: How long a node's leaving may take, in seconds: on a busy machine long, and less than until SIGTERM follows SIGINT.
LEAVE_S = 3.0


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
DEEP_TF_READER = qos(1000, DurabilityPolicy.VOLATILE, ReliabilityPolicy.RELIABLE)
DEEP_TF_STATIC_READER = qos(1000, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)
#: Matches any publisher of ``joint_states``, as robot_state_publisher's subscription does; that one keeps 5 messages,
#: and loses those of a fast source while it does not run for a moment.
JOINT_STATES = qos(50, DurabilityPolicy.VOLATILE, ReliabilityPolicy.BEST_EFFORT)
#: A value for late joiners, such as ``robot_description``.
LATCHED = qos(1, DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE)


@contextmanager
def open_node(name: str, namespace: str, *, args: Sequence[str] = ()) -> Iterator[Node]:
    """Give a node in a context of its own, and end both with the ``with`` block.

    Leaving takes some milliseconds; a process that ROS does not let go is ended after ``LEAVE_S``.

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
        with ended_unless_done(LEAVE_S):
            node.destroy_node()
            context.shutdown()
            context.destroy()


@contextmanager
def ended_unless_done(seconds: float) -> Iterator[None]:
    """End this process with code 1 if the block takes longer.

    Fast DDS 2.14 can wait for itself when several processes leave at once (one time in a hundred, seen on Jazzy): the
    participant that goes waits, at full load, for a listener that handles a publisher's going, and that listener waits
    for the participant. A thread of Python's could not end it, because ROS keeps the interpreter's lock while it
    leaves; faulthandler's can.
    """
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


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


def middleware() -> str:
    """Return the name of the middleware (rmw) that this process uses."""
    name: str = get_rmw_implementation_identifier()
    return name


def latch(node: Node, topic: str, text: str) -> Any:
    """Publish ``text`` as std_msgs/String for everybody who joins, while the returned publisher lives."""
    publisher = node.create_publisher(String, topic, LATCHED)
    publisher.publish(String(data=text))
    return publisher


def parameter(node: Node, name: str, default: T) -> T:
    """Return the value that ``-p name:=…`` among the node's arguments gives, or the default.

    Raises:
        RosError: if the value has another type than the default.
    """
    try:
        value: T = node.declare_parameter(name, default).value
    except InvalidParameterTypeException as error:
        raise RosError(f"the parameter {name} is not right: {' '.join(str(error).split())}") from None
    return value
