"""Sensors: the mount edge, inner frames, body and driver of each sensor."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

from tfcompose.compiler.resolve.bodies import Bodies
from tfcompose.compiler.resolve.containers import component_process
from tfcompose.compiler.resolve.edges import add_edge, add_joint_name
from tfcompose.compiler.resolve.isolation import settings_of
from tfcompose.compiler.resolve.optics import optics_of
from tfcompose.compiler.resolve.poses import rotation_of
from tfcompose.compiler.resolve.presets import DRIVER, TFCOMPOSE, sensor_of
from tfcompose.compiler.resolve.processes import full_name, how, namespace_of, program
from tfcompose.compiler.urdf.inertia import of_primitives
from tfcompose.foundation.findings import Finding, did_you_mean, finding
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import switch_text
from tfcompose.model.process_keys import PROCESS_KEYS
from tfcompose.model.robot import (
    BUILT_IN,
    STATIC,
    Edge,
    Link,
    MountedSensor,
    Node,
    Process,
    SensorTopic,
)
from tfcompose.spec.language.preset import Chosen
from tfcompose.spec.load import find_path

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft, Finds
    from tfcompose.compiler.resolve.presets import Library, Sensor
    from tfcompose.foundation.findings import Span
    from tfcompose.spec.language import Validated
    from tfcompose.spec.language.preset import DriverClaim, PresetDriver, PresetFrame
    from tfcompose.spec.language.robot import FrameOverride, RobotSpec
    from tfcompose.spec.load import Path


def add_sensors(draft: Draft) -> Iterator[Finding]:
    """Add the sensors to the draft, with their mounts, frames, bodies and drivers."""
    spec = draft.spec
    library = yield from _library(draft)
    for name, declared in spec.sensors.items():
        sensor = yield from sensor_of(name, declared, library, spec)
        if sensor:
            yield from _Mounting(draft, sensor).add()
        else:
            draft.broken.add(("sensors", name))


def _library(draft: Draft) -> Finds[Library]:
    """Return the presets. Folders from the robot file take precedence."""
    folders = []
    for index, named in enumerate(draft.spec.preset_path):
        span = draft.spec.span_of(("preset_path", index))
        folder = find_path(named, span)
        folders.append(folder)
        if not draft.library.storage.is_folder(folder):
            advice = "make it; it holds VENDOR/MODEL.yaml"
            yield finding("TF001", f"preset_path: no folder {folder}", span, help=advice)
    return draft.library.over(folders) if folders else draft.library


@dataclass(frozen=True, slots=True)
class _Mounting:
    """Adds a sensor to the draft."""

    draft: Draft
    sensor: Sensor
    unknown: dict[str, str] = field(default_factory=dict)

    def add(self) -> Iterator[Finding]:
        """Add the sensor to the draft."""
        draft, sensor = self.draft, self.sensor
        mount = self.rename(sensor.fill_name(sensor.preset.mount))
        draft.frames.setdefault(mount, self.span_of())
        keys, path = sensor.spec, ("sensors", sensor.name)
        yield from add_edge(draft, path, mount, keys, joint_name=keys.joint, sensor=sensor.name)
        count_before = len(draft.processes)
        publisher = yield from self.publisher()
        driver = sensor.name if len(draft.processes) > count_before else ""
        for name, frame in sensor.frames().items():
            yield from self.add_frame(name, frame, publisher)
        yield from self.report_unknown()
        yield from self.check_overrides(mount)
        yield from self.add_body()
        mounted = yield from self.mount(mount, driver)
        draft.sensors.append(mounted)

    def span_of(self, *keys: str) -> Span:
        """Return the span of the sensor's name, or of the value of a key."""
        path: Path = ("sensors", self.sensor.name, *keys)
        return self.draft.spec.span_of(path) if keys else self.draft.spec.key_span(path)

    def rename(self, name: str) -> str:
        override = self.sensor.spec.frames.get(name)
        return override.name if override and override.name else name

    def add_frame(self, name: str, frame: PresetFrame, publisher: str) -> Iterator[Finding]:
        """Add a frame inside the sensor.

        Values in the robot file override values of the preset.
        """
        override, final = self.sensor.spec.frames.get(name), self.rename(name)
        parent = self.sensor.parent_of(name, frame)
        owner = publisher if frame.driver else STATIC
        pose, missing = self.pose_of(name, frame, override)
        if missing and owner == STATIC:
            self.unknown[name] = f"{name}: {{{', '.join(missing)}}}"
        kind = "dynamic" if frame.driver == "dynamic" and owner != STATIC else "static"
        self.draft.frames.setdefault(final, self.span_of())
        nominal = frame.nominal and not (
            override and (override.xyz or rotation_of(override, name))
        )
        path: Path = ("sensors", self.sensor.name, "frames", name)
        joint_at = yield from add_joint_name(
            self.draft, override.joint if override else None, path
        )
        edge = Edge(
            parent=self.rename(parent),
            child=final,
            kind="dynamic" if kind == "dynamic" else "static",
            owner=owner,
            pose=pose,
            span=self.span_of(),
            declared=False,
            sensor=self.sensor.name,
            nominal=nominal,
            other_axes=frame.other_axes,
            pose_known=not missing,
            joint_name=(override.joint if override else None) or "",
            joint_at=joint_at,
            entry=path,
        )
        self.draft.edges.append(edge)

    def pose_of(
        self, name: str, frame: PresetFrame, override: FrameOverride | None
    ) -> tuple[Pose, list[str]]:
        """Return the frame's pose in its parent, and the keys that are missing for it.

        If keys are missing, the pose is the identity.
        """
        translation, rotation = frame.xyz, rotation_of(frame, name)
        if frame.by_driver and self.sensor.tf == DRIVER:
            translation, rotation = (
                frame.by_driver.xyz or translation,
                rotation_of(frame.by_driver, name) or rotation,
            )
        turned = rotation_of(override, name) if override else None
        xyz = (override.xyz if override else None) or translation
        missing = ["xyz: [x, y, z]"] if xyz is None else []
        if translation is None and rotation is None and turned is None:
            missing.append("rpy: [roll, pitch, yaw]")
        if xyz is None or missing:
            return Pose(), missing
        return Pose(xyz, turned or rotation or Pose().quat_xyzw), []

    def report_unknown(self) -> Iterator[Finding]:
        """Yield a finding that names the frames with unknown poses, and the keys to write."""
        if self.unknown:
            sensor, first = self.sensor, next(iter(self.unknown))
            *leading, last = self.unknown
            names = f"{', '.join(leading)} and {last}" if leading else last
            parent = "" if leading else f" in {sensor.parent_of(first, sensor.frames()[first])}"
            message = f"{sensor.spec.preset} has no pose of {names}{parent}"
            frames = ", ".join(self.unknown.values())
            advice = f"measure, and write: sensors: {{{sensor.name}: {{frames: {{{frames}}}}}}}"
            yield finding("TF605", message, self.span_of("preset"), help=advice)

    def publisher(self) -> Finds[str]:
        """Return the publisher of the inner frames that the driver can publish."""
        sensor, declared, driver = self.sensor, self.sensor.spec, self.sensor.preset.driver
        named = declared.driver.process if declared.driver else None
        process, findings = driver_process(sensor, self.draft.validated)
        yield from findings
        if process:
            self.draft.processes += [process, *further_processes(sensor, self.draft.spec)]
        elif findings:
            return STATIC
        if sensor.tf == DRIVER:
            return named or sensor.name
        if declared.tf == DRIVER:
            why = "driver is none" if named == "none" else f"{declared.preset} has no driver"
            if driver and named != "none":
                why = f"that of {declared.preset} publishes none" + (
                    " with these options" if _has_driven_frames(sensor) else ""
                )
            message = f"{sensor.name}: the driver cannot publish its frames: {why}"
            yield finding("TF604", message, self.span_of("tf"), help="tf: tfcompose")
        elif (
            declared.tf == TFCOMPOSE
            and driver
            and named is None
            and driver.off is None
            and sensor.driver_frames()
        ):
            message = (
                f"{sensor.name}: the driver of {declared.preset} has no switch for its frames"
            )
            advice = "tf: driver; or driver: none, if there is no device"
            yield finding("TF604", message, self.span_of("tf"), help=advice)
        return STATIC

    def mount(self, mount: str, driver: str) -> Finds[MountedSensor]:
        """Return the mounted sensor for the rules."""
        sensor, declared, preset = self.sensor, self.sensor.spec, self.sensor.preset
        named = declared.driver.process if declared.driver else None
        serial = next(
            (option for option in ("serial", "serial_number") if option in preset.options), ""
        )
        inside = (sensor.fill_name(preset.mount), *sensor.frames())
        optics = yield from optics_of(sensor, inside, self.rename, self.draft.spec)
        return MountedSensor(
            sensor.name,
            declared.preset,
            preset.kind,
            span=self.span_of(),
            mount=mount,
            frames=tuple(self.rename(name) for name in sensor.frames()),
            driver_frames=tuple(self.rename(name) for name in sensor.driver_frames()),
            driver="" if named == "none" else named or driver,
            switch=preset.driver.off if preset.driver else None,
            publishes=sensor.tf == DRIVER,
            claims={
                f"{claim.parent} → {self.rename(sensor.fill_name(claim.child))}": claim.off
                for claim in claims_of(sensor)
            },
            by_default=preset.driver is None or preset.driver.by_default,
            serial_option=serial,
            serial=sensor.options.get(serial) if serial else None,
            tf_at=self.span_of("tf"),
            optics=optics,
            topics=tuple(
                SensorTopic(
                    topic_name,
                    topic.type.replace("/", "/msg/"),
                    self.rename(sensor.fill_name(topic.frame)),
                )
                for topic_name, topic in preset.topics.items()
                if sensor.holds(topic.when)
            ),
        )

    def check_overrides(self, mount: str) -> Iterator[Finding]:
        sensor, spec = self.sensor, self.draft.spec
        original = sensor.fill_name(sensor.preset.mount)
        frames = [*sensor.frames(), original]
        path: Path = ("sensors", sensor.name, "frames")
        for name, override in sensor.spec.frames.items():
            span = spec.key_span((*path, name))
            if name not in frames:
                advice = did_you_mean(name, frames, f"its frames: {', '.join(frames)}")
                yield finding("TF203", f"{sensor.name} has no frame {name}", span, help=advice)
            elif override.parent and override.parent not in frames:
                advice = did_you_mean(override.parent, frames, f"its frames: {', '.join(frames)}")
                message = f"{sensor.name} has no frame {override.parent}"
                yield finding("TF203", message, spec.span_of((*path, name, "parent")), help=advice)
        mounted = sensor.spec.frames.get(original)
        if mounted and (mounted.xyz or mounted.parent or mounted.joint or rotation_of(mounted)):
            advice = f"set its pose and joint at {sensor.name} itself"
            message = f"{mount} is the mount and has no pose inside the sensor"
            yield finding("TF106", message, spec.key_span((*path, original)), help=advice)
        if mount in sensor.frames():
            message = f"{mount} is a frame inside {sensor.name} already"
            yield finding("TF604", message, self.draft.frames[mount], help="another name")

    def add_body(self) -> Iterator[Finding]:
        body = self.sensor.preset.body
        if body is None:
            return
        frame = self.rename(self.sensor.fill_name(body.frame))
        if frame in self.draft.links:
            return
        bodies = Bodies(self.draft.spec, self.draft.packages)
        shape = bodies.shape(body.shape, ("sensors", self.sensor.name))
        yield from bodies.findings
        inertial = of_primitives(body.mass, (shape,)) if body.mass and not shape.mesh else None
        self.draft.links[frame] = Link(frame, self.span_of(), (shape,), (shape,), inertial)


