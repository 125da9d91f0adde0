"""Peers of tfcompose in benchmarks, and how to tell whether this machine has them."""

from __future__ import annotations

import os
import shutil
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree as ET

from tests.benchmarks.benchmark import TFCOMPOSE, Contender
from tfcompose.tf.ros.environment import missing_ros

_SOURCE = "source a ROS 2 setup file"


def executable(package: str, name: str) -> Path:
    """Return the path of a package's program.

    Raises:
        FileNotFoundError: if no prefix in $AMENT_PREFIX_PATH has it.
    """
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        file = Path(prefix, "lib", package, name)
        if prefix and file.is_file():
            return file
    raise FileNotFoundError(f"{package} has no {name} here")


def _of_ros(name: str, package: str, program: str) -> Contender:
    """Return a contender that is a program of a ROS package."""

    def missing() -> str:
        try:
            executable(package, program)
        except FileNotFoundError:
            return f"not installed: {_SOURCE}"
        return missing_ros() or ""

    def installed() -> str:
        prefix = executable(package, program).parents[2]
        manifest = prefix / "share" / package / "package.xml"
        return ET.parse(manifest).findtext("version") or ""  # noqa: S314 (of an installed package)

    return Contender(name, missing, installed)


def _of_python(name: str, module: str, distribution: str) -> Contender:
    """Return a contender that is a Python package."""

    def missing() -> str:
        return "" if find_spec(module) else f"not installed: pip install {distribution}"

    def installed() -> str:
        try:
            return version(distribution)
        except PackageNotFoundError:  # of a system's ROS
            return ""

    return Contender(name, missing, installed)


def _missing_launch() -> str:
    if not shutil.which("ros2") or not find_spec("launch_ros"):
        return f"not installed: {_SOURCE}"
    return STATE_PUBLISHER.missing()


#: tfcompose where its work needs ROS.
TFCOMPOSE_ON_ROS = Contender(TFCOMPOSE.name, lambda: missing_ros() or "")
RCLPY = _of_python("plain rclpy", "rclpy", "ros-jazzy-rclpy")
STATE_PUBLISHER = _of_ros(
    "robot_state_publisher", "robot_state_publisher", "robot_state_publisher"
)
STATIC_PUBLISHERS = _of_ros("static_transform_publisher", "tf2_ros", "static_transform_publisher")
LAUNCH = Contender("`ros2 launch`", _missing_launch, STATE_PUBLISHER.version)
XACRO = _of_python("xacro", "xacro", "xacro")
