"""Import of an observed tree, live or from a bag, into the draft of a robot file."""

from __future__ import annotations

import math
import posixpath
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.presets import DRIVER, TFCOMPOSE
from tfcompose.foundation.findings import Span
from tfcompose.foundation.numbers import number
from tfcompose.foundation.yaml_text import flow
from tfcompose.model.plan.stock import STATE_PUBLISHER
from tfcompose.model.robot import Edge, Robot
from tfcompose.tools.importers.draft import pose_keys
from tfcompose.tools.importers.robot_file import sensor_keys
from tfcompose.tools.importers.sensors import recognise

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from tfcompose.compiler.resolve import Library
    from tfcompose.foundation.geometry import Pose
    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tools.importers.draft import ImportDraft
    from tfcompose.tools.importers.sensors import Recognised

#: Process that owns moving edges whose publisher is unknown, as in a bag.
RECORDED = "recorded"
#: The node of tfcompose that publishes fixed edges.
STATIC = "tfcompose_static"
#: The largest relative difference at which a round rate replaces a measured rate.
_NEAR = 0.03
_PID = re.compile(r"as pid (\d+)")
_STEPS = (1, 2, 2.5, 3, 4, 5, 6, 7.5, 8, 10)


@dataclass(slots=True)
class Observed:
    """Import of one observation into a draft."""

    draft: ImportDraft
    #: A function that returns the machine and process of a publisher, by its id.
    where: Callable[[bytes | None], str]
    #: A function that returns the command line of a process on this machine; empty if unknown.
    words_of: Callable[[int], Sequence[str]]
    #: The robot's namespace, without slashes.
    namespace: str = ""
    _owners: dict[str, str] = field(default_factory=dict)
    _poses: dict[str, Pose] = field(default_factory=dict)

    def add(self, edges: Iterable[EdgeState]) -> None:
        """Add the edges, parents before children, and their owners."""
        accepted = [edge for edge in edges if edge.stream.rejections < edge.stream.arrivals.count]
        for edge in _parents_first(accepted):
            self._edge(edge)

    def _edge(self, edge: EdgeState) -> None:
        stream, frames = edge.stream, self.draft.sections["frames"]
        path = ("frames", edge.child)
        if edge.child in frames:
            if edge.present is not False:
                publisher = edge.publisher or "another publisher"
                self.draft.todo(f"{publisher} publishes {edge.name} as well", None, path)
            return
        frames[edge.child] = {}  # keep the position of the entry; the owner follows
        if stream.static:
            self._poses[edge.child] = stream.pose
        owner = None if stream.static and self._is_own(edge) else self._owner(edge)
        keys: dict[str, Any] = {"parent": edge.parent}
        if stream.static:
            keys |= pose_keys(stream.pose, quaternion=True)
            keys |= {"owner": owner, "static": True} if owner else {}
        else:
            keys |= {"owner": owner}
            rate = round_rate(edge.timing.rate)
            keys |= {"rate": f"{number(rate)} Hz"} if rate else {}
        frames[edge.child] = keys

    def _is_own(self, edge: EdgeState) -> bool:
        """Return whether tfcompose's static publisher or a stock node sends the edge."""
        below = f"/{self.namespace}/" if self.namespace else "/"
        if self.draft.is_adopted:
            return edge.nodes == (below + STATIC,)
        return len(edge.nodes) == 1 and edge.nodes[0] in {below + STATIC, below + STATE_PUBLISHER}

    def recognise(self, library: Library) -> None:
        """Replace fixed frames by sensors, if presets describe the frames.

        All frames that the driver of a sensor publishes must have the same owner. The other frames
        of the sensor must have no owner.
        """
        frames = self.draft.sections["frames"]
        for publisher in (DRIVER, TFCOMPOSE):
            sensors, undecided = recognise(self._fixed_frames(), library, publisher)
            for sensor in sensors:
                owners = {edge.child: frames[edge.child].get("owner") for edge in sensor.inside}
                drivers = {owner for child, owner in owners.items() if child in sensor.sent} or {
                    None
                }
                other_owners = {
                    owner for child, owner in owners.items() if child not in sensor.sent
                } or {None}
                if (
                    other_owners == {None}
                    and len(drivers) == 1
                    and (drivers == {None}) is (publisher == TFCOMPOSE)
                ):
                    self._sensor(sensor, drivers.pop() or "")
            for mount, note in undecided.items():
                if mount in frames:
                    self.draft.note(("frames", mount), note)

    def _fixed_frames(self) -> Robot:
        """Return a robot with the fixed frames of the draft."""
        span, frames = Span(""), self.draft.sections["frames"]
        edges = tuple(
            Edge(
                parent=keys["parent"],
                child=child,
                kind="static",
                owner="",
                pose=self._poses[child],
                span=span,
            )
            for child, keys in frames.items()
            if child in self._poses
        )
        return Robot(
            "",
            "",
            dict.fromkeys((edge.child for edge in edges), span),
            edges=edges,
            links={},
            processes=(),
            base=None,
        )

    def _sensor(self, sensor: Recognised, driver: str) -> None:
        """Replace the frames of a sensor by an entry for the sensor.

        ``driver`` is the process that publishes the frames inside the sensor.
        """
        frames, mount = self.draft.sections["frames"], sensor.mount.child
        is_in_use = sensor.name in self.draft.sections["processes"]
        new = self._rename_process(sensor.name) if is_in_use else ""
        settings = {
            key: value for key, value in frames[mount].items() if key in {"owner", "static"}
        }
        pose = pose_keys(sensor.mount.pose, quaternion=True)
        keys = sensor_keys(sensor, pose, {}, new if driver == sensor.name else driver) | settings
        self.draft.sections["sensors"][sensor.name] = keys
        for edge in sensor.edges:
            self.draft.note(
                ("sensors", sensor.name), *self.draft.notes.pop(("frames", edge.child), ())
            )
            del frames[edge.child]
            self.draft.brought.add(edge.child)

    def _rename_process(self, name: str) -> str:
        """Rename a process that has the same name as a sensor, as drivers often do."""
        sections, path = self.draft.sections, ("processes", name)
        node = next(node for node, process in self._owners.items() if process == name)
        new = self.draft.free_name(f"{name}_driver")
        renamed = {}
        for process, keys in sections["processes"].items():
            if process == name:
                renamed[new] = keys | ({"node": node} if node.startswith("/") else {})
            else:
                renamed[process] = keys
        sections["processes"] = renamed
        self.draft.notes["processes", new] = self.draft.notes.pop(path, [])
        for keys in (*sections["frames"].values(), *sections["sensors"].values()):
            keys |= {key: new for key in ("owner", "driver") if keys.get(key) == name}
        self._owners[node] = new
        return new

    def _owner(self, edge: EdgeState) -> str | None:
        """Return the process that publishes an edge, after adding it if necessary.

        Return None for a fixed edge of an unknown node, because tfcompose can publish the edge. If
        the robot is adopted, its node keeps the edge.
        """
        if len(edge.nodes) != 1:
            for node in edge.nodes:
                self.draft.note(
                    ("frames", edge.child), f"one of {', '.join(edge.nodes)} publishes it"
                )
                return self._process(node, edge)
            return None if edge.stream.static and not self.draft.is_adopted else self._unknown()
        return self._process(edge.nodes[0], edge)

    def _process(self, node: str, edge: EdgeState) -> str:
        if not node.startswith("/"):
            return self._stranger(node, edge)
        if node not in self._owners:
            base = posixpath.basename(node)
            name = self.draft.free_name(base)
            plain = node == f"/{name}"
            keys: dict[str, Any] = {"external": True} | ({} if plain else {"node": node})
            self._owners[node] = self.draft.process(name, keys, *self._notes(edge))
            if _ANONYMOUS.fullmatch(base):
                self.draft.note(("processes", self._owners[node]), _ANEW)
        return self._owners[node]

    def _stranger(self, what: str, edge: EdgeState) -> str:
        """Return the process of a publisher that is not a ROS node, such as a DDS program.

        ``what`` describes the publisher.
        """
        key = f"{what} {edge.stream.gid!r}"
        if key not in self._owners:
            notes = (f"it is {what}", *self._notes(edge))
            self._owners[key] = self.draft.process("external", {"external": True}, *notes)
        return self._owners[key]

    def _notes(self, edge: EdgeState) -> Iterable[str]:
        where = self.where(edge.stream.gid)
        match = _PID.search(where)
        argv = self.words_of(int(match[1])) if match else ()
        run = parse_command_line(argv)
        if run:
            yield f"it runs here as: run: {flow(run)}"
        elif where:
            yield f"it runs {where}"

    def _unknown(self) -> str:
        if RECORDED not in self.draft.sections["processes"]:
            self.draft.process(
                RECORDED,
                {"external": True},
                "TODO a recording does not say who publishes: name the processes",
            )
        return RECORDED


