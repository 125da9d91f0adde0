"""The computers of a robot, and the places where processes name their computer."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.model.robot import Host

if TYPE_CHECKING:
    from tfcompose.model.robot import Process
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path


def hosts_of(spec: RobotSpec) -> dict[str, Host]:
    """Return the computers that the file declares, by name.

    The name is also the ssh address, unless the file sets another address.
    """
    return {
        name: Host(
            host.ssh or name,
            host.port,
            host.python,
            host.setup,
            host.node_selector,
            span=spec.key_span(("hosts", name)),
        )
        for name, host in spec.hosts.items()
    }


def entry_of(process: Process, spec: RobotSpec) -> Path:
    """Return the path of the entry with the keys of the process."""
    sections = (("containers", process.name), ("processes", process.name))
    return next(filter(spec.spans.has, sections), ("sensors", process.name, "driver"))


def with_host_place(process: Process, spec: RobotSpec) -> Process:
    """Return the process with the span of its host.

    A component has no host of its own: it runs on its container's host.
    """
    host_at = spec.spans.exact_span((*entry_of(process, spec), "host"))
    return replace(process, host_at=host_at)
