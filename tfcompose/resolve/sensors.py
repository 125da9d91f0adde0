"""Sensors on their mounts: the mount edge, the frames inside, the body and the driver of each."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.findings import did_you_mean, finding
from tfcompose.geometry import Pose
from tfcompose.model import STATIC, Edge, Link, MountedSensor
from tfcompose.resolve.drivers import claims_of, driver_process
from tfcompose.resolve.poses import Draft, rotation_of
from tfcompose.resolve.presets import DRIVER, TFCOMPOSE
from tfcompose.urdf.inertia import of_primitives

if TYPE_CHECKING:
    from tfcompose.findings import Span
    from tfcompose.language.preset import PresetFrame
    from tfcompose.language.robot import FrameOverride
    from tfcompose.load import Path
    from tfcompose.resolve.edges import Drafts
    from tfcompose.resolve.presets import Sensor


def add_sensor(drafts: Drafts, sensor: Sensor) -> None:
    """Take a sensor into the drafts of a robot."""
    _Mounting(drafts, sensor).add()


@dataclass(frozen=True, slots=True)
class _Mounting:
    """One sensor on its way into the drafts."""

    drafts: Drafts
    sensor: Sensor
    unknown: dict[str, str] = field(default_factory=dict)

    def add(self) -> None:
        drafts, sensor = self.drafts, self.sensor
        mount = self.renamed(sensor.named(sensor.preset.mount))
        drafts.frames.setdefault(mount, self.place())
        drafts.add(("sensors", sensor.name), sensor.spec.parent, mount, sensor.spec, sensor=sensor)
        publisher = self.publisher()
        for name, frame in sensor.frames().items():
            self.add_frame(name, frame, publisher)
        self.ask()
        self.check_overrides(mount)
        self.add_body()
        drafts.sensors.append(self.mounted(mount))

    def place(self, *keys: str) -> Span:
        """Return the place of the sensor, or of the value of a key in it."""
        at: Path = ("sensors", self.sensor.name, *keys)
        return self.drafts.source.at(at) if keys else self.drafts.source.at_key(at)

    def renamed(self, name: str) -> str:
        own = self.sensor.spec.frames.get(name)
        return own.name if own and own.name else name

    def add_frame(self, name: str, frame: PresetFrame, publisher: str) -> None:
        """Take one frame inside the sensor: the unit's own value before the preset's."""
        own, final = self.sensor.spec.frames.get(name), self.renamed(name)
        parent = self.sensor.parent_of(name, frame)
        pose, measured = self.pose_of(name, frame, own)
        owner = publisher if frame.driver else STATIC
        kind = "dynamic" if frame.driver == "dynamic" and owner != STATIC else "static"
        self.drafts.frames.setdefault(final, self.place())
        nominal = frame.nominal and not measured
        edge = Edge(
            self.renamed(parent), final, "dynamic" if kind == "dynamic" else "static", pose, owner, self.place(),
            given=False, sensor=self.sensor.name, nominal=nominal, other_axes=frame.other_axes,
        )  # fmt: skip
        self.drafts.edges.append(Draft(edge))

    def pose_of(self, name: str, frame: PresetFrame, own: FrameOverride | None) -> tuple[Pose, bool]:
        """Return the frame's pose in its parent, and whether it is the unit's own; note what nobody knows."""
        at, written = frame.xyz, rotation_of(frame, name)
        if frame.by_driver and self.sensor.tf == DRIVER:
            at, written = frame.by_driver.xyz or at, rotation_of(frame.by_driver, name) or written
        turned = rotation_of(own, name) if own else None
        unknown = ["xyz: [x, y, z]"] if at is None and not (own and own.xyz) else []
        if at is None and written is None and turned is None:
            unknown.append("rpy: [roll, pitch, yaw]")
        if unknown:
            self.unknown[name] = f"{name}: {{{', '.join(unknown)}}}"
        xyz = (own.xyz if own else None) or at or (0.0, 0.0, 0.0)
        return Pose(xyz, turned or written or Pose().quat_xyzw), bool(own and (own.xyz or turned))

    def ask(self) -> None:
        """Note where nobody knows where frames are, with what to write."""
        if self.unknown:
            sensor, first = self.sensor, next(iter(self.unknown))
            *others, last = self.unknown
            names = f"{', '.join(others)} and {last} are" if others else f"{last} is"
            parent = "" if others else f" in {sensor.parent_of(first, sensor.frames()[first])}"
            message = f"{sensor.spec.preset} does not know where {names}{parent}"
            frames = ", ".join(self.unknown.values())
            advice = f"measure, and write: sensors: {{{sensor.name}: {{frames: {{{frames}}}}}}}"
            self.drafts.found.append(finding("TF605", message, self.place("preset"), help=advice))

    def publisher(self) -> str:
        """Return who publishes the frames inside the sensor that a driver can publish; note what cannot be."""
        sensor, said, driver = self.sensor, self.sensor.spec, self.sensor.preset.driver
        named = said.driver.process if said.driver else None
        process, found = driver_process(sensor, self.drafts.validated)
        self.drafts.found += found
        if process:
            self.drafts.drivers.append(process)
        elif found:
            return STATIC
        if sensor.tf == DRIVER:
            return named or sensor.name
        if said.tf == DRIVER:
            why = "driver is none" if named == "none" else f"{said.preset} has no driver"
            if driver and named != "none":
                why = f"that of {said.preset} publishes none" + (" with these options" if _can(sensor) else "")
            self.refuse(f"{sensor.name}: the driver cannot publish its frames: {why}", "tf: tfcompose")
        elif said.tf == TFCOMPOSE and driver and named is None and driver.off is None and sensor.driven():
            message = f"{sensor.name}: the driver of {said.preset} has no switch for its frames"
            self.refuse(message, "tf: driver; or driver: none, where there is no device")
        return STATIC

    def refuse(self, message: str, advice: str) -> None:
        self.drafts.found.append(finding("TF604", message, self.place("tf"), help=advice))

    def mounted(self, mount: str) -> MountedSensor:
        """Return what the rules see of the sensor."""
        sensor, said, preset = self.sensor, self.sensor.spec, self.sensor.preset
        named = said.driver.process if said.driver else None
        own = sensor.name if any(process.name == sensor.name for process in self.drafts.drivers) else ""
        serial = next((option for option in ("serial", "serial_number") if option in preset.options), "")
        return MountedSensor(
            sensor.name,
            said.preset,
            preset.kind,
            self.place(),
            mount,
            tuple(self.renamed(name) for name in sensor.frames()),
            tuple(self.renamed(name) for name in sensor.driven()),
            "" if named == "none" else named or own,
            preset.driver.off if preset.driver else None,
            sensor.tf == DRIVER,
            {f"{claim.parent} → {self.renamed(sensor.named(claim.child))}": claim.off for claim in claims_of(sensor)},
            serial,
            sensor.options.get(serial) if serial else None,
            self.place("tf"),
        )

    def check_overrides(self, mount: str) -> None:
        sensor, source = self.sensor, self.drafts.source
        original = sensor.named(sensor.preset.mount)
        known = [*sensor.frames(), original]
        at: Path = ("sensors", sensor.name, "frames")
        for name, own in sensor.spec.frames.items():
            place = source.at_key((*at, name))
            if name not in known:
                advice = did_you_mean(name, known, f"there is {', '.join(known)}")
                self.drafts.found.append(finding("TF203", f"{sensor.name} has no frame {name}", place, help=advice))
            elif own.parent and own.parent not in known:
                advice = did_you_mean(own.parent, known, f"there is {', '.join(known)}")
                message = f"{sensor.name} has no frame {own.parent}"
                self.drafts.found.append(finding("TF203", message, source.at((*at, name, "parent")), help=advice))
        mounted = sensor.spec.frames.get(original)
        if mounted and (mounted.xyz or mounted.parent or rotation_of(mounted)):
            advice = f"the pose of {sensor.name} itself says where it is"
            message = f"{mount} is the mount, and has no pose inside"
            self.drafts.found.append(finding("TF106", message, source.at_key((*at, original)), help=advice))
        if mount in sensor.frames():
            message = f"{mount} is a frame inside {sensor.name} already"
            self.drafts.found.append(finding("TF604", message, self.drafts.frames[mount], help="another name"))

    def add_body(self) -> None:
        body = self.sensor.preset.body
        if body is None:
            return
        frame = self.renamed(self.sensor.named(body.frame))
        if frame in self.drafts.links:
            return
        shape = self.drafts.bodies.shape(body.shape, ("sensors", self.sensor.name))
        inertial = of_primitives(body.mass, (shape,)) if body.mass and not shape.mesh else None
        self.drafts.links[frame] = Link(frame, self.place(), (shape,), (shape,), inertial)


def _can(sensor: Sensor) -> bool:
    return any(frame.driver for frame in sensor.preset.frames.values())
