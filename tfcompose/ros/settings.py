"""Whether a process with these variables can start a node at all: ROS itself ends some, without a sentence.

This module imports no ROS.
"""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.findings import Finding, finding
from tfcompose.ros.environment import missing_ros

if TYPE_CHECKING:
    from collections.abc import Mapping

DOMAIN, RANGE, RMW = "ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "RMW_IMPLEMENTATION"
#: A port number holds no more domains (RTPS: 7400 + 250 times the domain, below 65536).
LAST_DOMAIN = 232


def ros_trouble(environment: Mapping[str, str]) -> Finding | None:
    """Return what keeps a process with this environment from starting a node, or None."""
    return no_ros() or _domain(environment.get(DOMAIN, "")) or _middleware(environment.get(RMW, ""))


def no_ros() -> Finding | None:
    """Return the finding that there is no ROS, with what to install, or None."""
    missing = missing_ros()
    if not missing:
        return None
    message, _, advice = missing.partition(": ")
    return finding("TF901", message, None, help=advice)


def _domain(domain: str) -> Finding | None:
    if not domain or (domain.isascii() and domain.isdigit() and int(domain) <= LAST_DOMAIN):
        return None
    advice = f"unset {DOMAIN}, which is domain 0, or set it to the robot's"
    return finding("TF909", f"{DOMAIN}={domain} is no domain: they go from 0 to {LAST_DOMAIN}", None, help=advice)


def _middleware(name: str) -> Finding | None:
    """Look for the library as ROS does; where it is not, ROS ends the process as soon as it is imported."""
    if not name:
        return None
    try:
        ctypes.CDLL(f"lib{name}.so")
    except OSError:
        found = {file.stem.removeprefix("lib") for folder in _folders() for file in folder.glob("librmw_*_cpp.so")}
        here = sorted(name for name in found if "_shared_" not in name and "__" not in name)
        advice = f"unset {RMW}, or install ros-jazzy-{name.replace('_', '-')}"
        advice += f"; here is {', '.join(here)}" if here else ""
        return finding("TF909", f"{RMW}={name}, and this ROS has no such middleware", None, help=advice)
    return None


def _folders() -> list[Path]:
    return [Path(folder) for folder in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep) if folder]
