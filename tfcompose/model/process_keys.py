"""The keys of a process, a row each: name, type, default, help, and equivalents in other systems.

The language derives its models from the rows. Exports write the settings that a row has for their
system. The import of launch files reads by the same rows, and ``up --dry-run`` shows them. The
launcher implements the effect of a key. Keys about edges, nodes or other processes (``publishes``,
``params``, ``after``, ``ready``, …) have no row, because they are not settings of a single
process.

Sources: systemd.service(5), systemd.exec(5), systemd.kill(5), the Compose specification,
Kubernetes' Pod v1 and Job batch/v1, and ``launch.actions.ExecuteProcess`` of ROS 2 Jazzy.
"""

from __future__ import annotations

import json
import math
import shlex
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from tfcompose.foundation.numbers import number
from tfcompose.foundation.text import plural
from tfcompose.model.plan import (
    Component,
    LogLevel,
    OutputPlace,
    PlanProcess,
    RestartPolicy,
    Schedule,
    StopRule,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

Way = Literal["run", "simulate", "external", "component", "container", "built-in"]
"""How a process runs, by the key that says so; built-in: one of tfcompose's own."""
#: Ways of running for keys that apply to all processes, not only to processes with ``run``.
ALL: tuple[Way, ...] = ("run", "simulate", "external", "component", "container", "built-in")
NOT_OWN: tuple[Way, ...] = ("run", "simulate", "external", "component", "container")
REMAPPED: tuple[Way, ...] = ("run", "simulate", "component", "container", "built-in")
NOT_EXTERNAL: tuple[Way, ...] = ("run", "simulate", "container", "built-in")
NOT_SIMULATED: tuple[Way, ...] = ("run", "external", "component", "container")
OF_NODES: tuple[Way, ...] = ("run", "external", "component")
PROGRAM: tuple[Way, ...] = ("run", "container")
KEPT_ALIVE: tuple[Way, ...] = ("run", "simulate", "component", "container")
STARTED: tuple[Way, ...] = ("run", "simulate", "component", "container", "built-in")
ENDED: tuple[Way, ...] = ("run", "simulate", "container")
LOADED: tuple[Way, ...] = ("component",)
OWN: tuple[Way, ...] = ("built-in",)
#: Keys that become ROS arguments of a node, with their form on the command line.
ROS_ARGUMENTS = {
    "remap": "-r FROM:=TO",
    "log_level": "--log-level LEVEL",
    "namespace": "-r __ns:=/NAMESPACE",
    "params": "--params-file ${params_file}",
}


# Types with more information than a Python type.


class Seconds(float):
    """A time in seconds. A robot file states it with a unit."""

    __slots__ = ()


class Folder(str):
    """A folder. In a robot file, it is relative to that file."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Integer:
    """An integer within a range, including both ends."""

    lowest: int
    highest: int


# Equivalents of a row in another system.


@dataclass(frozen=True, slots=True)
class Exported:
    """A process that another system starts."""

    process: PlanProcess
    #: Whether other processes wait for its end.
    awaited: bool = False


class Setting(NamedTuple):
    """A setting in the terms of another system, and its section in that system's file."""

    name: str
    value: Any
    section: str = ""


def _nothing(_of: Any) -> Iterable[Any]:
    return ()


@dataclass(frozen=True, slots=True)
class Dialect:
    """Equivalents of a key in a supervisor: settings, and sentences about what is lost.

    If both are empty, ``tfcompose.launcher.exec`` implements the key under any supervisor.
    """

    settings: Callable[[Exported], Iterable[Setting]] = _nothing
    gaps: Callable[[Exported], Iterable[str]] = _nothing


KeywordKind = Literal["text", "switch", "number", "output", "variables", "shutdown", "parameters"]


@dataclass(frozen=True, slots=True)
class Keyword:
    """A keyword of launch's actions and its attribute in XML and YAML."""

    name: str
    kind: KeywordKind = "text"
    #: Default: the name of the keyword.
    attribute: str = ""
    #: The attribute of ROS 1's launch that is true if this keyword is ``shutdown``.
    ros1: str = ""
    #: The type of the attribute in YAML.
    type: type[str | bool | int | float] = str


@dataclass(frozen=True, slots=True)
class LaunchDialect:
    """Equivalents of a key in launch, in both directions."""

    keywords: tuple[Keyword, ...] = ()
    #: Values by keyword.
    settings: Callable[[PlanProcess], Iterable[Setting]] = _nothing
    #: Sentences about what launch does differently.
    gaps: Callable[[PlanProcess], Iterable[str]] = _nothing
    #: Returns the key's value in the language from the keywords' values, None if not set. It
    #: appends a message to the list for each value that it cannot read.
    read: Callable[[Mapping[str, Any], list[str]], Any] = lambda _record, _todo: None
    #: Gaps for a process that is an included launch file, None if it cannot have the key.
    of_file: Callable[[PlanProcess], Iterable[str]] | None = None
    #: Whether launch lacks this setting and starts ``tfcompose.launcher.exec``, which implements
    #: it.
    is_external: bool = False
    #: Whether only a program that launch itself starts gets the keywords, because
    #: ``tfcompose.launcher.exec`` implements the setting.
    is_own: bool = False


_UNSET = PlanProcess("", "run")
_UNSET_COMPONENT = Component("", "", "")


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessKey:
    """A key of a process."""

    name: str
    #: A Python type or a type of this module.
    type: Any
    default: Any = None
    help: str
    examples: tuple[Any, ...] = ()
    #: Ways of running to which it applies.
    to: tuple[Way, ...] = ("run",)
    #: Whether a driver's additional processes inherit it from the first process.
    is_shared: bool = False
    #: Names of the key in other formats, separated by spaces, each with what to write instead.
    habits: tuple[tuple[str, str], ...] = ()
    #: Returns the lines for ``up --dry-run``, label and text. None for a line with the key's name
    #: and value.
    dry_run_lines: Callable[[PlanProcess], Iterable[tuple[str, str]]] | None = None
    systemd: Dialect = field(default_factory=Dialect)
    compose: Dialect = field(default_factory=Dialect)
    kubernetes: Dialect = field(default_factory=Dialect)
    launch: LaunchDialect | None = None

    def value_of(self, process: PlanProcess) -> Any:
        """Return the key's value. For a key of components, it is in the process's component."""
        return getattr(process.component if self.to == LOADED else process, self.name)

    def is_set(self, process: PlanProcess) -> bool:
        """Return whether the process's value differs from the value without the key."""
        if self.to == LOADED:
            return process.component is not None and self.value_of(process) != getattr(
                _UNSET_COMPONENT, self.name
            )
        return bool(self.value_of(process) != getattr(_UNSET, self.name))

    def lines_of(self, process: PlanProcess) -> Iterable[tuple[str, str]]:
        """Return the lines for the key in ``up --dry-run``, label and text."""
        if not self.is_set(process):
            return ()
        return (
            self.dry_run_lines(process)
            if self.dry_run_lines
            else ((self.name, str(self.value_of(process))),)
        )


# Restarting.

#: Default delay before the first restart in seconds. Exports write it for every restart.
FIRST_DELAY_S = 1.0


def _policy(process: PlanProcess) -> RestartPolicy:
    """Return when another supervisor restarts the process; tfcompose's own after each failure.

    Under another supervisor, no launcher stops the robot when such a process fails.
    """
    return process.restart if process.kind == "run" else "on-failure"


def _restart_of_unit(exported: Exported) -> Iterator[Setting]:
    """Yield the restart policy. A oneshot unit cannot restart after a success."""
    policy = _policy(exported.process)
    always = policy == "always"
    yield Setting("Restart", "on-failure" if exported.awaited and always else policy, "Service")


def _limit_of_unit(exported: Exported) -> Iterator[Setting]:
    process = exported.process
    if _policy(process) != "no":
        yield Setting("StartLimitIntervalSec", 300, "Unit")
        yield Setting("StartLimitBurst", process.restart_limit + 1, "Unit")


def _delay_of_unit(exported: Exported) -> Iterator[Setting]:
    delay_s = exported.process.restart_delay
    yield Setting("RestartSec", f"{FIRST_DELAY_S if delay_s is None else delay_s:g}", "Service")


def _restart_of_service(exported: Exported) -> Iterator[Setting]:
    policy, limit = _policy(exported.process), exported.process.restart_limit
    if policy != "on-failure":
        yield Setting("restart", policy)
    elif limit:
        yield Setting("restart", f"on-failure:{limit}")
    else:
        yield Setting("restart", "no")


def _limit_of_job(exported: Exported) -> Iterator[Setting]:
    if exported.awaited:
        yield Setting("backoffLimit", exported.process.restart_limit, "job")


def _restarts_of_pod(exported: Exported) -> Iterator[str]:
    process = exported.process
    if not exported.awaited and process.kind == "run" and process.restart != "always":
        yield f"{process.name} is started again whenever it ends"


def _respawn(process: PlanProcess) -> Iterator[Setting]:
    if process.restart != "no":
        yield Setting("respawn", value=True)


def _respawn_limit(process: PlanProcess) -> Iterator[Setting]:
    if process.restart != "no" and process.max_restarts is not None:
        yield Setting("respawn_max_retries", process.max_restarts)


def _respawn_delay(process: PlanProcess) -> Iterator[Setting]:
    if process.restart != "no":
        delay_s = process.restart_delay
        yield Setting("respawn_delay", FIRST_DELAY_S if delay_s is None else delay_s)


def _respawn_gaps(process: PlanProcess) -> Iterator[str]:
    if process.kind != "run" or process.restart == "no":
        return
    whatever = "whatever its exit code, and " if process.restart == "on-failure" else ""
    count = process.max_restarts
    limit = f"with a limit of {count} in all, and not in a row"
    yield (
        f"{process.name} is started again {whatever}"
        f"{'without a limit' if count is None else limit}"
    )


def _read_respawn(record: Mapping[str, Any], _todo: list[str]) -> RestartPolicy | None:
    return "always" if record.get("respawn") else None


def _read_respawn_limit(record: Mapping[str, Any], _todo: list[str]) -> int | None:
    limit = record.get("respawn_max_retries", -1)
    is_limit = record.get("respawn") and math.isfinite(limit) and limit >= 0
    return int(limit) if is_limit else None


def _read_respawn_delay(record: Mapping[str, Any], _todo: list[str]) -> Seconds | None:
    delay_s = record.get("respawn_delay", 0.0)
    is_meant = math.isfinite(delay_s) and delay_s > 0 and delay_s != FIRST_DELAY_S
    return Seconds(delay_s) if record.get("respawn") and is_meant else None


def _restart_lines(process: PlanProcess) -> Iterator[tuple[str, str]]:
    delay_s = process.restart_delay
    delay = "" if delay_s is None else f", {delay_s:g} s after its end"
    limit = plural(process.restart_limit, "time")
    yield "restart", f"{process.restart}, {limit} in a row{delay}"


# Stopping.

#: Time for a process to end, in seconds: the launcher waits 5 s after SIGINT and 5 s after
#: SIGTERM.
STOP_S = 10.0
#: Default time in seconds that launch waits after each signal.
_LAUNCH_STOP_S = 5.0


def stop_s(process: PlanProcess) -> float:
    """Return how long another supervisor waits for the end of a process, in seconds."""
    return STOP_S if process.stop.timeout_s is None else process.stop.timeout_s


def _stop_of_unit(exported: Exported) -> Iterator[Setting]:
    signal = exported.process.stop.signal
    yield Setting("KillSignal", signal, "Service")
    yield Setting("KillMode", "mixed", "Service")
    yield Setting("TimeoutStopSec", f"{stop_s(exported.process):g}", "Service")
    yield Setting("SuccessExitStatus", f"{signal} 130", "Service")


def _stop_of_service(exported: Exported) -> Iterator[Setting]:
    yield Setting("stop_signal", exported.process.stop.signal)
    yield Setting("stop_grace_period", f"{round(stop_s(exported.process) * 1000)}ms")


def _stop_of_pod(exported: Exported) -> Iterator[Setting]:
    """Yield the time to end, and a hook for the signal, because a kubelet sends only SIGTERM."""
    signal, time_s = exported.process.stop.signal, stop_s(exported.process)
    yield Setting("terminationGracePeriodSeconds", math.ceil(time_s), "pod")
    if signal != "SIGTERM":
        command = ["sh", "-c", f"kill -s {signal.removeprefix('SIG')} 1; sleep {time_s / 2:g}"]
        yield Setting("lifecycle", {"preStop": {"exec": {"command": command}}}, "container")


def _stop_in_launch(process: PlanProcess) -> Iterator[Setting]:
    rule = process.stop
    kill_timeout_s = rule.timeout_s if rule.kill_timeout_s is None else rule.kill_timeout_s
    if rule.timeout_s is not None:
        yield Setting("sigterm_timeout", number(rule.timeout_s))
    if kill_timeout_s is not None:
        yield Setting("sigkill_timeout", number(kill_timeout_s))


def _stop_gaps(process: PlanProcess) -> Iterator[str]:
    if process.stop.signal != "SIGINT":
        yield f"{process.name} is ended by SIGINT, and not by {process.stop.signal}"


def _read_stop(record: Mapping[str, Any], todo: list[str]) -> dict[str, Seconds] | None:
    """Return the times that launch waits after SIGINT and after SIGTERM."""
    times_s: list[float] = []
    for name in ("sigterm_timeout", "sigkill_timeout"):
        try:
            time_s = float(record.get(name, _LAUNCH_STOP_S))
        except ValueError:
            time_s = math.nan
        if math.isfinite(time_s) and time_s >= 0:
            times_s.append(time_s)
        else:
            todo.append(f"{name} {record[name]}")
    if len(times_s) < 2 or set(times_s) == {_LAUNCH_STOP_S}:  # noqa: PLR2004 (both are known)
        return None
    timeout_s, kill_timeout_s = times_s
    stop = {"timeout": Seconds(timeout_s)} if timeout_s != _LAUNCH_STOP_S else {}
    if kill_timeout_s != timeout_s:
        stop["kill_timeout"] = Seconds(kill_timeout_s)
    return stop


def _stop_lines(process: PlanProcess) -> Iterator[tuple[str, str]]:
    rule = process.stop
    timeout = "" if rule.timeout_s is None else f", {rule.timeout_s:g} s"
    kill_s = rule.kill_timeout_s
    kill = "" if kill_s is None else f", {kill_s:g} s from SIGTERM to SIGKILL"
    yield "stop", f"{rule.signal}{timeout}{kill}"


# Processes whose end stops the robot.


def _ends_alone(exported: Exported) -> Iterator[str]:
    if exported.process.required:
        yield f"{exported.process.name} is required: its end does not end the others here"


def _shutdown(process: PlanProcess) -> Iterator[Setting]:
    if process.required:
        yield Setting("on_exit", "shutdown")


def _required_lines(process: PlanProcess) -> Iterator[tuple[str, str]]:
    if process.required:
        yield "required", "its end ends everything"
    else:
        yield "optional", "the rest goes on when it fails"


# Output.

#: Destinations of output in the terms of launch, whose words differ.
_LAUNCH_OUTPUTS: dict[OutputPlace, Any] = {
    "both": "both",
    "screen": {"both": "screen"},
    "log": {"both": "log"},
}


def _output_in_launch(process: PlanProcess) -> Iterator[Setting]:
    yield Setting("output", _LAUNCH_OUTPUTS[process.output])


def _read_output(record: Mapping[str, Any], _todo: list[str]) -> OutputPlace | None:
    """Return the destination for launch's word or mapping.

    The word ``screen`` becomes the default, which also writes the log.
    """
    place = record.get("output")
    if place is None or isinstance(place, str):
        return "log" if place in {"log", "own_log"} else None
    if "screen" not in place:
        return "log"
    return "screen" if place == ["screen"] else None


def _output_lines(process: PlanProcess) -> Iterator[tuple[str, str]]:
    yield "output", process.output


def _terminal_lines(_process: PlanProcess) -> Iterator[tuple[str, str]]:
    yield "terminal", "a pseudo-terminal"


def _terminal(process: PlanProcess) -> Iterator[Setting]:
    if process.emulate_tty:
        yield Setting("emulate_tty", value=True)


# Environment of a process.


def _cwd_in_launch(process: PlanProcess) -> Iterator[Setting]:
    if process.cwd is not None:
        yield Setting("cwd", process.cwd)


def _read_cwd(record: Mapping[str, Any], _todo: list[str]) -> Folder | None:
    return Folder(record["cwd"]) if record.get("cwd") else None


def _env_in_launch(process: PlanProcess) -> Iterator[Setting]:
    yield Setting("additional_env", process.env)


def _prefix_in_launch(process: PlanProcess) -> Iterator[Setting]:
    if process.prefix:
        yield Setting("prefix", shlex.join(process.prefix))


def _read_prefix(record: Mapping[str, Any], todo: list[str]) -> list[str] | None:
    try:
        return shlex.split(record.get("prefix") or "") or None
    except ValueError:
        todo.append(f"the prefix {record['prefix']}")
        return None


def _plain(key: str, name: str, section: str = "") -> Callable[[Exported], Iterator[Setting]]:
    """Return a function that yields a key's value, if it is set, under another system's name."""

    def settings(exported: Exported) -> Iterator[Setting]:
        value = getattr(exported.process, key)
        if value is not None:
            yield Setting(name, value, section)

    return settings


def _within_pod(key: str) -> Callable[[Exported], Iterator[str]]:
    """Return a function that names a key that a pod lacks; the process sets it if permitted."""

    def gaps(exported: Exported) -> Iterator[str]:
        value = getattr(exported.process, key)
        if value is not None:
            name = exported.process.name
            yield f"{name} sets {key} {value} itself, and fails where its pod may not have that"

    return gaps


def _files_of_service(exported: Exported) -> Iterator[Setting]:
    if exported.process.open_files is not None:
        yield Setting("ulimits", {"nofile": exported.process.open_files})


def _schedule_lines(process: PlanProcess) -> Iterator[tuple[str, str]]:
    schedule = process.schedule or Schedule()
    cpus = f"CPU {', '.join(map(str, schedule.cpus))}" if schedule.cpus else "any CPU"
    priority = f" {schedule.priority}" if schedule.priority else ""
    yield "schedule", f"{cpus}, {schedule.policy}{priority}"


def _extra_in_launch(process: PlanProcess) -> Iterator[Setting]:
    if process.component and process.component.extra_arguments:
        yield Setting("extra_arguments", [process.component.extra_arguments])


def _read_extra(record: Mapping[str, Any], _todo: list[str]) -> dict[str, Any] | None:
    merged: dict[str, Any] = {}
    for arguments in record.get("extra_arguments", ()):
        merged |= arguments if isinstance(arguments, dict) else {}
    return merged or None


def _extra_lines(process: PlanProcess) -> Iterator[tuple[str, str]]:
    if process.component:
        for name, value in process.component.extra_arguments.items():
            yield "extra", f"{name}: {json.dumps(value)}"


def _is_in(name: str) -> Callable[[Mapping[str, Any], list[str]], bool | None]:
    return lambda record, _todo: True if record.get(name) else None


#: Keys of a program that is a ROS node; they become arguments of its command line.
NODE_KEYS = (
    ProcessKey(
        name="log_level",
        type=LogLevel,
        help="the log level of its nodes",
        to=PROGRAM,
        is_shared=True,
        dry_run_lines=_nothing,
    ),
)
#: Keys about the environment of a process and the destination of its output.
SURROUNDING_KEYS = (
    ProcessKey(
        name="env",
        type=dict[str, str],
        default={},
        help="environment variables",
        examples=({"RCUTILS_COLORIZED_OUTPUT": "1"},),
        to=NOT_EXTERNAL,
        is_shared=True,
        habits=(("env environment additional_env", "variables are env: {NAME: value}"),),
        dry_run_lines=_nothing,
        launch=LaunchDialect(
            (Keyword("additional_env", "variables"), Keyword("env", "variables")),
            _env_in_launch,
            of_file=_nothing,
            is_own=True,
        ),
    ),
    ProcessKey(
        name="cwd",
        type=Folder,
        help="its working directory, relative to this file; default: that of up",
        examples=("maps",),
        to=PROGRAM,
        is_shared=True,
        dry_run_lines=lambda process: (("folder", str(process.cwd)),),
        launch=LaunchDialect((Keyword("cwd"),), _cwd_in_launch, read=_read_cwd, is_own=True),
    ),
    ProcessKey(
        name="output",
        type=OutputPlace,
        default="both",
        help="destination of its output: the terminal of up, its log, or both",
        to=STARTED,
        dry_run_lines=_output_lines,
        launch=LaunchDialect(
            (Keyword("output", "output"),), _output_in_launch, read=_read_output, is_own=True
        ),
    ),
    ProcessKey(
        name="emulate_tty",
        type=bool,
        default=False,
        help="true: it writes to a pseudo-terminal, by line and in colour",
        to=PROGRAM,
        dry_run_lines=_terminal_lines,
        launch=LaunchDialect(
            (Keyword("emulate_tty", "switch", type=bool),), _terminal, read=_is_in("emulate_tty")
        ),
    ),
)
#: Keys about starting, restarting and stopping a process.
SUPERVISION_KEYS = (
    ProcessKey(
        name="required",
        type=bool,
        help=(
            "true: the robot stops when it exits, unless another process waits until it is "
            "done; false: the robot goes on if it fails; default: the robot stops if it fails"
        ),
        to=KEPT_ALIVE,
        dry_run_lines=_required_lines,
        systemd=Dialect(gaps=_ends_alone),
        compose=Dialect(gaps=_ends_alone),
        kubernetes=Dialect(gaps=_ends_alone),
        launch=LaunchDialect(
            (Keyword("on_exit", "shutdown", ros1="required"),),
            _shutdown,
            read=_is_in("on_exit"),
            of_file=lambda process: _ends_alone(Exported(process)),
        ),
    ),
    ProcessKey(
        name="restart",
        type=RestartPolicy,
        default="no",
        help="when to restart it",
        to=KEPT_ALIVE,
        is_shared=True,
        habits=(("respawn", "restart: on-failure, or always, starts it again"),),
        dry_run_lines=_restart_lines,
        systemd=Dialect(_restart_of_unit),
        compose=Dialect(_restart_of_service),
        kubernetes=Dialect(gaps=_restarts_of_pod),
        launch=LaunchDialect(
            (Keyword("respawn", "switch"),),
            _respawn,
            _respawn_gaps,
            _read_respawn,
            of_file=lambda process: (f"{process.name} is not started again: it is a launch file",),
        ),
    ),
    ProcessKey(
        name="max_restarts",
        type=Integer(0, 1_000_000),
        help="restarts in a row before tfcompose gives up",
        examples=(5,),
        to=KEPT_ALIVE,
        is_shared=True,
        habits=(("respawn_max_retries", "how often in a row is max_restarts: 5"),),
        dry_run_lines=_nothing,
        systemd=Dialect(_limit_of_unit),
        kubernetes=Dialect(_limit_of_job),
        launch=LaunchDialect(
            (Keyword("respawn_max_retries", "number", type=int),),
            _respawn_limit,
            read=_read_respawn_limit,
            of_file=_nothing,
        ),
    ),
    ProcessKey(
        name="restart_delay",
        type=Seconds,
        help="delay of a restart; default: 1 s, doubled each time, up to 30 s",
        to=KEPT_ALIVE,
        is_shared=True,
        habits=(("respawn_delay", "how long after its end is restart_delay: 2 s"),),
        dry_run_lines=_nothing,
        systemd=Dialect(_delay_of_unit),
        launch=LaunchDialect(
            (Keyword("respawn_delay", "number", type=float),),
            _respawn_delay,
            read=_read_respawn_delay,
            of_file=_nothing,
        ),
    ),
    ProcessKey(
        name="prefix",
        type=tuple[str, ...],
        default=(),
        help="a wrapper command with its arguments: gdb, valgrind, nice, …",
        examples=(["nice", "-n", "10"],),
        to=PROGRAM,
        habits=(("launch_prefix", "a program that runs it is prefix: [nice, -n, '10']"),),
        dry_run_lines=_nothing,
        launch=LaunchDialect(
            (Keyword("prefix", attribute="launch-prefix"),),
            _prefix_in_launch,
            read=_read_prefix,
            is_own=True,
        ),
    ),
    ProcessKey(
        name="schedule",
        type=Schedule,
        help="its CPUs and real-time priority",
        examples=({"cpus": [2, 3], "priority": 80},),
        to=NOT_EXTERNAL,
        is_shared=True,
        habits=(
            (
                "cpus cpu_affinity affinity",
                "its processors are schedule: {cpus: [2, 3]}",
            ),
            ("priority sched_priority", "a real-time priority is schedule: {priority: 80}"),
        ),
        dry_run_lines=_schedule_lines,
        launch=LaunchDialect(is_external=True),
    ),
    ProcessKey(
        name="oom_score_adj",
        type=Integer(-1000, 1000),
        help="from 1000 (the kernel kills it first if memory runs out) to -1000 (never); "
        "default: the launcher's",
        examples=(500,),
        to=NOT_EXTERNAL,
        is_shared=True,
        systemd=Dialect(_plain("oom_score_adj", "OOMScoreAdjust", "Service")),
        compose=Dialect(_plain("oom_score_adj", "oom_score_adj")),
        kubernetes=Dialect(gaps=_within_pod("oom_score_adj")),
        launch=LaunchDialect(is_external=True),
    ),
    ProcessKey(
        name="open_files",
        type=Integer(16, 2**30),
        help="the most files, sockets and pipes it may have open; default: the launcher's",
        examples=(4096,),
        to=NOT_EXTERNAL,
        is_shared=True,
        habits=(("nofile ulimit ulimits", "a limit of open files is open_files: 4096"),),
        systemd=Dialect(_plain("open_files", "LimitNOFILE", "Service")),
        compose=Dialect(_files_of_service),
        kubernetes=Dialect(gaps=_within_pod("open_files")),
        launch=LaunchDialect(is_external=True),
    ),
    ProcessKey(
        name="stop",
        type=StopRule,
        help="how to stop it",
        examples=({"signal": "SIGTERM", "timeout": "5 s"},),
        to=ENDED,
        is_shared=True,
        habits=(
            ("sigterm_timeout", "how long it may take to end is stop: {timeout: 5 s}"),
            (
                "sigkill_timeout",
                "the time from SIGTERM to SIGKILL is stop: {kill_timeout: 10 s}",
            ),
        ),
        dry_run_lines=_stop_lines,
        systemd=Dialect(_stop_of_unit),
        compose=Dialect(_stop_of_service),
        kubernetes=Dialect(_stop_of_pod),
        launch=LaunchDialect(
            (Keyword("sigterm_timeout", type=float), Keyword("sigkill_timeout", type=float)),
            _stop_in_launch,
            _stop_gaps,
            _read_stop,
        ),
    ),
)
PROCESS_KEYS = (*NODE_KEYS, *SURROUNDING_KEYS, *SUPERVISION_KEYS)
#: Options for a container about a component that it loads.
EXTRA_ARGUMENTS = ProcessKey(
    name="extra_arguments",
    type=dict[str, Any],
    default={},
    help="options that the container applies when it loads the component",
    examples=({"use_intra_process_comms": True},),
    to=LOADED,
    dry_run_lines=_extra_lines,
    launch=LaunchDialect(
        (Keyword("extra_arguments", "parameters", attribute="extra_arg"),),
        _extra_in_launch,
        read=_read_extra,
    ),
)


def launch_keywords(*kinds: KeywordKind) -> tuple[Keyword, ...]:
    """Return launch's keywords for values of these kinds, in the order of the rows."""
    dialects = (key.launch for key in (*PROCESS_KEYS, EXTRA_ARGUMENTS) if key.launch)
    return tuple(
        keyword for dialect in dialects for keyword in dialect.keywords if keyword.kind in kinds
    )
