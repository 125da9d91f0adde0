"""Start of a robot on this machine by ``up``: checks, runtime directory, launcher.

With ``-d``, the launcher continues in the background. The command waits until the robot has
started, or is ready.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import traceback
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.console import (
    Console,
    Nowhere,
    StandardOutput,
    StatusLine,
    describe_changes,
    describe_vanished_edges,
)
from tfcompose.cli.live_run import can_show_live, follow
from tfcompose.cli.plans import copy_plan, is_plan, plan_to_start, read_built_plan
from tfcompose.cli.reading import read_text
from tfcompose.cli.runs import (
    find_hidden_run,
    notices,
    print_missing,
    request,
    since,
    wait_until_ready,
    warnings_before_start,
)
from tfcompose.cli.terminal import (
    FAILED,
    INTERRUPTED,
    UNREADABLE,
    can_redraw,
    code_addresses,
    fail,
    is_coloured,
    print_findings,
    reject,
    size_of,
    warn,
)
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.signals import SIGNALS
from tfcompose.launcher.child import end_with
from tfcompose.launcher.forking import Forker
from tfcompose.launcher.output import Logs, NonBlockingOutput
from tfcompose.launcher.preflight import commands_of
from tfcompose.launcher.program import load_shared, run_process
from tfcompose.launcher.run_files import RunFiles
from tfcompose.launcher.runtime_dir import (
    Lock,
    RuntimeDirError,
    goes_with_logout,
    runtime_dir_of,
    user_name,
)
from tfcompose.launcher.supervisor import RunSession, supervise
from tfcompose.model.messages import AllReady, AllStarted, Ended, PlanChange, UpdateRequest
from tfcompose.tf.ros.environment import (
    child_environment,
    other_distro,
    other_middleware,
    ros_trouble,
)

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Sequence

    from tfcompose.foundation.findings import Finding
    from tfcompose.launcher.output import EventStream
    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.plan import Plan
    from tfcompose.spec.load import Source


def load_forker(arguments: Namespace) -> Forker | None:
    """Import the modules of tfcompose's own processes into a process that can fork them.

    Return None if ROS cannot be imported, or if the command starts nothing. This must not be done
    without the middleware that the environment names, because ROS would end the process.
    """
    if arguments.update or ros_trouble(os.environ):
        return None
    try:
        return Forker(load_shared, run_process)
    except ImportError:  # tfcompose's processes report the missing module
        return None


def start(
    file: Path,
    arguments: Namespace,
    forker: Forker | None = None,
    built_with: Sequence[Finding] = (),
    events: EventStream | None = None,
) -> int:
    """Check everything that the plan in the file needs, and start it; return ``up``'s exit code.

    ``forker`` has imported the modules of tfcompose's own processes. ``built_with`` are the
    warnings of the plan's build, which were printed. ``events`` receives each notice.

    Raises:
        SystemExit: after an error message, if the plan cannot be started.
    """
    plan = plan_to_start(read_built_plan(file), arguments)
    if plan.guard.mode == "off" and arguments.settle is not None:
        fail("the guard is off, so --settle has no effect: leave it out", UNREADABLE)
    _refuse_trouble(plan, file, arguments)
    try:
        runtime_dir = runtime_dir_of(plan, os.environ)
        lock = Lock(runtime_dir)
    except RuntimeDirError as error:
        fail(str(error), UNREADABLE)
    except BlockingIOError:
        return _update(plan, file, runtime_dir, arguments)
    except OSError as error:
        fail(f"the run cannot be recorded: {error}", UNREADABLE)
    with ExitStack() as stack:
        stack.callback(lock.close)
        if arguments.update or ros_trouble(os.environ):
            fail(f"{runtime_dir.name} is not running; up --update only updates a running robot")
        if hidden := find_hidden_run(runtime_dir):
            fail(hidden)
        copy = copy_plan(plan, file, runtime_dir, alone=True)
        session = RunSession(
            copy,
            RunFiles(runtime_dir, lock, copy),
            file.absolute().parent,
            forker=forker,
            events=events,
        )
        warnings = [
            *_unnamed_overlays(plan, arguments),
            *warnings_before_start(runtime_dir, plan, session.run_id),
        ]
        for warning in warnings:
            warn(warning)
        if arguments.detach or arguments.wait:
            return _detach(plan, runtime_dir, lock, session, arguments)
        if arguments.live and can_show_live():
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            pid = _fork(plan, runtime_dir, lock, session, arguments.duration, mask)
            stack.close()  # from now on, the launcher holds the lock
            return follow(runtime_dir, plan, pid, mask, built_with, warnings)
        session.output = NonBlockingOutput(sys.stdout.fileno())
        stack.callback(session.output.close)
        return _run(plan, runtime_dir, session, session.output, arguments.duration)


def _unnamed_overlays(plan: Plan, arguments: Namespace) -> list[str]:
    """Return a line that names the merged overlays that the command line does not name."""
    named = len(arguments.overlays) + len(arguments.settings)
    unnamed = plan.overlays[: len(plan.overlays) - named]
    if not unnamed or arguments.overlay_robot is not None:
        return []
    return [f"{plan.robot}: {', '.join(unnamed)} merged over {plan.file}"]


def _refuse_trouble(plan: Plan, file: Path, arguments: Namespace) -> None:
    """Print warnings, and exit if something prevents the start.

    Raises:
        SystemExit: after error messages about all obstacles.
    """
    trouble = ros_trouble(child_environment(os.environ, plan.ros, is_built_in=True), plan.ros)
    findings = (
        [trouble]
        if trouble
        else commands_of(plan, plan.managed, file, os.environ, child_environment)[1]
    )
    if findings:
        reject([_with_profiles(finding, arguments) for finding in findings])
    odd = (other_middleware(os.environ, plan.ros), other_distro(os.environ, plan.ros))
    print_findings([finding for finding in odd if finding], sys.stderr)


def _run(
    plan: Plan,
    runtime_dir: RuntimeDir,
    session: RunSession,
    output: NonBlockingOutput,
    duration_s: float | None,
) -> int:
    """Run the plan on this terminal until it ends, and return the exit code."""
    logs = Logs(runtime_dir.logs)
    status = StatusLine(plan, lambda: size_of(output.fd)[0]) if can_redraw(sys.stdout) else None
    console = Console(
        plan,
        output,
        colour=is_coloured(sys.stdout),
        address_of=code_addresses(sys.stdout),
        keep=logs.write,
        status=status,
    )
    session.refresh = console.refresh if status else None
    try:
        return supervise(
            plan, session.plan_file, report=console, duration_s=duration_s, session=session
        )
    finally:
        logs.close()


def _update(plan: Plan, file: Path, runtime_dir: RuntimeDir, arguments: Namespace) -> int:
    """Change the running robot to the plan.

    Return 0; 1 if nothing changed although the user wanted to start the robot here.
    """
    holder = runtime_dir.holder()
    who = (
        f"{runtime_dir.name} is already running: pid {holder.pid}, since {since(holder)}"
        if holder
        else f"{runtime_dir.name} just ended"
    )
    folder = (
        Path(arguments.build_dir).absolute() if arguments.build_dir else file.absolute().parent
    )
    copy = copy_plan(plan, file, runtime_dir, alone=False, build_dir=folder)
    answer = request(runtime_dir, UpdateRequest(str(copy), str(folder)), PlanChange)
    if answer is None:
        fail(who)
    labels = ("restarted", "started", "stopped", "new description for", "moved")
    changes = describe_changes(answer, labels)
    if answer.differs:
        print(f"{who}; {changes or 'the plan changed, and nothing had to restart'}")
    elif changes:
        print(f"{who}; {changes}")
    else:
        warn(f"{who}, with the same plan; tfcompose down stops it")
    if answer.held and changes:
        print(describe_vanished_edges(answer.held))
    if arguments.wait:
        return wait_until_ready(runtime_dir, arguments.timeout)
    return 0 if changes or answer.differs or arguments.detach or arguments.update else FAILED


def _with_profiles(finding: Finding, arguments: Namespace) -> Finding:
    """Return the finding. If it is about missing programs, add profiles that do not need them."""
    if finding.code != "TF810" or is_plan(arguments.file):
        return finding
    profiles = _profiles_that_start(arguments)
    if not profiles:
        return finding
    advice = f"to start without them: tfcompose up {arguments.file} --profile {profiles}"
    return replace(finding, help="; ".join(filter(None, (finding.help, advice))))


def _profiles_that_start(arguments: Namespace) -> str:
    """Return the profiles for which every program exists, such as ``a or b``, empty without any.

    The profiles replace the requested profiles, or else are added to them: ``sim --profile a``.
    """
    from tfcompose.cli.compiling import load_robot
    from tfcompose.spec.language import profiles_in

    try:
        source = load_robot(arguments.file)
        names = [name for name in profiles_in(source) if name not in arguments.profiles]
        for profiles in dict.fromkeys(((), tuple(arguments.profiles))):
            fitting = [
                name for name in names if _starts_with(source, [*profiles, name], arguments)
            ]
            if fitting:
                return " --profile ".join([*profiles, " or ".join(fitting)])
    except RejectedError:
        pass
    return ""


def _starts_with(source: Source, profiles: Sequence[str], arguments: Namespace) -> bool:
    from tfcompose.cli.compiling import inputs_of, library, overlays_of
    from tfcompose.compiler.compile import compile_source
    from tfcompose.compiler.emit.plan import plan_of

    overlays, inputs = overlays_of(arguments, source), inputs_of(arguments)
    compiled = compile_source(source, library(), profiles, overlays, read_text, inputs=inputs)
    if compiled.robot is None or compiled.errors:
        return False
    plan = plan_of(compiled.robot)
    return not commands_of(
        plan, plan.managed, Path(arguments.file), os.environ, child_environment
    )[1]


def _detach(
    plan: Plan, runtime_dir: RuntimeDir, lock: Lock, session: RunSession, arguments: Namespace
) -> int:
    """Start the launcher as a separate process, and wait until the robot has started.

    With --wait, wait until all processes are ready. Return 0, or 1 if this does not happen.
    """
    if goes_with_logout(runtime_dir):
        user = user_name()
        warn(
            f"lingering is off for {user}: logging out removes {runtime_dir.folder} and may stop"
            f" the robot; to keep both: loginctl enable-linger {user}"
        )
    pid = _fork(plan, runtime_dir, lock, session, arguments.duration)
    return _follow(plan, runtime_dir, pid, arguments)


def _fork(  # noqa: PLR0913, PLR0917 (what a launcher needs)
    plan: Plan,
    runtime_dir: RuntimeDir,
    lock: Lock,
    session: RunSession,
    duration_s: float | None,
    mask: Iterable[int] | None = None,
) -> int:
    """Start the launcher as a separate process, and return its process id.

    With a ``mask``, the launcher ends together with this process, and ``mask`` becomes its signal
    mask.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    starter = os.getpid()
    pid = os.fork()
    if pid == 0:
        code = FAILED
        try:
            lock.sign()
            if mask is not None:
                end_with(starter, signal.SIGTERM)
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
            code = _launch(plan, runtime_dir, session, duration_s)
        except KeyboardInterrupt:
            code = INTERRUPTED
        except BaseException:  # noqa: BLE001 (nobody further out says what it was)
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(code)
    if session.files:
        session.files.listener.close()
    return pid