#: Default node names of ROS 2's static_transform_publisher.
_ANONYMOUS = re.compile(r"static_transform_publisher_[A-Za-z0-9]{16}")
_ANEW = (
    "its node name changes at each start: set it with -r __node:=NAME, or remove owner and"
    " static at its frames"
)


def _parents_first(edges: Sequence[EdgeState]) -> list[EdgeState]:
    """Return the edges from the roots downwards.

    If several edges lead to a child, the newest comes first.
    """
    parents = {edge.child: edge.parent for edge in edges}

    def depth(frame: str) -> int:
        count = 0
        while frame in parents and count <= len(parents):
            frame, count = parents[frame], count + 1
        return count

    return sorted(
        edges, key=lambda edge: (depth(edge.child), edge.stream.static, edge.parent, edge.child)
    )


def round_rate(rate_hz: float | None) -> float | None:
    """Return the probable nominal rate for a measured rate, both in Hz.

    This is a round rate near the measured rate or, if there is none, a lower rate that the
    publisher certainly reaches.
    """
    if not rate_hz or not math.isfinite(rate_hz) or rate_hz <= 0:
        return None
    scale = 10.0 ** math.floor(math.log10(rate_hz))
    near = min((step * scale for step in _STEPS), key=lambda value: abs(value - rate_hz))
    if abs(near - rate_hz) <= _NEAR * rate_hz:
        return float(f"{near:.6g}")
    return float(f"{math.floor(rate_hz / scale * 10) / 10 * scale:.6g}")


def parse_command_line(argv: Sequence[str]) -> dict[str, Any]:
    """Return the package, executable and arguments of a command line.

    Return an empty mapping if the program is not in a ROS package. In a command line that begins
    with a Python interpreter, the program is the next argument.
    """
    rest = list(argv)
    if rest and posixpath.basename(rest[0]).startswith("python") and rest[1:]:
        rest.pop(0)
    match = re.search(r"/lib/([^/]+)/([^/]+)$", rest[0]) if rest else None
    if match is None:
        return {}
    arguments = rest[1 : rest.index("--ros-args")] if "--ros-args" in rest else rest[1:]
    ros = rest[rest.index("--ros-args") :] if "--ros-args" in rest else []
    keys: dict[str, Any] = {"package": match[1], "executable": match[2]}
    return keys | ({"args": [*arguments, *ros]} if arguments or ros else {})
