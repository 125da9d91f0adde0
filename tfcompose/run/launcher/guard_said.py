"""What follows from what the guard says, and what is said to one that joins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.ipc import (
    Absent,
    Alive,
    Clear,
    Complete,
    Found,
    Live,
    OwnerLive,
    Present,
    Recovered,
    RecoveredShown,
    Remember,
    Silent,
    TreeComplete,
)
from tfcompose.run.launcher.action import Order
from tfcompose.run.launcher.gates import kind_of, opened
from tfcompose.run.launcher.offender import judged
from tfcompose.run.launcher.vigil import heard

if TYPE_CHECKING:
    from tfcompose.run.launcher.happening import Event
    from tfcompose.run.launcher.state import Tracked
    from tfcompose.run.launcher.turn import Turn


def guard_said(turn: Turn, event: Event) -> None:
    """Take what the guard says of the tree; other events are left alone."""
    seconds = turn.now - (turn.state.begun or 0.0)
    match event:
        case Alive():
            heard(turn)
        case Clear():
            _cleared(turn, seconds)
        case Live(children=children):
            turn.know(live=turn.state.live.union(children))
        case Silent(children, over):
            silent = turn.state.silent
            turn.know(silent=silent.difference(children) if over else silent.union(children))
        case Complete(edges):
            _complete(turn, edges)
        case Found(found, process):
            judged(turn, found, process)
        case Recovered(message):
            turn.tell(RecoveredShown(message, seconds))
        case Remember(changed):
            turn.know(memory=turn.state.memory | changed)
        case _:
            pass


def owner_ready(turn: Turn, process: str) -> None:
    """Note that all edges of the owner are live."""
    if kind_of(turn.state.tracked[process].process) == "edges":
        opened(turn, process, "its edges are live")
    edges = turn.state.plan.edges_of(process)
    if edges:
        names = tuple(edge.name for edge in edges)
        turn.tell(OwnerLive(process, edges[0].node, names, turn.now - (turn.state.begun or 0.0)))
        if not turn.state.missing:
            _complete(turn, len(turn.state.plan.edges))


def say_of(turn: Turn, owner: Tracked) -> None:
    """Tell a guard that joins what became of an owner meanwhile, whatever the one before it knew."""
    name = owner.process.name
    runs = owner.state in ("STARTING", "RUNNING", "EXPECTED")
    missing = any(child not in turn.state.live for _, child in owner.process.owns)
    if owner.process.owns and not runs:
        turn.actions.append(Order(Absent(name)))
    elif missing and turn.state.memory:
        turn.actions += [Order(Absent(name)), Order(Present(name))]


def _cleared(turn: Turn, seconds: float) -> None:
    state = turn.state
    if state.clear is None:
        turn.know(clear=turn.now)
    if state.unwatched is not None:
        turn.know(unwatched=None)
        turn.tell(RecoveredShown(f"{state.guard} watches again after {turn.now - state.unwatched:.1f} s", seconds))


def _complete(turn: Turn, edges: int) -> None:
    if not turn.state.complete:
        turn.know(complete=True)
        turn.tell(TreeComplete(edges, turn.now - (turn.state.begun or 0.0)))
