"""Edges as the user gave them: frames, links with a parent, joints and sensors; each with its owner."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.diagnostic import Diagnostic, Note, Span, did_you_mean, finding
from tfcompose.model import JOINTS, STATIC, Edge, Joint, Link, MountedSensor, Process
from tfcompose.pose import Pose
from tfcompose.resolve.bodies import Bodies, inertial_of
from tfcompose.resolve.joints import FREE, joint_of
from tfcompose.resolve.poses import Draft, pose_of, rotation_of
from tfcompose.resolve.processes import driver_process

if TYPE_CHECKING:
    from tfcompose.load import Path, Source
    from tfcompose.plan import EdgeKind
    from tfcompose.resolve.parts import Joined
    from tfcompose.resolve.presets import Sensor
    from tfcompose.validate.edges import EdgeKeys
    from tfcompose.validate.spec import RobotSpec


@dataclass(slots=True)
class Drafts:
    """What is known of a robot while it is resolved."""

    spec: RobotSpec
    source: Source
    simulated: frozenset[str]
    bodies: Bodies
    frames: dict[str, Span] = field(default_factory=dict)
    edges: list[Draft] = field(default_factory=list)
    links: dict[str, Link] = field(default_factory=dict)
    drivers: list[Process] = field(default_factory=list)
    sensors: list[MountedSensor] = field(default_factory=list)
    found: list[Diagnostic] = field(default_factory=list)

    def add_frames(self) -> None:
        """Take the bare frames; one without a parent is a root, said so."""
        for name, frame in self.spec.frames.items():
            self.frames.setdefault(name, self.source.at_key(("frames", name)))
            if frame.parent is not None:
                self._add(("frames", name), frame.parent, name, frame)

    def add_links(self) -> None:
        """Take the bodies; one with a parent has a fixed edge."""
        for name, link in self.spec.links.items():
            at = self.source.at_key(("links", name))
            self.frames.setdefault(name, at)
            self.links[name] = self.bodies.link(name, link)
            if link.parent is not None:
                self._add(("links", name), link.parent, name, link)

    def add_joints(self) -> None:
        """Take the edges between bodies."""
        for name, joint in self.spec.joints.items():
            moving = joint_of(name, joint, self.source.at_key(("joints", name)))
            self._add(("joints", name), joint.parent, joint.child, joint, joint=moving, joint_name=name)

    def add_sensor(self, sensor: Sensor) -> None:
        """Take a sensor: its mount edge, the frames inside it, its body and its driver."""
        at: Path = ("sensors", sensor.name)
        place, said = self.source.at_key(at), sensor.spec
        mount = self._renamed(sensor, sensor.named(sensor.preset.mount))
        self.frames.setdefault(mount, place)
        self._add(at, said.parent, mount, said, sensor=sensor)
        publisher = self._publisher(sensor)
        for name, frame in sensor.frames().items():
            final, own = self._renamed(sensor, name), said.frames.get(name)
            pose = pose_of(frame, final)
            turned = rotation_of(own, final) if own else None
            if own:
                pose = Pose(own.xyz or pose.xyz, turned or pose.quat_xyzw)
            measured = bool(own and (own.xyz or turned))
            owner = publisher if frame.driver else STATIC
            self.frames.setdefault(final, place)
            parent = self._renamed(sensor, sensor.named(frame.parent))
            edge = Edge(
                parent, final, "static", pose, owner, place,
                given=False, sensor=sensor.name, nominal=frame.nominal and not measured,
            )  # fmt: skip
            self.edges.append(Draft(edge))
        self._check_overrides(sensor, mount)
        self._add_body(sensor)
        self.sensors.append(self._mounted(sensor, mount))

    def add_part(self, part: Joined) -> bool:
        """Take a part: its frames, edges and bodies under the names that they have here, and its mount edge.

        Return False, and take nothing, if it brings names that are there already.
        """
        robot, at = part.robot, ("parts", part.name)
        hanging = {edge.child for edge in robot.edges}
        free = part.shared | (self.spec.frames.keys() - hanging)  # a free root can have its edge here
        taken = [name for name in robot.frames if name in self.frames and name not in free]
        if taken:
            self._refuse_names(taken, part)
            return False
        for name, place in robot.frames.items():
            self.frames.setdefault(name, place)
        for name, link in robot.links.items():
            self.links.setdefault(name, link)
        if part.said.parent is not None and part.root is not None:
            self._add(at, part.said.parent, part.root, part.said, owner=STATIC, part=part.name)
        self.edges += [Draft(edge, part=part.name) for edge in robot.edges]
        self.sensors += robot.sensors
        return True

    def _refuse_names(self, taken: list[str], part: Joined) -> None:
        first, more = taken[0], f" and {len(taken) - 1} more" if taken[1:] else ""
        notes = [Note(f"{first} stands here", self.frames[first]), Note("and here", part.robot.frames[first])]
        advice = f"a prefix of its own, prefix: {part.name}/; or ros: {{shared_frames: [{first}]}}"
        message = f"the part {part.name} brings the frame {first}{more}, which is there already"
        place = self.source.at_key(("parts", part.name))
        self.found.append(finding("TF505", message, place, notes=notes, help=advice))

    def _add(  # noqa: PLR0913 (an edge has that many parts)
        self,
        at: Path,
        parents: tuple[str, ...],
        child: str,
        keys: EdgeKeys,
        *,
        joint: Joint | None = None,
        joint_name: str = "",
        sensor: Sensor | None = None,
        owner: str | None = None,
        part: str | None = None,
    ) -> None:
        free = joint if joint and joint.type in FREE else None
        joint = None if free else joint
        owner = owner or keys.owner or (JOINTS if joint else STATIC)
        place: str | None = getattr(keys, "place", None)
        edge = Edge(
            parent=parents[0],
            child=child,
            kind=self._kind(owner, keys, joint),
            pose=pose_of(keys, place or child),
            owner=owner,
            at=self.source.at((*at, "parent")),
            rate=keys.rate,
            joint=joint,
            free=free,
            joint_name=joint_name,
            child_at=self.source.at((*at, "child")) if joint_name else None,
            owner_at=self.source.at((*at, "owner")) if keys.owner else None,
            sensor=sensor.name if sensor else None,
            rate_at=self.source.at((*at, "rate")) if keys.rate else None,
            switched=parents[1:],
        )
        relative_at = self.source.at((*at, "relative_to")) if keys.relative_to else None
        place_at = self.source.at((*at, "place")) if place else None
        self.edges.append(Draft(edge, keys.relative_to, relative_at, place, place_at, at, part))

    def _kind(self, owner: str, keys: EdgeKeys, joint: Joint | None) -> EdgeKind:
        if owner == STATIC:
            return "static"
        if joint and owner == JOINTS:
            return "joint"
        return "static" if keys.static and owner not in self.simulated else "dynamic"

    def _renamed(self, sensor: Sensor, name: str) -> str:
        own = sensor.spec.frames.get(name)
        return own.name if own and own.name else name

    def _publisher(self, sensor: Sensor) -> str:
        """Return who publishes the frames inside the sensor that a driver can publish; note what cannot be."""
        said, driver, own = sensor.spec, sensor.preset.driver, sensor.spec.driver
        named = own.process if own else None
        process, found = driver_process(sensor, self.spec, self.source, publishes=said.tf != "tfcompose")
        self.found += found
        if process:
            self.drivers.append(process)
        elif found:
            return STATIC
        place = self.source.at(("sensors", sensor.name, "tf"))
        if named == "none" or driver is None:
            if said.tf == "driver":
                why = "driver is none" if named == "none" else f"{said.preset} has no driver"
                self._refuse(f"{sensor.name}: the driver cannot publish its frames: {why}", place, "tf: tfcompose")
            return STATIC
        if said.tf != "tfcompose":
            return named or sensor.name
        if named is None and driver.switch is None:
            message = f"{sensor.name}: the driver of {said.preset} has no switch for its frames"
            self._refuse(message, place, "tf: driver")
        return STATIC

    def _mounted(self, sensor: Sensor, mount: str) -> MountedSensor:
        """Return what the rules see of the sensor."""
        said, preset, driver = sensor.spec, sensor.preset, sensor.preset.driver
        inside = sensor.frames()
        named = said.driver.process if said.driver else None
        own = sensor.name if any(process.name == sensor.name for process in self.drivers) else ""
        serial = next((option for option in ("serial", "serial_number") if option in preset.options), "")
        return MountedSensor(
            sensor.name,
            said.preset,
            preset.kind,
            self.source.at_key(("sensors", sensor.name)),
            mount,
            tuple(self._renamed(sensor, name) for name in inside),
            tuple(self._renamed(sensor, name) for name, frame in inside.items() if frame.driver),
            "" if named == "none" else named or own,
            driver.switch if driver else None,
            said.tf != "tfcompose",
            serial,
            sensor.options.get(serial) if serial else None,
            self.source.at(("sensors", sensor.name, "tf")),
        )

    def _refuse(self, message: str, place: Span, advice: str) -> None:
        self.found.append(finding("TF604", message, place, help=advice))

    def _check_overrides(self, sensor: Sensor, mount: str) -> None:
        known = [*sensor.frames(), sensor.named(sensor.preset.mount)]
        for name in sensor.spec.frames:
            if name not in known:
                place = self.source.at_key(("sensors", sensor.name, "frames", name))
                advice = did_you_mean(name, known, f"there is {', '.join(known)}")
                self.found.append(finding("TF203", f"{sensor.name} has no frame {name}", place, help=advice))
        mounted = sensor.spec.frames.get(sensor.named(sensor.preset.mount))
        if mounted and (mounted.xyz or rotation_of(mounted)):
            place = self.source.at_key(("sensors", sensor.name, "frames", sensor.named(sensor.preset.mount)))
            advice = f"the pose of {sensor.name} itself says where it is"
            self.found.append(finding("TF106", f"{mount} is the mount, and has no pose inside", place, help=advice))
        if mount in sensor.frames():
            self._refuse(f"{mount} is a frame inside {sensor.name} already", self.frames[mount], "another name")

    def _add_body(self, sensor: Sensor) -> None:
        body = sensor.preset.body
        if body is None:
            return
        frame = self._renamed(sensor, sensor.named(body.frame))
        if frame in self.links:
            return
        shape = self.bodies.shape(body.shape, ("sensors", sensor.name))
        inertial = inertial_of(body.mass, (shape,)) if body.mass and not shape.mesh else None
        place = self.source.at_key(("sensors", sensor.name))
        self.links[frame] = Link(frame, place, (shape,), (shape,), inertial)
