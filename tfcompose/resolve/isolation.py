"""Robots beside each other: frame prefixes, topics below a namespace, and names that processes are given.

A prefix is written in front of every frame that is not shared, as it is (robot_state_publisher's ``frame_prefix`` does
the same). Topics are isolated as Clearpath does it: /tf and /tf_static, which are absolute and no namespace moves, are
remapped below the namespace for every process at once.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, did_you_mean, finding
from tfcompose.plan import RosSettings

if TYPE_CHECKING:
    from tfcompose.load import Path, Source
    from tfcompose.model import Process, Robot
    from tfcompose.validate.spec import RosSpec

TF_TOPICS = ("/tf", "/tf_static")
_FRAME = re.compile(r"\$\{\s*frame\(\s*([^(){}]*?)\s*\)\s*\}")


def settings_of(ros: RosSpec) -> RosSettings:
    """Return what all processes share, with the frame prefix that follows from the isolation."""
    namespace = ros.namespace.strip("/")
    prefix = ros.frame_prefix
    if not prefix and ros.isolate in {"frames", "both"} and namespace:
        prefix = f"{namespace}/"
    return RosSettings(namespace, ros.domain_id, ros.discovery, ros.clock, prefix, tuple(ros.shared_frames))


def isolate(robot: Robot, ros: RosSpec, source: Source) -> tuple[Robot, list[Diagnostic]]:
    """Return the robot with its processes' topics moved and ``${frame(…)}`` in them replaced, and what is wrong."""
    found = _wrong(robot, ros, source)
    remap = {}
    if ros.isolate in {"topics", "both"} and robot.ros.namespace:
        remap = {topic: f"/{robot.ros.namespace}{topic}" for topic in TF_TOPICS}
    processes = []
    for process in robot.processes:
        moved = replace(process, remap=remap | process.remap)
        processes.append(_named(moved, robot, source, found))
    return replace(robot, processes=tuple(processes)), found


def _wrong(robot: Robot, ros: RosSpec, source: Source) -> list[Diagnostic]:
    found = []
    named = robot.ros.namespace or robot.parts or (ros.isolate == "frames" and ros.frame_prefix)
    if ros.isolate != "none" and not named:
        message = f"isolate: {ros.isolate} needs a namespace"
        found.append(finding("TF304", message, source.at(("ros", "isolate")), help="ros: {namespace: robot1}"))
    for index, frame in enumerate(ros.shared_frames):
        if frame not in robot.frames and not robot.excuses(frame):
            place = source.at(("ros", "shared_frames", index))
            advice = did_you_mean(frame, robot.frames, "remove it")
            found.append(finding("TF203", f"shared_frames: no frame {frame}", place, help=advice))
    return found


def _named(process: Process, robot: Robot, source: Source, found: list[Diagnostic]) -> Process:
    """Return the process with every ``${frame(NAME)}`` replaced by that frame's final name."""
    section: Path = ("processes", process.name)
    if not source.has(section):
        section = ("sensors", process.name, "driver")

    def fill(value: Any, path: Path) -> Any:
        if isinstance(value, str):
            return _FRAME.sub(lambda hole: name_of(hole[1], path), value) if "${" in value else value
        if isinstance(value, dict):
            return {key: fill(item, (*path, key)) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return type(value)(fill(item, (*path, index)) for index, item in enumerate(value))
        return value

    def name_of(frame: str, path: Path) -> str:
        if frame not in robot.frames and not robot.excuses(frame):
            advice = did_you_mean(frame, robot.frames)
            found.append(finding("TF203", f"${{frame({frame})}}: no frame {frame}", source.at(path), help=advice))
        return robot.final(frame)

    return replace(
        process,
        nodes=tuple(replace(n, params=fill(n.params, (*n.path, "params"))) for n in process.nodes),
        argv=fill(process.argv, (*section, "run")),
        remap=fill(process.remap, (*section, "remap")),
        env=fill(process.env, (*section, "env")),
    )
