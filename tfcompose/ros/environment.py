"""What a process needs around it to speak ROS: rclpy, and the variables that ROS reads when it starts.

This module imports no ROS, so that everything can ask whether there is one.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.plan import RosSettings

#: The profile of tfcompose's own processes, and the one where they hear this machine alone; the files say what for.
FASTDDS_PROFILE = Path(__file__).with_name("fastdds.xml")
FASTDDS_PROFILE_LOCALHOST = Path(__file__).with_name("fastdds_localhost.xml")

# Fast DDS 2 reads the first, Fast DDS 3 the second. A user who sets either has decided.
PROFILE_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")


class RosError(Exception):
    """Raised when ROS is there and cannot be used as needed; the message is one sentence for the user."""


def missing_ros() -> str | None:
    """Return None when rclpy can be imported, else one sentence that says what to install."""
    if find_spec("rclpy") is not None:
        return None
    return (
        "rclpy cannot be imported: on x86-64 Linux install it with pip install 'tfcompose[ros]', elsewhere install "
        "ROS 2 Jazzy from the distribution, make the environment with python3 -m venv --system-site-packages, and "
        "run source /opt/ros/jazzy/setup.bash first"
    )


def child_environment(base: Mapping[str, str], ros: RosSettings, *, own: bool) -> dict[str, str]:
    """Return ``base`` with what the plan says about ROS.

    What the plan leaves open stays as it is in ``base``. With ``own`` the process is one of tfcompose's and announces
    itself by ``FASTDDS_PROFILE``, or the one for this machine alone, unless ``base`` names a profile file already.
    Other processes keep their profile.
    """
    environment = {**base, "PYTHONUNBUFFERED": "1"}
    if ros.domain_id is not None:
        environment["ROS_DOMAIN_ID"] = str(ros.domain_id)
    if ros.discovery is not None:
        environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = ros.discovery.upper()
    if own and not any(base.get(name) for name in PROFILE_VARIABLES):
        alone = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "LOCALHOST"
        environment[PROFILE_VARIABLES[0]] = str(FASTDDS_PROFILE_LOCALHOST if alone else FASTDDS_PROFILE)
    return environment
