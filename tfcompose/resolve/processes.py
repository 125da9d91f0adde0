"""Processes: what is started, or expected to run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, Note, did_you_mean, finding
from tfcompose.model import BUILT_IN, GUARD, JOINTS, STATIC, Process
from tfcompose.plan import ProcessKind, Simulation
from tfcompose.resolve.isolation import settings_of
from tfcompose.resolve.poses import pose_of
from tfcompose.resolve.presets import driver_parameters

if TYPE_CHECKING:
    from tfcompose.load import Path, Source
    from tfcompose.resolve.presets import Sensor
    from tfcompose.validate.spec import ProcessSpec, RobotSpec, Run, Simulate

_BUILT_IN_KEYS = frozenset({"rate", "remap", "env", "after"})
_KINDS: dict[str, ProcessKind] = {STATIC: "static", JOINTS: "joints", GUARD: "guard"}


def full_name(namespace: str, name: str) -> str:
    """Return a node's fully qualified name: below the namespace unless it begins with a slash."""
    if name.startswith("/"):
        return name
    return "/" + "/".join(part for part in (namespace.strip("/"), name) if part)


def built_in(spec: RobotSpec, source: Source) -> list[Process]:
    """Return tfcompose's own processes, with what stands of them under ``processes``."""
    own = []
    for name in BUILT_IN:
        said = spec.processes.get(name)
        at = source.at_key(("processes", name)) if said else source.at_key(("robot",))
        process = Process(name, _KINDS[name], at, full_name(spec.ros.namespace, f"tfcompose_{name}"))
        if said:
            process = Process(
                name, process.kind, at, process.node, remap=said.remap, env=said.env, after=said.after, rate=said.rate
            )
        own.append(process)
    return own


def user_process(
    name: str, said: ProcessSpec, spec: RobotSpec, source: Source
) -> tuple[Process | None, list[Diagnostic]]:
    """Return the process that the user describes, or None and what is missing."""
    at: Path = ("processes", name)
    place = source.at_key(at)
    if name in BUILT_IN:
        wrong = [key for key in source.data["processes"][name] if key not in _BUILT_IN_KEYS]
        advice = f"its keys can be: {', '.join(sorted(_BUILT_IN_KEYS))}"
        return None, [
            finding("TF101", f"{name} is built in and has no {key}", source.at_key((*at, key)), help=advice)
            for key in wrong
        ]
    node = full_name(spec.ros.namespace, said.node or name)
    if said.external:
        return Process(name, "external", place, node, after=said.after), []
    if said.simulate:
        return _simulated(name, said, said.simulate, node, source)
    if _starts(said.run):
        return _run(name, said, node, source), []
    if said.run:
        return None, [finding("TF102", f"{name}: run needs package and executable", source.at_key((*at, "run")))]
    advice = "run: {package: …, executable: …}, simulate: {…}, or external: true"
    return None, [finding("TF102", f"{name} does not say how it runs", place, help=advice)]


def _simulated(
    name: str, said: ProcessSpec, simulate: Simulate, node: str, source: Source
) -> tuple[Process | None, list[Diagnostic]]:
    place = source.at_key(("processes", name))
    if simulate.circle:
        circle = simulate.circle
        simulation = Simulation("circle", simulate.rate, radius=circle.radius, speed=circle.speed)
    elif simulate.fixed:
        simulation = Simulation("fixed", simulate.rate, pose=pose_of(simulate.fixed))
    elif simulate.joints is not None:
        simulation = Simulation("joints", simulate.rate, joints=dict(simulate.joints))
    else:
        message = f"{name}: simulate needs circle, fixed or joints"
        return None, [finding("TF102", message, source.at_key(("processes", name, "simulate")))]
    return Process(name, "simulate", place, node, env=said.env, after=said.after, simulate=simulation), []


def _run(name: str, said: ProcessSpec, node: str, source: Source) -> Process:
    run = said.run
    return Process(
        name,
        "run",
        source.at_key(("processes", name)),
        node,
        package=run.package if run else None,
        executable=run.executable if run else None,
        argv=(run.argv or run.args) if run else (),
        params=said.params,
        remap=said.remap,
        env=said.env,
        cwd=said.cwd,
        restart=said.restart,
        after=said.after,
    )


