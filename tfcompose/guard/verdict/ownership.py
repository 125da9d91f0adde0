"""Who may publish which edge, and how: violations of a plan, and their findings.

A ``Violation`` is one edge that was published by somebody who may not, or in a way that it may
not. The guard finds violations message by message, with ``OwnershipRules``; verify and the doctor
find them at the end, by ``code_of``. All say them with ``violation_finding``.
"""

from __future__ import annotations

import json
from collections import OrderedDict
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import counted, listed
from tfcompose.foundation.tree import loop_closed_by
from tfcompose.guard.verdict import publishers, stamps, tree
from tfcompose.tf.live.state import NAMELESS, NO_NODE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tfcompose.foundation.catalogue import Severity
    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import Driven, Plan, PlanEdge
    from tfcompose.tf.live.publishers import OtherRun, Senders

LOOP, SELF, TWO_PUBLISHERS = "TF820", "TF821", "TF822"
#: Codes about stamps: over as soon as these are right.
_OF_STAMPS = frozenset({stamps.REPEATED, stamps.BACK, stamps.WRONG_CLOCK})
_WARNINGS = frozenset({SELF, TWO_PUBLISHERS, stamps.REPEATED, stamps.BACK})
#: Frames that were sent otherwise than expected, or were not expected.
_OTHERWISE = frozenset({"TF802", "TF803"})
LISTED_AT_MOST = 12
#: So many publishers of one name have a note each.
RUNS_AT_MOST = 50
#: The publishers that a plan starts once and never again.
_OWN = ("static", "joints")
#: tf2's buffers keep moving edges for 10 s; one that did not come for so long closes no loop any
#: more.
KEPT_S = 10.0
#: Of frames that nobody planned so many are remembered.
MOST_FRAMES = 10_000
#: Of one frame so many senders are remembered.
MOST_SENDERS = 16
#: Of one publisher's undeclared edges so many are judged; further ones are neither reported nor
#: admitted.
MOST_UNDECLARED = 1000
#: A loop is looked for so many edges up, so that a chain of thousands costs a bounded time; no
#: robot is that deep.
DEEPEST_LOOP = 100


@dataclass(frozen=True, slots=True)
class Violation:
    """One edge that was published by a node that may not, or in a way that it may not.

    Attributes:
        code: the finding's code. parent: the frame in which the pose was given. child: the frame
        whose pose it was. nodes: the nodes of which one did it: a single one where the rmw says
        who sent a message, none where the sender
            has no name.
        static: whether it came on /tf_static. edge: the planned edge of that child, None where
        nobody declared one. namesake: whether the publisher has the owner's name and is not the
        owner. loop: the frames of a loop that the edge closes. detail: what was seen of stamps, or
        who the other publisher is. recorded: whether it is from a recording, in which nobody has a
        name. stranger: whether the publisher is seen to be of no process that the plan starts,
        whatever its name. alternates: whether it is one of several with the owner's name that
        send by turns, of which any may be the owner. publishers: how many do it.
    """

    code: str
    parent: str
    child: str
    nodes: tuple[str, ...]
    static: bool
    edge: PlanEdge | None
    namesake: bool = False
    loop: tuple[str, ...] = ()
    detail: str = ""
    recorded: bool = False
    stranger: bool = False
    alternates: bool = False
    publishers: int = 1

    @property
    def who(self) -> str:
        """The publisher, as people read it."""
        if len(self.nodes) > 1:
            return f"one of {', '.join(self.nodes)}"
        name = self.nodes[0] if self.nodes else "somebody" if self.recorded else NAMELESS
        name = f"another {name}" if self.namesake else name
        return f"{name} ({self.publishers} processes)" if self.publishers > 1 else name

    @property
    def whom(self) -> str:
        """The publisher, as the one to do something about: one without a name was named just before."""
        if self.publishers > 1:
            return "all but one of them" if self.alternates else "them"
        if (not self.nodes and not self.recorded and not self.namesake) or self.nodes == (
            NO_NODE,
        ):
            return "it"
        return f"the other {self.nodes[0]}" if self.namesake and len(self.nodes) == 1 else self.who

    @property
    def name(self) -> str:
        """The edge that was received."""
        return f"{self.parent} → {self.child}"

    @property
    def is_owners(self) -> bool:
        """Whether the edge's owner did it."""
        return self.edge is not None and self.edge.node in self.nodes and not self.namesake

    @property
    def is_of_stamps(self) -> bool:
        """Whether it is about stamps, and over as soon as these are right."""
        return self.code in _OF_STAMPS

    def over(self, more: int = 0, *, kept: bool = False, who: str = "") -> str:
        """Return the sentence that it and so many ``more`` have ended; listeners may have ``kept`` what was latched.

        ``who`` is named instead of the node, where it is given.
        """
        named = f"{self.name} and {more} more edges" if more else self.name
        if self.is_of_stamps:
            return f"{self.who} stamps {named} as it should again"
        rest = (
            "; listeners keep what it latched until they get another value, or start again"
            if kept
            else ""
        )
        return f"{named} {'are' if more else 'is'} no longer published by {who or self.who}{rest}"


