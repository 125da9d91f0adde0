"""A part: its entry in the including robot file, and its content under the names there."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.renamed import Names, rename_robot
from tfcompose.compiler.urdf.blocks import with_joints, within
from tfcompose.foundation.findings import Finding, RejectedError, did_you_mean, finding
from tfcompose.model.fields import narrow
from tfcompose.model.plan import RosSettings
from tfcompose.model.robot import Part
from tfcompose.spec.language import ArgValue, as_part

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.language.robot import PartSpec, RobotSpec
    from tfcompose.spec.load import Path, Source

#: Valid prefixes.
_PREFIX = re.compile(r"([\w.:+@-]+/)*[\w.:+@-]*")


@dataclass(frozen=True, slots=True)
class Joined:
    """A part as the including robot sees it."""

    name: str
    declared: PartSpec
    robot: Robot
    #: The frame to attach to the including robot; None unless there is a single root.
    root: str | None
    #: Frames of the part that are also frames of the including robot.
    shared: frozenset[str]


@dataclass(slots=True)
class PartEntry:
    """An entry of ``parts`` during resolution."""

    name: str
    declared: PartSpec
    spec: RobotSpec
    outer_prefix: str
    findings: list[Finding] = field(default_factory=list)

    @property
    def path(self) -> Path:
        """The path of the entry in the robot file."""
        return ("parts", self.name)

    @property
    def span(self) -> Span:
        """The span of the part's name."""
        return self.spec.key_span(self.path)

    @property
    def prefix(self) -> str:
        """The prefix of the part's frames.

        This is the declared prefix, otherwise the namespace if ``isolate`` applies to frames.
        """
        if self.declared.prefix is not None:
            return self.declared.prefix
        namespace = (self.declared.namespace or "").strip("/")
        return f"{namespace}/" if namespace and self.spec.ros.isolate in {"frames", "both"} else ""

    @property
    def isolate(self) -> str:
        """The isolation of the part. Without a prefix, its frames are not isolated."""
        declared = self.spec.ros.isolate
        return (
            declared
            if self.prefix
            else {"both": "topics", "frames": "none"}.get(declared, declared)
        )

    @property
    def settings(self) -> RosSettings:
        """Settings of the part's processes: the holder's, with the part's namespace and prefix."""
        ros = self.spec.ros
        parts = (ros.namespace, self.declared.namespace or "")
        namespace = "/".join(part.strip("/") for part in parts if part.strip("/"))
        return narrow(
            RosSettings, ros, namespace=namespace, frame_prefix=f"{self.outer_prefix}{self.prefix}"
        )

    def given_args(self) -> dict[str, ArgValue]:
        """Return the values of the part's arguments that the including file sets."""
        path = (*self.path, "args")
        return {
            name: ArgValue(value, self.spec.span_of((*path, name)))
            for name, value in self.declared.args.items()
        }

    def overlay_on(self, inner: Source) -> Source:
        """Return the part's source, overlaid with the settings of the including robot."""
        settings = {
            "namespace": self.settings.namespace,
            "frame_prefix": self.settings.frame_prefix,
            "state_publisher": (
                self.spec.ros.state_publisher if self.declared.is_alone else "tfcompose"
            ),
            "isolate": self.isolate,
        }
        source, findings = as_part(
            inner, self.spec.spans, self.path, self.spec.ros, settings, self.declared.vars
        )
        self.findings += findings
        return source

    def join(self, robot: Robot, implied: frozenset[str] = frozenset()) -> Joined:
        """Return the part with its names in the including robot.

        ``implied`` are frames that only the including robot defines.

        Raises:
            RejectedError: if the prefix is invalid, or the root frame is unknown.
        """
        if not _PREFIX.fullmatch(self.prefix):
            span, advice = (
                self.spec.span_of((*self.path, "prefix")),
                "letters, digits and _: left_, or left/",
            )
            raise RejectedError(
                [finding("TF501", f"invalid prefix {self.prefix!r}", span, help=advice)]
            )
        shared = frozenset(robot.ros.shared_frames) & robot.frames.keys() | implied
        if self.declared.root is not None:
            robot = self._subtree(robot, self.declared.root)
        names = Names(self.name, self.prefix, shared, self.declared.is_alone)
        again = rename_robot(robot, names)
        if self.declared.owner is not None:
            span = self.spec.span_of((*self.path, "owner"))
            again = replace(
                again,
                edges=tuple(_with_owner(edge, self.declared.owner, span) for edge in again.edges),
            )
        if self.declared.is_alone:
            again = replace(again, parts=(Part(self.name, self.prefix, robot), *again.parts))
        return Joined(self.name, self.declared, again, self._root(robot, names), shared)

    def _subtree(self, robot: Robot, root: str) -> Robot:
        """Return the robot below ``root``."""
        if root not in robot.frames:
            if robot.tolerates(root):
                raise RejectedError([])
            span, advice = (
                self.spec.span_of((*self.path, "root")),
                did_you_mean(root, robot.frames),
            )
            raise RejectedError(
                [finding("TF203", f"the part {self.name} has no frame {root}", span, help=advice)]
            )
        return subtree(robot, root)

    def _root(self, robot: Robot, names: Names) -> str | None:
        """Return the frame to attach to the including robot, None unless there is a single root.

        Raises:
            RejectedError: if the part has a ``parent``, so that it needs a single root.
        """
        roots = [name for name in robot.roots() if name not in names.shared]
        if self.declared.parent is None or len(roots) == 1:
            return names.frame(roots[0]) if len(roots) == 1 else None
        if robot.broken:
            raise RejectedError([])  # the rejected entry may have defined the root or its parent
        held = (edge.parent for edge in robot.edges if edge.parent in names.shared)
        listed = ", ".join(roots or dict.fromkeys((*robot.roots(), *held)))
        what = f"has several roots: {listed}" if roots else f"is a child of {listed} already"
        span = self.spec.span_of((*self.path, "parent"))
        advice = (
            f"choose one: root: {roots[0]}"
            if roots
            else "leave parent out, or take a part of it: root: FRAME"
        )
        raise RejectedError([finding("TF313", f"the part {self.name} {what}", span, help=advice)])


