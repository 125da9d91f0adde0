"""A context of ROS's launch that also records what launch files start.

This runs in the process that reads launch files (``launch_process``), with ROS's own ``launch``.
"""

from __future__ import annotations

import contextlib
import os
from collections import deque
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import launch

from tfcompose.tools.importers.launch_objects import here
from tfcompose.tools.importers.launch_records import FailedError, LaunchRecording, with_package

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

#: Attributes that ``visit_later`` saves when it is called, and restores for the delayed visit.
_SCOPE = ("params", "conditions", "whens", "period_s", "after", "depth")
#: Maximum depth of launch files that include each other.
_DEEPEST = 30


class RecordingContext(launch.LaunchContext, LaunchRecording):  # type: ignore[misc]
    """A launch context that also records what launch files start."""

    def __init__(self, find: Callable[[str, str], str | None], *, every_branch: bool) -> None:
        launch.LaunchContext.__init__(self, noninteractive=True)
        LaunchRecording.__init__(self, find, every_branch=every_branch)
        #: Parameters that a launch file sets for all nodes: mappings, and names of files.
        self.params: list[Any] = []
        #: The container of the components that are being visited: the id of its action, or the
        #: full name of its node.
        self.container: str | None = None
        #: Visits of actions in event handlers and timers, which follow after all other visits.
        self.later: deque[Callable[[], None]] = deque()
        self._environment = dict(os.environ)
        self._scopes: list[tuple[list[Any], dict[str, str]]] = []

    @property
    def file(self) -> str:
        """The launch file being read."""
        return str(self.get_locals_as_dict().get("current_launch_file_path", ""))

    def here(self) -> tuple[str, int]:
        """Return the file and line being read."""
        place = here()
        return place if place[0] else self.place

    @property
    def variables(self) -> dict[str, str]:
        """The environment variables that launch files have set or changed."""
        return {
            name: with_package(value)
            for name, value in os.environ.items()
            if self._environment.get(name) != value
        }

    def is_inherited(self, name: str) -> bool:
        """Return whether a variable has the value from the environment of the import."""
        return name in os.environ and self._environment.get(name) == os.environ[name]

    @contextlib.contextmanager
    def within(self, path: str) -> Iterator[None]:
        """Set the launch file that is being read, for a ``with`` block.

        Raises:
            FailedError: if launch files include each other too deeply.
        """
        if self.depth >= _DEEPEST:
            raise FailedError("launch files include each other")
        self._push_locals()
        folder = str(Path(path).parent)
        self.extend_locals(
            {"current_launch_file_path": path, "current_launch_file_directory": folder}
        )
        self.depth += 1
        try:
            yield
        finally:
            self.depth -= 1
            self._pop_locals()

    def visit_later(self, visit: Callable[[], None]) -> None:
        """Queue a function that is called after the outermost launch file has been visited.

        launch runs the actions of timers and event handlers later, too. During the call, scope
        and conditions are as they are now. Environment variables are not restored.
        """
        configurations, names = dict(self.launch_configurations), dict(self.get_locals_as_dict())
        now = {name: copy(getattr(self, name)) for name in _SCOPE}

        def visit_in_scope() -> None:
            then = {name: getattr(self, name) for name in _SCOPE}
            self._push_launch_configurations()
            self._push_locals()
            self.launch_configurations.clear()
            self.launch_configurations.update(configurations)
            self.extend_locals(names)
            self.__dict__.update(now)
            try:
                visit()
            finally:
                self._pop_locals()
                self._pop_launch_configurations()
                self.__dict__.update(then)

        self.later.append(visit_in_scope)

    def _push_launch_configurations(self) -> None:
        super()._push_launch_configurations()
        self._scopes.append((list(self.params), dict(self.declared)))

    def _pop_launch_configurations(self) -> None:
        super()._pop_launch_configurations()
        self.params, self.declared = self._scopes.pop()
