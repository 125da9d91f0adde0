"""Faults of publishers against a plan, and the findings about them.

A ``Fault`` is an edge from a publisher that must not send it, or must not send it in this way. The
guard detects faults in each message; verify and the doctor detect them at the end.
``fault_finding`` returns the finding for faults with the same code and publisher name.
``_SENTENCES`` has a function for each code.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import list_names, plural
from tfcompose.guard.verdict import publishers, stamps, tree
from tfcompose.guard.verdict.simulators import switch_of_simulator
from tfcompose.model.plan import PlanEdge  # noqa: TC001 (faults are decoded by their types)
from tfcompose.tf.live.state import NAMELESS, NO_NODE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import Driven, Plan
    from tfcompose.tf.live.publishers import OtherRun

NOT_OWNER, WRONG_PARENT, UNDECLARED, WRONG_TOPIC = "TF801", "TF802", "TF803", "TF809"
LOOP, SELF, TWO_PUBLISHERS = "TF820", "TF821", "TF822"
#: Codes about stamps. Such a fault ends with the first correct stamp.
_OF_STAMPS = frozenset({stamps.REPEATED, stamps.BACK, stamps.WRONG_CLOCK})
_WARNINGS = frozenset({SELF, TWO_PUBLISHERS, stamps.REPEATED, stamps.BACK})
#: Codes of frames that a driver sends differently from its preset.
_OTHERWISE = frozenset({WRONG_PARENT, UNDECLARED})
LISTED_AT_MOST = 12
#: Up to this many recovered edges get a line each. More edges share a line.
OVER_IN_LINES = 3
#: Maximum number of publishers with the same name that get a note each.
RUNS_AT_MOST = 50


@dataclass(frozen=True, slots=True)
class Fault:
    """An edge from a publisher that must not send it, or must not send it in this way."""

    #: The finding's code.
    code: str
    #: The parent and child frame of the received transform.
    parent: str
    child: str
    #: The publisher's node; several candidates if the rmw does not identify senders; empty without
    #: a name.
    nodes: tuple[str, ...]
    #: Whether it arrived on /tf_static.
    static: bool
    #: The planned edge of the child, None if the child is undeclared.
    edge: PlanEdge | None
    #: Whether the publisher has the owner's name but is not the owner.
    namesake: bool = False
    #: Whether several publishers with the owner's name alternate, and each may be the owner.
    alternates: bool = False
    #: Frames of the loop that the edge closes.
    loop: tuple[str, ...] = ()
    #: The observed stamps, or the name of the other publisher.
    detail: str = ""
    #: Whether it comes from a recording, in which publishers have no names.
    recorded: bool = False
    #: Whether the publisher, despite its name, belongs to no process that the plan starts.
    stranger: bool = False
    #: Number of processes with this fault.
    publishers: int = 1

    @property
    def who(self) -> str:
        """The publisher for display."""
        if len(self.nodes) > 1:
            return f"one of {', '.join(self.nodes)}"
        name = self.nodes[0] if self.nodes else "somebody" if self.recorded else NAMELESS
        name = f"another {name}" if self.namesake else name
        return f"{name} ({self.publishers} processes)" if self.publishers > 1 else name

    @property
    def whom(self) -> str:
        """The publisher as the object of advice.

        A pronoun stands for a publisher without a name.
        """
        if self.publishers > 1:
            return "all but one of them" if self.alternates else "them"
        is_nameless = not self.nodes and not self.recorded and not self.namesake
        if is_nameless or self.nodes == (NO_NODE,):
            return "it"
        return f"the other {self.nodes[0]}" if self.namesake and len(self.nodes) == 1 else self.who

    @property
    def ends(self) -> tuple[str, str]:
        """The edge's parent and child."""
        return (self.parent, self.child)

    @property
    def name(self) -> str:
        """The edge's name."""
        return f"{self.parent} → {self.child}"

    @property
    def is_owners(self) -> bool:
        """Whether the edge's owner caused the fault."""
        return self.edge is not None and self.edge.node in self.nodes and not self.namesake

    @property
    def is_of_stamps(self) -> bool:
        """Whether the fault is about stamps, and ends with the first correct stamp."""
        return self.code in _OF_STAMPS


