"""What all processes of a plan share, and what the guard does."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

GuardMode = Literal["off", "watch", "strict"]
UnknownEdges = Literal["ignore", "warn", "error"]
OnViolation = Literal["report", "stop-offender", "stop"]
#: How a strict guard fences processes off; auto: by partition where their rmw is Fast DDS, else by remapping.
FenceWay = Literal["auto", "partition", "remap"]
FENCES: tuple[FenceWay, ...] = ("auto", "partition", "remap")


@dataclass(frozen=True, slots=True)
class RosSettings:
    """What every process of the plan shares. ``shared_frames`` are those that do not begin with ``frame_prefix``."""

    namespace: str = ""
    domain_id: int | None = None
    discovery: str | None = None
    clock: str = "wall"
    frame_prefix: str = ""
    shared_frames: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class GuardPolicy:
    """What the guard does. ``allow`` holds (parent, child) patterns of edges that need no declaration.

    ``fence`` says how a strict guard fences processes off.
    """

    mode: GuardMode = "watch"
    unknown_edges: UnknownEdges = "warn"
    on_violation: OnViolation = "report"
    allow: tuple[tuple[str, str], ...] = ()
    fence: FenceWay = "auto"


@dataclass(frozen=True, slots=True)
class Claim:
    """An edge that a node publishes by default and somebody else owns; ``switch`` stops it, empty: nothing does."""

    node: str
    parent: str
    child: str
    switch: str


def switch_text(switch: dict[str, Any]) -> str:
    """Return parameters as they are written in YAML."""
    return ", ".join(f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in switch.items())
