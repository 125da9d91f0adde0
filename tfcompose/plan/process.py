"""One process of a plan: what is started, when it is ready, how it ends, and what it stands in for."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, Literal

from tfcompose.geometry import Pose

ProcessKind = Literal["static", "joints", "guard", "simulate", "external", "run"]
PROCESS_KINDS: tuple[ProcessKind, ...] = ("static", "joints", "guard", "simulate", "external", "run")
ReadyKind = Literal["edges", "topic", "service", "lifecycle", "log", "exit", "time"]
READY_KINDS: tuple[ReadyKind, ...] = ("edges", "topic", "service", "lifecycle", "log", "exit", "time")
LIFECYCLE_STATES = ("inactive", "active")
LOG_LEVELS = ("debug", "info", "warn", "error", "fatal")
STOP_SIGNALS = ("SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2")
#: How well the pose of a frame is known that a driver publishes.
KNOWN = ("exact", "nominal")

#: In an ``argv``, ``${python}``, ``${plan}``, ``${build_dir}`` and ``${params_file}`` stand for what only the starting
#: machine knows. As its first word ``${executable:PACKAGE/NAME}`` is a package's program, and
#: ``${launch:PACKAGE/FILE}`` a package's launch file; the words after that are the launch file's arguments,
#: ``name:=value``.
_AT_START = re.compile(r"\$\{(?:file:|build_dir\}|params_file\})")


@dataclass(frozen=True, slots=True)
class Sweep:
    """How a simulated joint moves: to and fro between two positions (rad or m) once in ``period_s``.

    Without them it turns round and round, once in that time.
    """

    period_s: float
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True, slots=True)
class Simulation:
    """A stand-in for an owner: a body on a circle, one that stays, or joint states.

    ``joints`` are where joints begin (rad or m), and stay unless ``sweep`` says how they move.
    """

    kind: Literal["circle", "fixed", "joints"]
    rate: float
    radius: float = 0.0
    speed: float = 0.0
    pose: Pose = field(default_factory=Pose)
    joints: dict[str, float] = field(default_factory=dict)
    sweep: dict[str, Sweep] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Ready:
    """When a process counts as ready.

    ``text`` is the full name of the topic or the service, the lifecycle state of the process's nodes, or the regular
    expression that a line of the output holds; ``number`` the exit code, or the seconds after the start. Without
    ``timeout_s`` the launcher's own time holds.
    """

    kind: ReadyKind
    text: str = ""
    number: float = 0.0
    timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class StopRule:
    """How a process is ended: the first signal, and the time until a firmer one; None: the launcher's own."""

    signal: str = "SIGINT"
    timeout_s: float | None = None


@dataclass(frozen=True, slots=True)
class Driven:
    """A sensor that a process drives. ``publishes`` says that the frames inside the sensor are the driver's.

    ``switch`` holds the parameters, or arguments, that keep the driver from publishing what is not its own. ``frames``
    says of the frames that the driver publishes inside the sensor whether their poses are exact or nominal.
    """

    sensor: str
    preset: str
    publishes: bool
    switch: dict[str, str | int | float | bool] = field(default_factory=dict)
    frames: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PlanProcess:
    """What is started, or, with kind ``external``, expected to run.

    ``nodes`` are full names; ``lifecycle`` says of some of them into which state they are brought after the start.
    ``required`` says what ends the plan: True, this process's end; None, its failure; False, neither.
    ``max_restarts`` None is the launcher's default, as is ``ready`` None: the edges that the process owns, or that it
    was started.
    ``drives`` are the sensors that it is the driver of, by their presets. ``switches`` holds, by the full names of its
    nodes, the parameters that were written for them and decide what they publish.
    ``description`` is the file beside the plan that a publisher sends as ``robot_description``; None: the plan's.
    ``namespace`` is that of its nodes, without a leading slash; None: the plan's.
    """

    name: str
    kind: ProcessKind
    argv: tuple[str, ...] = ()
    env: dict[str, str] = field(default_factory=dict)
    cwd: str | None = None
    params_file: str | None = None
    remap: dict[str, str] = field(default_factory=dict)
    nodes: tuple[str, ...] = ()
    restart: str = "no"
    max_restarts: int | None = None
    required: bool | None = None
    stop: StopRule = field(default_factory=StopRule)
    log_level: str | None = None
    lifecycle: dict[str, str] = field(default_factory=dict)
    after: dict[str, str] = field(default_factory=dict)
    ready: Ready | None = None
    host: str | None = None
    owns: tuple[tuple[str, str], ...] = ()
    simulate: Simulation | None = None
    description: str | None = None
    drives: tuple[Driven, ...] = ()
    switches: dict[str, dict[str, str | int | float | bool]] = field(default_factory=dict)
    namespace: str | None = None

    @property
    def topics(self) -> tuple[str, str]:
        """The topics (moving, fixed) on which it publishes TF."""
        return self.remap.get("/tf", "/tf"), self.remap.get("/tf_static", "/tf_static")


def told_at_start(value: Any) -> bool:
    """Return whether a value holds a path that only the launcher knows."""
    if isinstance(value, str):
        return bool(_AT_START.search(value))
    items = value.values() if isinstance(value, dict) else value if isinstance(value, (list, tuple)) else ()
    return any(told_at_start(item) for item in items)