def _has_driven_frames(sensor: Sensor) -> bool:
    return any(frame.driver for frame in sensor.preset.frames.values())


#: Keys that the additional processes of a driver inherit from its first process.
_INHERITED = frozenset({"host", *(row.name for row in PROCESS_KEYS if row.is_shared)})
#: Placeholder, in an argument, for the parameter file of a process.
PARAMS_FILE = "${params_file}"


def driver_process(sensor: Sensor, validated: Validated) -> tuple[Process | None, list[Finding]]:
    """Return the process of a sensor's driver, with the parameters that the sensor needs.

    The process is the preset's, overridden by the user's keys. If the preset has no driver, it is
    the user's process, or None.
    """
    driver, declared = sensor.preset.driver, sensor.spec.driver
    spec = validated.spec
    path: Path = ("sensors", sensor.name, "driver")
    if declared and declared.process is not None:
        return None, [*_check_driver(sensor, declared.process, validated)]
    if declared and declared.simulate:
        advice = "driver: none and tf: tfcompose, if there is no device"
        return None, [
            finding(
                "TF604",
                "a driver cannot be simulated",
                spec.key_span((*path, "simulate")),
                help=advice,
            )
        ]
    run, external = (declared.run, bool(declared.external)) if declared else (None, False)
    loaded = declared if declared and declared.component and declared.container else None
    if driver is None and declared is None:
        return None, []
    if not external and not loaded and not (run and run.is_startable) and (run or driver is None):
        return None, [*_says_not_how(sensor.name, validated)]
    launched = driver is not None and driver.launch is not None and run is None and loaded is None
    computed = driver_parameters(sensor, settings_of(spec.ros).frame_prefix)
    params = (declared.params if declared else {}) | _node_parameters(
        sensor, computed, launched=launched
    )
    span = spec.key_span(path[:2])
    state = driver.lifecycle if driver and run is None else None
    node = Node(
        driver_node(sensor, spec),
        span,
        path,
        params,
        (declared.lifecycle if declared else None) or state,
    )
    way: Literal["external", "component", "run"] = (
        "external" if external else "component" if loaded else "run"
    )
    process = Process(sensor.name, way, span=span, ros_nodes=(node,))
    if declared:
        process = replace(
            process, **how(declared, namespace_of(declared, spec.ros.namespace), way)
        )
    if loaded:
        process = component_process(process, loaded, spec)
    elif run:
        process = replace(process, **program(run, shell=bool(declared and declared.shell)))
    elif driver and launched:
        args = {key: value for key, value in computed.items() if params or value != PARAMS_FILE}
        process = replace(
            process, launch=f"{driver.package}/{driver.launch}", argv=tuple(arguments(args))
        )
    elif driver:
        process = replace(process, package=driver.package, executable=driver.executable)
    return process, [
        *_check_parameters(sensor, computed, spec),
        *_check_driver_names(sensor, spec),
    ]


