"""Running robots: their selection, requests to their launchers, and the launchers' reports."""

from __future__ import annotations

import contextlib
import os
import shlex
import time
from typing import TYPE_CHECKING, TypeVar

from tfcompose.cli.options import DEFAULT_FILE
from tfcompose.cli.plans import PLAN
from tfcompose.cli.reading import read_text
from tfcompose.cli.terminal import FAILED, UNREADABLE, fail, wait_for_data, warn
from tfcompose.foundation import procfs
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.text import list_names
from tfcompose.launcher.control import RequestRefusedError, ask, connect
from tfcompose.launcher.leftovers import leftovers
from tfcompose.launcher.runtime_dir import RuntimeDirError, domain_of, runtime_dirs
from tfcompose.model.messages import (
    Done,
    EventsRequest,
    ProcessRequest,
    RobotStatus,
    StatusRequest,
    line_of,
    read_notice,
)
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.topics import judged_topics

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from typing import TextIO

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.runtime_dir import Holder, RuntimeDir
    from tfcompose.model.messages import Notice, ProcessStatus, Request, Verb
    from tfcompose.model.plan import Plan, PlanEdge

A = TypeVar("A")

NAMED_AT_MOST = 12
ASK_EVERY_S = 0.1


def running() -> list[tuple[RuntimeDir, Holder]]:
    """Return the running robots with their launchers.

    Raises:
        RuntimeDirError: if no folder exists that only this user can open.
    """
    runs = [(runtime_dir, runtime_dir.holder()) for runtime_dir in runtime_dirs(os.environ)]
    return [(runtime_dir, holder) for runtime_dir, holder in runs if holder]


def is_meant(runtime_dir: RuntimeDir, name: str) -> bool:
    """Return whether the name selects the robot.

    A name without the domain, or without domain and host, also selects the robot.
    """
    return name in {runtime_dir.name, runtime_dir.share, runtime_dir.robot}


def chosen_run(
    name: str | None, command: str, *, among: Callable[[], list[RuntimeDir]] | None = None
) -> RuntimeDir:
    """Return the selected robot among the running robots, or among the results of ``among``.

    Without a name, select the robot in this shell's ROS domain, or else the robot of
    ``robot.yaml`` here. ``command`` is the user's command, for an example in the error message.

    Raises:
        SystemExit: after an error message, if no robot or several robots match.
    """
    try:
        candidates = among() if among else [runtime_dir for runtime_dir, _ in running()]
    except RuntimeDirError as error:
        fail(str(error), UNREADABLE)
    verb = "has run" if among else "runs"
    matches = (
        [runtime_dir for runtime_dir in candidates if is_meant(runtime_dir, name)]
        if name
        else in_scope(candidates)
    )
    names = list_names([runtime_dir.name for runtime_dir in candidates], NAMED_AT_MOST)
    if not candidates:
        fail(f"no robot {verb} here")
    if not matches and name:
        fail(f"no robot {name} {verb} here; known robots: {names}")
    if not matches:
        example = f"tfcompose {command} --robot {candidates[0].name}"
        fail(
            f"no robot {verb} in ROS domain {domain_of(os.environ)}; elsewhere: {names}"
            f" ({example})"
        )
    if len(matches) > 1:
        fail(
            f"several robots: {', '.join(run.name for run in matches)}; choose one with --robot",
            UNREADABLE,
        )
    return matches[0]


def in_scope(places: list[RuntimeDir]) -> list[RuntimeDir]:
    """Return the robots in this shell's ROS domain.

    If there are no such robots, return the robots with the name in ``robot.yaml`` here.
    """
    matches = [
        runtime_dir for runtime_dir in places if runtime_dir.domain == domain_of(os.environ)
    ]
    robot = _robot_here() if places and not matches else None
    return matches or [runtime_dir for runtime_dir in places if runtime_dir.robot == robot]


def _robot_here() -> str | None:
    """Return the robot's name in ``robot.yaml`` here, None if the file cannot be read."""
    from tfcompose.spec.load import load

    try:
        name = load(read_text(DEFAULT_FILE), DEFAULT_FILE).data.get("robot")
    except RejectedError:
        return None
    return name if isinstance(name, str) else None


def request(runtime_dir: RuntimeDir, question: Request, answer: type[A]) -> A | None:
    """Return the launcher's answer, None if there is none.

    If the launcher refuses or does not answer, the function prints a message.
    """
    try:
        return ask(runtime_dir, question, answer)
    except RequestRefusedError as error:
        warn(str(error))
    except OSError as error:
        warn(f"{runtime_dir.name} does not answer: {error}")
    return None


