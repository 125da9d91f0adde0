"""Resolution of claims, edges that a node publishes by default.

If another process owns the edge, tfcompose writes the parameter that stops the node from
publishing it. Otherwise the claim gets the names of the robot's frames. Parameters cannot always
do this, for example if another program starts the process. Then a finding names the parameter.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.presets import node_preset, preset_of, unknown_node_preset
from tfcompose.foundation.findings import Finding, Note, RejectedError, Span, finding
from tfcompose.model.plan import switch_text
from tfcompose.model.robot import BUILT_IN, Claim, Edge, Node, Process

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.model.robot import Edge, Robot
    from tfcompose.spec.language.node_preset import ClaimSpec, NodePresetSpec
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path


def settle_claims(draft: Draft) -> Iterator[Finding]:
    """Resolve claims by parameters, and yield findings about claims that cannot be resolved."""
    robot = draft.robot
    if not any(
        declared.nodes or declared.publishes or preset_of(declared.node)
        for declared in draft.spec.processes.values()
    ):
        return
    work = _Claims(robot, draft.spec)
    processes = tuple(work.process(process) for process in robot.processes)
    edges = tuple(work.edge(edge) for edge in robot.edges)
    draft.robot = replace(
        robot, processes=processes, edges=edges, claims=(*robot.claims, *work.claims)
    )
    yield from work.findings


@dataclass(slots=True)
class _Claims:
    robot: Robot
    spec: RobotSpec
    findings: list[Finding] = field(default_factory=list)
    claims: list[Claim] = field(default_factory=list)
    publishers: dict[tuple[str, str], str] = field(default_factory=dict)
    preset_processes: set[str] = field(default_factory=set)

    def process(self, process: Process) -> Process:
        """Return the process with the parameters of its nodes."""
        if process.name not in self.spec.processes or process.kind not in {
            "run",
            "external",
            "component",
        }:
            return process
        claimants = [self._node(process, node) for node in process.ros_nodes]
        if all(claimant is not None for claimant in claimants):
            self.preset_processes.add(process.name)
        nodes = []
        for node, claimant in zip(process.ros_nodes, claimants, strict=True):
            nodes.append(claimant.settle() if claimant else node)
        return replace(process, ros_nodes=tuple(nodes))

    def edge(self, edge: Edge) -> Edge:
        """Return the edge with the node that publishes it.

        If no node of the owner is known to publish the edge, add a finding.
        """
        node = self.publishers.get((edge.owner, edge.child))
        if node is not None:
            return replace(edge, node=node)
        owner = next(
            (process for process in self.robot.processes if process.name == edge.owner), None
        )
        if owner is None or owner.name in BUILT_IN or owner.name not in self.spec.processes:
            return edge
        span = edge.owner_at or edge.span
        entry = f"publishes: [{{parent: {edge.parent}, child: {edge.child}, off: none}}]"
        if owner.name in self.preset_processes and owner.kind != "simulate":
            message = f"{owner.name} is not known to publish {edge.name}"
            advice = (
                f"if it does, add {entry} to {owner.name}; off can name the parameter that"
                " stops it"
            )
            self.findings.append(finding("TF332", message, span, help=advice))
        elif len(owner.nodes) > 1:
            message = (
                f"{owner.name} has {len(owner.nodes)} nodes, and none is known to publish"
                f" {edge.name}"
            )
            advice = f"add to the node that does: {entry}"
            self.findings.append(finding("TF332", message, span, help=advice))
        return edge

    def _node(self, process: Process, node: Node) -> Claimant | None:
        """Return the node with its claims and parameters, None for an unknown node."""
        declared = self.spec.processes[process.name]
        inner = declared.nodes.get(str(node.path[-1])) if len(node.path) > 2 else None  # noqa: PLR2004 (below nodes)
        name = (
            inner.preset
            if inner
            else preset_of(declared.node)
            if declared.node and not declared.nodes
            else None
        )
        by_hand = inner.publishes if inner else declared.publishes
        preset = (
            self._preset(name, (*node.path, *(() if inner else ("node",)), "preset"))
            if name
            else None
        )
        if preset is None and not by_hand:
            return None
        claims = (*(preset.publishes if preset else ()), *by_hand)
        roles = Roles(self.robot, process.name, preset, claims)
        claimant = Claimant(
            process, node, claims, preset=preset, roles=roles, params=node.flat_params
        )
        self._set_names(claimant)
        for claim in self._of_one(claimant) if preset and preset.one_of else claims:
            self._settle(claimant, claim)
        return claimant

    def _preset(self, name: str, path: Path) -> NodePresetSpec | None:
        try:
            return node_preset(name)
        except KeyError:
            self.findings.append(unknown_node_preset(name, self.spec.span_of(path)))
        except RejectedError as error:
            self.findings += error.findings
        return None

    def _of_one(self, claimant: Claimant) -> tuple[ClaimSpec, ...]:
        """Return the claim in effect, for a node that publishes only one of several edges.

        This is the claim whose edge the process owns, otherwise the claim that parameters select.
        """
        for claim in claimant.claims:
            if self._is_own(claimant, claim):
                return (claim,)
        for claim in claimant.claims:
            if claimant.has(
                {key: claimant.roles.final(value) for key, value in claim.chosen_by.items()}
                or claim.on
            ):
                return (claim,)
        return claimant.claims[:1]

    def _set_names(self, claimant: Claimant) -> None:
        """Set the parameters that hold frame names, and fixed parameters of the node's preset."""
        preset = claimant.preset
        if preset is None:
            return
        for role, described in preset.frames.items():
            frame = claimant.roles.frames.get(role)
            if described.parameter is None or frame is None:
                continue
            parameter = described.parameter
            if described.instead in claimant.params:
                parameter = described.instead
            setting = claimant.params.get(parameter)
            if (
                setting is not None
                and not claimant.roles.is_bound(role)
                and self._is_frame(setting)
            ):
                continue  # the tree does not determine this frame
            self._set(claimant, parameter, self.robot.final(frame))
        for key, value in preset.set.items():
            self._set(claimant, key, value)

    def _is_frame(self, name: Any) -> bool:
        return any(name == self.robot.final(frame) for frame in self.robot.frames)

    def _set(self, claimant: Claimant, key: str, value: Any) -> None:
        setting = claimant.params.get(key)
        if setting is None:
            claimant.computed[key] = value
        elif setting != value:
            claimant.contradicting.add(key)
            message = (
                f"{key} of {claimant.process.name} is {setting!r}, but in the tree it is {value!r}"
            )
            advice = "remove it: tfcompose writes it"
            if not claimant.takes_parameters:
                advice = (
                    f"set {key}: {_format_value(value)} where {claimant.process.name} is started,"
                    " and here"
                )
            self.findings.append(
                finding("TF333", message, self._span_of(claimant, key), help=advice)
            )

    def _is_own(self, claimant: Claimant, claim: ClaimSpec) -> bool:
        edge = self._edge(*claimant.ends(claim))
        return edge is not None and edge.owner == claimant.process.name

    def _edge(self, parent: str, child: str) -> Edge | None:
        edges = (edge for edge in self.robot.edges if edge.child == child)
        return next((edge for edge in edges if parent in {edge.parent, *edge.switched}), None)

    def _settle(self, claimant: Claimant, claim: ClaimSpec) -> None:
        parent, child = claimant.ends(claim)
        if "*" in parent + child:
            self._settle_pattern(claimant, claim, parent, child)
            return
        edge = self._edge(parent, child)
        if edge is not None and edge.owner == claimant.process.name:
            self._take_own(claimant, claim, edge)
            return
        if claimant.is_published(claim) or claim.by_default:
            self.claims.append(Claim(claimant.node.name, parent, child, off=claim.off))
        if not claimant.is_published(claim):
            return
        owned_edge = edge or self.robot.parent_edge(child)
        if owned_edge is None:
            self._report_undeclared(claimant, claim, parent, child)
        else:
            self._switch_off(claimant, claim, f"{parent} → {child}", owned_edge)

    def _compare_rate(self, claimant: Claimant, edge: Edge) -> None:
        """Report a parameter that makes the node publish the edge more slowly than declared."""
        preset = claimant.preset
        key, rate = preset.rate_in(claimant.params) if preset else ("", math.inf)
        if edge.rate and edge.is_slower(rate):
            message = f"{key} of {claimant.process.name} gives {edge.name} {rate:.3g} Hz, but"
            message += f" {edge.rate:g} Hz is declared"
            notes = [Note("declared here", edge.rate_at)] if edge.rate_at else []
            advice = f"raise {key}, or declare the rate that it has"
            if key == (preset and preset.period):
                advice = f"write {key}: {1 / edge.rate:.3g}, or declare the rate that it has"
            self.findings.append(
                finding("TF336", message, self._span_of(claimant, key), help=advice, notes=notes)
            )

    def _take_own(self, claimant: Claimant, claim: ClaimSpec, edge: Edge) -> None:
        self.publishers[claimant.process.name, edge.child] = claimant.node.name
        self._compare_rate(claimant, edge)
        for key, value in claim.chosen_by.items():
            self._set(claimant, key, claimant.roles.final(value))
        for key, value in claim.on.items() if not claim.by_default else ():
            self._set(claimant, key, value)
        if claimant.has(claim.off):
            message = (
                f"{claimant.process.name} owns {edge.name}, but a parameter turns that off:"
                f" {switch_text(claim.off)}"
            )
            span = self._span_of(claimant, next(iter(claim.off)))
            self.findings.append(
                finding("TF333", message, span, help="remove it, or name another owner")
            )

    def _switch_off(
        self, claimant: Claimant, claim: ClaimSpec, name: str, owned_edge: Edge
    ) -> None:
        """Set the parameter that stops the publication, or report that this is not possible."""
        against = next(
            (key for key, off in claim.off.items() if claimant.params.get(key, off) != off), None
        )
        if against is not None and claimant.takes_parameters and not claimant.has(claim.on):
            value = claimant.params[against]
            message = (
                f"{against} of {claimant.process.name} is {value!r}, and {owned_edge.owner} owns"
                f" {owned_edge.name}"
            )
            advice = "remove it: tfcompose writes the switch"
            self.findings.append(
                finding("TF333", message, self._span_of(claimant, against), help=advice)
            )
            return
        needed = any(
            self._is_own(claimant, owned_claim) and set(owned_claim.off) & set(claim.off)
            for owned_claim in claimant.claims
        )
        if claim.off and claimant.takes_parameters and not needed and not claimant.has(claim.on):
            claimant.computed |= claim.off
            return
        owner = (
            f"{owned_edge.owner} owns"
            if owned_edge.name == name
            else f"{owned_edge.owner} owns {owned_edge.name}"
        )
        message = (
            f"{claimant.process.name} publishes {name} by default, which {owned_edge.owner} owns"
        )
        if owned_edge.name != name:
            message = f"{claimant.process.name} publishes {name} by default, and {owner}"
        self.findings.append(
            finding(
                "TF330",
                message,
                claimant.node.span,
                help=self._way_out(claimant, claim, needed=needed),
            )
        )

    def _way_out(self, claimant: Claimant, claim: ClaimSpec, *, needed: bool) -> str:
        hint = f"; {claimant.preset.hint}" if claimant.preset and claimant.preset.hint else ""
        if not claim.off:
            return f"it has no switch: name {claimant.process.name} as the owner{hint}"
        if needed:
            return (
                f"its switch, {switch_text(claim.off)}, stops its own edge too: name it as the"
                f" owner of both{hint}"
            )
        switch = switch_text(claim.off)
        return (
            f"set {switch} where {claimant.process.name} is started, and write"
            f" params: {{{switch}}} here, so that lint knows; or name it as the owner{hint}"
        )

    def _report_undeclared(
        self, claimant: Claimant, claim: ClaimSpec, parent: str, child: str
    ) -> None:
        static = ", static: true" if claim.static else ""
        advice = (
            f"frames: {{{child}: {{parent: {parent}, owner: {claimant.process.name}{static}}}}}"
        )
        if claim.off:
            advice += f"; or params: {{{switch_text(claim.off)}}}"
        message = (
            f"{claimant.process.name} publishes {parent} → {child} by default, which no process"
            " declared"
        )
        self.findings.append(finding("TF331", message, claimant.node.span, help=advice))

    def _settle_pattern(
        self, claimant: Claimant, claim: ClaimSpec, parent: str, child: str
    ) -> None:
        self.claims.append(Claim(claimant.node.name, parent, child, off=claim.off))
        guard = self.robot.guard
        owns = any(edge.owner == claimant.process.name for edge in self.robot.edges)
        allowed = any(
            fnmatchcase(pattern.child, child) or fnmatchcase(child, pattern.child)
            for pattern in guard.allow
        )
        if owns or allowed or guard.unknown_edges == "ignore" or not claimant.is_published(claim):
            return
        message = (
            f"{claimant.process.name} publishes {parent} → {child} by default, which the guard"
            " does not allow"
        )
        advice = f'guard: {{allow: [{{child: "{child}"}}]}}'
        self.findings.append(finding("TF331", message, claimant.node.span, help=advice))

    def _span_of(self, claimant: Claimant, key: str) -> Span:
        return self.spec.span_of((*claimant.node.path, "params", *key.split(".")))


