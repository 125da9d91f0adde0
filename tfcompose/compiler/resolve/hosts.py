"""The computers of a robot, and where processes name theirs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.model.robot import Host

if TYPE_CHECKING:
    from tfcompose.model.robot import Process
    from tfcompose.spec.language.robot import RobotSpec


def hosts_of(spec: RobotSpec) -> dict[str, Host]:
    """Return the computers that the file declares, by name.

    Ssh finds one by its name if nothing else is said.
    """
    return {
        name: Host(
            one.ssh or name,
            one.port,
            one.python,
            one.setup,
            one.node_selector,
            at=spec.at_key(("hosts", name)),
        )
        for name, one in spec.hosts.items()
    }


def with_host_place(process: Process, spec: RobotSpec) -> Process:
    """Return the process with the place of its host.

    A component that runs where its container does has none.
    """
    for path in (
        ("processes", process.name),
        ("containers", process.name),
        ("sensors", process.name, "driver"),
    ):
        if process.host is not None and spec.spans.has((*path, "host")):
            return replace(process, host_at=spec.at((*path, "host")))
    return process