def driver_process(
    sensor: Sensor, spec: RobotSpec, source: Source, *, publishes: bool
) -> tuple[Process | None, list[Diagnostic]]:
    """Return the process of a sensor's driver, with the parameters that make it do what the spec says.

    It is the preset's with the user's keys over it, the user's alone where the preset has none, or None.
    """
    driver, said = sensor.preset.driver, sensor.spec.driver
    at: Path = ("sensors", sensor.name, "driver")
    if said and said.process is not None:
        return None, _named_driver(sensor, said.process, source)
    if said and said.simulate:
        advice = "driver: none, and tf: tfcompose, where there is no device"
        return None, [finding("TF604", "a driver cannot be simulated", source.at_key((*at, "simulate")), help=advice)]
    run, external = (said.run, bool(said.external)) if said else (None, False)
    if driver is None and said is None:
        return None, []
    if not external and not _starts(run) and (run or driver is None):
        place, advice = source.at_key((*at, "run")), "run: {package: …, executable: …}, or external: true"
        return None, [finding("TF102", f"the driver of {sensor.name} does not say how it runs", place, help=advice)]
    computed = driver_parameters(sensor, publishes=publishes, prefix=settings_of(spec.ros).frame_prefix)
    node = f"{sensor.named(driver.namespace)}/{sensor.named(driver.node)}".strip("/") if driver else sensor.name
    process = Process(
        sensor.name,
        "external" if external else "run",
        source.at_key(at[:2]),
        full_name(spec.ros.namespace, (said.node if said else None) or node),
        package=run.package if run else driver.package if driver else None,
        executable=run.executable if run else driver.executable if driver else None,
        argv=(run.argv or run.args) if run else (),
        params=(said.params if said else {}) | computed,
        remap=said.remap if said else {},
        env=said.env if said else {},
        cwd=said.cwd if said else None,
        restart=said.restart if said else "no",
        after=said.after if said else {},
    )
    return process, _given_parameters(sensor, computed, source)


def _starts(run: Run | None) -> bool:
    return run is not None and bool(run.argv or (run.package and run.executable))


def _named_driver(sensor: Sensor, name: str, source: Source) -> list[Diagnostic]:
    """Return findings about a driver that is the name of a process: it must be one, and has its own keys."""
    at: Path = ("sensors", sensor.name, "driver")
    known = [*source.data.get("processes", {}), *source.data["sensors"], *BUILT_IN]
    found = []
    if name != "none" and name not in known:
        advice = did_you_mean(name, known, f"processes: {{{name}: {{external: true}}}}")
        found.append(
            finding("TF813", f"the driver of {sensor.name} is {name}, which is no process", source.at(at), help=advice)
        )
    written = source.data["sensors"][sensor.name]["driver"]
    for key in written if isinstance(written, dict) else ():
        if key != "process":
            place = source.at_key((*at, key))
            advice = f"write it under processes: {name}"
            found.append(finding("TF107", f"{key} and process exclude each other", place, help=advice))
    return found


def _given_parameters(sensor: Sensor, computed: dict[str, Any], source: Source) -> list[Diagnostic]:
    """Return a finding for each parameter that the user gives and tfcompose computes."""
    found = []
    for key in sensor.spec.driver.params if sensor.spec.driver else ():
        if key in computed:
            message = f"{key} is computed by tfcompose for {sensor.spec.preset}: {computed[key]!r}"
            place = source.at_key(("sensors", sensor.name, "driver", "params", key))
            found.append(finding("TF604", message, place, help="remove it; options and tf set it"))
    return found


def name_clashes(processes: list[Process]) -> list[Diagnostic]:
    """Return a finding for each name that a sensor's driver and a process, or two processes, share."""
    first: dict[str, Process] = {}
    found = []
    for process in processes:
        other = first.setdefault(process.name, process)
        if other is not process:
            notes = [Note(f"{other.name} stands here too", other.at)]
            message = f"the name {process.name} is used twice; sensors and processes share one name space"
            found.append(finding("TF502", message, process.at, notes=notes, help="rename one of them"))
    return found


def unknown_names(processes: list[Process], source: Source, broken: frozenset[str]) -> list[Diagnostic]:
    """Return a finding for each name under ``after`` that no process has."""
    names = [process.name for process in processes]
    found = []
    for process in processes:
        section = "processes" if ("processes", process.name) in source.keys else "sensors"
        inside = ("after",) if section == "processes" else ("driver", "after")
        for other in process.after:
            if other not in names and other not in broken:
                place = source.at_key((section, process.name, *inside, other))
                advice = did_you_mean(other, names, f"there is {', '.join(names)}")
                found.append(
                    finding("TF813", f"{process.name} waits for {other}, which is no process", place, help=advice)
                )
    return found