def over_texts(ended: Sequence[tuple[Fault, bool]], robot: str = "") -> list[str]:
    """Return sentences that report the end of faults of a group.

    Each fault comes with a flag, which is True if listeners keep the latched edge. ``robot`` is
    the other robot that caused all these faults, if there is one.
    """
    by_edge = {fault.ends: fault for fault, _ in ended}
    kept = {fault.ends for fault, is_kept in ended if is_kept}
    first, more = ended[0][0], len(by_edge) - 1
    if robot or more >= OVER_IN_LINES:
        return [_over_text(first, more, kept=bool(kept), who=robot)]
    return [_over_text(fault, kept=ends in kept) for ends, fault in by_edge.items()]


def _over_text(fault: Fault, more: int = 0, *, kept: bool = False, who: str = "") -> str:
    named = f"{fault.name} and {more} more edges" if more else fault.name
    if fault.is_of_stamps:
        return f"{fault.who} stamps {named} as it should again"
    rest = "; listeners keep what it latched until they get another value, or start again"
    are = "are" if more else "is"
    return f"{named} {are} no longer published by {who or fault.who}{rest if kept else ''}"


@dataclass(frozen=True, slots=True)
class FaultGroup:
    """Faults in a finding, one for each edge, and the state of their publishers."""

    faults: Sequence[Fault]
    plan: Plan
    #: Where each publisher runs; empty if unknown.
    runs: Sequence[str] = ()
    #: The sensor that the publisher drives.
    driven: Driven | None = None
    #: The process of the plan that the publisher is proven to belong to.
    process: str = ""

    @property
    def first(self) -> Fault:
        """The fault that the finding names first."""
        return self.faults[0]

    @property
    def edges(self) -> str:
        """The first edge's name, and the number of further edges."""
        return self.first.name + self.more

    @property
    def more(self) -> str:
        """The number of further edges, as text."""
        more = len(self.faults) - 1
        return f" and {plural(more, 'more edge')}" if more else ""

    @property
    def are(self) -> str:
        """The verb for the edges: singular or plural."""
        return "are" if self.more else "is"


def group_of(
    faults: Sequence[Fault],
    plan: Plan,
    runs: Sequence[str] = (),
    driven: Driven | None = None,
    process: str = "",
) -> FaultGroup:
    """Return faults with the same code and publisher name as a group, with one for each edge."""
    by_edge = {fault.ends: fault for fault in faults}
    # Two publishers of an edge are named together. Of alternating publishers, one may be the
    # owner.
    is_pair = faults[0].code == TWO_PUBLISHERS
    number = 1 if is_pair else max(1, len(runs) - faults[0].alternates)
    faults = [replace(fault, publishers=number) for fault in by_edge.values()]
    return FaultGroup(faults, plan, runs, driven, process)


def fault_finding(group: FaultGroup, span: Span | None = None) -> Finding:
    """Return the finding for a group; ``span`` is the span of the first edge."""
    first = group.first
    is_mild = first.code in _WARNINGS or (
        first.code == UNDECLARED and group.plan.guard.unknown_edges == "warn"
    )
    severity: Severity = "warning" if is_mild else "error"
    notes = [*_edge_notes(group), *([] if span else _declared_notes(first)), *_run_notes(group)]
    message, advice = _SENTENCES[first.code](group)
    advice = _misnamed_help(group) or _driver_help(group) or _switch_help(group) or advice
    return finding(first.code, message, span, help=advice, notes=notes, severity=severity)


# Message and help of each code.