def control_processes(arguments: Namespace, verb: Verb, doing: str) -> int:
    """Ask the launcher to apply the verb to each named process; return the exit code.

    Raises:
        SystemExit: if the user names a robot file instead of processes, or if no robot is
            selected.
    """
    files = [name for name in arguments.name if name.endswith((".yaml", ".yml"))]
    if files:
        advice = "down stops a robot" if verb == "stop" else f"up {files[0]} starts a robot"
        fail(f"{verb} takes processes of a running robot; tfcompose {advice}", UNREADABLE)
    runtime_dir = chosen_run(arguments.robot, shlex.join([verb, *arguments.name]))
    code = 0
    for name in arguments.name:
        answer = request(runtime_dir, ProcessRequest(verb, name), Done)
        if answer is None:
            code = FAILED
            continue
        later = f", and waits for {answer.waits}" if answer.waits else ""
        print(f"{name}: {doing}{later}")
    return code


def notices(
    runtime_dir: RuntimeDir, timeout_s: float | None = None, output: TextIO | None = None
) -> Iterator[tuple[Notice, float]]:
    """Yield past and new notices of the launcher with their times, until the launcher ends.

    The caller prints the notices on ``output``. When the reader of ``output`` is gone, the notices
    end, even without a new notice.

    Raises:
        OSError: if the launcher cannot be reached.
        TimeoutError: after ``timeout_s``.
        BrokenPipeError: if the reader of ``output`` is gone.
    """
    end = None if timeout_s is None else time.monotonic() + timeout_s
    with connect(runtime_dir) as connection:
        connection.sendall(line_of(EventsRequest()))
        rest = b""
        while True:
            left = None if end is None else end - time.monotonic()
            if left is not None and left <= 0:
                raise TimeoutError
            connection.settimeout(left)
            if output and not wait_for_data(connection, output):
                raise BrokenPipeError
            data = connection.recv(64 * 1024)
            if not data:
                return
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                try:
                    yield read_notice(line)
                except (ValueError, TypeError) as error:
                    raise ConnectionError(
                        f"this version of tfcompose cannot read what its launcher sends: {error}"
                    ) from None


def wait_until_ready(
    runtime_dir: RuntimeDir, timeout_s: float | None, *, without_errors: bool = False
) -> int:
    """Wait until every process is ready and every edge is live.

    With ``without_errors``, also wait until the guard sees no error. Return 0, or 1 after a
    message with the reason.
    """
    end = None if timeout_s is None else time.monotonic() + timeout_s
    while True:
        try:
            status = ask(runtime_dir, StatusRequest(), RobotStatus)
        except OSError:
            warn(f"{runtime_dir.name} has ended; see tfcompose logs")
            return FAILED
        if status.ready and not (without_errors and _errors(status)):
            return 0
        if timeout_s is not None and end is not None and time.monotonic() >= end:
            print_missing(runtime_dir, timeout_s)
            return FAILED
        time.sleep(ASK_EVERY_S)


def _errors(status: RobotStatus) -> list[Finding]:
    return [finding for finding in status.findings if finding.severity == "error"]


def print_missing(runtime_dir: RuntimeDir, timeout_s: float) -> None:
    """Report each process that is not ready, and each edge that is not live."""
    try:
        status = ask(runtime_dir, StatusRequest(), RobotStatus)
    except OSError as error:
        warn(f"{runtime_dir.name} does not answer: {error}")
        return
    missing = status.missing
    warn(
        f"{runtime_dir.name} is not ready after {timeout_s:g} s and keeps running; see tfcompose"
        " logs and down"
    )
    for process in status.processes:
        if process.failed:
            warn(f"  failed: {process.name} ({process.state}, {process.detail})")
        elif not process.ready and process.state != "exited":
            warn(f"  not ready: {process.name} ({_why_not_ready(process)})")
    if missing:
        warn(f"  not live: {list_names(missing, NAMED_AT_MOST)}")
    for finding in _errors(status):
        warn(f"  {finding.severity}[{finding.code}] {finding.message}")


def _why_not_ready(process: ProcessStatus) -> str:
    """Return the conditions for which the start of the process waits.

    For a started process, return its state, the missing conditions, and the last observation.
    """
    if process.state == "stopped" and process.waits:
        return process.waits
    parts: list[str] = [process.state]
    if process.edges:
        parts.append(f"{process.live} of {process.edges} edges live")
    elif process.waits:
        parts.append(process.waits)
    if process.seen:
        parts.append(f"seen instead: {process.seen}")
    return ", ".join(parts)


def since(holder: Holder) -> str:
    """Return the local time of the launcher's start, such as 14:03:27.

    The text includes the date if the launcher did not start today.
    """
    then, today = time.localtime(holder.since), time.localtime()
    form = "%H:%M:%S" if then[:3] == today[:3] else "%Y-%m-%d %H:%M:%S"
    return time.strftime(form, then)


