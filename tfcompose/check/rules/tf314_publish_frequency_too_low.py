"""TF314: publish frequency too low."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.model import Process, Robot

STOCK = "robot_state_publisher"
STOCK_HZ = 20.0


def publish_frequency_too_low(robot: Robot) -> Iterator[Finding]:
    """Joint states are left out, because they come more often than they are published.

    ``publish_frequency`` is the most that tfcompose's ``joints`` and the stock robot_state_publisher publish of joint
    states with the same names; more is left out, by the stock one in silence. ``joints`` publishes all where it is left
    out, the stock one 20 Hz; and that one counts in whole milliseconds, so that give it twice what is needed. A joint
    should come as often as its edge says, or as a stand-in sends joint states.
    """
    for process in robot.processes:
        most = _most(process)
        if most is None:
            continue
        wanted = [(edge.rate or 0.0, f"{edge.name} should come with", edge.rate_at or edge.at) for edge in robot.edges
                  if edge.joint and edge.owner == process.name]  # fmt: skip
        if wanted:
            wanted += [
                (one.simulate.rate, f"what {one.name} sends comes with", one.at)
                for one in robot.processes
                if one.simulate and one.simulate.kind == "joints"
            ]
        rate, what, at = max(wanted, default=(0.0, "", process.at), key=lambda each: each[0])
        if rate > most:
            message = f"{process.name} publishes at most {most:g} Hz of joint states, and {what} {rate:g} Hz"
            advice = f"params: {{publish_frequency: {2 * rate:g}}} at {process.name}"
            if process.package is None:
                advice = f"leave publish_frequency of {process.name} out, and every joint state is published"
            notes = (Note(f"{process.name} is here", process.at),) if at != process.at else ()
            yield finding("TF314", message, at, notes=notes, help=advice)


def _most(process: Process) -> float | None:
    """Return the most that the process publishes of joint states, in Hz; None: all, or it publishes none."""
    stock = process.package == STOCK
    most = process.params.get("publish_frequency", STOCK_HZ if stock else None)
    ignores = process.params.get("ignore_timestamp") is True
    if (not stock and process.kind != "joints") or ignores or isinstance(most, bool):
        return None
    return float(most) if isinstance(most, (int, float)) and most > 0 else None
