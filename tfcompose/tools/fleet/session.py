"""Sessions of Zenoh that reach one router, over the extra ``fleet``."""

from __future__ import annotations

import json
from typing import Any

import zenoh

#: So long a router is waited for, in milliseconds.
_CONNECT_MS = 1000


def connect_router(router: str) -> Any:
    """Return a client's session with the router.

    It connects again by itself, and has to be closed.

    Raises:
        ConnectionError: if the router is not reached within a second.
    """
    config = zenoh.Config()
    settings = {
        "mode": "client",
        "connect/endpoints": [router],
        "connect/timeout_ms": _CONNECT_MS,
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,  # when it was sent, by the clock of who sends
    }
    for name, value in settings.items():
        config.insert_json5(name, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ConnectionError(
            f"no router at {router}: {str(error).partition(' at /')[0]}"
        ) from None
