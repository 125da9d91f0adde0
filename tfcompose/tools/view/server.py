"""Starts viser's server so that it talks to its own page, and elsewhere than on this machine to who has its token."""

from __future__ import annotations

import contextlib
import hmac
import http
import io
import re
from functools import partial
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import viser
import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

if TYPE_CHECKING:
    from collections.abc import Callable

#: Pages that may talk to the server: its own, which this machine has. Programs that are no browser
#: name no origin.
_OWN_PAGES = (re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?"), None)
_COOKIE = "tfcompose_view"


def started(host: str, port: int, name: str, token: str = "") -> viser.ViserServer:
    """Return a server at a port that is free; 0 takes any.

    It refuses pages of other sites, which could otherwise move and save mounts while they are open
    in a browser here, and with a ``token`` whoever did not open the page by an address with that.
    viser has no setting for either, so it starts with what websockets has.
    """
    serve = websockets.asyncio.server.serve

    def guarded(*arguments: Any, process_request: Any, **options: Any) -> Any:
        admit = partial(_admitted, token, process_request) if token else process_request
        return serve(
            *arguments, process_request=admit, origins=None if token else _OWN_PAGES, **options
        )

    websockets.asyncio.server.serve = guarded  # type: ignore[assignment,misc]
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # its banner
            return viser.ViserServer(host, port, label=name, verbose=False)
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def stop(server: viser.ViserServer) -> None:
    """End a server."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def _admitted(
    token: str,
    answer: Callable[[Any, Request], Response | None],
    connection: Any,
    request: Request,
) -> Response | None:
    """Answer who has the token, in the address or then in a cookie; others, and pages of other sites, are refused."""
    headers = request.headers
    in_address = parse_qs(urlsplit(request.path).query).get("token", [""])[-1]
    origin = headers.get("Origin")
    is_own_page = origin is None or urlsplit(origin).netloc == headers.get("Host")
    has_token = any(
        hmac.compare_digest(one.encode(), token.encode()) for one in (in_address, _cookie(headers))
    )
    if not has_token or not is_own_page:
        return Response(
            http.HTTPStatus.FORBIDDEN, "FORBIDDEN", Headers(), b"open the address with its token\n"
        )
    response = answer(connection, request)
    if response is not None:
        response.headers["Set-Cookie"] = f"{_COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/"
        response.headers["Referrer-Policy"] = "no-referrer"
    return response


def _cookie(headers: Headers) -> str:
    cookies: SimpleCookie = SimpleCookie()
    for text in headers.get_all("Cookie"):
        with contextlib.suppress(CookieError):
            cookies.load(text)
    return cookies[_COOKIE].value if _COOKIE in cookies else ""
