"""Creation of the session for the robot file or the built plan that ``view`` shows."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import (
    disk_of,
    inputs_of,
    library,
    load_robot,
    overlays_of,
    robot_overlay,
)
from tfcompose.cli.fixing import rewrite
from tfcompose.cli.plans import in_folder, is_plan, refuse_variant
from tfcompose.cli.terminal import UNREADABLE, fail, print_findings, reject
from tfcompose.compiler.compile import Compiled, compile_source
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.reading import is_file
from tfcompose.model.plan.file import read_plan
from tfcompose.tools.view.plan_robot import robot_of_plan
from tfcompose.tools.view.session import Session

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

    from tfcompose.model.plan import Plan
    from tfcompose.tools.view.reload import WatchedFiles


def session_of(file: str, arguments: Namespace, files: WatchedFiles) -> Session:
    """Return a session for a robot file, a built plan or its folder.

    ``files`` reads the files.

    Raises:
        SystemExit: after printing why there is no robot to show.
    """
    file = in_folder(file)
    try:
        session = (_plan_session if is_plan(file) else _robot_session)(file, arguments, files)
    except RejectedError as error:
        reject(error.findings)
    if session.state.robot is None or not session.robot.frames:
        reject(session.state.findings)
    print_findings(session.state.findings, sys.stderr)
    return session


def _robot_session(file: str, arguments: Namespace, files: WatchedFiles) -> Session:
    robot = robot_overlay(arguments, load_robot(file, files))
    texts = {name: files(name) for name in (file, *arguments.overlays, robot) if name}
    presets, packages = library(files), replace(disk_of(file, arguments), read=files)

    def compile_model(now: Mapping[str, str]) -> Compiled:
        def read(name: str) -> str:
            return now[name] if name in now else files(name)

        try:
            source = load_robot(file, read)
            return compile_source(
                source,
                presets.over(()),  # reads presets again
                arguments.profiles,
                overlays_of(arguments, source, read),
                read,
                packages,
                inputs_of(arguments),
            )
        except RejectedError as error:
            return Compiled(None, error.findings)

    def write(name: str, old: str, new: str) -> None:
        rewrite(Path(name), old, new)
        files.wrote(name, new)

    return Session(texts, compile_model, write)


def _plan_session(file: str, arguments: Namespace, files: WatchedFiles) -> Session:
    refuse_variant(arguments)
    if arguments.edit:
        fail("a built plan cannot be edited: give the robot's file", UNREADABLE)
    packages = Packages(disk_of(file, arguments))

    def compile_model(now: Mapping[str, str]) -> Compiled:
        try:
            plan = read_plan(now[file], file)
            description = Path(file).with_name(plan.description)
            text = files(str(description)) if is_file(description) else None
            return Compiled(robot_of_plan(plan, text, str(description), packages.asset), ())
        except RejectedError as error:
            return Compiled(None, error.findings)

    return Session({file: files(file)}, compile_model, lambda *_: None)


def plan_of_session(session: Session) -> Plan:
    """Return the plan of the session's robot.

    Raises:
        SystemExit: after printing the errors that prevent a plan.
    """
    file, text = next(iter(session.texts.items()))
    if is_plan(file):
        return read_plan(text, file)
    if session.state.errors:
        reject(session.state.findings)
    return plan_of(session.robot.with_final_names())