def code_of(edge: PlanEdge, parent: str, *, static: bool, owner: bool, sure: bool) -> str:
    """Return what is wrong with a planned edge that came with ``parent``, on /tf_static or not; empty if nothing is.

    ``owner`` says that its owner may have sent it, ``sure`` that nobody else can have.
    """
    if not edge.may_hang_on(parent):
        return "TF802"
    if not owner:
        return "TF801"
    return "TF809" if sure and static != (edge.kind == "static") else ""


def relays_of(plan: Plan) -> frozenset[str]:
    """Return the nodes that may pass on what others own: the guards of all hosts, where they are strict."""
    hosts = {None, *(process.host for process in plan.processes)}
    return frozenset(node for host in hosts for node in plan.guards_of(host))


def may_be_owners(
    edge: PlanEdge, nodes: Sequence[str], relays: frozenset[str] = frozenset()
) -> bool:
    """Return whether one of the nodes is the edge's owner, or passes on what the owner sends."""
    return edge.node in nodes or not relays.isdisjoint(nodes)


# Violations as findings.


def violation_finding(
    violations: Sequence[Violation],
    plan: Plan,
    runs: Sequence[str] = (),
    driven: Driven | None = None,
    place: Span | None = None,
) -> Finding:
    """Return the finding for violations of one kind by publishers of one name, which may drive a sensor.

    ``runs`` says of each of the publishers where it runs, empty where that is not known; ``place``
    is where the edge is in the robot's file, if that is at hand.
    """
    found = _by_edge(violations, runs)
    first = found[0]
    mild = first.code in _WARNINGS or (
        first.code == "TF803" and plan.guard.unknown_edges == "warn"
    )
    severity: Severity = "warning" if mild else "error"
    notes = [*_others(found), *([] if place else _declared(first)), *_runs(first, runs)]
    message = _unexpected_frames(first, _more(found), driven) or _message(found, plan)
    advice = (
        _driver_help(first, driven)
        or _switch_help(first, plan)
        or _help(first, plan, _pattern(found))
    )
    return finding(first.code, message, place, help=advice, notes=notes, severity=severity)


def taken_finding(violations: Sequence[Violation], runs: Sequence[str] = ()) -> Finding:
    """Return the finding for edges that publishers of one name, which run there, published before the start."""
    found = _by_edge(violations, runs)
    first = found[0]
    message = (
        f"{first.name}{_more(found)} {'are' if len(found) > 1 else 'is'} already published by"
        f" {first.who}"
    )
    if first.edge and not first.edge.may_hang_on(first.parent):
        message += f"; in the plan {first.child} is a child of "
        message += " or ".join((first.edge.parent, *first.edge.switched))
    if first.loop:
        message += f", which closes the loop {tree.way(first.loop)}"
    notes = [*_others(found), *_declared(first), *_runs(first, runs)]
    advice = f"end {first.whom}"
    if first.namesake:
        advice += ": is the robot running already?"
    elif len(first.nodes) == 1 and first.nodes[0] != NO_NODE:
        owner = f"processes: {{NAME: {{external: true, node: {first.nodes[0]}}}}}"
        advice += f", or let it own the edge: {owner}, and owner: NAME at the edge"
    return finding("TF807", message, None, help=advice, notes=notes)