def _not_owner(group: FaultGroup) -> tuple[str, str]:
    owners = {
        f"{fault.edge.owner} ({fault.edge.node})": None for fault in group.faults if fault.edge
    }
    verb = "the owner is" if len(owners) == 1 else "the owners are"
    message = f"{group.edges} {group.are} published by {group.first.who}; {verb} "
    return message + ", ".join(owners), _leave_out_help(group)


def _wrong_parent(group: FaultGroup) -> tuple[str, str]:
    first, edge = group.first, group.first.edge
    if edge is None:
        raise ValueError(first)
    message, owner = _driver_message(group), f"{edge.owner} ({edge.node})"
    if not message and (first.recorded or first.is_owners):
        by = f"its owner {owner} publishes {group.edges}"
        by = f"{group.edges} is recorded" if first.recorded else by
        message = f"{first.child} has the wrong parent: {by}, declared is {edge.name}"
    elif not message:
        parents = [(first.parent, first.who), (edge.parent, f"its owner {owner}")]
        message = tree.two_parents_message(first.child, parents)
        message += f" ({group.edges})" if group.more else ""
    if first.is_owners and not first.recorded:
        return message, f"correct what {first.who} publishes, or the parent in the robot's file"
    return message, _leave_out_help(group)


def _undeclared_text(group: FaultGroup) -> tuple[str, str]:
    first = group.first
    by = "recorded" if first.recorded else f"published by {first.who}"
    message = _driver_message(group) or f"{group.edges} {group.are} {by}, but not declared"
    allowed = f"{{parent: {first.parent}, child: {_child_pattern(group)}}}"
    return message, f"declare it under frames, or allow it: guard: {{allow: [{allowed}]}}"


def _wrong_topic(group: FaultGroup) -> tuple[str, str]:
    first, plan = group.first, group.plan
    moving, fixed = "/tf", "/tf_static"
    if first.edge and first.edge.owner in {process.name for process in plan.processes}:
        moving, fixed = plan.process(first.edge.owner).topics
    received, declared = (fixed, moving) if first.static else (moving, fixed)
    by = "" if first.recorded else f"its owner {first.who}"
    message = publishers.topics_message(
        group.edges, [(received, by)], declared=declared, are_many=bool(group.more)
    )
    return message, "static: true says that the owner sends it on /tf_static"


def _loop(group: FaultGroup) -> tuple[str, str]:
    first = group.first
    message = tree.loop_message(first.loop, closed_by=f"{group.edges} from {first.who}")
    return message, tree.loop_help(f"stop {first.whom}")


def _self(group: FaultGroup) -> tuple[str, str]:
    return tree.self_message(group.edges, group.first.who), tree.SELF_HELP


def _two_publishers(group: FaultGroup) -> tuple[str, str]:
    names = [group.first.who, group.first.detail]
    message = publishers.two_publishers_message(group.edges, names, are_many=bool(group.more))
    advice = f"stop one of them, or give each its own frame: {tree.LAST_WINS}"
    return message, advice


def _stamps(group: FaultGroup) -> tuple[str, str]:
    first = group.first
    message = stamps.message(first.code, first.who, group.edges, first.detail)
    return message, stamps.advice(first.code, first.detail)


_SENTENCES: Mapping[str, Callable[[FaultGroup], tuple[str, str]]] = {
    NOT_OWNER: _not_owner,
    WRONG_PARENT: _wrong_parent,
    UNDECLARED: _undeclared_text,
    WRONG_TOPIC: _wrong_topic,
    LOOP: _loop,
    SELF: _self,
    TWO_PUBLISHERS: _two_publishers,
    stamps.REPEATED: _stamps,
    stamps.BACK: _stamps,
    stamps.WRONG_CLOCK: _stamps,
}


# Findings about edges before the start, and about another robot.


