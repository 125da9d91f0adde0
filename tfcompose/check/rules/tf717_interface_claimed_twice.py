"""TF717: interface claimed twice."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.findings import Span
    from tfcompose.model import Robot


def interface_claimed_twice(robot: Robot) -> Iterator[Finding]:
    """Two hardware components of ros2_control have one interface of one joint.

    The controller manager refuses the second, and no controller starts. A joint is driven by one component; a second
    one may bring other interfaces of it.
    """
    first: dict[tuple[str, str, str], tuple[str, Span]] = {}
    for hardware in robot.hardware:
        for component in hardware.components:
            for way, interfaces in (("command", component.command), ("state", component.state)):
                for interface in interfaces:
                    claim = (component.name, way, interface.name)
                    other, at = first.setdefault(claim, (hardware.name, component.at))
                    if at != component.at:
                        message = f"{hardware.name} and {other} both have the {way} interface {claim[0]}/{claim[2]}"
                        notes = [Note(f"{other} has it here", at)]
                        yield finding("TF717", message, component.at, help="keep it in one of them", notes=notes)
