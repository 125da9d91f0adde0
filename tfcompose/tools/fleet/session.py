"""Zenoh sessions with a router, from the extra ``fleet``."""

from __future__ import annotations

import json
from typing import Any

import zenoh

#: The timeout for a connection to a router, in milliseconds.
_CONNECT_MS = 1000


def connect_router(router: str) -> Any:
    """Return a client session with a router.

    The session reconnects by itself. The caller must close it.

    Raises:
        ConnectionError: if the router does not answer within a second.
    """
    config = zenoh.Config()
    settings = {
        "mode": "client",
        "connect/endpoints": [router],
        "connect/timeout_ms": _CONNECT_MS,
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,  # the time of sending, by the sender's clock
    }
    for name, value in settings.items():
        config.insert_json5(name, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ConnectionError(
            f"no router at {router}: {str(error).partition(' at /')[0]}"
        ) from None