@dataclass(slots=True)
class Claimant:
    """A node that may publish TF."""

    process: Process
    node: Node
    claims: tuple[ClaimSpec, ...]
    preset: NodePresetSpec | None
    roles: Roles
    #: Parameters from the robot file.
    params: dict[str, Any]
    #: Parameters that tfcompose adds.
    computed: dict[str, Any] = field(default_factory=dict)
    contradicting: set[str] = field(default_factory=set)

    def settle(self) -> Node:
        """Return the node with the parameters that tfcompose adds, if the node receives them."""
        node = replace(self.node, contradicting=frozenset(self.contradicting))
        return replace(node, params=node.params | self.computed) if self.takes_parameters else node

    def ends(self, claim: ClaimSpec) -> tuple[str, str]:
        """Return the parent and child frames of the claim."""
        return self.roles.fill(claim.parent), self.roles.fill(claim.child)

    def has(self, params: dict[str, Any]) -> bool:
        """Return whether the user set all these parameters to these values."""
        return bool(params) and all(self.params.get(key) == value for key, value in params.items())

    def is_published(self, claim: ClaimSpec) -> bool:
        """Return whether the node publishes the edge with the user's parameters."""
        return (claim.by_default or self.has(claim.on)) and not self.has(claim.off)

    @property
    def takes_parameters(self) -> bool:
        """Whether the node receives the parameters that tfcompose writes.

        A launch file or a shell would have to pass them on.
        """
        process = self.process
        if process.kind != "run":
            return process.component is not None
        return process.takes_ros_arguments or "${params_file}" in " ".join(process.argv)


