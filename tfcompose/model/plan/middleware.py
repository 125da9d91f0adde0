"""Middleware (rmw) settings of a plan: environment variables, and Zenoh's router.

Facts of rmw_zenoh_cpp (its README and design): sessions are peers that find each other through one
router, which listens on port 7447 of their own computer. ``ZENOH_CONFIG_OVERRIDE`` holds
``key=value`` pairs with a semicolon between them, for sessions and routers alike. A router passes
nothing on between peers, so that sessions which reach it from another computer have to be clients.
``ROS_AUTOMATIC_DISCOVERY_RANGE`` means nothing to it.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.plan import Rmw, RosSettings

#: What ``RMW_IMPLEMENTATION`` has to be.
IMPLEMENTATIONS: Mapping[Rmw, str] = {
    "fastdds": "rmw_fastrtps_cpp",
    "cyclonedds": "rmw_cyclonedds_cpp",
    "zenoh": "rmw_zenoh_cpp",
}

#: The process that is Zenoh's router, its program, and what it writes once it listens.
ROUTER = "zenoh_router"
ROUTER_PROGRAM = "${executable:rmw_zenoh_cpp/rmw_zenohd}"
ROUTER_LISTENS = "Started Zenoh router with id"
ZENOH_OVERRIDE = "ZENOH_CONFIG_OVERRIDE"
#: Files with whole configurations.
ZENOH_FILES = ("ZENOH_SESSION_CONFIG_URI", "ZENOH_ROUTER_CONFIG_URI")
CYCLONE_URI = "CYCLONEDDS_URI"

#: A place where a router listens.
ENDPOINT = r"(tcp|tls|quic|ws)/(\[[0-9a-fA-F:]+\]|[A-Za-z0-9.-]+):([0-9]{1,5})"
_PORT = "7447"
#: rmw_cyclonedds lets 33 processes of one computer run in a domain where discovery is for it
#: alone; its ports hold 120. What stands in the variable goes over what rmw_cyclonedds writes
#: itself.
_CYCLONE_ALONE = (
    "<CycloneDDS><Domain><Discovery><MaxAutoParticipantIndex>119"
    "</MaxAutoParticipantIndex></Discovery></Domain>"
    "</CycloneDDS>"
)


def middleware_variables(ros: RosSettings, base: Mapping[str, str]) -> dict[str, str]:
    """Return what the plan's middleware has in every process's environment, over ``base``.

    A configuration that ``base`` names stays.
    """
    found = {"RMW_IMPLEMENTATION": IMPLEMENTATIONS[ros.rmw]} if ros.rmw else {}
    alone = (ros.discovery or base.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")).upper() == "LOCALHOST"
    if ros.rmw == "cyclonedds" and alone and not base.get(CYCLONE_URI):
        found[CYCLONE_URI] = _CYCLONE_ALONE
    if (
        ros.rmw == "zenoh"
        and ros.router
        and not any(base.get(name) for name in (ZENOH_OVERRIDE, ZENOH_FILES[0]))
    ):
        found[ZENOH_OVERRIDE] = f'mode="client";connect/endpoints=["{ros.router}"]'
    return found


def router_variables(ros: RosSettings) -> dict[str, str]:
    """Return what the router alone has in its environment.

    Where it listens, if that is not its own default.
    """
    endpoint = re.fullmatch(ENDPOINT, ros.router) if ros.router else None
    if endpoint is None and ros.discovery != "localhost":
        return {}
    host = "localhost" if ros.discovery == "localhost" else "[::]"
    protocol, port = (endpoint[1], endpoint[3]) if endpoint else ("tcp", _PORT)
    return {ZENOH_OVERRIDE: f'listen/endpoints=["{protocol}/{host}:{port}"]'}
