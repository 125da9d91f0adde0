"""Adjusted poses of fixed edges of a running robot.

An adjustment is a copy of the plan that the robot runs, and of its descriptions, with other poses.
The launcher follows it without a restart: the edge's publisher sends the new pose, and late
listeners and restarted processes get it, too. The robot file stays as it is.
"""

from __future__ import annotations

import os
import random
import shutil
import time
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING

from tfcompose.cli.plans import PLAN, digest_of, files_of, write_copy
from tfcompose.cli.runs import plan_file
from tfcompose.compiler.emit.argv import edit_description
from tfcompose.compiler.urdf.write import with_pose
from tfcompose.foundation import procfs
from tfcompose.foundation.numbers import clean
from tfcompose.launcher.control import RequestRefusedError, ask
from tfcompose.model.messages import AdjustRequest, PlanChange
from tfcompose.model.plan.file import read_plan

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from tfcompose.foundation.geometry import Pose
    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.plan import Plan, PlanEdge, PlanProcess

#: The edges to replace, by child.
Edges = dict[str, "PlanEdge"]
#: Number of earlier poses that an edge keeps; the built one is always among them.
MOST_EARLIER = 100
#: How long to try again while other commands change the plan, and the longest pause between two
#: attempts, in seconds. The pauses are random: otherwise the quicker one of two commands wins
#: each time.
_RETRY_S, _PAUSE_S = 5.0, 0.05
#: How long copies of earlier adjustments are kept after they were replaced, in seconds.
_KEPT_S = 5.0


@dataclass(frozen=True, slots=True)
class RunningPlan:
    """The plan that a robot runs, and its file in the runtime directory."""

    plan: Plan
    file: Path


def running_plan(runtime_dir: RuntimeDir) -> RunningPlan:
    """Return the plan that the robot runs.

    Raises:
        RejectedError, OSError, ValueError: if it cannot be read.
    """
    file = plan_file(runtime_dir)
    return RunningPlan(read_plan(file.read_text(encoding="utf-8"), str(file)), file)


def moved(edge: PlanEdge, pose: Pose) -> PlanEdge:
    """Return the edge at another pose; it remembers the current one."""
    pose = clean(pose)
    if pose == edge.pose:
        return edge
    earlier = (*edge.earlier, edge.pose)
    return replace(edge, pose=pose, earlier=(earlier[0], *earlier[1:][1 - MOST_EARLIER :]))


def undone(edge: PlanEdge) -> PlanEdge:
    """Return the edge before its last adjustment."""
    return replace(edge, pose=edge.earlier[-1], earlier=edge.earlier[:-1])


def reset(edge: PlanEdge) -> PlanEdge:
    """Return the edge as it was built."""
    return replace(edge, pose=edge.earlier[0], earlier=())


def describe_adjustment(edge: PlanEdge) -> str:
    """Return how far an edge of the running robot is from the built one."""
    return f"adjusted by {edge.adjustment.text}" if edge.adjustment else "as built"


def adjust(runtime_dir: RuntimeDir, choose: Callable[[Plan], Edges]) -> Edges:
    """Have a running robot follow other poses, and return the edges with them.

    ``choose`` returns the changed edges of a plan by child. It is called again if another command
    changed the plan meanwhile, so that no adjustment is lost.

    Raises:
        RequestRefusedError: with the launcher's reason.
        OSError: if the robot does not answer, or a file cannot be read or written.
        RejectedError, ValueError: if its plan cannot be read.
    """
    end = time.monotonic() + _RETRY_S
    while True:
        running = running_plan(runtime_dir)
        edges = choose(running.plan)
        plan = replace(
            running.plan,
            edges=tuple(edges.get(edge.child, edge) for edge in running.plan.edges),
        )
        if plan == running.plan:
            return edges
        files = _files_of(plan, running.file.parent, edges)
        folder = runtime_dir.plan_folder(digest_of(files))
        write_copy(files, folder)
        try:
            ask(runtime_dir, AdjustRequest(str(folder / PLAN), str(running.file)), PlanChange)
        except RequestRefusedError:
            if time.monotonic() > end or plan_file(runtime_dir) == running.file:
                raise
            time.sleep(random.uniform(0, _PAUSE_S))  # noqa: S311 (no secret)
            continue
        _remove_earlier(runtime_dir, running.file.parent)
        return edges


def _files_of(plan: Plan, folder: Path, edges: Edges) -> Mapping[str, bytes]:
    """Return the plan's files; descriptions have the edges' poses."""
    files = files_of(plan, folder)

    def edit(name: str, change: Callable[[str], str]) -> None:
        if name in files:
            files[name] = change(files[name].decode("utf-8")).encode()

    for edge in edges.values():
        owner = plan.process(edge.owner)
        part = _part(owner)
        place = partial(with_pose, parent=edge.parent, child=edge.child, pose=edge.pose)
        for description in {plan.description, owner.description or plan.description}:
            edit(description, place)
        for process in plan.processes:
            if process.is_state_publisher and _part(process) in {"", part}:
                edit(process.params_file or "", partial(edit_description, edit=place))
    return files


def _part(process: PlanProcess) -> str:
    """Return the part that a process belongs to; empty: the robot."""
    return process.name.rpartition("/")[0]


def _remove_earlier(runtime_dir: RuntimeDir, replaced: Path) -> None:
    """Remove copies of earlier adjustments, unless a process was started with one.

    A process that is being started shows the copy in its command line a moment later: a copy that
    was just ``replaced`` is kept for that time.
    """
    try:
        os.utime(replaced)
        current = runtime_dir.linked_plan()
    except OSError:  # another command has removed the copy, or the robot has ended
        return
    before = time.time() - _KEPT_S
    earlier = [
        folder
        for folder in runtime_dir.plan_folders()
        if folder != current and _is_adjusted(folder, before)
    ]
    arguments = "\n".join(chain.from_iterable(map(_argv, procfs.pids() if earlier else ())))
    for folder in earlier:
        if folder.name not in arguments:
            shutil.rmtree(folder, ignore_errors=True)


def _is_adjusted(folder: Path, before_s: float) -> bool:
    """Return whether a copy has adjusted edges, and was replaced before that time."""
    try:
        text = (folder / PLAN).read_text(encoding="utf-8")
        return '"earlier": ' in text and folder.stat().st_mtime < before_s
    except OSError:
        return False


def _argv(pid: int) -> list[str]:
    """Return a process's command line; empty if it has ended."""
    try:
        return procfs.argv(pid)
    except OSError:
        return []