def _launch(
    plan: Plan, runtime_dir: RuntimeDir, session: RunSession, duration_s: float | None
) -> int:
    """Run the launcher without a terminal. Python's own errors go to a file next to the logs."""
    os.setsid()
    nowhere = errors = os.open(os.devnull, os.O_RDWR)
    with contextlib.suppress(OSError):  # a full disk must not stop a robot
        runtime_dir.logs.mkdir(parents=True, exist_ok=True)
        errors = os.open(
            runtime_dir.logs / "launcher.err", os.O_CREAT | os.O_WRONLY | os.O_TRUNC, 0o640
        )
    for fd, to in ((0, nowhere), (1, errors), (2, errors)):
        os.dup2(to, fd)
    for fd in {nowhere, errors}:
        os.close(fd)
    logs = Logs(runtime_dir.logs)
    console = Console(plan, Nowhere(), colour=False, keep=logs.write)
    try:
        return supervise(
            plan, session.plan_file, report=console, duration_s=duration_s, session=session
        )
    finally:
        logs.close()


def _follow(plan: Plan, runtime_dir: RuntimeDir, pid: int, arguments: Namespace) -> int:
    console = Console(
        plan,
        StandardOutput(),
        colour=is_coloured(sys.stdout),
        address_of=code_addresses(sys.stdout),
    )
    goal = AllReady if arguments.wait else AllStarted
    with contextlib.suppress(OSError):
        try:
            for notice, _ in notices(runtime_dir, arguments.timeout if arguments.wait else None):
                console(notice)
                if isinstance(notice, Ended):
                    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
                if isinstance(notice, goal):
                    print(
                        f"{runtime_dir.name} runs in the background: pid {pid}; see tfcompose ps,"
                        " logs -f and down"
                    )
                    return 0
        except TimeoutError:
            print_missing(runtime_dir, arguments.timeout)
            return FAILED
        except KeyboardInterrupt:
            warn(
                f"{runtime_dir.name} keeps running in the background: pid {pid}; tfcompose down"
                " stops it"
            )
            return INTERRUPTED
    warn(f"the launcher has ended; see {runtime_dir.logs / 'launcher.err'}")
    return FAILED
