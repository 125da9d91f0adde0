"""Robots beside each other: frame prefixes, topics below a namespace, and names that processes are given.

A prefix is written in front of every frame that is not shared, as it is (robot_state_publisher's ``frame_prefix`` does
the same). Topics are isolated as Clearpath does it: /tf and /tf_static, which are absolute and no namespace moves, are
remapped below the namespace for every process at once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, did_you_mean, finding
from tfcompose.plan import RosSettings
from tfcompose.resolve.filling import Filler

if TYPE_CHECKING:
    from tfcompose.language.robot import RobotSpec, RosSpec
    from tfcompose.load import Source
    from tfcompose.model import Robot
    from tfcompose.urdf.packages import Disk

TF_TOPICS = ("/tf", "/tf_static")


def settings_of(ros: RosSpec) -> RosSettings:
    """Return what all processes share, with the frame prefix that follows from the isolation."""
    namespace = ros.namespace.strip("/")
    prefix = ros.frame_prefix
    if not prefix and ros.isolate in {"frames", "both"} and namespace:
        prefix = f"{namespace}/"
    return RosSettings(namespace, ros.domain_id, ros.discovery, ros.clock, prefix, tuple(ros.shared_frames))


def topics_below(namespace: str, isolate: str) -> dict[str, str]:
    """Return where the TF topics are moved: below the namespace, if they are isolated and it is one."""
    moves = isolate in {"topics", "both"} and namespace
    return {topic: f"/{namespace}{topic}" for topic in TF_TOPICS} if moves else {}


def isolate(robot: Robot, spec: RobotSpec, source: Source, disk: Disk | None = None) -> tuple[Robot, list[Finding]]:
    """Return the robot with its processes' topics moved, and frames and files in them named; and what is wrong."""
    found = _wrong(robot, spec, source)
    remap = topics_below(robot.ros.namespace, spec.ros.isolate)
    processes = []
    filler = Filler(robot, source, disk)
    for process in robot.processes:
        moved = replace(process, remap=remap | process.remap)
        processes.append(filler.filled(moved))
    return replace(robot, processes=tuple(processes)), [*found, *filler.found]


def _wrong(robot: Robot, spec: RobotSpec, source: Source) -> list[Finding]:
    found, ros = [], spec.ros
    has_parts = spec.parts or any(section == "parts" for section, _ in robot.broken)
    named = robot.ros.namespace or has_parts or (ros.isolate == "frames" and ros.frame_prefix)
    if ros.isolate != "none" and not named:
        message = f"isolate: {ros.isolate} needs a namespace"
        found.append(finding("TF304", message, source.at(("ros", "isolate")), help="ros: {namespace: robot1}"))
    for index, frame in enumerate(ros.shared_frames):
        if frame not in robot.frames and not robot.excuses(frame):
            place = source.at(("ros", "shared_frames", index))
            advice = did_you_mean(frame, robot.frames, "remove it")
            found.append(finding("TF203", f"shared_frames: no frame {frame}", place, help=advice))
    return found
