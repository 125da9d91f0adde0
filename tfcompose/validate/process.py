"""Processes as users describe them: what is started, or expected to run, and how."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.validate.claims import ClaimSpec
from tfcompose.validate.fields import (
    ANYTHING,
    BOOLEAN,
    DURATION,
    NAMESPACE,
    ONLY_TRUE,
    RATE_,
    TEXT,
    choice,
    integer,
    text,
)
from tfcompose.validate.running import LIST, WORD, Run, Simulate
from tfcompose.validate.schema import BROKEN, Model, Problems, Type, key, listing, mapping, record, shown, then

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.load import Path
    from tfcompose.plan import LifecycleState, LogLevel, RestartPolicy, StartCondition, StopSignal

_NODE = r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*"
_NODE_MEANS = "a node's name: letters, digits and _"


def _environment(value: Any, path: Path, problems: Problems) -> Any:
    for name in value if isinstance(value, dict) else ():
        if not name or "=" in name:
            problems.refuse("TF106", (*path, name), f"{name!r} cannot name a variable", on_key=True)
    return mapping(WORD).read(value, path, problems)


class StopSpec(Model):
    """How a process is ended: a first signal to its whole group; then firmer ones."""

    signal: StopSignal = key(
        choice("SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2"), "SIGINT", "the first signal"
    )
    timeout: float | None = key(DURATION, None, "how long it has until the next, firmer one", ("5 s",))


def _regular(value: str, path: Path, problems: Problems) -> Any:
    try:
        re.compile(value)
    except (re.error, RecursionError, OverflowError) as error:
        return problems.refuse("TF106", path, f"{shown(value)} is no regular expression: {error}")
    return value


class ReadySpec(Model):
    """When the process counts as ready; one of these. Left out: when all the edges that it owns are live."""

    edges: bool | None = key(ONLY_TRUE, None, "all the edges that it owns are live")
    topic: str | None = key(
        TEXT, None, "somebody publishes it; below the process's namespace unless it begins with /", ("scan",)
    )
    service: str | None = key(TEXT, None, "it is there; below the process's namespace unless it begins with /")
    lifecycle: LifecycleState | None = key(
        choice("inactive", "active"), None, "its nodes are in this state, whoever did it"
    )
    log: str | None = key(then(TEXT, _regular), None, "a regular expression that a line of its output holds")
    exit: int | None = key(integer(0, 255), None, "it has ended with this exit code")
    time: float | None = key(DURATION, None, "so long after its start", ("2 s",))
    timeout: float | None = key(DURATION, None, "when to give up waiting, and say what was seen instead", ("30 s",))


READY_WAYS = frozenset(ReadySpec.KEYS) - {"timeout"}


def _ready(value: Any, path: Path, problems: Problems) -> Any:
    if value == "edges":
        return ReadySpec(edges=True)
    if isinstance(value, dict) and not READY_WAYS & set(value):
        ways = ", ".join(sorted(READY_WAYS))
        return problems.refuse("TF102", path, "ready does not say what is waited for", f"one of: {ways}", on_key=True)
    return record(ReadySpec).read(value, path, problems)


LIFECYCLE = choice("inactive", "active")


PUBLISHES = listing(record(ClaimSpec))
_PARAMS_ABOUT = (
    "the node's parameters, passed on as they are; file: names parameter files, over which the others are laid"
)
_PUBLISHES_ABOUT = "edges that the node publishes by default, and what stops it; a preset knows them"


class NodeSpec(Model):
    """One node of a process."""

    preset: str | None = key(TEXT, None, "what is known of this node: its edges and parameters", ("slam_toolbox",))
    publishes: tuple[ClaimSpec, ...] = key(PUBLISHES, (), _PUBLISHES_ABOUT)
    params: dict[str, Any] = key(mapping(ANYTHING), {}, _PARAMS_ABOUT)
    lifecycle: LifecycleState | None = key(
        LIFECYCLE, None, "a lifecycle node is brought into this state after the start"
    )


def _nodes(value: Any, path: Path, problems: Problems) -> Any:
    for name in value if isinstance(value, dict) else ():
        if not re.fullmatch(_NODE, name):
            problems.refuse("TF106", (*path, name), f"{shown(name)} is not {_NODE_MEANS}", on_key=True)
    return mapping(record(NodeSpec)).read(value, path, problems)


NODE_NAME = text(_NODE, _NODE_MEANS)


class NamedNode(Model):
    """The one node of a process: its name, and what is known of it."""

    name: str | None = key(NODE_NAME, None, "left out: the process's name, or, where others start it, its usual one")
    preset: str | None = key(TEXT, None, "what is known of this node: its edges and parameters", ("slam_toolbox",))


class Started(Model):
    """What is started, or expected to run: one of run, simulate and external."""

    run: Run | None = key(
        record(
            Run,
            lambda value: {"argv": value} if isinstance(value, list) else value,
            {"anyOf": [LIST | {"minItems": 1}, {"type": "string", "description": "with shell: true"}]},
        ),
        None,
        "{package, executable, args}, {launch, args}, or a command as a list",
    )
    simulate: Simulate | None = key(record(Simulate), None)
    external: bool | None = key(ONLY_TRUE, None, "somebody else starts it")
    shell: bool | None = key(ONLY_TRUE, None, "run is one text, and /bin/sh reads it")
    node: NamedNode | None = key(
        record(NamedNode, lambda value: {"name": value} if isinstance(value, str) else value, NODE_NAME),
        None,
        "its name, or {preset, name}; below its namespace unless it begins with /",
        ("slam_toolbox", {"preset": "slam_toolbox"}),
    )
    namespace: str | None = key(
        NAMESPACE, None, "its nodes are below it; itself below ros.namespace unless it begins with /", ("front",)
    )
    publishes: tuple[ClaimSpec, ...] = key(PUBLISHES, (), _PUBLISHES_ABOUT)
    params: dict[str, Any] = key(mapping(ANYTHING), {}, _PARAMS_ABOUT)
    lifecycle: LifecycleState | None = key(
        LIFECYCLE, None, "the lifecycle node is brought into this state after the start"
    )
    log_level: LogLevel | None = key(choice("debug", "info", "warn", "error", "fatal"), None, "of its nodes' loggers")
    remap: dict[str, str] = key(mapping(TEXT), {}, "topic names: from, to")
    env: dict[str, str] = key(Type(_environment, mapping(TEXT).schema), {})
    cwd: str | None = key(TEXT, None, "the folder that it runs in, seen from this file's; left out: where up is called")
    rate: float | None = key(RATE_, None, "for joints: how often joint states come")
    host: str | None = key(TEXT, None, "the machine that it runs on", ("jetson",))
    required: bool | None = key(
        BOOLEAN,
        None,
        "true: its end stops everything; false: the rest goes on when it fails; left out: its failure stops everything",
    )
    restart: RestartPolicy = key(choice("no", "on-failure", "always"), "no")
    max_restarts: int | None = key(integer(0, 1_000_000), None, "how often in a row, before it is given up")
    stop: StopSpec | None = key(record(StopSpec), None, "how it is ended")
    ready: ReadySpec | None = key(Type(_ready, {"anyOf": [{"const": "edges"}, ReadySpec]}), None, "when it is ready")
    after: dict[str, StartCondition] = key(
        mapping(choice("started", "ready", "done")), {}, "what must have happened before the start"
    )


class ProcessSpec(Started):
    """What is started, or expected to run: one of run, simulate and external."""

    nodes: dict[str, NodeSpec] = key(
        Type(_nodes, mapping(record(NodeSpec)).schema),
        {},
        "the nodes of a process that holds several, by name; node, params and lifecycle are the short form for one",
    )


class DriverSpec(Started):
    """Keys over the preset's driver; or the name of the process that drives this sensor; or none."""

    process: str | None = key(TEXT, None)


def process(cls: type[Started], normal: Callable[[Any], Any] | None = None, short: Any = None) -> Type:
    """Return the type of a process; a command in one text is for a shell, and that must be said."""
    inner = record(cls, normal, short)

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if isinstance(value, dict):
            run, at = value.get("run"), (*path, "run")
            if isinstance(run, str) and value.get("shell") is True:
                value = value | {"run": [run]}
            elif isinstance(run, str):
                advice = "give a list, one item a word; or shell: true"
                problems.refuse("TF103", at, "a command in one text is for a shell", advice)
                value = value | {"run": BROKEN}
            elif value.get("shell") is True and "run" in value and run is not BROKEN:
                advice = "run: one text, for example 'zcat log.gz | player'"
                problems.refuse("TF107", (*path, "shell"), "shell: true, and run is no text", advice, on_key=True)
        return inner.read(value, path, problems)

    return Type(read, inner.schema)
