"""What another plan changes about a run: which processes must start anew, and what listeners will still hold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tfcompose.plan import SourceLine

if TYPE_CHECKING:
    from pathlib import Path

    from tfcompose.plan import Plan, PlanProcess


@dataclass(frozen=True, slots=True)
class Change:
    """The processes that are in both plans and different, and the fixed frames that listeners keep as they were."""

    changed: frozenset[str]
    held: tuple[str, ...]


def change(old: Plan, old_folder: Path, new: Plan, new_folder: Path) -> Change:
    """Return what is different; the folders hold what stands beside the plans."""
    described = _bytes(old_folder, old.description) != _bytes(new_folder, new.description)
    before = {process.name: process for process in old.processes}
    changed = set()
    for process in new.processes:
        other = before.get(process.name)
        if other is None:
            continue
        same = (
            process == other
            and (old.ros, _fence(old)) == (new.ros, _fence(new))
            and _data(old, other, old_folder) == _data(new, process, new_folder)
        )
        if not same or (described and process.kind in ("static", "joints")):
            changed.add(process.name)
    return Change(frozenset(changed), _held(old, new))


def _data(plan: Plan, process: PlanProcess, folder: Path) -> tuple[object, ...]:
    """Return what the process reads beside its own entry; where an edge stands in the file does not matter."""
    edges = plan.edges if process.kind == "guard" else plan.edges_of(process.name)
    policy = plan.guard if process.kind == "guard" else None
    return (
        tuple(replace(edge, source=SourceLine("", 0)) for edge in edges),
        policy,
        _bytes(folder, process.params_file),
    )


def _fence(plan: Plan) -> tuple[str, str] | None:
    """Return behind which fence the plan's processes send, if there is one: it is put up when they start."""
    return (plan.robot, plan.guard.fence) if plan.guard.mode == "strict" else None


def _bytes(folder: Path, name: str | None) -> bytes | None:
    try:
        return None if name is None else (folder / name).read_bytes()
    except OSError:
        return None


def _held(old: Plan, new: Plan) -> tuple[str, ...]:
    """Return the fixed edges that vanish: tf2 never forgets one, so listeners keep it until they start anew."""
    children = {edge.child for edge in new.edges}
    return tuple(edge.name for edge in old.edges if edge.kind == "static" and edge.child not in children)