def _says_not_how(name: str, validated: Validated) -> Iterator[Finding]:
    """Yield a finding about a driver that does not define how it runs.

    A driver whose key was rejected is not reported.
    """
    path: Path = ("sensors", name, "driver")
    if not {(*path, "component"), (*path, "container")} & validated.refused:
        advice = "run: {package: …, executable: …}, component: PACKAGE/CLASS, or external: true"
        span = validated.spec.key_span((*path, "run"))
        message = f"the driver of {name} does not say how it runs"
        yield finding("TF102", message, span, help=advice)


def further_processes(sensor: Sensor, spec: RobotSpec) -> Iterator[Process]:
    """Yield the additional processes of a driver, if the preset's driver is started."""
    driver, declared = sensor.preset.driver, sensor.spec.driver
    if driver is None or (
        declared and (declared.process or declared.run or declared.external or declared.simulate)
    ):
        return
    path: Path = ("sensors", sensor.name)
    above = namespace_of(declared, spec.ros.namespace)
    inherited = (
        {key: value for key, value in how(declared, above).items() if key in _INHERITED}
        if declared
        else {}
    )
    fill = _SensorFiller(sensor, settings_of(spec.ros).frame_prefix)
    for suffix, further in driver.also.items():
        if not sensor.holds(further.when):
            continue
        namespace = full_name(above, sensor.fill_name(further.namespace)).strip("/")
        name, span = f"{sensor.name}_{suffix}", spec.key_span(path)
        full = full_name(f"/{namespace}", sensor.fill_name(further.node))
        node = Node(
            full,
            span,
            (*path, "driver", "also", suffix),
            fill.table(further.params),
            further.lifecycle,
        )
        process = Process(
            name,
            "run",
            span=span,
            ros_nodes=(node,),
            argv=tuple(arguments(fill.table(further.args))),
        )
        process = replace(process, **inherited)
        if further.launch:
            yield replace(
                process, launch=f"{further.package}/{further.launch}", namespace=namespace
            )
        else:
            yield replace(process, package=further.package, executable=further.executable)