def _with_owner(edge: Edge, owner: str, span: Span) -> Edge:
    """Return the edge with another owner: a fixed edge on /tf_static, a moving edge on /tf."""
    return replace(
        edge, owner=owner, owner_at=span, kind="static" if edge.kind == "static" else "dynamic"
    )


def subtree(robot: Robot, root: str) -> Robot:
    """Return the part of the robot below the frame ``root``, which becomes the base.

    Hardware, raw blocks and drivers are omitted if their joints, links or sensors are omitted.
    """
    frames = robot.below(root)
    edges = tuple(edge for edge in robot.edges if edge.child in frames and edge.child != root)
    sensors = tuple(sensor for sensor in robot.sensors if sensor.mount in frames)
    joints = {edge.joint_name for edge in edges if edge.joint_name}
    busy = {sensor.driver for sensor in sensors} | {edge.owner for edge in edges}
    unused = {sensor.driver for sensor in robot.sensors} - busy
    return replace(
        robot,
        frames={name: span for name, span in robot.frames.items() if name in frames},
        edges=edges,
        links={name: link for name, link in robot.links.items() if name in frames},
        processes=tuple(process for process in robot.processes if process.name not in unused),
        claims=tuple(
            claim
            for claim in robot.claims
            if {claim.parent, claim.child} <= frames or claim.child == root
        ),
        sensors=sensors,
        base=root,
        hardware=tuple(
            filter(None, (with_joints(hardware, joints) for hardware in robot.hardware))
        ),
        blocks=tuple(
            filter(None, (within(block, robot, frames, joints) for block in robot.blocks))
        ),
    )
