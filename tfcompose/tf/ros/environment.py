"""Environment of a process that uses ROS: rclpy, and the variables that ROS reads at its start.

With some settings, ROS ends a process that starts a node without any message. ``ros_trouble``
detects these settings beforehand. This module imports no ROS, so that any module can check whether
ROS is installed.
"""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.plan.middleware import IMPLEMENTATIONS, ZENOH_FILES, middleware_variables

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Distro, RosSettings

#: Profiles for tfcompose's processes, in general and on a single machine. The files explain their
#: purpose.
FASTDDS_PROFILE = Path(__file__).with_name("fastdds.xml")
FASTDDS_PROFILE_LOCALHOST = Path(__file__).with_name("fastdds_localhost.xml")

# Fast DDS 2 reads the first variable, Fast DDS 3 the second. If the user has set either, it is
# kept.
PROFILE_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")

DOMAIN, RANGE, RMW = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "RMW_IMPLEMENTATION"
DISTRO = "ROS_DISTRO"
#: The ROS release by the major version of rclpy. rclpy is a package of that name, or a wheel with
#: another name.
_RELEASES: Mapping[str, Distro] = {"7": "jazzy", "9": "kilted"}
_RCLPY = ("rclpy", "ros-rclpy")
#: The highest domain whose ports exist (RTPS: 7400 + 250 times the domain, below 65536).
LAST_DOMAIN = 232


class RosError(Exception):
    """ROS is installed but cannot be used as needed.

    The message is a sentence for the user.
    """


def missing_ros() -> str | None:
    """Return a sentence that tells what to install, None if rclpy can be imported."""
    if find_spec("rclpy") is not None:
        return None
    return (
        "rclpy cannot be imported: on x86-64 Linux install it with pip install 'tfcompose[ros]',"
        " elsewhere install ROS 2 Jazzy from the distribution, make the environment with python3"
        " -m venv --system-site-packages, and run source /opt/ros/jazzy/setup.bash first"
    )


def child_environment(
    base: Mapping[str, str], ros: RosSettings, *, is_built_in: bool
) -> dict[str, str]:
    """Return ``base`` with the plan's ROS settings.

    Settings that the plan does not state stay as in ``base``. ``is_built_in``: the process belongs
    to tfcompose. It uses the discovery profile ``FASTDDS_PROFILE``, or the profile for a single
    machine, unless ``base`` already names a profile file or the middleware is not Fast DDS. Other
    processes keep their profile.
    """
    environment = {**base, "PYTHONUNBUFFERED": "1", **middleware_variables(ros, base)}
    if ros.domain_id is not None:
        environment[DOMAIN] = str(ros.domain_id)
    if ros.discovery is not None:
        environment[RANGE] = ros.discovery.upper()
    if (
        is_built_in
        and is_fastdds(environment)
        and not any(base.get(name) for name in PROFILE_VARIABLES)
    ):
        alone = environment.get(RANGE) == "LOCALHOST"
        environment[PROFILE_VARIABLES[0]] = str(
            FASTDDS_PROFILE_LOCALHOST if alone else FASTDDS_PROFILE
        )
    return environment


def is_fastdds(environment: Mapping[str, str]) -> bool:
    """Return whether processes with this environment use Fast DDS, which is the default."""
    return (environment.get(RMW) or IMPLEMENTATIONS["fastdds"]).startswith("rmw_fastrtps")


def ros_trouble(environment: Mapping[str, str], ros: RosSettings | None = None) -> Finding | None:
    """Return the finding that prevents a process from starting a node here, or None.

    ``ros`` are the plan's settings.
    """
    named = environment.get(RMW, "")
    return (
        no_ros()
        or _domain(environment.get(DOMAIN, ""))
        or _middleware(named, ros)
        or _configuration(environment)
    )


def installed_distro(environment: Mapping[str, str]) -> str | None:
    """Return the ROS release in this environment, such as ``jazzy``, None if unknown."""
    if distro := environment.get(DISTRO):
        return distro
    for name in _RCLPY:
        with suppress(PackageNotFoundError):
            return _RELEASES.get(version(name).partition(".")[0])
    return None


def other_distro(environment: Mapping[str, str], ros: RosSettings) -> Finding | None:
    """Return a warning if the environment's ROS release is not the plan's, or None."""
    here = installed_distro(environment)
    if ros.distro is None or here in {None, ros.distro}:
        return None
    message = (
        f"the robot has ros: {{distro: {ros.distro}}}, and ROS 2 {str(here).capitalize()} is set"
        " up here"
    )
    advice = f"source /opt/ros/{ros.distro}/setup.bash, or change distro"
    return finding("TF909", message, None, severity="warning", help=advice)