def taken_finding(group: FaultGroup) -> Finding:
    """Return the finding for edges that another node published before the start."""
    first = group.first
    message = f"{group.edges} {group.are} already published by {first.who}"
    if first.edge and not first.edge.may_hang_on(first.parent):
        message += f"; in the plan {first.child} is a child of "
        message += " or ".join((first.edge.parent, *first.edge.switched))
    if first.loop:
        message += f", which closes the loop {tree.way(first.loop)}"
    notes = [*_edge_notes(group), *_declared_notes(first), *_run_notes(group)]
    advice = f"end {first.whom}"
    if first.namesake:
        advice += ": is the robot running already?"
    elif len(first.nodes) == 1 and first.nodes[0] != NO_NODE:
        owner = f"processes: {{NAME: {{external: true, node: {first.nodes[0]}}}}}"
        advice += f", or let it own the edge: {owner}, and owner: NAME at the edge"
    return finding("TF807", message, None, help=advice, notes=notes)


def other_robot_finding(faults: Sequence[Fault], run: OtherRun, plan: Plan) -> Finding:
    """Return the finding for all edges that another robot publishes on these topics."""
    is_mild = all(
        fault.edge is None and fault.code in {UNDECLARED, TWO_PUBLISHERS} for fault in faults
    )
    children = list(dict.fromkeys(fault.child for fault in faults))
    message = (
        f"{run.name} (pid {run.pid}, since {run.since}) runs in this domain: it publishes"
        f" {list_names(children)}"
    )
    nodes = dict.fromkeys(node for fault in faults for node in fault.nodes)
    shared = dict.fromkeys(fault.child for fault in faults if fault.edge is not None)
    notes = [Note(f"its nodes are {list_names(nodes)}")] if nodes else []
    notes += [Note(f"both robots have {list_names(shared)}")] if shared else []
    advice = (
        f"end it: tfcompose down --robot {run.name}; or keep them apart: ros: {{domain_id:"
        " N}, or ros: {namespace: NAME, isolate: topics}"
    )
    is_warning = is_mild and plan.guard.unknown_edges == "warn"
    severity: Severity = "warning" if is_warning else "error"
    return finding("TF854", message, None, notes=notes, help=advice, severity=severity)


# Advice.


def _leave_out_help(group: FaultGroup) -> str:
    """Return the help for a publisher that should not send the edge or has a wrong parent."""
    first, plan = group.first, group.plan
    if first.namesake:
        return f"stop {first.whom}: is the robot running twice? {tree.LAST_WINS}"
    if first.recorded:
        return tree.LAST_WINS
    if process := _run_by(first, plan):
        owns = f", or own it: owner: {process}" if first.code == NOT_OWNER else ""
        component = plan.process(process).component
        which = f", a component of {component.container}," if component else ""
        return f"let {first.who}{which} leave {first.child} out{owns}"
    if first.nodes == (NO_NODE,):
        return (
            f"stop {first.whom}, or start it with another DDS domain: ss -lunp lists the programs"
            " that use UDP ports of DDS, which begin at 7400"
        )
    its = "their" if first.publishers > 1 else "its"
    return f"stop {first.whom} or disable {its} TF output; {tree.LAST_WINS}"


def _run_by(fault: Fault, plan: Plan) -> str:
    """Return the process of this robot that the publisher certainly belongs to."""
    kinds = {"external"} if fault.stranger else {"run", "external", "component"}
    for process in plan.processes if len(fault.nodes) == 1 else ():
        if process.kind in kinds and fault.nodes[0] in process.nodes:
            return process.name
    return ""


def _misnamed_help(group: FaultGroup) -> str:
    """Return the help for the case that the owner's node has another name than planned."""
    first = group.first
    if first.code != NOT_OWNER or first.namesake or len(first.nodes) != 1 or first.edge is None:
        return ""
    owners = {fault.edge.owner for fault in group.faults if fault.edge}
    if not group.process or owners != {group.process} or _run_by(first, group.plan):
        return ""
    return (
        f"it is {group.process} itself: write node: {first.who} there, or have the program name"
        f" its node {first.edge.node}"
    )


