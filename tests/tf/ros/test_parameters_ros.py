"""Parameters of another node: asked for by hand, each answer taken once."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from tests.support.waiting import TIMEOUT_S, until
from tfcompose.tf.ros.parameters import ANSWER_S, ParameterReader

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.ros

VALUES: dict[str, Any] = {
    "publish_tf": False,
    "depth": 7,
    "rate": 0.5,
    "frame": "odom",
    "list": [1, 2],
}
EXPECTED: dict[str, Any] = VALUES | {"list": None}


@contextmanager
def driver() -> Iterator[SingleThreadedExecutor]:
    """Give a stock node with parameters, which answers while its executor is spun."""
    context = Context()
    context.init()
    node: Any = Node("camera", context=context, namespace="/rover")
    for name, value in VALUES.items():
        node.declare_parameter(name, value)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield executor
    finally:
        executor.shutdown(TIMEOUT_S)
        node.destroy_node()
        context.shutdown()


def test_the_answer_is_that_to_the_last_question(node: Any) -> None:
    with driver() as executor:
        reader = ParameterReader(node, "/rover/camera", tuple(EXPECTED))
        assert until(lambda: reader.is_there)
        assert reader.take() is None, "nothing was asked"
        reader.ask(0.0)
        executor.spin_once(TIMEOUT_S)
        [camera] = executor.get_nodes()
        parameter: Any = Parameter
        camera.set_parameters([parameter("depth", value=8)])
        reader.ask(ANSWER_S + 1.0)  # the first answer is not taken in time
        answers: list[dict[str, Any]] = []

        def is_answered() -> bool:
            executor.spin_once(0.01)
            answers.extend(answer for answer in [reader.take()] if answer is not None)
            return bool(answers)

        assert until(is_answered)
        assert answers == [EXPECTED | {"depth": 8}]
        assert reader.take() is None, "it was taken"
        reader.close()
