"""Keys of a process that nothing reads: they belong to another way of running it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.language.process import RUNNING
from tfcompose.model import JOINTS, STATIC
from tfcompose.resolve.running import EXTERNAL_KEYS, SIMULATED_KEYS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.language.process import Started
    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Path, Source

#: What is read of every process; of two ways of running one is refused elsewhere, as is a rate.
_ALWAYS = frozenset({*RUNNING, "node", "nodes", "namespace", "rate"})
#: For each way of running: the keys that are read, how it is called, and whom the other keys are for.
_READ = {
    "external": (
        _ALWAYS | {*EXTERNAL_KEYS, "publishes", "params", "lifecycle"},
        "started by others",
        "whoever starts the process",
    ),
    "simulate": (_ALWAYS | {*SIMULATED_KEYS}, "simulated", "the real process"),
}


def idle_keys(spec: RobotSpec, source: Source) -> list[Finding]:
    """Return a finding for each key of a process that does nothing there."""
    said: dict[Path, tuple[str, Started | None]] = {}
    said |= {("processes", name): (name, process) for name, process in spec.processes.items()}
    said |= {("sensors", name, "driver"): (f"the driver of {name}", s.driver) for name, s in spec.sensors.items()}
    found: list[Finding] = []
    for path, (name, process) in said.items():
        if process is not None:
            found += _idle_rate(path, name, process, source)
            found += _idle(path, name, process, source)
    return found


def _idle_rate(path: Path, name: str, process: Started, source: Source) -> Iterator[Finding]:
    """Yield a finding about a rate: only ``joints`` has one."""
    if process.rate is None or path == ("processes", JOINTS):
        return
    advice = "remove it; an edge says itself how often it is sent: odom: {parent: map, owner: …, rate: 10 Hz}"
    if process.simulate:
        advice = "write it under simulate"
    elif path == ("processes", STATIC):
        advice = "remove it; fixed edges are sent once"
    message = f"{name} has no rate; only the process joints has"
    yield finding("TF101", message, source.at_key((*path, "rate")), help=advice)


def _idle(path: Path, name: str, process: Started, source: Source) -> Iterator[Finding]:
    """Yield a finding for each key beside external or simulate that does nothing.

    Where an overlay puts that in the place of something else, the keys below it are meant for what they stood beside.
    """
    way = "external" if process.external else "simulate" if process.simulate else None
    if way is None or (*path, way) in source.replaced or (way == "simulate" and path[0] == "sensors"):
        return  # no driver is simulated: that is refused
    read, how, whom = _READ[way]
    for key in process.model_fields_set - read:
        message, advice = f"{name} is {how}: {key} does nothing there", f"remove it: it is for {whom}"
        yield finding("TF851", message, source.at_key((*path, key)), help=advice, severity="warning")