def _format_value(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


_HOLE = re.compile(r"\{(\w+)\}")


class Roles:
    """Frames of the robot that play a role for a node, such as ``odom`` or ``base``.

    An edge that the node's process owns determines the roles of its two frames. Otherwise a role
    belongs to the frame with the name that the node expects. The role ``base`` falls back to the
    child of the odom frame, then to the robot's base. A role without a frame in the tree keeps the
    node's default name.
    """

    def __init__(
        self,
        robot: Robot,
        process: str,
        preset: NodePresetSpec | None,
        claims: tuple[ClaimSpec, ...],
    ) -> None:
        self._robot = robot
        self._usual = (
            {role: declared.default for role, declared in preset.frames.items()} if preset else {}
        )
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
        """Return whether an edge that the process owns determines the role."""
        return role in self._bound

    def fill(self, template: str) -> str:
        """Return the name with each role replaced by the name of its frame."""
        return _HOLE.sub(
            lambda hole: self.frames.get(hole[1], self._usual.get(hole[1], hole[0])), template
        )

    def final(self, value: Any) -> Any:
        """Return a parameter's value. A role is replaced by the frame's name on /tf."""
        hole = _HOLE.fullmatch(value) if isinstance(value, str) else None
        if hole is None:
            return value
        frame = self.frames.get(hole[1])
        return self._robot.final(frame) if frame else self._usual.get(hole[1], value)

    def _bind(self, edge: Edge, claims: tuple[ClaimSpec, ...]) -> None:
        """Assign the roles of the best-fitting claim to the two frames of an owned edge."""
        fitting = [(self._fit(edge, claim), -index, claim) for index, claim in enumerate(claims)]
        fitting = [fit for fit in fitting if fit[0] >= 0]
        if not fitting:
            return
        claim = max(fitting, key=lambda fit: fit[:2])[2]
        for template, frame in ((claim.parent, edge.parent), (claim.child, edge.child)):
            hole = _HOLE.fullmatch(template)
            if hole:
                self._bound.setdefault(hole[1], frame)

    def _fit(self, edge: Edge, claim: ClaimSpec) -> int:
        """Return how well an edge fits a claim, by its frame names and by moving edges below it.

        Negative if the edge does not fit.
        """
        score = 0
        for template, frame in ((claim.parent, edge.parent), (claim.child, edge.child)):
            hole = _HOLE.fullmatch(template)
            usual = self._usual.get(hole[1]) if hole else None
            if hole is None and _HOLE.sub("", template) == template and template != frame:
                return -1
            if hole is None and _HOLE.search(template) and self.fill(template) != frame:
                return -1
            score += 4 * (usual == frame)
        ends = _HOLE.fullmatch(claim.child)
        moves_on = any(
            below.parent == edge.child and below.kind == "dynamic" for below in self._robot.edges
        )
        return score + (ends is not None and (ends[1] == "odom") == moves_on)

    def _open(self, role: str, usual: str) -> str | None:
        robot = self._robot
        if role == "base":
            odom = self._bound.get("odom") or self.frames.get("odom")
            below = (
                edge.child
                for edge in robot.edges
                if edge.parent == odom and edge.kind == "dynamic"
            )
            used_frames = {self._bound.get("map"), odom, self.frames.get("map")}
            base = usual if usual in robot.frames else robot.base
            return next(below, None) or (base if base not in used_frames else None)
        if role == "odom" and usual not in robot.frames:
            above = self._bound.get("map")
            return next(
                (
                    edge.child
                    for edge in robot.edges
                    if edge.parent == above and edge.kind == "dynamic"
                ),
                None,
            )
        return usual if usual in robot.frames else None