def driver_node(sensor: Sensor, spec: RobotSpec) -> str:
    """Return the full name of the driver's node."""
    driver, declared = sensor.preset.driver, sensor.spec.driver
    node_name = (
        f"{sensor.fill_name(driver.namespace)}/{sensor.fill_name(driver.node)}".strip("/")
        if driver
        else sensor.name
    )
    namespace = namespace_of(declared, spec.ros.namespace)
    return full_name(
        namespace, (declared.node.name if declared and declared.node else None) or node_name
    )


def driver_parameters(sensor: Sensor, prefix: str = "") -> dict[str, Any]:
    """Return the driver's parameters or launch arguments that follow from the sensor's entry."""
    driver = sensor.preset.driver
    if driver is None:
        return {}
    fill = _SensorFiller(sensor, prefix)
    named = _frame_names(sensor, driver)
    switch = (
        (driver.on if sensor.tf == DRIVER else driver.off or {}) if sensor.driver_frames() else {}
    )
    claims = {key: value for claim in claims_of(sensor) for key, value in claim.off.items()}
    return (
        fill.table(driver.args if driver.launch else driver.params)
        | named
        | fill.table(claims | switch)
    )


def claims_of(sensor: Sensor) -> tuple[DriverClaim, ...]:
    """Return the edges outside the sensor that its driver publishes by default.

    The mount edge is not included.
    """
    driver, declared = sensor.preset.driver, sensor.spec
    drivers = {sensor.name, declared.driver.process if declared.driver else None}
    return (
        () if driver is None or (declared.owner and declared.owner in drivers) else driver.claims
    )


