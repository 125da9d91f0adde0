"""Launch events about a robot that launch started.

tfcompose's launcher reports these events. The ``action`` of an event is the ``TfCompose`` action
that started the robot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from launch.event import Event

if TYPE_CHECKING:
    from launch import Action


class RobotEvent(Event):  # type: ignore[misc]  # launch has no types
    """An event of the robot that ``action`` started."""

    name = "tfcompose.tools.ros2.events.RobotEvent"

    def __init__(self, action: Action) -> None:
        self.action = action


class RobotTreeComplete(RobotEvent):
    """Every edge of the plan is live.

    ``edges`` is the number of edges. ``seconds`` is the time since the robot's start.
    """

    name = "tfcompose.tools.ros2.events.RobotTreeComplete"

    def __init__(self, action: Action, edges: int, seconds: float) -> None:
        super().__init__(action)
        self.edges = edges
        self.seconds = seconds


class RobotProcessChanged(RobotEvent):
    """The state of a process of the robot has changed.

    ``state`` is a ``tfcompose.model.messages.StateName``. ``detail`` is the reason, such as an
    exit code. ``pid`` is None if the process does not run.
    """

    name = "tfcompose.tools.ros2.events.RobotProcessChanged"

    def __init__(
        self, action: Action, process: str, state: str, pid: int | None, detail: str
    ) -> None:
        super().__init__(action)
        self.process = process
        self.state = state
        self.pid = pid
        self.detail = detail


class RobotEnded(RobotEvent):
    """The robot has ended, with all its processes.

    ``exit_code`` is the exit code of ``tfcompose up``. ``because`` contains the message and the
    notes of the first failure.
    """

    name = "tfcompose.tools.ros2.events.RobotEnded"

    def __init__(self, action: Action, exit_code: int, because: tuple[str, ...]) -> None:
        super().__init__(action)
        self.exit_code = exit_code
        self.because = because


class RobotFailed(RobotEvent):
    """The robot has failed, and launch ends."""

    name = "tfcompose.tools.ros2.events.RobotFailed"