def other_robot_finding(found: Sequence[Violation], run: OtherRun, plan: Plan) -> Finding:
    """Return the finding for all that another robot publishes here, whatever is wrong with each edge."""
    mild = all(one.edge is None and one.code in {"TF803", TWO_PUBLISHERS} for one in found)
    children = list(dict.fromkeys(one.child for one in found))
    message = (
        f"{run.name} (pid {run.pid}, since {run.since}) runs in this domain: it publishes"
        f" {listed(children)}"
    )
    nodes = dict.fromkeys(node for one in found for node in one.nodes)
    both = [one.child for one in found if one.edge is not None]
    notes = [Note(f"its nodes are {listed(nodes)}")] if nodes else []
    notes += [Note(f"both robots have {listed(dict.fromkeys(both))}")] if both else []
    advice = (
        f"end it: tfcompose down --robot {run.name}; or keep them apart: ros: {{domain_id:"
        " N}, or "
    )
    advice += "ros: {namespace: NAME, isolate: topics}"
    severity: Severity = "warning" if mild and plan.guard.unknown_edges == "warn" else "error"
    return finding("TF854", message, None, notes=notes, help=advice, severity=severity)


def misnamed_help(found: Sequence[Violation], plan: Plan, process: str) -> str:
    """Return what to do where the owner ``process`` itself sends the edges, by a node of another name; else nothing."""
    first = found[0]
    if first.code != "TF801" or first.namesake or len(first.nodes) != 1 or _run_by(first, plan):
        return ""
    if (
        not process
        or first.edge is None
        or any(one.edge is None or one.edge.owner != process for one in found)
    ):
        return ""
    return (
        f"it is {process} itself: write node: {first.who} there, or have the program name its node"
        f" {first.edge.node}"
    )


def _message(found: Sequence[Violation], plan: Plan) -> str:
    first, more = found[0], _more(found)
    named, are = f"{first.name}{more}", "are" if more else "is"
    edge = first.edge
    if first.loop:
        return tree.loop_message(first.loop, closed_by=f"{named} from {first.who}")
    if first.code == SELF:
        return tree.self_message(named, first.who)
    if first.code == TWO_PUBLISHERS:
        return publishers.two_publishers_message(
            named, [first.who, first.detail], several=bool(more)
        )
    if first.is_of_stamps:
        return stamps.message(first.code, first.who, named, first.detail)
    if edge is None:
        by = "recorded" if first.recorded else f"published by {first.who}"
        return f"{named} {are} {by}, but not declared"
    owner = f"{edge.owner} ({edge.node})"
    if first.code == "TF802":
        if first.recorded or first.is_owners:
            by = (
                f"{named} is recorded"
                if first.recorded
                else f"its owner {owner} publishes {named}"
            )
            return f"{first.child} has the wrong parent: {by}, declared is {edge.name}"
        parents = [(first.parent, first.who), (edge.parent, f"its owner {owner}")]
        return tree.two_parents_message(first.child, parents) + (f" ({named})" if more else "")
    if first.code == "TF809":
        fixed, moving = "/tf_static", "/tf"
        if edge.owner in {process.name for process in plan.processes}:
            moving, fixed = plan.process(edge.owner).topics
        topics = (fixed, moving) if first.static else (moving, fixed)
        by = "" if first.recorded else f"its owner {first.who}"
        return publishers.topics_message(
            named, [(topics[0], by)], declared=topics[1], several=bool(more)
        )
    owners = list(
        dict.fromkeys(f"{one.edge.owner} ({one.edge.node})" for one in found if one.edge)
    )
    owned_by = (
        f"the owner is {owners[0]}" if len(owners) == 1 else f"the owners are {', '.join(owners)}"
    )
    return f"{named} {are} published by {first.who}; {owned_by}"


def _help(first: Violation, plan: Plan, child: str) -> str:
    if first.code == "TF803":
        allowed = f"{{parent: {first.parent}, child: {child}}}"
        return f"declare it under frames, or allow it: guard: {{allow: [{allowed}]}}"
    if first.loop:
        return tree.loop_help(f"end {first.whom}")
    if first.is_of_stamps:
        return stamps.advice(first.code, first.detail)
    return _HELP.get(first.code) or _help_about(first, plan)


_HELP = {
    SELF: tree.SELF_HELP,
    TWO_PUBLISHERS: (
        "end one of them, or let each send a frame of its own: tf2 takes whatever came last"
    ),
    "TF809": "static: true says that the owner sends it on /tf_static",
}


def sensor_of(found: Violation, drives: Mapping[str, Sequence[Driven]]) -> Driven | None:
    """Return the sensor that the publisher drives; of several the one whose name the frame has."""
    driven = drives.get(found.nodes[0], ()) if len(found.nodes) == 1 and not found.namesake else ()
    named = [one for one in driven if one.sensor in found.child]
    return next(iter(named or driven), None)


