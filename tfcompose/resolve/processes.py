"""Processes: what is started, or expected to run."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, did_you_mean, finding
from tfcompose.language.process import SIMULATIONS
from tfcompose.model import BUILT_IN, Node, Process
from tfcompose.plan import Simulation
from tfcompose.resolve.built_in import built_in_keys
from tfcompose.resolve.nodes import namespace_of, nodes_of
from tfcompose.resolve.poses import pose_of
from tfcompose.resolve.running import EXTERNAL_KEYS, SIMULATED_KEYS, how, program

if TYPE_CHECKING:
    from tfcompose.language import Validated
    from tfcompose.language.process import ProcessSpec, Simulate
    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Path, Source


def user_process(name: str, said: ProcessSpec, validated: Validated) -> tuple[Process | None, list[Finding]]:
    """Return the process that the user describes, or None and what is missing."""
    spec, source = validated.spec, validated.source
    at: Path = ("processes", name)
    place = source.at_key(at)
    if name in BUILT_IN:
        return None, built_in_keys(name, said, source)
    namespace = namespace_of(said, spec.ros.namespace)
    nodes, found = nodes_of(name, said, namespace, source)
    if said.external:
        keys = how(said, namespace, EXTERNAL_KEYS)
        return replace(Process(name, "external", place, nodes), **keys), found
    if said.simulate:
        one = (Node(nodes[0].name, nodes[0].at),)
        process, refused = _simulated(Process(name, "simulate", place, one), said.simulate, validated)
        keys = how(said, namespace, SIMULATED_KEYS)
        return process and replace(process, **keys), [*found, *refused]
    if said.run and said.run.is_startable:
        process = Process(name, "run", place, nodes)
        return replace(process, **how(said, namespace), **program(said.run, shell=bool(said.shell))), found
    if _is_run_refused(name, validated):
        return None, found
    if said.run:
        advice = "run: {package: …, executable: …}, or {launch: package/file.launch.py}"
        at = (*at, "run")
        return None, [finding("TF102", f"{name}: run needs package and executable", source.at_key(at), help=advice)]
    advice = "run: {package: …, executable: …}, simulate: {…}, or external: true"
    return None, [finding("TF102", f"{name} does not say how it runs", place, help=advice)]


def _simulated(process: Process, simulate: Simulate, validated: Validated) -> tuple[Process | None, list[Finding]]:
    at: Path = ("processes", process.name, "simulate")
    if simulate.circle:
        circle = simulate.circle
        simulation = Simulation("circle", simulate.rate, radius=circle.radius, speed=circle.speed)
    elif simulate.fixed:
        simulation = Simulation("fixed", simulate.rate, pose=pose_of(simulate.fixed))
    elif simulate.joints is not None:
        simulation = Simulation("joints", simulate.rate)
    elif any(path[:3] == at and path[3:4] and path[3] in SIMULATIONS for path in validated.refused):
        return None, []
    else:
        message = f"{process.name}: simulate needs circle, fixed or joints"
        return None, [finding("TF102", message, validated.source.at_key(at))]
    return replace(process, simulate=simulation), []


def _is_run_refused(name: str, validated: Validated) -> bool:
    """Whether what says what to start was refused, and is missing only therefore."""
    refused = [path[3:] for path in validated.refused if path[:3] == ("processes", name, "run")]
    return any(not rest or isinstance(rest[0], int) or rest[0] != "args" for rest in refused)


def name_clashes(processes: list[Process], spec: RobotSpec, source: Source) -> list[Finding]:
    """Return a finding for each name that a sensor and a process, or two processes, share.

    A sensor may have the name of the process that drives it.
    """
    first: dict[str, Process] = {}
    found = []
    for name, sensor in spec.sensors.items():
        driven_by_it = sensor.driver is not None and sensor.driver.process == name
        if name in spec.processes and not driven_by_it:
            first[name] = Process(name, "external", source.at_key(("sensors", name)))
    for process in processes:
        other = first.setdefault(process.name, process)
        if other.at != process.at:
            notes = [Note(f"{other.name} stands here too", other.at)]
            advice = "rename one of them"
            if process.name in spec.sensors:
                advice += f", or, if it drives the sensor, driver: {process.name}"
            message = f"the name {process.name} is used twice; sensors and processes share one name space"
            found.append(finding("TF502", message, process.at, notes=notes, help=advice))
    return found


def unknown_names(
    processes: list[Process], source: Source, known: frozenset[str], missing: tuple[str, ...]
) -> list[Finding]:
    """Return a finding for each name under ``after`` that is no process, and for each end that never comes.

    ``known`` are those that are there or were refused, ``missing`` how the names of those begin that are not known.
    """
    names = sorted(known)
    lasting = {process.name: process for process in processes if process.kind != "run"}
    found = []
    for process in processes:
        section = "processes" if source.has(("processes", process.name)) else "sensors"
        inside = ("after",) if section == "processes" else ("driver", "after")
        for other, what in process.after.items():
            if what == "done" and other in lasting:
                place = source.at((section, process.name, *inside, other))
                message = f"{process.name} waits until {other} is done: that never comes"
                found.append(finding("TF813", message, place, help=f"after: {{{other}: ready}}, or started"))
            elif other not in known and not other.startswith(missing):
                place = source.at_key((section, process.name, *inside, other))
                advice = did_you_mean(other, names, f"there is {', '.join(names)}")
                found.append(
                    finding("TF813", f"{process.name} waits for {other}, which is no process", place, help=advice)
                )
    return found
