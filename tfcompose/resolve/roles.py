"""Which frames of the robot a known node means by its map, its odom and its base."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tfcompose.language.node_preset import ClaimSpec, NodePresetSpec
    from tfcompose.model import Edge, Robot

_HOLE = re.compile(r"\{(\w+)\}")


class Roles:
    """A node's frames by role.

    First come the ends of the edges that its process owns; then frames with the names that the node expects; for the
    base what hangs on its odom, else the robot's base. What is nowhere in the tree has the node's own name for it.
    """

    def __init__(
        self, robot: Robot, process: str, preset: NodePresetSpec | None, claims: tuple[ClaimSpec, ...]
    ) -> None:
        self._robot = robot
        self._usual = {role: said.default for role, said in preset.frames.items()} if preset else {}
        self._bound: dict[str, str] = {}
        self.frames: dict[str, str] = {}
        """role → frame of the tree"""
        for edge in robot.edges:
            if edge.owner == process:
                self._bind(edge, claims)
        self.frames |= self._bound
        for role, usual in self._usual.items():
            frame = self._bound.get(role) or self._open(role, usual)
            if frame is not None:
                self.frames[role] = frame

    def is_bound(self, role: str) -> bool:
        """Return whether the role follows from an edge that the process owns."""
        return role in self._bound

    def fill(self, template: str) -> str:
        """Return a name with roles in it as a name of the tree."""
        return _HOLE.sub(lambda hole: self.frames.get(hole[1], self._usual.get(hole[1], hole[0])), template)

    def final(self, value: Any) -> Any:
        """Return a parameter's value; a role in it is the frame's name on the live tree."""
        whole = _HOLE.fullmatch(value) if isinstance(value, str) else None
        if whole is None:
            return value
        frame = self.frames.get(whole[1])
        return self._robot.final(frame) if frame else self._usual.get(whole[1], value)

    def _bind(self, edge: Edge, claims: tuple[ClaimSpec, ...]) -> None:
        """Give an owned edge's ends the roles of the claim that fits it best."""
        fitting = [(self._fit(edge, claim), -index, claim) for index, claim in enumerate(claims)]
        fitting = [one for one in fitting if one[0] >= 0]
        if not fitting:
            return
        claim = max(fitting, key=lambda one: one[:2])[2]
        for template, frame in ((claim.parent, edge.parent), (claim.child, edge.child)):
            whole = _HOLE.fullmatch(template)
            if whole:
                self._bound.setdefault(whole[1], frame)

    def _fit(self, edge: Edge, claim: ClaimSpec) -> int:
        """Return how well an edge fits a claim: by its ends' names, and by what hangs below; negative if not at all."""
        score = 0
        for template, frame in ((claim.parent, edge.parent), (claim.child, edge.child)):
            whole = _HOLE.fullmatch(template)
            usual = self._usual.get(whole[1]) if whole else None
            if whole is None and _HOLE.sub("", template) == template and template != frame:
                return -1
            if whole is None and _HOLE.search(template) and self.fill(template) != frame:
                return -1
            score += 4 * (usual == frame)
        ends = _HOLE.fullmatch(claim.child)
        moves_on = any(below.parent == edge.child and below.kind == "dynamic" for below in self._robot.edges)
        return score + (ends is not None and (ends[1] == "odom") == moves_on)

    def _open(self, role: str, usual: str) -> str | None:
        robot = self._robot
        if role == "base":
            odom = self._bound.get("odom") or self.frames.get("odom")
            below = (edge.child for edge in robot.edges if edge.parent == odom and edge.kind == "dynamic")
            taken = {self._bound.get("map"), odom, self.frames.get("map")}
            base = usual if usual in robot.frames else robot.base
            return next(below, None) or (base if base not in taken else None)
        if role == "odom" and usual not in robot.frames:
            above = self._bound.get("map")
            return next((edge.child for edge in robot.edges if edge.parent == above and edge.kind == "dynamic"), None)
        return usual if usual in robot.frames else None