def _unexpected_frames(found: Violation, more: str, driven: Driven | None) -> str:
    """Return the message for frames that a driver sends otherwise than its preset has them, or nothing."""
    if (
        driven is None
        or not driven.publishes
        or found.code not in _OTHERWISE
        or not _is_own(found)
    ):
        return ""
    expected = found.edge.name if found.edge else f"no frame {found.child}"
    return (
        f"preset {driven.preset} expects {expected}, the driver {found.who} sent"
        f" {found.name}{more}"
    )


def _driver_help(found: Violation, driven: Driven | None) -> str:
    """Return what to do about a driver, or nothing."""
    if driven is None or found.code not in {*_OTHERWISE, "TF801"}:
        return ""
    if driven.publishes and found.code in _OTHERWISE and _is_own(found):
        frames = f"frames: {{{found.child}: {{parent: {found.parent}}}}}"
        return f"describe what the driver does under sensors.{driven.sensor}: " + (
            frames if found.edge else "options with that frame"
        )
    switch = ", ".join(f"{name}: {json.dumps(value)}" for name, value in driven.switch.items())
    ignores = (
        f"{found.whom} drives {driven.sensor} ({driven.preset}) and ignores its switch: start it"
        f" with {switch}"
    )
    return ignores if switch else ""


def _is_own(found: Violation) -> bool:
    """Return whether the plan gives the edge to the publisher, or to no process."""
    return found.edge is None or found.edge.node in found.nodes


def _help_about(first: Violation, plan: Plan) -> str:
    """Return what to do about a publisher of another's edge, or one with the wrong parent."""
    if first.namesake:
        return f"end {first.whom}: is the robot running twice? tf2 takes whatever came last"
    if first.recorded:
        return "tf2 takes whatever came last"
    if first.code == "TF802" and first.is_owners:
        return f"correct what {first.who} publishes, or the parent in the robot's file"
    if process := _run_by(first, plan):
        owns = f", or own it: owner: {process}" if first.code == "TF801" else ""
        component = plan.process(process).component
        which = f", a component of {component.container}," if component else ""
        return f"let {first.who}{which} leave {first.child} out{owns}"
    if first.nodes == (NO_NODE,):
        return (
            f"end {first.whom}, or start it with another DDS domain: ss -lunp lists the programs"
            " that use UDP ports of DDS, which begin at 7400"
        )
    its = "their" if first.publishers > 1 else "its"
    return f"end {first.whom}, or switch {its} TF off; tf2 takes whatever came last"


def _run_by(first: Violation, plan: Plan) -> str:
    """Return which process with programs of the robot's own the publisher is of, if it is surely one."""
    kinds = {"external"} if first.stranger else {"run", "external", "component"}
    for process in plan.processes if len(first.nodes) == 1 else ():
        if process.kind in kinds and first.nodes[0] in process.nodes:
            return process.name
    return ""


def _switch_help(first: Violation, plan: Plan) -> str:
    """Return what to set, where it is known that the node publishes the edge by default."""
    claim = plan.claim_on(first.nodes, first.parent, first.child)
    if claim is None or first.namesake:
        return ""
    if not claim.switch:
        return (
            f"{first.who} publishes it by default and has no switch: let its process own the edge"
        )
    return f"{first.who} publishes it by default: set {claim.switch}"


def _more(found: Sequence[Violation]) -> str:
    return f" and {counted(len(found) - 1, 'more edge')}" if len(found) > 1 else ""


def _pattern(found: Sequence[Violation]) -> str:
    """Return the child frame, or what stands for all of them where they are one name with numbers: ``tag_*``."""
    children = [one.child for one in found]
    begins = {child.rstrip("0123456789") for child in children}
    return (
        f"'{begins.pop()}*'"
        if len(children) > 1 and len(begins) == 1 and "" not in begins
        else children[0]
    )


def _others(found: Sequence[Violation]) -> list[Note]:
    if len(found) == 1:
        return []
    listed = [Note(one.name) for one in found[:LISTED_AT_MOST]]
    more = len(found) - len(listed)
    return [*listed, Note(f"and {more} more")] if more else listed


def _declared(first: Violation) -> list[Note]:
    edge = first.edge
    return [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}")] if edge else []


def _by_edge(violations: Sequence[Violation], runs: Sequence[str]) -> list[Violation]:
    """Return one violation for each edge, by as many publishers as ``runs`` has."""
    edges = {(violation.parent, violation.child): violation for violation in violations}
    # Each of two publishers of an edge is named with the other; of those that alternate one may be
    # the owner.
    is_pair = violations[0].code == TWO_PUBLISHERS
    number = 1 if is_pair else max(1, len(runs) - violations[0].alternates)
    return [replace(violation, publishers=number) for violation in edges.values()]


