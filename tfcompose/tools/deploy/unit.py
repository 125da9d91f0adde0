"""Text of the systemd unit of a robot on a host."""

from __future__ import annotations

from dataclasses import dataclass

from tfcompose.launcher.program import anywhere
from tfcompose.model.systemd import quote, source_then_run

#: The time in seconds in which all processes on a host must end. The launcher ends them one after
#: another.
STOP_S = 90


@dataclass(frozen=True, slots=True)
class Unit:
    """The systemd unit for the part of a robot on a host.

    All paths are absolute paths on the host.
    """

    #: The name of the robot's part on the host: ROBOT.HOST.
    name: str
    robot: str
    host: str
    #: The folder of the robot's releases.
    base: str
    #: The host's Python. Not used if ``has_wheels``.
    python: str
    #: Setup files to source, in order.
    setup: tuple[str, ...] = ()
    #: Whether the unit belongs to the system's systemd instead of the user's.
    system: bool = False
    #: Whether the release has its own Python environment.
    has_wheels: bool = False

    @property
    def file(self) -> str:
        """The file name of the unit."""
        return f"tfcompose-{self.name}.service"

    def text(self) -> str:
        """Return the text of the unit, which starts the current release."""
        run = f"tfcompose/{self.name}"
        parts = {
            "Unit": [
                f"Description=Robot {self.robot} on {self.host}",
                *(
                    ["Wants=network-online.target", "After=network-online.target"]
                    if self.system
                    else []
                ),
                "StartLimitIntervalSec=0",
            ],
            "Service": [
                "Type=exec",
                *([f"RuntimeDirectory={run}", "RuntimeDirectoryMode=0700"] if self.system else []),
                *([f"Environment=XDG_RUNTIME_DIR=/run/{run}"] if self.system else []),
                *([f"Environment={quote(f'ROS_LOG_DIR={self.base}/log')}"] if self.system else []),
                f"ExecStart={self._command()}",
                "Restart=on-failure",
                "RestartSec=2",
                "KillMode=mixed",
                f"TimeoutStopSec={STOP_S}",
                "SuccessExitStatus=130 143",
            ],
            "Install": [f"WantedBy={'multi-user' if self.system else 'default'}.target"],
        }
        return "\n".join("\n".join([f"[{name}]", *lines, ""]) for name, lines in parts.items())

    def _command(self) -> str:
        current = f"{self.base}/current"
        python = f"{current}/venv/bin/python" if self.has_wheels else self.python
        argv = [
            *anywhere(python),
            "up",
            f"{current}/plan.json",
            "--host",
            self.host,
            "--no-live",
        ]
        return " ".join(
            quote(argument).replace("$", "$$") for argument in source_then_run(self.setup, argv)
        )
