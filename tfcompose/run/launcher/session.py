"""What a run has on this machine besides its processes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from socket import socket

    from tfcompose.run.launcher.outlet import Outlet


@dataclass(slots=True)
class Session:
    """The plan's file, the run's id, the control socket, and an output that does not wait.

    ``base`` is the folder that the plan was built in, where ``plan_file`` is a copy. With an id, what the run's
    processes leave behind is ended with it, also what left their groups. ``refresh`` is called now and then.
    """

    plan_file: Path
    run_id: str = ""
    base: Path | None = None
    listener: socket | None = None
    outlet: Outlet | None = None
    refresh: Callable[[], None] | None = None