def _runs(first: Violation, runs: Sequence[str]) -> list[Note]:
    """Return a note for each publisher with where it runs."""
    who = replace(first, publishers=1, namesake=first.namesake and not first.alternates).who
    notes = [Note(f"{who} runs {where}") for where in runs if where and len(first.nodes) <= 1]
    more = len(notes) - RUNS_AT_MOST
    return [*notes[:RUNS_AT_MOST], Note(f"and {more} more")] if more > 0 else notes


# Violations message by message.


class LastSenders:
    """Who sent each frame last, and before: tells those that alternate from one that was restarted."""

    def __init__(self) -> None:
        self._gids: OrderedDict[str, tuple[bytes, ...]] = OrderedDict()

    def take(self, child: str, gid: bytes) -> tuple[bytes, bool]:
        """Note that this publisher sent the frame now; return the current one until now, and whether ``gid`` is back.

        It is where it has sent the frame before, and another has since.
        """
        gids = self._gids.get(child, (gid,))
        current = gids[-1]
        if current == gid:
            self._gids[child] = gids
        else:
            self._gids[child] = (*(other for other in gids if other != gid), gid)[-MOST_SENDERS:]
        if len(self._gids) > MOST_FRAMES:
            self._gids.popitem(last=False)
        return current, current != gid and gid in gids

    def forget(self, child: str) -> None:
        """Take whoever sends the frame next as the first."""
        self._gids.pop(child, None)

    def is_known(self, child: str) -> bool:
        """Return whether the frame was sent before."""
        return child in self._gids

    def current(self, child: str) -> bytes | None:
        """Return who sent it last."""
        return self._gids[child][-1] if child in self._gids else None

    def memory(self) -> dict[str, tuple[str, ...]]:
        """Return what the next guard must know: by frame who sent it, the last one last, in hexadecimal."""
        return {child: tuple(gid.hex() for gid in gids) for child, gids in self._gids.items()}

    def recall(self, memory: dict[str, tuple[str, ...]]) -> None:
        """Know what the guard before knew."""
        for child, gids in memory.items():
            self._gids[child] = tuple(map(bytes.fromhex, gids))


class KnownTree:
    """Each frame's parent: by the plan, or as others have sent it."""

    def __init__(self, plan: Plan) -> None:
        self._planned = {edge.child: edge.parent for edge in plan.edges}
        self._others: OrderedDict[str, tuple[str, float]] = OrderedDict()

    def add(self, parent: str, child: str, now: float, *, static: bool) -> bool:
        """Note an edge that is not in the plan, and return whether it changes the tree."""
        before = self._others.get(child)
        self._others[child] = (parent, float("inf") if static else now)
        self._others.move_to_end(child)
        if len(self._others) > MOST_FRAMES:
            self._others.popitem(last=False)
        return before is None or before[0] != parent

    def loop(self, parent: str, child: str, now: float) -> tuple[str, ...]:
        """Return the frames of the loop that the edge closes, from ``child`` down to it again; () if it closes none."""
        left = iter(range(DEEPEST_LOOP))
        return loop_closed_by(
            (parent, child),
            lambda frame: None if next(left, None) is None else self._parent(frame, now),
        )

    def is_planned(self, parent: str, child: str) -> bool:
        """Return whether the plan has this edge."""
        return self._planned.get(child) == parent

    def _parent(self, frame: str, now: float) -> str | None:
        if frame in self._planned:
            return self._planned[frame]
        parent, since = self._others.get(frame, (None, 0.0))
        return parent if now - since < KEPT_S else None


@dataclass(slots=True)
class Start:
    """When the observation before the start began and ended; in monotonic seconds, and by the system's clock."""

    begun: float
    begun_ns: int
    cleared: float | None = None
    cleared_ns: int = 0

    def clear(self, now: float) -> None:
        """Note that the observation is over."""
        self.cleared = now
        self.cleared_ns = self.begun_ns + int((now - self.begun) * 1e9)


@dataclass(frozen=True, slots=True)
class SentEdge:
    """An edge as it was published on a topic."""

    gid: bytes | None
    parent: str
    child: str
    static: bool


