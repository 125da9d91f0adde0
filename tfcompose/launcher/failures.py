"""Findings of the launcher, and descriptions of a process's end."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, Note, finding
from tfcompose.foundation.text import list_names

if TYPE_CHECKING:
    from tfcompose.launcher.events import Exited
    from tfcompose.launcher.state import Tracked
    from tfcompose.model.plan import PlanEdge


#: Maximum number of edges of an owner that a finding lists.
NAMED_AT_MOST = 12


def signal_name(number: int) -> str:
    """Return the signal's name, such as SIGSEGV."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def describe_exit(returncode: int) -> str:
    """Return a description of an exit code or of minus a signal: "exit code 3", "SIGSEGV"."""
    return signal_name(-returncode) if returncode < 0 else f"exit code {returncode}"


def ended_by_itself_finding(
    name: str, returncode: int, when: str, last_lines: tuple[str, ...]
) -> Finding:
    """Return the finding for a process that ended unexpectedly; ``when`` ends the sentence."""
    verb = "was ended by" if returncode < 0 else "ended with"
    notes = [Note(f"{name}: {line}") for line in last_lines]
    return finding("TF808", f"{name} {verb} {describe_exit(returncode)}{when}", None, notes=notes)


def guard_lost(name: str, event: Exited, *, strict: bool) -> Finding:
    """Return the finding for a guard that ended while other processes run, and restarts."""
    verb = "was ended by" if event.returncode < 0 else "ended with"
    blind = "no edge of the plan reaches /tf" if strict else "no process watches the tree"
    message = f"{name} {verb} {describe_exit(event.returncode)}: {blind} until it is back"
    notes = [Note(f"{name}: {line}") for line in event.last_lines]
    advice = "tfcompose restarts it; it does not repeat earlier findings"
    return finding("TF808", message, None, severity="warning", notes=notes, help=advice)


def guard_hangs(name: str, seconds: float, *, strict: bool) -> Finding:
    """Return the finding for a guard that runs without a sign of life for ``seconds``."""
    blind = "forwarded nothing" if strict else "watched nothing"
    message = f"{name} hangs: it has {blind} for {seconds:.0f} s"
    return finding("TF808", message, None, severity="warning", help="tfcompose restarts it")


def not_started_finding(name: str, why: str) -> Finding:
    """Return the finding for a process that the operating system did not start."""
    return finding("TF808", f"{name} could not be started: {why}", None)


def waits_in_vain(name: str, awaited: str, what: str, why: str) -> Finding:
    """Return the finding for a process that waits for something that cannot happen."""
    return finding(
        "TF808",
        f"{name} is not started: it waits for {awaited} to be {what}, and {awaited} {why}",
        None,
    )


def never_clear(name: str, seconds: float) -> Finding:
    """Return the finding for a guard that never reports whether the plan's edges are free."""
    message = (
        f"{name} did not report within {seconds:g} s whether the plan's edges are published"
        " already"
    )
    return finding(
        "TF808", message, None, help="its log shows how far it got; --guard off starts without it"
    )


def never_published_finding(owner: Tracked, edges: tuple[PlanEdge, ...]) -> Finding:
    """Return the finding for edges of an owner that were not published in time."""
    names = list_names((edge.name for edge in edges), NAMED_AT_MOST)
    name = owner.process.name
    if owner.state == "stopped" and owner.order == 0:
        waits = " and ".join(
            f"{awaited} to be {what}" for awaited, what in owner.process.after.items()
        )
        why = f"was not started: it waits for {waits}" if waits else "was not started"
        return finding("TF811", f"no node published {names}: {name} {why}", None)
    if owner.state in ("stopped", "exited", "fatal", "backoff"):
        why = f"{owner.state}: {owner.detail}" if owner.detail else owner.state
        return finding("TF811", f"no node publishes {names}: {name} is {why}", None)
    host = owner.process.host if owner.process.kind == "external" else None
    advice = (
        f"start its share on {host}: tfcompose up --host {host}; a profile with host: null starts"
        " it here"
    )
    return finding("TF811", f"{name} never published {names}", None, help=advice if host else "")