def sensor_of(fault: Fault, drives: Mapping[str, Sequence[Driven]]) -> Driven | None:
    """Return the sensor that the publisher drives.

    If it drives several sensors, return the sensor whose name is in the frame's name.
    """
    driven = drives.get(fault.nodes[0], ()) if len(fault.nodes) == 1 and not fault.namesake else ()
    named = [sensor for sensor in driven if sensor.sensor in fault.child]
    return next(iter(named or driven), None)


def _is_driver_otherwise(group: FaultGroup) -> bool:
    """Return whether a driver sends its own frames differently from its preset."""
    first = group.first
    is_own = first.edge is None or first.edge.node in first.nodes
    is_publisher = group.driven is not None and bool(group.driven.publishes)
    return is_publisher and first.code in _OTHERWISE and is_own


def _driver_message(group: FaultGroup) -> str:
    """Return the message for a driver's frames that differ from its preset."""
    if group.driven is None or not _is_driver_otherwise(group):
        return ""
    first = group.first
    expected = first.edge.name if first.edge else f"no frame {first.child}"
    return (
        f"preset {group.driven.preset} expects {expected}, the driver {first.who} sent"
        f" {group.edges}"
    )


def _driver_help(group: FaultGroup) -> str:
    """Return the help about a sensor's driver; empty without a driver."""
    first, driven = group.first, group.driven
    if driven is None or first.code not in {*_OTHERWISE, NOT_OWNER}:
        return ""
    if _is_driver_otherwise(group):
        frames = f"frames: {{{first.child}: {{parent: {first.parent}}}}}"
        what = frames if first.edge else "options with that frame"
        return f"describe what the driver does under sensors.{driven.sensor}: {what}"
    switch = ", ".join(f"{name}: {json.dumps(value)}" for name, value in driven.switch.items())
    ignores = (
        f"{first.whom} drives {driven.sensor} ({driven.preset}) and ignores its switch: start it"
        f" with {switch}"
    )
    return ignores if switch else ""


def _switch_help(group: FaultGroup) -> str:
    """Return the parameter to set, if the node publishes the edge by default."""
    first = group.first
    claim = group.plan.claim_on(first.nodes, first.parent, first.child)
    if claim is None or first.namesake:
        return switch_of_simulator(first.nodes)
    by_default = f"{first.who} publishes it by default"
    if not claim.switch:
        return f"{by_default} and has no switch: let its process own the edge"
    return f"{by_default}: set {claim.switch}"


def _child_pattern(group: FaultGroup) -> str:
    """Return the child, or a pattern such as ``tag_*`` if the names differ only in numbers."""
    children = [fault.child for fault in group.faults]
    stems = {child.rstrip("0123456789") for child in children}
    if len(children) > 1 and len(stems) == 1 and "" not in stems:
        return f"'{stems.pop()}*'"
    return children[0]


# Notes.


def _edge_notes(group: FaultGroup) -> list[Note]:
    if len(group.faults) == 1:
        return []
    notes = [Note(fault.name) for fault in group.faults[:LISTED_AT_MOST]]
    more = len(group.faults) - len(notes)
    return [*notes, Note(f"and {more} more")] if more else notes


def _declared_notes(fault: Fault) -> list[Note]:
    edge = fault.edge
    return [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}")] if edge else []


def _run_notes(group: FaultGroup) -> list[Note]:
    """Return a note for each publisher with the place where it runs."""
    first = group.first
    who = replace(first, publishers=1, namesake=first.namesake and not first.alternates).who
    runs = [] if len(first.nodes) > 1 else filter(None, group.runs)
    notes = [Note(f"{who} runs {where}") for where in runs]
    more = len(notes) - RUNS_AT_MOST
    return [*notes[:RUNS_AT_MOST], Note(f"and {more} more")] if more > 0 else notes
