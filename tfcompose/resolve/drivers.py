"""A sensor's driver: its process, with the parameters that make it do what the spec says."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.language.preset import Chosen
from tfcompose.model import BUILT_IN, Node, Process
from tfcompose.resolve.isolation import settings_of
from tfcompose.resolve.nodes import full_name, namespace_of
from tfcompose.resolve.presets import DRIVER
from tfcompose.resolve.running import EXTERNAL_KEYS, KEYS, how, program

if TYPE_CHECKING:
    from tfcompose.language import Validated
    from tfcompose.language.preset import DriverClaim, PresetDriver
    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Path, Source
    from tfcompose.resolve.presets import Sensor

#: In an argument, the file that holds the parameters of a process.
PARAMS_FILE = "${params_file}"


def driver_process(sensor: Sensor, validated: Validated) -> tuple[Process | None, list[Finding]]:
    """Return the process of a sensor's driver, with the parameters that make it do what the spec says.

    It is the preset's with the user's keys over it, the user's alone where the preset has none, or None.
    """
    driver, said = sensor.preset.driver, sensor.spec.driver
    spec, source = validated.spec, validated.source
    at: Path = ("sensors", sensor.name, "driver")
    if said and said.process is not None:
        return None, _named_driver(sensor, said.process, validated)
    if said and said.simulate:
        advice = "driver: none, and tf: tfcompose, where there is no device"
        return None, [finding("TF604", "a driver cannot be simulated", source.at_key((*at, "simulate")), help=advice)]
    run, external = (said.run, bool(said.external)) if said else (None, False)
    if driver is None and said is None:
        return None, []
    if not external and not (run and run.is_startable) and (run or driver is None):
        place, advice = source.at_key((*at, "run")), "run: {package: …, executable: …}, or external: true"
        return None, [finding("TF102", f"the driver of {sensor.name} does not say how it runs", place, help=advice)]
    launched = driver is not None and driver.launch is not None and run is None
    computed = driver_parameters(sensor, settings_of(spec.ros).frame_prefix)
    params = (said.params if said else {}) | _node_parameters(sensor, computed, launched=launched)
    place = source.at_key(at[:2])
    state = driver.lifecycle if driver and run is None else None
    node = Node(driver_node(sensor, spec), place, at, params, (said.lifecycle if said else None) or state)
    process = Process(sensor.name, "external" if external else "run", place, (node,))
    if said:
        keys = how(said, namespace_of(said, spec.ros.namespace), EXTERNAL_KEYS if external else KEYS)
        process = replace(process, **keys)
    if run:
        process = replace(process, **program(run, shell=bool(said and said.shell)))
    elif driver and launched:
        args = {key: value for key, value in computed.items() if params or value != PARAMS_FILE}
        process = replace(process, launch=f"{driver.package}/{driver.launch}", argv=tuple(arguments(args)))
    elif driver:
        process = replace(process, package=driver.package, executable=driver.executable)
    return process, [*_given_parameters(sensor, computed, source), *_unreached(sensor, spec, source)]


def driver_node(sensor: Sensor, spec: RobotSpec) -> str:
    """Return the full name of the driver's node."""
    driver, said = sensor.preset.driver, sensor.spec.driver
    own = f"{sensor.named(driver.namespace)}/{sensor.named(driver.node)}".strip("/") if driver else sensor.name
    namespace = namespace_of(said, spec.ros.namespace)
    return full_name(namespace, (said.node.name if said and said.node else None) or own)


def driver_parameters(sensor: Sensor, prefix: str = "") -> dict[str, Any]:
    """Return the parameters, or the arguments of a launch file, that make the driver do what the spec says."""
    driver = sensor.preset.driver
    if driver is None:
        return {}
    fill = _Filler(sensor, prefix)
    named = _frame_names(sensor, driver)
    switch = (driver.on if sensor.tf == DRIVER else driver.off or {}) if sensor.driven() else {}
    claims = {key: value for claim in claims_of(sensor) for key, value in claim.off.items()}
    return fill.table(driver.args if driver.launch else driver.params) | named | fill.table(claims | switch)


def claims_of(sensor: Sensor) -> tuple[DriverClaim, ...]:
    """Return the edges outside the sensor that its driver publishes by default, unless it owns the mount's."""
    driver, said = sensor.preset.driver, sensor.spec
    own = {sensor.name, said.driver.process if said.driver else None}
    return () if driver is None or (said.owner and said.owner in own) else driver.claims


def _node_parameters(sensor: Sensor, computed: dict[str, Any], *, launched: bool) -> dict[str, Any]:
    """Return the node's own parameters; a launch file takes arguments, and may pass a file of parameters on."""
    driver = sensor.preset.driver
    if driver is None or not driver.launch:
        return computed
    return _Filler(sensor, "").table(driver.params) if launched else {}