class OwnershipRules:
    """The plan's edges and owners, and what others have added; ``changes`` counts what can change a verdict."""

    def __init__(self, plan: Plan, senders: Senders, start: Start) -> None:
        self.changes = 0
        self.owners = LastSenders()
        self.planned: dict[str, PlanEdge] = {edge.child: edge for edge in plan.edges}
        self.started = {process.name: process.kind != "external" for process in plan.processes}
        self._plan = plan
        self._senders = senders
        self._start = start
        self._others = LastSenders()
        self._tree = KnownTree(plan)

    def violation(self, sent: SentEdge, nodes: tuple[str, ...], now: float) -> Violation | None:
        """Return what is wrong with an edge that one of these nodes sent, or None."""
        edge = self.planned.get(sent.child)
        parent, child, static = sent.parent, sent.child, sent.static
        if parent == child:
            return Violation(SELF, parent, child, nodes, static, edge)
        if edge is None:
            return self._unplanned(sent, nodes, now)
        code = code_of(edge, parent, static=static, owner=edge.node in nodes, sure=len(nodes) == 1)
        loop = self._tree.loop(parent, child, now) if code == "TF802" else ()
        may_be_owner = code in {"", "TF809"}
        namesake = may_be_owner and self._is_namesake(edge, sent)
        alternates = may_be_owner and not namesake and self._alternates(edge, sent)
        code = LOOP if loop else "TF801" if namesake or alternates else code
        if not code:
            return None
        found = Violation(code, parent, child, nodes, static, edge, namesake or alternates, loop)
        return replace(found, alternates=True) if alternates else found

    def may_be_undeclared(self, parent: str, child: str) -> bool:
        """Return whether the plan lets somebody publish the edge though nobody declared it."""
        return self._plan.may_be_undeclared(parent, child)

    def _unplanned(self, sent: SentEdge, nodes: tuple[str, ...], now: float) -> Violation | None:
        """Judge an edge that the plan does not have."""
        parent, child, static = sent.parent, sent.child, sent.static
        if self._tree.add(parent, child, now, static=static):
            self.changes += 1
        undeclared = not self.may_be_undeclared(parent, child)
        loop = self._tree.loop(parent, child, now)
        ours = any(self._tree.is_planned(*edge) for edge in pairwise(loop))
        if loop and (ours or undeclared):
            return Violation(LOOP, parent, child, nodes, static, None, loop=loop)
        if undeclared:
            return Violation("TF803", parent, child, nodes, static, None)
        if sent.gid is None:
            return None
        current, is_back = self._others.take(child, sent.gid)
        self.changes += current != sent.gid
        if not (is_back and self._senders.is_present(current)):
            return None
        named = self._senders.nodes(current, static=static)
        other = named[0] if len(named) == 1 else "another"
        return Violation(TWO_PUBLISHERS, parent, child, nodes, static, None, detail=other)

    def _is_namesake(self, edge: PlanEdge, sent: SentEdge) -> bool:
        """Return whether a publisher has the owner's name and is surely not the owner.

        A process of this run proves by its environment which one it is: where the plan starts the
        owner, no other process is it, and nobody else while it is there itself. Without proof it
        is another where it spoke before the start, and where tfcompose's own publisher, which is
        never restarted, is there already.
        """
        gid, sender, start = sent.gid, self._senders.sender(sent.gid), self._start
        if gid is None or sender is None or not self.started.get(edge.owner, False):
            return False
        proven = self._senders.process(gid)
        if proven != edge.owner:
            early = start.cleared is None or sender.first_ns < start.cleared_ns
            shown = self._senders.shows_process(edge.owner, edge.node, static=sent.static)
            if proven or early or (shown and self._senders.is_sure(gid)):
                return True
        current = self.owners.current(edge.child)
        if edge.owner not in _OWN or current in {None, gid}:
            return False
        is_proven = bool(proven) and self._senders.process(current) != proven
        return self._senders.is_present(current) and not is_proven

    def _alternates(self, edge: PlanEdge, sent: SentEdge) -> bool:
        """Return whether several with the owner's name send the edge by turns: A, B, and A again.

        Any of them may be the owner, unless one has proven that it is. Fixed edges come again
        whenever a subscription is made anew.
        """
        gid = sent.gid
        if gid is None or self._senders.sender(gid) is None:
            return False
        current, is_back = self.owners.take(edge.child, gid)
        if current == gid:
            return False
        self.changes += 1
        proven = self._senders.process(gid) if self.started.get(edge.owner, False) else ""
        if proven and self._senders.process(current) != proven:
            return False
        return is_back and not sent.static
