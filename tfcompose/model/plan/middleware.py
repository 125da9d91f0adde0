"""Middleware (rmw) settings of a plan: environment variables, and Zenoh's router.

Facts from the README and the design of rmw_zenoh_cpp: sessions are peers that discover each other
through a router, which listens on port 7447 of their own computer. ``ZENOH_CONFIG_OVERRIDE`` holds
``key=value`` pairs separated by semicolons, for sessions and for routers. A router does not
forward messages between peers, so a session that connects to a router on another computer must be
a client. rmw_zenoh_cpp ignores ``ROS_AUTOMATIC_DISCOVERY_RANGE``.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Rmw, RosSettings

#: Value of ``RMW_IMPLEMENTATION`` for each middleware.
IMPLEMENTATIONS: Mapping[Rmw, str] = {
    "fastdds": "rmw_fastrtps_cpp",
    "cyclonedds": "rmw_cyclonedds_cpp",
    "zenoh": "rmw_zenoh_cpp",
}

#: The process of Zenoh's router, its program, and its log line when it listens.
ROUTER = "zenoh_router"
ROUTER_PROGRAM = "${executable:rmw_zenoh_cpp/rmw_zenohd}"
ROUTER_LISTENS = "Started Zenoh router with id"
ZENOH_OVERRIDE = "ZENOH_CONFIG_OVERRIDE"
#: Variables with files of complete configurations.
ZENOH_FILES = ("ZENOH_SESSION_CONFIG_URI", "ZENOH_ROUTER_CONFIG_URI")
CYCLONE_URI = "CYCLONEDDS_URI"

#: An endpoint where a router listens.
ENDPOINT = r"(tcp|tls|quic|ws)/(\[[0-9a-fA-F:]+\]|[A-Za-z0-9.-]+):([0-9]{1,5})"
_PORT = "7447"
#: With discovery limited to localhost, rmw_cyclonedds allows 33 processes of a computer in a
#: domain, although its ports suffice for 120. The value of the variable overrides settings of
#: rmw_cyclonedds.
_CYCLONE_ALONE = (
    "<CycloneDDS><Domain><Discovery><MaxAutoParticipantIndex>119"
    "</MaxAutoParticipantIndex></Discovery></Domain>"
    "</CycloneDDS>"
)


def middleware_variables(ros: RosSettings, base: Mapping[str, str]) -> dict[str, str]:
    """Return the environment variables that the plan's middleware needs in every process.

    They are added to ``base``. A configuration that ``base`` names is kept.
    """
    variables = {"RMW_IMPLEMENTATION": IMPLEMENTATIONS[ros.rmw]} if ros.rmw else {}
    alone = (ros.discovery or base.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")).upper() == "LOCALHOST"
    if ros.rmw == "cyclonedds" and alone and not base.get(CYCLONE_URI):
        variables[CYCLONE_URI] = _CYCLONE_ALONE
    if (
        ros.rmw == "zenoh"
        and ros.router
        and not any(base.get(name) for name in (ZENOH_OVERRIDE, ZENOH_FILES[0]))
    ):
        variables[ZENOH_OVERRIDE] = f'mode="client";connect/endpoints=["{ros.router}"]'
    return variables


def router_variables(ros: RosSettings) -> dict[str, str]:
    """Return the environment variables that only the router needs.

    They set its listening address, unless that is the default.
    """
    endpoint = re.fullmatch(ENDPOINT, ros.router) if ros.router else None
    if endpoint is None and ros.discovery != "localhost":
        return {}
    host = "localhost" if ros.discovery == "localhost" else "[::]"
    protocol, port = (endpoint[1], endpoint[3]) if endpoint else ("tcp", _PORT)
    return {ZENOH_OVERRIDE: f'listen/endpoints=["{protocol}/{host}:{port}"]'}
