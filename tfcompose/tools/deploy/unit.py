"""The unit that systemd runs for a robot on a host."""

from __future__ import annotations

from dataclasses import dataclass

from tfcompose.launcher.program import anywhere
from tfcompose.model.systemd import quote, source_then_run

#: How long everything on a host has to end: the launcher ends processes one after the other.
STOP_S = 90


@dataclass(frozen=True, slots=True)
class Unit:
    """What the unit of a robot's share on a host is made of.

    Paths are absolute, and those on the host.

    ``python`` is the host's; with ``has_wheels`` the release brings its own. ``name`` is
    ROBOT.HOST.
    """

    name: str
    robot: str
    host: str
    base: str
    python: str
    setup: tuple[str, ...] = ()
    system: bool = False
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
