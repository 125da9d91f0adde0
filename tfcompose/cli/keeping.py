"""The copy of a plan that a run is made from, and what earlier runs left behind."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from typing import TYPE_CHECKING

from tfcompose.cli.terminal import UNREADABLE, complain
from tfcompose.plan.file import write_plan
from tfcompose.run.launcher.leftovers import leftovers, variables_of
from tfcompose.run.publishing.addresses import with_whole_addresses

if TYPE_CHECKING:
    from pathlib import Path

    from tfcompose.plan import Plan
    from tfcompose.run.place import Place

PLAN = "plan.json"


def kept(plan: Plan, file: Path, place: Place, *, alone: bool) -> Path | int:
    """Copy the plan, and what stands beside it, to where the run is; return the copy, or an exit code with a complaint.

    A build then does not reach into a run. Meshes stay where they are: descriptions address them from the copy too.
    ``alone`` removes the copies of earlier runs.
    """
    parts = {PLAN: write_plan(plan).encode()}
    descriptions = {plan.description, *(one.description for one in plan.processes if one.description is not None)}
    try:
        for name in (*descriptions, *(process.params_file for process in plan.processes)):
            if name is not None and (file.parent / name).is_file():
                parts[name] = (file.parent / name).read_bytes()
        for name in descriptions & parts.keys():
            parts[name] = _addressed(parts[name], (file.parent / name).parent)
        digest = hashlib.sha256(repr(sorted(parts.items())).encode()).hexdigest()[:16]
        folder = place.folder / f"plan-{digest}"
        if alone:
            for old in set(place.folder.glob("plan-*")) - {folder}:
                shutil.rmtree(old, ignore_errors=True)
        try:
            _copy(parts, folder)
        except FileNotFoundError:  # who has won the race for the run removed it as an earlier one's
            _copy(parts, folder)
    except OSError as error:
        complain(f"the plan cannot be copied to {place.folder}: {error.strerror}")
        return UNREADABLE
    return folder / PLAN


def _copy(parts: dict[str, bytes], folder: Path) -> None:
    """Write the files, each at once: another ``up`` may write the same, and the run's processes read them."""
    for name, data in parts.items():
        file = folder / name
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        new = file.with_name(f".{file.name}.{os.getpid()}")
        new.write_bytes(data)
        new.replace(file)


def _addressed(urdf: bytes, folder: Path) -> bytes:
    """Return a description with whole addresses; bytes that are no text stay, for their reader to refuse."""
    try:
        return with_whole_addresses(urdf.decode("utf-8"), folder).encode()
    except UnicodeDecodeError:
        return urdf


def runs_elsewhere(place: Place) -> str | None:
    """Return what is to be said if the robot runs already, where this runtime folder does not show it."""
    led = [one for one in leftovers(f"{place.name}:") if one.launcher not in (None, os.getpid())]
    if not led or led[0].launcher is None:
        return None
    with contextlib.suppress(OSError):
        folder = variables_of(led[0].launcher).get("XDG_RUNTIME_DIR")
        where = f"XDG_RUNTIME_DIR={folder}" if folder else "no XDG_RUNTIME_DIR"
        return f"{place.name} runs already: pid {led[0].launcher}, with {where}; ps and down find it there"
    return None


def left_behind(place: Place, run_id: str) -> list[str]:
    """Return what is to be said about processes of earlier runs that are still there."""
    found = [one for one in leftovers(f"{place.name}:") if one.run != run_id and one.launcher is None]
    if not found:
        return []
    lines = [f"an earlier run left {one.pid} behind: {one.command}" for one in found]
    return [*lines, f"tfcompose down --leftovers --robot {place.name} stops {'it' if len(found) == 1 else 'them'}"]
