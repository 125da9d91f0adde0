"""The systemd unit of a robot on a host."""

from __future__ import annotations

from dataclasses import dataclass

from tfcompose.launcher.program import anywhere
from tfcompose.model.systemd import quote, source_then_run

#: How long everything on a host has to end: the launcher ends processes one after the other.
STOP_S = 90


@dataclass(frozen=True, slots=True)
class Unit:
    """The systemd unit of a robot's share on a host. All paths are absolute, on the host."""

    #: ROBOT.HOST.
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
        """The unit's file name."""
        return f"tfcompose-{self.name}.service"

    def text(self) -> str:
        """Return the unit, which starts the current release."""
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
        at = f"{self.base}/current"
        python = f"{at}/venv/bin/python" if self.has_wheels else self.python
        argv = [
            *anywhere(python),
            "up",
            f"{at}/plan.json",
            "--host",
            self.host,
            "--no-live",
        ]
        return " ".join(
            quote(argument).replace("$", "$$") for argument in source_then_run(self.setup, argv)
        )
