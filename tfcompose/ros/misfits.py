"""Publishers of TF that listeners do not hear because of how or where they publish: what there is to say of each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.findings import Finding, Note, finding

if TYPE_CHECKING:
    from collections.abc import Sequence

LISTED_AT_MOST = 12


def best_effort_writer(node: str, topic: str) -> Finding:
    """Return the finding for a publisher that sends best effort, which no TF listener accepts."""
    message = f"{node} writes {topic} best effort, so no listener receives it: they ask for reliable"
    return finding("TF826", message, None, help="publish it reliable")


def leak(node: str, topic: str, own: str) -> Finding:
    """Return the finding for a node of an isolated robot that writes a global TF topic."""
    message = f"{node} writes the global {topic}, and its robot keeps its own on {own}"
    advice = f"start it with the remapping {topic}:={own}, as tfcompose does with the processes that it starts"
    return finding("TF827", message, None, help=advice)


def replaced_latched(node: str, sent_before: int, missing: Sequence[str]) -> Finding:
    """Return the finding for a publisher whose latched messages before the first that was heard held these edges."""
    lost = f"{sent_before} message{'s' if sent_before > 1 else ''}"
    named = ", ".join(missing[:LISTED_AT_MOST])
    message = f"{node} sent {lost} on /tf_static before anybody heard it, and none since holds {named}"
    advice = "send all fixed edges in each message: a latched topic keeps the last one only"
    return finding("TF850", message, None, severity="warning", help=advice)


def volatile_writer(node: str, topic: str, owned: Sequence[str]) -> Finding:
    """Return the finding for a publisher of fixed edges that no TF listener accepts; ``owned`` are its edges."""
    notes = [Note(f"it owns {', '.join(owned[:LISTED_AT_MOST])}")] if owned else []
    message = f"{node} writes {topic} with durability volatile, so no listener receives it"
    return finding("TF806", message, None, notes=notes, help="publish it with durability transient_local, reliable")
