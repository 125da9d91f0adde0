"""Event handlers for a robot's events, for ``launch.actions.RegisterEventHandler``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from launch.event_handlers.on_action_event_base import OnActionEventBase

from tfcompose.tools.ros2.actions import TfCompose
from tfcompose.tools.ros2.events import RobotEnded, RobotProcessChanged, RobotTreeComplete

if TYPE_CHECKING:
    from collections.abc import Callable


class OnTreeComplete(OnActionEventBase):  # type: ignore[misc]  # launch has no types
    """Run actions once the tree of a robot is complete, that is, every edge of its plan is live.

    Actions run only the first time, because launch can execute an action only once. A function is
    called each time.
    """

    def __init__(
        self,
        *,
        on_complete: Any,
        target_action: TfCompose | Callable[[TfCompose], bool] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_complete,
            target_event_cls=RobotTreeComplete,
            target_action_cls=TfCompose,
            **{"handle_once": not callable(on_complete)} | options,
        )


class OnRobotProcessChanged(OnActionEventBase):  # type: ignore[misc]  # as above
    """Call a function, or run actions, when the state of a robot's process changes."""

    def __init__(
        self,
        *,
        on_change: Any,
        target_action: TfCompose | Callable[[TfCompose], bool] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_change,
            target_event_cls=RobotProcessChanged,
            target_action_cls=TfCompose,
            **options,
        )


class OnRobotEnded(OnActionEventBase):  # type: ignore[misc]  # as above
    """Call a function, or run actions, when a robot has ended with all its processes."""

    def __init__(
        self,
        *,
        on_end: Any,
        target_action: TfCompose | Callable[[TfCompose], bool] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(
            action_matcher=target_action,
            on_event=on_end,
            target_event_cls=RobotEnded,
            target_action_cls=TfCompose,
            **options,
        )