def _node_parameters(
    sensor: Sensor, computed: dict[str, Any], *, launched: bool
) -> dict[str, Any]:
    """Return the parameters of the driver's node.

    A launch file takes arguments instead, and may pass on a parameter file.
    """
    driver = sensor.preset.driver
    if driver is None or not driver.launch:
        return computed
    return _SensorFiller(sensor, "").table(driver.params) if launched else {}


def _frame_names(sensor: Sensor, driver: PresetDriver) -> dict[str, str]:
    """Return the parameters that name frames, as ``${frame(…)}``, for existing frames."""
    inside = {sensor.fill_name(sensor.preset.mount), *sensor.frames()}
    frames = {key: sensor.fill_name(frame) for key, frame in driver.naming.items()}
    renamed = {
        name: override.name for name, override in sensor.spec.frames.items() if override.name
    }
    return {
        sensor.fill_name(key): f"${{frame({renamed.get(frame, frame)})}}"
        for key, frame in frames.items()
        if frame in inside
    }


class _SensorFiller:
    """Fills in a driver's parameters for a sensor. Parameters without a value are left out."""

    def __init__(self, sensor: Sensor, prefix: str) -> None:
        self.sensor = sensor
        self.prefix = prefix

    def table(self, table: dict[str, Any]) -> dict[str, Any]:
        filled = {self.sensor.fill_name(key): self.value(value) for key, value in table.items()}
        return {key: value for key, value in filled.items() if value is not None and value != ""}

    def value(self, value: Any) -> Any:
        if isinstance(value, Chosen):
            if value.option:
                return self.sensor.options.get(value.option)
            return self.value(
                value.value if self.sensor.holds(value.when or {}) else value.otherwise
            )
        if isinstance(value, str):
            return self.sensor.fill_name(value).replace("{prefix}", self.prefix)
        return value


def arguments(values: dict[str, Any]) -> list[str]:
    """Return the values as arguments of a launch file, NAME:=VALUE."""
    return [f"{key}:={_plain(value)}" for key, value in values.items()]


