"""Process of one case: starts the robot, observes its tree, judges it, and ends the robot.

It has the case's ROS domain and runtime directory in its environment. It is given the file with
its ``LiveSetup``, and writes the findings next to it.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.build_process import BuildProcess
from tfcompose.foundation.findings import finding
from tfcompose.foundation.signals import Stop
from tfcompose.launcher.child import end_with
from tfcompose.launcher.program import HERE
from tfcompose.model.plan.file import read_plan, write_plan
from tfcompose.model.plan.topics import joint_states_topics
from tfcompose.tf.ros.environment import RosError, child_environment, ros_trouble
from tfcompose.tools.treetest.case import variant_of
from tfcompose.tools.treetest.inject_live import InjectionError, Injections
from tfcompose.tools.treetest.judging import CaseJudge
from tfcompose.tools.treetest.processes import end_process
from tfcompose.tools.treetest.relayed_plan import with_relays
from tfcompose.tools.treetest.running import not_judged
from tfcompose.tools.treetest.setup import LiveSetup

if TYPE_CHECKING:
    from typing_extensions import Self

    from tfcompose.foundation.findings import Finding
    from tfcompose.tf.live.ros_feed import RosFeed
    from tfcompose.tools.treetest.case import Case

#: Time until the first transform, and from it until the tree is complete, in seconds; a tree that
#: is not complete by then is judged as it is.
START_S, COMPLETE_S = 60.0, 10.0
#: How often conditions are checked, in seconds.
CHECK_EVERY_S = 0.1
#: How often rates, ages and findings are judged at most, each time over the case's ``for``.
ATTEMPTS = 3
#: Time that an expected finding may take, in seconds, unless the case says so.
REPORT_S = 5.0
#: Time for ``up`` to end the robot, in seconds; it kills what does not end sooner.
_END_S = 40.0
#: Maximum number of lines of the log in a finding.
_LINES = 10


def main() -> int:
    """Run the case of the setup file that the command line names; return the exit code."""
    setup = LiveSetup.read(sys.argv[1])
    end_with(setup.parent, signal.SIGTERM)
    with Stop() as stop:
        findings = judge_live(setup, stop)
    setup.write_findings(findings)
    return 0


def judge_live(setup: LiveSetup, stop: Stop) -> list[Finding]:
    """Start the case's robot, and return a finding for each expectation that it does not meet."""
    case = setup.case
    folder = Path(setup.folder)
    os.environ.update(child_environment(os.environ, case.plan.ros, is_built_in=True))
    span = case.value_span("name")
    if trouble := ros_trouble(os.environ, case.plan.ros):
        return [finding(trouble.code, trouble.message, span, help=trouble.help)]
    with StartedRobot(case, setup) as robot, Injections(case, setup) as injections:
        from tfcompose.tf.live.ros_feed import RosFeed  # noqa: PLC0415 (rclpy reads the environment)

        judge = CaseJudge(case, case.spec.for_, keeps=setup.keeps)
        topics = joint_states_topics(case.plan)
        try:
            with RosFeed("tfcompose_test", judge.trees, topics) as feed:
                findings = LiveJudgement(judge, robot, injections, feed=feed, stop=stop).findings()
        except RosError as error:
            return [finding("TF901", str(error), span)]
        except InjectionError as error:
            return [not_judged(case, str(error))]
    if findings and not stop.requested:
        judge.write_evidence(folder)
    return findings


