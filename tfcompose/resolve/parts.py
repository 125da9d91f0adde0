"""Parts: another robot file as a subtree, or as a robot beside others on one map.

A part is resolved like any robot, with what the holder says laid over it: values of variables, the prefix, the
namespace, the shared frames and the isolation. Then it gets the names that it has in the holder.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Allow, Diagnostic, Note, RejectedError, did_you_mean, finding
from tfcompose.load import Place, Source, composed, lay_over, load, with_includes
from tfcompose.model import Part
from tfcompose.resolve.beside import beside
from tfcompose.resolve.renamed import Names, renamed
from tfcompose.validate import validate

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.diagnostic import Span
    from tfcompose.load import Path
    from tfcompose.model import Robot
    from tfcompose.resolve.library import Library
    from tfcompose.resolve.packages import Disk
    from tfcompose.resolve.resolve import Resolved
    from tfcompose.validate.part import PartSpec
    from tfcompose.validate.spec import RobotSpec

    Reader = Callable[[str], str]

#: How many parts a robot may have, those of its parts counted.
MOST_PARTS = 100

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


@dataclass(slots=True)
class Parts:
    """Resolves the parts of one robot file, and theirs. ``resolve`` is what resolves a robot within these ``files``."""

    library: Library
    read: Reader | None
    disk: Disk | None
    resolve: Callable[..., Resolved]
    files: tuple[str, ...] = ()
    counted: list[str] = field(default_factory=list)
    found: list[Diagnostic] = field(default_factory=list)
    missing: list[tuple[str, str]] = field(default_factory=list)
    allows: list[Allow] = field(default_factory=list)

    def join(self, spec: RobotSpec, source: Source, prefix: str) -> list[Joined]:
        """Return the parts of a robot whose own frames have the prefix; those that cannot be had are findings."""
        joined = []
        for name, said in spec.parts.items():
            part = _Part(name, said, spec, source, prefix)
            try:
                joined.append(part.joined(self._resolved(part)))
                self.found += part.found
            except RejectedError as error:
                self.found += [*part.found, *error.diagnostics]
                self.missing += [("parts", begin) for begin in (f"{name}/", part.prefix) if begin]
        return joined

    def _resolved(self, part: _Part) -> Robot:
        at = part.source.at((*part.at, "spec"))
        file = beside(part.said.spec, at)
        self.counted.append(file)
        if file in self.files:
            circle = " → ".join([*self.files[self.files.index(file) :], file])
            raise RejectedError([finding("TF015", f"robots are parts of each other: {circle}", at)])
        if self.read is None or len(self.counted) > MOST_PARTS:
            message = f"more than {MOST_PARTS} parts" if self.read else f"{file}: files cannot be read here"
            raise RejectedError([finding("TF008", message, at)])
        inside = replace(self, files=(*self.files, file), found=[], missing=[])
        try:
            loaded = with_includes(load(self.read(file), file), self.read)
            validated = validate(part.laid_over(composed(loaded, part.said.profiles)))
            resolved = self.resolve(validated, self.library, self.read, self.disk, inside)
        except RejectedError as error:
            raise RejectedError([_noted(one, part) for one in error.diagnostics]) from None
        self.found += [_noted(one, part) for one in (*validated.found, *resolved.found)]
        self.allows += validated.source.allows
        known = loaded.data.get("vars") or {}
        for name in validated.unused:
            if name in part.said.vars and name not in known:
                at = part.source.at_key((*part.at, "vars", name))
                advice = did_you_mean(name, known, "remove it")
                self.found.append(finding("TF105", f"{file} has no use for the variable {name}", at, help=advice))
        return resolved.robot


def _noted(found: Diagnostic, part: _Part) -> Diagnostic:
    return replace(found, notes=(*found.notes, Note(f"as the part {part.name}", part.place)))


@dataclass(slots=True)
class _Part:
    """One entry of ``parts`` while it is resolved."""

    name: str
    said: PartSpec
    spec: RobotSpec
    source: Source
    outer_prefix: str
    found: list[Diagnostic] = field(default_factory=list)

    @property
    def at(self) -> Path:
        return ("parts", self.name)

    @property
    def place(self) -> Span:
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
        parts = (ros.namespace, self.said.namespace or "")
        settings = {
            "namespace": "/".join(part.strip("/") for part in parts if part.strip("/")),
            "frame_prefix": f"{self.outer_prefix}{self.prefix}",
            "shared_frames": [name for name in ros.shared_frames if name in _named_in(inner.data)],
            "state_publisher": ros.state_publisher if self.alone else "tfcompose",
            "isolate": ros.isolate if self.prefix else _topics_only(ros.isolate),
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

    def joined(self, robot: Robot) -> Joined:
        """Return the part under the names that it has in the holder."""
        shared = frozenset(robot.ros.shared_frames)
        if self.said.root is not None:
            robot = self._cut(robot, self.said.root)
        names = Names(self.name, self.prefix, shared, self.alone)
        again = renamed(robot, names)
        if self.said.owner is not None:
            again = replace(again, edges=tuple(replace(edge, owner=self.said.owner) for edge in again.edges))
        if self.alone:
            again = replace(again, parts=(Part(self.name, self.prefix, robot), *again.parts))
        return Joined(self.name, self.said, again, self._root(robot, names), shared)

    def _cut(self, robot: Robot, root: str) -> Robot:
        """Return what is below ``root``."""
        if root not in robot.frames:
            at, advice = self.source.at((*self.at, "root")), did_you_mean(root, robot.frames)
            raise RejectedError([finding("TF203", f"{self.said.spec} has no frame {root}", at, help=advice)])
        children, below, waiting = robot.children(), {root}, [root]
        while waiting:
            new = [edge.child for edge in children.get(waiting.pop(), []) if edge.child not in below]
            below.update(new)
            waiting += new
        return replace(
            robot,
            frames={name: at for name, at in robot.frames.items() if name in below},
            edges=tuple(edge for edge in robot.edges if edge.child in below and edge.child != root),
            links={name: link for name, link in robot.links.items() if name in below},
            sensors=tuple(sensor for sensor in robot.sensors if sensor.mount in below),
            base=root,
        )

    def _root(self, robot: Robot, names: Names) -> str | None:
        """Return the frame that the holder bolts on; to have none, or several, is wrong only if it has to be one."""
        roots = [name for name in robot.roots() if name not in names.shared]
        if self.said.parent is None or len(roots) == 1:
            return names.frame(roots[0]) if len(roots) == 1 else None
        what = f"several roots: {', '.join(roots)}" if roots else "only roots that are shared"
        at = self.source.at((*self.at, "parent"))
        advice = f"say which: root: {roots[0]}" if roots else "leave parent out"
        raise RejectedError([finding("TF313", f"the part {self.name} has {what}", at, help=advice)])


def _topics_only(isolate: str) -> str:
    """Return the isolation without that of frames, which the prefix does."""
    return {"both": "topics", "frames": "none"}.get(isolate, isolate)


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
