"""One entry of ``parts``: what is laid over the part, which of it is taken, and its names in the holder."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, Note, RejectedError, did_you_mean, finding
from tfcompose.language import lay_over
from tfcompose.load import Place, Source
from tfcompose.model import Part
from tfcompose.plan import RosSettings
from tfcompose.resolve.renamed import Names, renamed
from tfcompose.resolve.subtree import subtree

if TYPE_CHECKING:
    from tfcompose.findings import Span
    from tfcompose.language.robot import PartSpec, RobotSpec
    from tfcompose.load import Path
    from tfcompose.model import Edge, Robot

#: What may stand in front of names so that they can be looked up.
_PREFIX = re.compile(r"([\w.:+@-]+/)*[\w.:+@-]*")
#: What all processes of a plan share; a part cannot have its own.
_SHARED_SETTINGS = ("clock", "domain_id", "discovery")


@dataclass(frozen=True, slots=True)
class Joined:
    """A part as its holder sees it. ``root`` is the frame that is bolted on, None if there is no single one.

    ``shared`` are those of its frames that are the holder's too.
    """

    name: str
    said: PartSpec
    robot: Robot
    root: str | None
    shared: frozenset[str]

    @property
    def alone(self) -> bool:
        """Whether it is a robot of its own beside the others, with joint states of its own."""
        return bool((self.said.namespace or "").strip("/"))


@dataclass(slots=True)
class PartEntry:
    """One entry of ``parts`` while it is resolved."""

    name: str
    said: PartSpec
    spec: RobotSpec
    source: Source
    outer_prefix: str
    is_broken: bool = False
    found: list[Finding] = field(default_factory=list)

    @property
    def at(self) -> Path:
        """Where it is written."""
        return ("parts", self.name)

    @property
    def place(self) -> Span:
        """The place of its name."""
        return self.source.at_key(self.at)

    @property
    def alone(self) -> bool:
        """Whether it is a robot of its own beside the others."""
        return bool((self.said.namespace or "").strip("/"))

    @property
    def prefix(self) -> str:
        """What is written in front of its frames: what is said, or the namespace where frames are isolated by it."""
        if self.said.prefix is not None:
            return self.said.prefix
        namespace = (self.said.namespace or "").strip("/")
        return f"{namespace}/" if namespace and self.spec.ros.isolate in {"frames", "both"} else ""

    @property
    def isolate(self) -> str:
        """How it is isolated. Where it has no prefix, its frames are not."""
        said = self.spec.ros.isolate
        return said if self.prefix else {"both": "topics", "frames": "none"}.get(said, said)

    @property
    def settings(self) -> RosSettings:
        """What its processes share: the holder's, below its own namespace and with its own prefix."""
        ros = self.spec.ros
        parts = (ros.namespace, self.said.namespace or "")
        namespace = "/".join(part.strip("/") for part in parts if part.strip("/"))
        prefix = f"{self.outer_prefix}{self.prefix}"
        return RosSettings(namespace, ros.domain_id, ros.discovery, ros.clock, prefix, tuple(ros.shared_frames))

    def laid_over(self, inner: Source) -> Source:
        """Return the part's source with what the holder says about all its parts laid over it."""
        ros = self.spec.ros
        own: Any = inner.data.get("ros")
        for key in _SHARED_SETTINGS:
            wanted = getattr(ros, key)
            if isinstance(own, dict) and key in own and own[key] != wanted:
                message = f"{key} of the part {self.name} is {own[key]}, and of the robot that holds it {wanted}"
                notes = [Note("it is said here", inner.at(("ros", key)))]
                advice = f"ros: {{{key}: {own[key]}}} here, or leave it out there"
                self.found.append(finding("TF312", message, self.place, notes=notes, help=advice))
        shared = _named_in(inner.data)
        settings = {
            "namespace": self.settings.namespace,
            "frame_prefix": self.settings.frame_prefix,
            "shared_frames": [name for name in ros.shared_frames if name in shared],
            "state_publisher": ros.state_publisher if self.alone else "tfcompose",
            "isolate": self.isolate,
            **{key: getattr(ros, key) for key in _SHARED_SETTINGS if getattr(ros, key) is not None},
        }
        here = Place(self.place)
        inside = {"ros": Place(self.place, dict.fromkeys(settings, here), dict.fromkeys(settings, here))}
        data: dict[str, Any] = {"ros": settings}
        if self.said.vars:
            data["vars"] = dict(self.said.vars)
            inside["vars"] = self.source.places.nearest((*self.at, "vars"))
        over = Source(self.source.file, data, Place(self.place, inside, dict.fromkeys(data, here)), has_nulls=False)
        return lay_over(inner, over, is_overlay=False)

    def joined(self, robot: Robot, implied: frozenset[str] = frozenset()) -> Joined:
        """Return the part under the names that it has in the holder; ``implied`` are frames that only that has."""
        if not _PREFIX.fullmatch(self.prefix):
            at, advice = self.source.at((*self.at, "prefix")), "letters, digits and _: left_, or left/"
            raise RejectedError([finding("TF501", f"{self.prefix!r} is no good prefix", at, help=advice)])
        shared = frozenset(robot.ros.shared_frames) & robot.frames.keys() | implied
        if self.said.root is not None:
            robot = self._subtree(robot, self.said.root)
        names = Names(self.name, self.prefix, shared, self.alone)
        again = renamed(robot, names)
        if self.said.owner is not None:
            at = self.source.at((*self.at, "owner"))
            again = replace(again, edges=tuple(_owned(edge, self.said.owner, at) for edge in again.edges))
        if self.alone:
            again = replace(again, parts=(Part(self.name, self.prefix, robot), *again.parts))
        return Joined(self.name, self.said, again, self._root(robot, names), shared)

    def _subtree(self, robot: Robot, root: str) -> Robot:
        """Return what is below ``root``."""
        if root not in robot.frames:
            if robot.excuses(root):
                raise RejectedError([])
            at, advice = self.source.at((*self.at, "root")), did_you_mean(root, robot.frames)
            raise RejectedError([finding("TF203", f"the part {self.name} has no frame {root}", at, help=advice)])
        return subtree(robot, root)

    def _root(self, robot: Robot, names: Names) -> str | None:
        """Return the frame that the holder bolts on; to have none, or several, is wrong only if it has to be one."""
        roots = [name for name in robot.roots() if name not in names.shared]
        if self.said.parent is None or len(roots) == 1:
            return names.frame(roots[0]) if len(roots) == 1 else None
        if robot.broken:
            raise RejectedError([])  # what would be the root, or would hang on it, was refused
        held = (edge.parent for edge in robot.edges if edge.parent in names.shared)
        listed = ", ".join(roots or dict.fromkeys((*robot.roots(), *held)))
        what = f"has several roots: {listed}" if roots else f"hangs on {listed} already"
        at = self.source.at((*self.at, "parent"))
        advice = f"say which: root: {roots[0]}" if roots else "leave parent out, or take a part of it: root: FRAME"
        raise RejectedError([finding("TF313", f"the part {self.name} {what}", at, help=advice)])


def _owned(edge: Edge, owner: str, at: Span) -> Edge:
    """Return the edge of another owner, who sends what is fixed on /tf_static and what moves on /tf."""
    return replace(edge, owner=owner, owner_at=at, kind="static" if edge.kind == "static" else "dynamic")


def _named_in(data: dict[str, Any]) -> set[str]:
    """Return every name that the written data use for a frame."""
    names: set[str] = set()
    for section in ("frames", "links", "joints", "sensors"):
        entries = data.get(section)
        for name, entry in entries.items() if isinstance(entries, dict) else ():
            names.add(name)
            if isinstance(entry, dict):
                names.update(entry[key] for key in ("parent", "child") if isinstance(entry.get(key), str))
    return names
