"""A tree that was observed, live or in a bag, as a draft: what is published, by which nodes, how often."""

from __future__ import annotations

import math
import posixpath
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.importing.draft import pose_keys
from tfcompose.importing.yaml_text import Bare, flow
from tfcompose.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from tfcompose.importing.draft import Draft
    from tfcompose.live.edges import EdgeState

#: The process that owns moving edges whose publisher nobody knows, as in a bag.
RECORDED = "recorded"
#: A rate is taken for a rounder one that is so near.
_NEAR = 0.03
_PID = re.compile(r"as pid (\d+)")
_STEPS = (1, 2, 2.5, 3, 4, 5, 6, 7.5, 8, 10)


@dataclass(slots=True)
class Observed:
    """What becomes of one observation.

    ``where`` gives, by a publisher's id, on which machine and as which process it runs; ``words_of`` the command line
    of a process of this machine, empty where that cannot be had.
    """

    draft: Draft
    where: Callable[[bytes | None], str]
    words_of: Callable[[int], Sequence[str]]
    _owners: dict[str, str] = field(default_factory=dict)

    def add(self, edges: Iterable[EdgeState]) -> None:
        """Add the edges, parents before children, and their owners."""
        taken = [edge for edge in edges if edge.stream.rejections < edge.stream.arrivals.count]
        for edge in _parents_first(taken):
            self._edge(edge)

    def _edge(self, edge: EdgeState) -> None:
        stream, frames = edge.stream, self.draft.sections["frames"]
        at = ("frames", edge.child)
        if edge.child in frames:
            if edge.present is not False:
                publisher = edge.publisher or "another publisher"
                self.draft.todo(f"{publisher} publishes {edge.name} as well", None, at)
            return
        frames[edge.child] = {}  # its place is kept while its owner is named
        owner = self._owner(edge)
        keys: dict[str, Any] = {"parent": edge.parent}
        if stream.static:
            keys |= pose_keys(stream.pose, quaternion=True)
            keys |= {"owner": owner, "static": True} if owner else {}
        else:
            keys |= {"owner": owner or self._unknown()}
            rate = round_rate(edge.timing.rate)
            keys |= {"rate": Bare(f"{number(rate)} Hz")} if rate else {}
        frames[edge.child] = keys

    def _owner(self, edge: EdgeState) -> str | None:
        """Return the process of an edge's publisher, or None where its node is not known."""
        if len(edge.nodes) != 1:
            for node in edge.nodes:
                self.draft.note(("frames", edge.child), f"one of {', '.join(edge.nodes)} publishes it")
                return self._process(node, edge)
            return None
        return self._process(edge.nodes[0], edge)

    def _process(self, node: str, edge: EdgeState) -> str:
        if node not in self._owners:
            base = posixpath.basename(node)
            name = self.draft.free_name(base)
            plain = node == f"/{name}"
            keys: dict[str, Any] = {"external": True} | ({} if plain else {"node": node})
            self._owners[node] = self.draft.process(name, keys, *self._notes(edge))
        return self._owners[node]

    def _notes(self, edge: EdgeState) -> Iterable[str]:
        where = self.where(edge.stream.gid)
        found = _PID.search(where)
        words = self.words_of(int(found[1])) if found else ()
        run = started_by(words)
        if run:
            yield f"it runs here as: run: {flow(run)}"
        elif where:
            yield f"it runs {where}"

    def _unknown(self) -> str:
        if RECORDED not in self.draft.sections["processes"]:
            self.draft.process(
                RECORDED, {"external": True}, "TODO a recording does not say who publishes: name the processes"
            )
        return RECORDED


def _parents_first(edges: Sequence[EdgeState]) -> list[EdgeState]:
    """Return the edges from the roots on; of several to one child the newest first."""
    parents = {edge.child: edge.parent for edge in edges}

    def depth(frame: str) -> int:
        count = 0
        while frame in parents and count <= len(parents):
            frame, count = parents[frame], count + 1
        return count

    return sorted(edges, key=lambda edge: (depth(edge.child), edge.stream.static, edge.parent, edge.child))


def round_rate(rate_hz: float | None) -> float | None:
    """Return the rate (Hz) that was meant by one that was measured: a round one near it, or what is surely reached."""
    if not rate_hz or not math.isfinite(rate_hz) or rate_hz <= 0:
        return None
    scale = 10.0 ** math.floor(math.log10(rate_hz))
    near = min((step * scale for step in _STEPS), key=lambda value: abs(value - rate_hz))
    if abs(near - rate_hz) <= _NEAR * rate_hz:
        return float(f"{near:.6g}")
    return float(f"{math.floor(rate_hz / scale * 10) / 10 * scale:.6g}")


def started_by(words: Sequence[str]) -> dict[str, Any]:
    """Return the package, executable and arguments of a command line; nothing where it is no package's program.

    A program of a Python package has the interpreter in front.
    """
    rest = list(words)
    if rest and posixpath.basename(rest[0]).startswith("python") and rest[1:]:
        rest.pop(0)
    found = re.search(r"/lib/([^/]+)/([^/]+)$", rest[0]) if rest else None
    if found is None:
        return {}
    own = rest[1 : rest.index("--ros-args")] if "--ros-args" in rest else rest[1:]
    ros = rest[rest.index("--ros-args") :] if "--ros-args" in rest else []
    keys: dict[str, Any] = {"package": found[1], "executable": found[2]}
    return keys | ({"args": [*own, *ros]} if own or ros else {})