def _frame_names(sensor: Sensor, driver: PresetDriver) -> dict[str, str]:
    """Return the parameters that give frames their names, as ``${frame(…)}``, for the frames that the sensor has."""
    inside = {sensor.named(sensor.preset.mount), *sensor.frames()}
    frames = {key: sensor.named(frame) for key, frame in driver.naming.items()}
    renamed = {name: own.name for name, own in sensor.spec.frames.items() if own.name}
    return {
        sensor.named(key): f"${{frame({renamed.get(frame, frame)})}}"
        for key, frame in frames.items()
        if frame in inside
    }


class _Filler:
    """Fills a driver's parameters for one sensor; what ends up empty or undecided is left out."""

    def __init__(self, sensor: Sensor, prefix: str) -> None:
        self.sensor = sensor
        self.prefix = prefix

    def table(self, table: dict[str, Any]) -> dict[str, Any]:
        filled = {self.sensor.named(key): self.value(value) for key, value in table.items()}
        return {key: value for key, value in filled.items() if value is not None and value != ""}

    def value(self, value: Any) -> Any:
        if isinstance(value, Chosen):
            if value.option:
                return self.sensor.options.get(value.option)
            return self.value(value.value if self.sensor.holds(value.when or {}) else value.otherwise)
        if isinstance(value, str):
            return self.sensor.named(value).replace("{prefix}", self.prefix)
        return value


def arguments(values: dict[str, Any]) -> list[str]:
    """Return the values as arguments of a launch file."""
    return [f"{key}:={_plain(value)}" for key, value in values.items()]


def _plain(value: Any) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)


def _unreached(sensor: Sensor, spec: RobotSpec, source: Source) -> list[Finding]:
    """Return findings about names that the driver makes itself, and that the spec wants otherwise."""
    driver, said = sensor.preset.driver, sensor.spec
    if driver is None or (said.driver and (said.driver.run or said.driver.external)):
        return []
    settings = settings_of(spec.ros)
    named = {sensor.named(frame) for frame in driver.naming.values()}
    stamped = {sensor.named(topic.frame) for topic in sensor.preset.topics.values() if sensor.holds(topic.when)}
    own = (stamped | ({*sensor.driven()} if sensor.tf == DRIVER else set())) - named
    at: Path = ("sensors", sensor.name)
    found = []
    for name in sorted(own & {frame for frame, one in said.frames.items() if one.name}):
        message = (
            f"the driver of {said.preset} makes the name {name} itself, and cannot call it {said.frames[name].name}"
        )
        place = source.at((*at, "frames", name, "name"))
        found.append(finding("TF604", message, place, help=f"rename the sensor {sensor.name}, or keep the name"))
    if settings.frame_prefix and not driver.prefixed and own & {*sensor.frames(), sensor.named(sensor.preset.mount)}:
        message = f"the driver of {said.preset} cannot write {settings.frame_prefix} in front of its frames"
        advice = "ros: {isolate: topics} keeps robots apart without a prefix"
        found.append(finding("TF604", message, source.at_key(at), help=advice))
    if driver.launch and said.driver and said.driver.params and PARAMS_FILE not in driver.args.values():
        message = f"{driver.launch} of {said.preset} takes no file of parameters"
        place = source.at_key((*at, "driver", "params"))
        found.append(finding("TF604", message, place, help="driver: {run: {package: …, executable: …}}"))
    return found


def _named_driver(sensor: Sensor, name: str, validated: Validated) -> list[Finding]:
    """Return findings about a driver that is the name of a process: it must be one, and has its own keys."""
    at: Path = ("sensors", sensor.name, "driver")
    spec, source = validated.spec, validated.source
    broken = (entry for section, entry in validated.broken if section in {"processes", "sensors"})
    known = [*dict.fromkeys([*spec.processes, *spec.sensors, *broken]), *BUILT_IN]
    found = []
    if name != "none" and name not in known:
        advice = did_you_mean(name, known, f"processes: {{{name}: {{external: true}}}}")
        found.append(
            finding("TF813", f"the driver of {sensor.name} is {name}, which is no process", source.at(at), help=advice)
        )
    driver = sensor.spec.driver
    for key in driver.model_fields_set - {"process"} if driver else ():
        place = source.at_key((*at, key))
        advice = f"write it under processes: {name}"
        found.append(finding("TF107", f"{key} and process exclude each other", place, help=advice))
    return found


def _given_parameters(sensor: Sensor, computed: dict[str, Any], source: Source) -> list[Finding]:
    """Return a finding for each parameter that the user gives and tfcompose computes."""
    found = []
    for key in sensor.spec.driver.params if sensor.spec.driver else ():
        if key in computed:
            message = f"{key} is computed by tfcompose for {sensor.spec.preset}: {computed[key]!r}"
            place = source.at_key(("sensors", sensor.name, "driver", "params", key))
            found.append(finding("TF604", message, place, help="remove it; options and tf set it"))
    return found