def find_hidden_run(runtime_dir: RuntimeDir) -> str | None:
    """Return a message if the robot already runs in another runtime directory."""
    led = [
        leftover
        for leftover in leftovers(f"{runtime_dir.name}:")
        if leftover.launcher not in (None, os.getpid())
    ]
    if not led or led[0].launcher is None:
        return None
    with contextlib.suppress(OSError):
        folder = procfs.environ(led[0].launcher).get("XDG_RUNTIME_DIR")
        where = f"XDG_RUNTIME_DIR={folder}" if folder else "no XDG_RUNTIME_DIR"
        return (
            f"{runtime_dir.name} is already running: pid {led[0].launcher}, with {where}; use the"
            " same for ps and down"
        )
    return None


def warnings_before_start(runtime_dir: RuntimeDir, plan: Plan, run_id: str) -> list[str]:
    """Return a sentence for each circumstance that may disturb the robot's start."""
    return [
        *other_domains(runtime_dir),
        *_left_behind(runtime_dir, run_id),
        *_neighbours(runtime_dir, plan),
    ]


def _neighbours(runtime_dir: RuntimeDir, plan: Plan) -> Iterator[str]:
    """Yield a sentence for each other robot in the domain with the same TF topics.

    The guard of each robot would report the other robot's nodes.
    """
    neighbours = [
        (neighbour.robot, holder)
        for neighbour, holder in running()
        if neighbour.domain == runtime_dir.domain
        and neighbour.robot != runtime_dir.robot
        and _share_topics(neighbour, plan)
    ]
    for robot, holder in neighbours:
        where = f"runs in domain {runtime_dir.domain} on the same TF topics"
        yield f"{robot} (pid {holder.pid}, since {since(holder)}) {where}"
    if neighbours:
        yield (
            "each guard will report the other's edges: give one ros: {domain_id: N}, "
            "or ros: {namespace: NAME, isolate: topics}"
        )


def _share_topics(neighbour: RuntimeDir, plan: Plan) -> bool:
    """Return whether the plan of the other run has TF topics in common with this plan."""
    running_plan = plan_of_run(neighbour)
    return running_plan is not None and not judged_topics(plan).isdisjoint(
        judged_topics(running_plan)
    )


def other_domains(runtime_dir: RuntimeDir) -> Iterator[str]:
    """Yield a sentence for each run of this robot in another domain.

    Such runs remain after a change of domain_id.
    """
    for running_dir, holder in running():
        if running_dir.share == runtime_dir.share and running_dir.domain != runtime_dir.domain:
            yield (
                f"{running_dir.name} still runs (pid {holder.pid}, since {since(holder)}); "
                f"tfcompose down --robot {running_dir.name} stops it"
            )


def plan_file(runtime_dir: RuntimeDir) -> Path:
    """Return the path of the plan that the robot runs.

    Raises:
        OSError: if the robot does not run.
    """
    return runtime_dir.linked_plan() / PLAN


def plan_of_run(runtime_dir: RuntimeDir) -> Plan | None:
    """Return the plan that a robot runs, None if the plan cannot be read."""
    try:
        return read_plan(plan_file(runtime_dir).read_text("utf-8"), PLAN)
    except (OSError, ValueError, RejectedError):
        return None


def run_of_domain() -> tuple[RuntimeDir, Plan] | None:
    """Return the only robot that runs in this shell's ROS domain, and its plan.

    Return None if no robot or several robots run there.
    """
    try:
        matches = [
            runtime_dir
            for runtime_dir, _ in running()
            if runtime_dir.domain == domain_of(os.environ)
        ]
    except RuntimeDirError:
        return None
    plan = plan_of_run(matches[0]) if len(matches) == 1 else None
    return (matches[0], plan) if plan else None


def adjusted_edges(robot: str) -> tuple[PlanEdge, ...]:
    """Return the adjusted edges of this robot, if it alone runs in this shell's ROS domain."""
    run = run_of_domain()
    return run[1].adjusted if run and run[1].robot == robot else ()


def plan_of_domain() -> Plan | None:
    """Print the name of the only robot in this shell's ROS domain, and return its plan.

    Return None if no robot or several robots run there.
    """
    running = run_of_domain()
    if running is None:
        return None
    warn(f"expecting the edges of {running[0].name}, which is running")
    return running[1]


def _left_behind(runtime_dir: RuntimeDir, run_id: str) -> Iterator[str]:
    """Yield a sentence for each process that an earlier run left running."""
    remaining = [
        leftover
        for leftover in leftovers(f"{runtime_dir.name}:")
        if leftover.run != run_id and leftover.launcher is None
    ]
    for leftover in remaining:
        yield f"an earlier run left process {leftover.pid} behind: {leftover.command}"
    if remaining:
        them = "it" if len(remaining) == 1 else "them"
        yield f"tfcompose down --leftovers --robot {runtime_dir.name} stops {them}"