def reads_zenoh_alone(environment: Mapping[str, str]) -> bool:
    """Return whether TF on Zenoh must be read without ROS, and can be.

    This requires eclipse-zenoh from the extra ``zenoh``.
    """
    needs_zenoh = (
        environment.get(RMW) == IMPLEMENTATIONS["zenoh"]
        and find_spec("zenoh")
        and find_spec("xxhash")
    )
    return bool(needs_zenoh) and (
        missing_ros() is not None or _middleware(IMPLEMENTATIONS["zenoh"], None) is not None
    )


def other_middleware(environment: Mapping[str, str], ros: RosSettings) -> Finding | None:
    """Return a warning if the environment's middleware is not the plan's, or None.

    Tools do not discover the robot's processes in that case.
    """
    here, implementation = environment.get(RMW), IMPLEMENTATIONS[ros.rmw] if ros.rmw else None
    if not here or implementation in {None, here}:
        return None
    message = (
        f"{RMW}={here} in this environment, and the robot has ros: {{rmw: {ros.rmw}}}: tools from"
        " here do not see it"
    )
    return finding(
        "TF909",
        message,
        None,
        severity="warning",
        help=f"export {RMW}={implementation}, or change rmw",
    )


def no_ros() -> Finding | None:
    """Return the finding that ROS is missing, with what to install, or None."""
    missing = missing_ros()
    if not missing:
        return None
    message, _, advice = missing.partition(": ")
    return finding("TF901", message, None, help=advice)


def missing_composition() -> Finding | None:
    """Return the finding that containers cannot load components here, or None."""
    if find_spec("composition_interfaces") is not None:
        return None
    advice = (
        "install the package rclcpp_components (on Ubuntu: sudo apt install"
        " ros-jazzy-rclcpp-components)"
    )
    message = (
        "composition_interfaces cannot be imported: it comes with the ROS installation that has"
        " the containers"
    )
    return finding("TF901", message, None, help=advice)


def _domain(domain: str) -> Finding | None:
    if not domain or (domain.isascii() and domain.isdigit() and int(domain) <= LAST_DOMAIN):
        return None
    advice = f"unset {DOMAIN}, which is domain 0, or set it to the robot's"
    return finding(
        "TF909",
        f"{DOMAIN}={domain} is not a domain: domains are 0 to {LAST_DOMAIN}",
        None,
        help=advice,
    )


def _middleware(name: str, ros: RosSettings | None) -> Finding | None:
    """Search for the library of the middleware, as ROS does.

    Without it, ROS ends the process as soon as ROS is imported.
    """
    if not name:
        return None
    try:
        ctypes.CDLL(f"lib{name}.so")
    except OSError:
        installed = {
            file.stem.removeprefix("lib")
            for folder in _folders()
            for file in folder.glob("librmw_*_cpp.so")
        }
        here = sorted(name for name in installed if "_shared_" not in name and "__" not in name)
        package = f"ros-{_release(ros)}-{name.replace('_', '-')}"
        advice, message = (
            f"unset {RMW}, or install {package}",
            f"{RMW}={name}, which is not installed",
        )
        if ros and ros.rmw:
            advice, message = (
                f"install {package}, or change rmw",
                f"rmw: {ros.rmw} needs {name}, which is not installed",
            )
        advice += f"; here is {', '.join(here)}" if here else ""
        return finding("TF901", message, None, help=advice)
    if not is_fastdds({RMW: name}) and find_spec("tf2_msgs") is None:
        advice = f"install ros-{_release(ros)}-tf2-msgs, or use {IMPLEMENTATIONS['fastdds']}"
        return finding(
            "TF901",
            f"{name} needs the package tf2_msgs, but it is not installed",
            None,
            help=advice,
        )
    return None


def _release(ros: RosSettings | None) -> str:
    """Return the ROS release for names of packages in advice."""
    return (ros and ros.distro) or os.environ.get(DISTRO) or "jazzy"


def _configuration(environment: Mapping[str, str]) -> Finding | None:
    """Check the files that configure Zenoh. If a file is missing, every session ends at once."""
    for name in ZENOH_FILES if environment.get(RMW) == IMPLEMENTATIONS["zenoh"] else ():
        file = environment.get(name)
        if file and not Path(file).is_file():
            return finding(
                "TF909", f"{name}={file}: the file does not exist", None, help=f"unset {name}"
            )
    return None


def _folders() -> list[Path]:
    return [
        Path(folder)
        for folder in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
        if folder
    ]
