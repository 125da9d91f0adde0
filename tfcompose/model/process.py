"""A process before it is a command line, its nodes, and what they publish by default."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.plan import (
    LifecycleState,
    LogLevel,
    ProcessKind,
    Ready,
    RestartPolicy,
    Simulation,
    StartCondition,
    StopRule,
)

STATIC, JOINTS, GUARD = "static", "joints", "guard"
BUILT_IN = (STATIC, JOINTS, GUARD)
#: How a command begins that a shell reads.
SHELL = ("/bin/sh", "-c")

if TYPE_CHECKING:
    from tfcompose.findings import Span


class AsInFile(str):
    """A parameter as it stands without quotes in somebody's parameter file: what it is, is for ROS to say."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Node:
    """One ROS node of a process, by its full name; ``lifecycle`` is the state that it is brought into.

    ``path`` leads to the mapping that holds its ``params``.
    """

    name: str
    at: Span
    path: tuple[str | int, ...] = ()
    params: dict[str, Any] = field(default_factory=dict)
    lifecycle: LifecycleState | None = None


@dataclass(frozen=True, slots=True)
class Process:
    """A process of the plan, before it is a command line.

    It runs a ``package``'s ``executable``, a ``launch`` file (``package/file``), or else the command ``argv``, which
    for the others holds the arguments. ``part`` is the ``Part`` that it belongs to, if any. ``describes`` says that its
    parameter ``robot_description`` is the URDF for a stock robot_state_publisher.
    """

    name: str
    kind: ProcessKind
    at: Span
    nodes: tuple[Node, ...] = ()
    package: str | None = None
    executable: str | None = None
    launch: str | None = None
    argv: tuple[str, ...] = ()
    remap: dict[str, str] = field(default_factory=dict)
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    log_level: LogLevel | None = None
    host: str | None = None
    required: bool | None = None
    restart: RestartPolicy = "no"
    max_restarts: int | None = None
    stop: StopRule = field(default_factory=StopRule)
    ready: Ready | None = None
    after: dict[str, StartCondition] = field(default_factory=dict)
    simulate: Simulation | None = None
    rate: float | None = None
    part: str = ""
    describes: bool = False
    namespace: str | None = None

    @property
    def node(self) -> str:
        """The full name of the first node, which is the only one of most processes."""
        return self.nodes[0].name if self.nodes else ""

    @property
    def params(self) -> dict[str, Any]:
        """The parameters of the first node."""
        return self.nodes[0].params if self.nodes else {}


@dataclass(frozen=True, slots=True)
class Claim:
    """An edge that a node publishes by default and somebody else owns; ``switch`` are the parameters that stop it."""

    node: str
    parent: str
    child: str
    switch: dict[str, Any]
