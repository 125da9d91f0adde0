"""How a process is run, kept alive and ended: keys that go to the plan as they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.model import SHELL
from tfcompose.plan import Ready, StopRule
from tfcompose.resolve.nodes import full_name

if TYPE_CHECKING:
    from tfcompose.language.process import ReadySpec, Run, Started

#: Keys of a process that have the same name in the model.
_AS_WRITTEN = ("after", "cwd", "env", "host", "log_level", "max_restarts", "remap", "required", "restart")
#: All that ``how`` reads, of a process that tfcompose starts.
KEYS = (*_AS_WRITTEN, "stop", "ready")
#: Those of a process that somebody else starts, and of one that is simulated.
EXTERNAL_KEYS = ("after", "host", "ready")
SIMULATED_KEYS = ("after", "env", "host", "max_restarts", "remap", "required", "restart", "stop")


def how(said: Started, namespace: str, keys: tuple[str, ...] = KEYS) -> dict[str, Any]:
    """Return a process's fields from what was written, those of ``keys``; ``namespace`` is that of its nodes."""
    fields = {key: getattr(said, key) for key in keys if key in _AS_WRITTEN}
    if said.namespace is not None:
        fields["namespace"] = namespace
    if "stop" in keys and said.stop:
        fields["stop"] = StopRule(said.stop.signal, said.stop.timeout)
    if "ready" in keys and said.ready:
        fields["ready"] = _ready(said.ready, namespace)
    return fields


def program(run: Run, *, shell: bool) -> dict[str, Any]:
    """Return what is started: a package's program, a launch file, or a command; a shell's command is one text."""
    argv = (*SHELL, *run.argv) if shell and run.argv else run.argv or run.args
    return {"package": run.package, "executable": run.executable, "launch": run.launch, "argv": argv}


def _ready(said: ReadySpec, namespace: str) -> Ready | None:
    timeout_s = said.timeout
    if said.topic is not None:
        return Ready("topic", full_name(namespace, said.topic), timeout_s=timeout_s)
    if said.service is not None:
        return Ready("service", full_name(namespace, said.service), timeout_s=timeout_s)
    if said.lifecycle is not None:
        return Ready("lifecycle", said.lifecycle, timeout_s=timeout_s)
    if said.log is not None:
        return Ready("log", said.log, timeout_s=timeout_s)
    if said.exit is not None:
        return Ready("exit", number=float(said.exit), timeout_s=timeout_s)
    if said.time is not None:
        return Ready("time", number=said.time, timeout_s=timeout_s)
    return Ready("edges", timeout_s=timeout_s) if said.edges else None  # what else was said was refused