class StartedRobot:
    """The robot of a case, started by ``tfcompose up`` within the ``with`` block.

    It also ends if this process does: ``up`` stops when the reader of its events is gone.
    """

    def __init__(self, case: Case, setup: LiveSetup) -> None:
        self._case = case
        self._setup = setup
        self._folder = Path(setup.folder)
        self._log = self._folder / "up.log"

    def __enter__(self) -> Self:
        plan = self._build()
        events = self._folder / "events"
        os.mkfifo(events, 0o600)
        self._events = os.open(events, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        options = ["--no-live", "--settle", "0", "--events", str(events)]
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [*HERE, "up", str(plan), *options],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        return self

    def _build(self) -> Path:
        """Build the robot, with relays for the case's faults; return the file of its plan.

        Raises:
            SystemExit: if it cannot be built; the reason is printed.
        """
        case = self._case
        arguments = variant_of(case.spec.profile, trust=case.trust, starts=True)
        arguments.file, arguments.output = case.robot, str(self._folder / "build")
        with BuildProcess(arguments) as build:
            file, _ = build.wait_until_built()
        plan = replace(read_plan(file.read_text("utf-8"), str(file)), ros=case.plan.ros)
        plan = with_relays(plan, case.spec.inject, self._setup.path)
        file.write_text(write_plan(plan), "utf-8")
        return file

    def __exit__(self, *_: object) -> None:
        end_process(self._process, signal.SIGINT, _END_S)
        os.close(self._events)
        (self._folder / "events").unlink()

    def exit_code(self) -> int | None:
        """Return the exit code of ``up``; None: the robot runs."""
        with contextlib.suppress(BlockingIOError):
            os.read(self._events, 64 * 1024)  # or up would keep them
        return self._process.poll()

    def last_lines(self) -> list[str]:
        """Return the last lines that ``up`` printed."""
        return self._log.read_text("utf-8", errors="replace").splitlines()[-_LINES:]


class LiveJudgement:
    """The judgement of a started robot: waits for conditions, each for a bounded time."""

    def __init__(
        self,
        judge: CaseJudge,
        robot: StartedRobot,
        injections: Injections,
        *,
        feed: RosFeed,
        stop: Stop,
    ) -> None:
        self._judge = judge
        self._spec = judge.case.spec
        self._robot = robot
        self._injections = injections
        self._feed = feed
        self._stop = stop
        self._ended_s: float | None = None

    def findings(self) -> list[Finding]:
        """Wait until the expectations are met, or cannot be any more; return the unmet ones.

        Raises:
            RosError: if ROS cannot take messages.
            InjectionError: if a fault cannot be injected.
        """
        self._wait_until_complete()
        complete = time.monotonic()
        begun_s: float | None = None
        attempts = 0
        window = complete
        while self._observe():
            now = time.monotonic()
            if not self._injections.begin_due(now - complete):
                window = now
                continue
            if begun_s is None:
                begun_s = self._judge.elapsed_s() or 0.0
                self._judge.begin_window()
            self._feed.pass_joints()
            if not self._is_decided(begun_s) or now < window + self._spec.for_:
                continue
            lasting = [*self._judge.lasting_findings(), *self._judge.late_reports(begun_s)]
            recent = list(self._judge.recent_findings())
            attempts += 1
            if lasting or not recent or attempts == ATTEMPTS:
                return [*lasting, *recent]
            window = now
            self._judge.begin_window()
        return [] if self._stop.requested else [self._robot_ended()]

    def _wait_until_complete(self) -> None:
        limit_s = max(self._spec.expect.complete or 0.0, COMPLETE_S)
        begun = time.monotonic()
        while self._judge.missing_edges() and self._observe():
            elapsed_s = self._judge.elapsed_s()
            if elapsed_s is None:
                if time.monotonic() > begun + START_S:
                    return
            elif elapsed_s > limit_s:
                return

    def _is_decided(self, begun_s: float) -> bool:
        """Return whether lookups and expected findings came, or are too late."""
        expected = self._spec.expect.findings or ()
        waits_s = max((each.within or REPORT_S for each in expected), default=0.0)
        is_over = (self._judge.elapsed_s() or 0.0) > begun_s + waits_s
        return (self._judge.note_reports() or is_over) and self._judge.are_lookups_decided()

    def _observe(self) -> bool:
        """Take messages for a moment; return whether the robot runs and is to be judged."""
        end = time.monotonic() + CHECK_EVERY_S
        while not self._stop.requested and (rest_s := end - time.monotonic()) > 0:
            self._feed.take(rest_s, self._stop)
        return not self._stop.requested and self._robot.exit_code() is None

    def _robot_ended(self) -> Finding:
        elapsed_s = self._judge.elapsed_s()
        when = "before the first transform" if elapsed_s is None else f"after {elapsed_s:.3f} s"
        message = f"the robot ended {when}, with exit code {self._robot.exit_code()}"
        return not_judged(self._judge.case, message, *self._robot.last_lines())
