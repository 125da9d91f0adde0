"""Offences in words: the edge, who sent it, who owns it, and what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding
from tfcompose.verdict.driven import advice_of, message_of
from tfcompose.verdict.offence import BACK, REPEATED, SELF, TWO_WRITERS, WRONG_CLOCK

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.catalogue import Severity
    from tfcompose.findings import Span
    from tfcompose.plan import Driven, Plan, PlanEdge
    from tfcompose.verdict.offence import Offence

LISTED_AT_MOST = 12
_ADVICE = {
    SELF: "no listener gets it; give the node's child frame another name, or switch its TF off",
    TWO_WRITERS: "tf2 takes whatever came last: end one of them, or let each send a frame of its own",
    REPEATED: "tf2 drops all but the first; stamp with the time of the measurement, or send when there is a new one",
    BACK: "tf2 sorts it in behind newer ones, or drops it; is a bag being played, or was a clock set?",
    WRONG_CLOCK: "no lookup brings it together with the rest: use_sim_time and ros.clock must agree, and hosts in sync",
}


def violation(
    offences: Sequence[Offence], plan: Plan, where: str = "", driven: Driven | None = None, place: Span | None = None
) -> Finding:
    """Return the finding for offences of one kind by one node, that runs ``where`` and may drive a sensor.

    ``place`` is where the edge stands in the robot's file, if that is at hand.
    """
    first = offences[0]
    severity: Severity | None = "warning" if first.code == "TF803" and plan.guard.unknown_edges == "warn" else None
    notes = [*_others(offences), *([] if place else _declared(first)), *_runs(first, where)]
    message = message_of(first, _more(offences), driven) or _message(offences, plan)
    advice = advice_of(first, driven) or _switch(first, plan) or _help(first, plan, _pattern(offences))
    return finding(first.code, message, place, help=advice, notes=notes, severity=severity)


def taken(offences: Sequence[Offence], where: str = "") -> Finding:
    """Return the finding for edges that a node, that runs ``where``, published before the start."""
    first = offences[0]
    message = f"{first.name}{_more(offences)}: published by {first.who} before the start"
    if first.edge and not first.edge.may_hang_on(first.parent):
        message += f", and the plan hangs {first.child} on {' or '.join((first.edge.parent, *first.edge.switched))}"
    if first.loop:
        message += f", which closes the loop {_loop(first)}"
    notes = [*_others(offences), *_declared(first), *_runs(first, where)]
    advice = f"end {first.whom}"
    if first.namesake:
        advice += ": is the robot running already?"
    elif len(first.nodes) == 1:
        owner = f"processes: {{NAME: {{external: true, node: {first.nodes[0]}}}}}"
        advice += f", or let it own the edge: {owner}, and owner: NAME at the edge"
    return finding("TF807", message, None, help=advice, notes=notes)


def misnamed(offences: Sequence[Offence], plan: Plan, process: str) -> str:
    """Return what to do where the owner ``process`` itself sends the edges, by a node of another name; else nothing."""
    first = offences[0]
    if first.code != "TF801" or first.namesake or len(first.nodes) != 1 or _run_by(first, plan):
        return ""
    if not process or first.edge is None or any(one.edge is None or one.edge.owner != process for one in offences):
        return ""
    return f"it is {process} itself: write node: {first.who} there, or have the program name its node {first.edge.node}"


def _message(offences: Sequence[Offence], plan: Plan) -> str:
    first = offences[0]
    more = _more(offences)
    verb = "are" if more else "is"
    edge = first.edge
    if first.loop:
        return f"{first.who} publishes {first.name}{more}, which closes the loop {_loop(first)}"
    if first.code == SELF:
        return f"{first.who} publishes {first.name}{more}, a frame in itself, which tf2 drops"
    if first.code == TWO_WRITERS:
        return f"{first.name}{more} {verb} published by {first.who}, and {first.detail}"
    if first.of_stamps:
        return _of_stamps(first, more)
    if edge is None:
        by = "recorded" if first.recorded else f"published by {first.who}"
        return f"{first.name}{more} {verb} {by}, and nobody declared {'them' if more else 'it'}"
    if first.code == "TF802":
        return _of_parents(first, edge, more)
    if first.code == "TF809":
        fixed, moving = "/tf_static", "/tf"
        if edge.owner in {process.name for process in plan.processes}:
            moving, fixed = plan.process(edge.owner).topics
        topics = (fixed, moving) if first.static else (moving, fixed)
        by = "" if first.recorded else f" by its owner {first.who}"
        return f"{first.name}{more} {verb} published{by} on {topics[0]}, declared for {topics[1]}"
    owners = list(dict.fromkeys(f"{o.edge.owner} ({o.edge.node})" for o in offences if o.edge))
    owner = f"the owner is {owners[0]}" if len(owners) == 1 else f"the owners are {', '.join(owners)}"
    return f"{first.name}{more} {verb} published by {first.who}; {owner}"


def _of_parents(first: Offence, edge: PlanEdge, more: str) -> str:
    if first.recorded:
        return f"{first.child} hangs on {first.parent}{more}, and belongs on {edge.parent}"
    owner = f"{edge.owner} ({edge.node})"
    if first.is_owners:
        publishes = f"its owner {owner} publishes {first.name}{more}"
        return f"{first.child} hangs on {first.parent}: {publishes}, declared is {edge.name}"
    return f"{first.child} has a second parent: {first.who} publishes {first.name}{more}, {owner} {edge.name}"


def _loop(first: Offence) -> str:
    return " → ".join(first.loop)


def _of_stamps(first: Offence, more: str) -> str:
    if first.code == REPEATED:
        return f"{first.who} sends {first.name}{more} with the same stamp again and again: {first.detail}"
    if first.code == BACK:
        return f"{first.who} stamps {first.name}{more} back in time, by {first.detail}"
    return f"{first.who} stamps {first.name}{more} {first.detail}"


def _runs(first: Offence, where: str) -> list[Note]:
    return [Note(f"{first.who} runs {where}")] if where and len(first.nodes) <= 1 else []


def _more(offences: Sequence[Offence]) -> str:
    more = len(offences) - 1
    return f" and {more} more edge{'s' if more > 1 else ''}" if more else ""


def _pattern(offences: Sequence[Offence]) -> str:
    """Return the child frame, or what stands for all of them where they are one name with numbers: ``tag_*``."""
    children = [one.child for one in offences]
    begins = {child.rstrip("0123456789") for child in children}
    return f"'{begins.pop()}*'" if len(children) > 1 and len(begins) == 1 and "" not in begins else children[0]


def _help(first: Offence, plan: Plan, child: str) -> str:
    if first.code == "TF803":
        allowed = f"{{parent: {first.parent}, child: {child}}}"
        return f"declare it under frames, or allow it: guard: {{allow: [{allowed}]}}"
    if first.code in _ADVICE:
        return _ADVICE[first.code]
    if first.loop:
        return f"end {first.whom}, or turn the edge round; while it is there, tf2 finds no way through these frames"
    if first.code == "TF809":
        return "static: true says that the owner sends it on /tf_static"
    if first.namesake:
        return f"end {first.whom}: is the robot running twice? tf2 takes whatever came last"
    if first.recorded:
        return "tf2 takes whatever came last"
    if first.code == "TF802" and first.is_owners:
        return f"correct what {first.who} publishes, or the parent in the robot's file"
    if process := _run_by(first, plan):
        owns = f", or own it: owner: {process}" if first.code == "TF801" else ""
        return f"let {first.who} leave {first.child} out{owns}"
    return f"end {first.whom}, or switch its TF off; tf2 takes whatever came last"


def _run_by(first: Offence, plan: Plan) -> str:
    """Return which process with programs of the robot's own the offender is of, if it is surely one."""
    for process in plan.processes if len(first.nodes) == 1 else ():
        if process.kind in {"run", "external"} and first.nodes[0] in process.nodes:
            return process.name
    return ""


def _switch(first: Offence, plan: Plan) -> str:
    """Return what to set, where it is known that the node publishes the edge by default."""
    claim = plan.claim_on(first.nodes, first.parent, first.child)
    if claim is None or first.namesake:
        return ""
    if not claim.switch:
        return f"{first.who} publishes it by default and has no switch: let its process own the edge"
    return f"{first.who} publishes it by default: set {claim.switch}"


def _others(offences: Sequence[Offence]) -> list[Note]:
    if len(offences) == 1:
        return []
    listed = [Note(offence.name) for offence in offences[:LISTED_AT_MOST]]
    more = len(offences) - len(listed)
    return [*listed, Note(f"and {more} more")] if more else listed


def _declared(first: Offence) -> list[Note]:
    edge = first.edge
    return [Note(f"{edge.name} is declared in {edge.source[0]}:{edge.source[1]}")] if edge else []