def _plain(value: Any) -> str:
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)


def _check_driver_names(sensor: Sensor, spec: RobotSpec) -> Iterator[Finding]:
    """Yield findings about names and parameters that the driver does not accept."""
    driver, declared = sensor.preset.driver, sensor.spec
    if driver is None or (declared.driver and (declared.driver.run or declared.driver.external)):
        return
    settings = settings_of(spec.ros)
    named = {sensor.fill_name(frame) for frame in driver.naming.values()}
    stamped = {
        sensor.fill_name(topic.frame)
        for topic in sensor.preset.topics.values()
        if sensor.holds(topic.when)
    }
    frames = (stamped | ({*sensor.driver_frames()} if sensor.tf == DRIVER else set())) - named
    path: Path = ("sensors", sensor.name)
    for name in sorted(
        frames & {frame for frame, described in declared.frames.items() if described.name}
    ):
        declared_name = declared.frames[name].name
        message = (
            f"the driver of {declared.preset} makes the name {name} itself, and cannot call it"
            f" {declared_name}"
        )
        span = spec.span_of((*path, "frames", name, "name"))
        advice = f"rename the sensor {sensor.name}, or keep the name"
        yield finding("TF604", message, span, help=advice)
    if (
        settings.frame_prefix
        and not driver.prefixed
        and frames & {*sensor.frames(), sensor.fill_name(sensor.preset.mount)}
    ):
        message = (
            f"the driver of {declared.preset} cannot write {settings.frame_prefix} in front of its"
            " frames"
        )
        advice = "ros: {isolate: topics} keeps robots apart without a prefix"
        yield finding("TF604", message, spec.key_span(path), help=advice)
    if (
        driver.launch
        and declared.driver
        and declared.driver.params
        and PARAMS_FILE not in driver.args.values()
    ):
        message = f"{driver.launch} of {declared.preset} takes no file of parameters"
        span = spec.key_span((*path, "driver", "params"))
        yield finding("TF604", message, span, help="driver: {run: {package: …, executable: …}}")


#: Words that a user may write for "no driver" and that YAML 1.2 reads as strings.
OFF = frozenset({"off", "Off", "OFF", "no", "No", "NO", "null", "None", "NONE", "disabled"})


def _check_driver(sensor: Sensor, name: str, validated: Validated) -> Iterator[Finding]:
    """Yield findings about a driver that is the name of a process.

    The process must exist. Other keys belong under the process, not under the driver.
    """
    path: Path = ("sensors", sensor.name, "driver")
    spec = validated.spec
    broken = (entry for section, entry in validated.broken if section in {"processes", "sensors"})
    names = [*dict.fromkeys([*spec.processes, *spec.sensors, *broken]), *BUILT_IN]
    if name != "none" and name not in names:
        declare = f"processes: {{{name}: {{external: true}}}}"
        otherwise = (
            f"leave driver out to start that of the preset; or {declare}"
            if sensor.preset.driver
            else declare
        )
        advice = did_you_mean(name, names, otherwise)
        if name in OFF:
            advice = "driver: none starts no driver"
        message = f"the driver of {sensor.name} is {name}, which is not a process"
        yield finding("TF813", message, spec.span_of(path), help=advice)
    driver = sensor.spec.driver
    for key in driver.model_fields_set - {"process"} if driver else ():
        span = spec.key_span((*path, key))
        advice = f"write it under processes: {name}"
        yield finding("TF107", f"{key} and process exclude each other", span, help=advice)


def _check_parameters(
    sensor: Sensor, computed: dict[str, Any], spec: RobotSpec
) -> Iterator[Finding]:
    """Yield a finding for each parameter that the user sets and tfcompose computes."""
    for key in sensor.spec.driver.params if sensor.spec.driver else ():
        if key in computed:
            message = (
                f"tfcompose sets {switch_text({key: computed[key]})} itself, for"
                f" {sensor.spec.preset}"
            )
            span = spec.key_span(("sensors", sensor.name, "driver", "params", key))
            yield finding("TF604", message, span, help="remove it; options and tf set it")
