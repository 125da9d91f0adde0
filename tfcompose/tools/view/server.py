"""Server of the browser view, which accepts only windows with its token."""

from __future__ import annotations

import contextlib
import hmac
import http
import io
import logging
import secrets
from functools import partial
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import viser
import websockets.asyncio.server
from viser._messages import Message
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

if TYPE_CHECKING:
    from collections.abc import Callable

#: The length of a token: nobody can guess 256 bits.
_TOKEN_BYTES = 32
#: Logger for websockets. Its default logger prints a traceback for each connection without a
#: request.
_LOGGER = logging.getLogger(__name__)
_LOGGER.addFilter(lambda record: record.msg != "opening handshake failed")


def new_token() -> str:
    """Return an unguessable token that is valid in a URL."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def start_server(host: str, port: int, name: str, token: str) -> viser.ViserServer:
    """Start a server on a free port, and return it; port 0 means any port.

    The page and the websocket require the ``token``. Other users of the machine, pages of other
    sites and port scanners get the status 403 and no data about the robot. The token is in the URL
    of the page, ``?token=``. It is then also in a cookie, because viser's page opens its websocket
    without a query. viser has no setting for this. Therefore this function replaces ``serve`` of
    websockets while it starts viser.
    """
    serve = websockets.asyncio.server.serve

    def serve_guarded(*arguments: Any, process_request: Any, **options: Any) -> Any:
        admit = partial(_admit, token, process_request)
        options |= {"create_connection": _Connection, "logger": _LOGGER}
        return serve(*arguments, process_request=admit, **options)

    websockets.asyncio.server.serve = serve_guarded  # type: ignore[assignment,misc]
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner
            return viser.ViserServer(host, port, label=name, verbose=False)
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


class _Connection(ServerConnection):
    """A websocket that closes if it receives a message that is not viser's."""

    async def recv(self, decode: bool | None = None) -> Any:  # noqa: FBT001 (as the base has it)
        """Return the next message; raise ConnectionClosed if it is not viser's."""
        data = await super().recv(decode)
        try:
            if isinstance(data, bytes):
                Message.deserialize(data)
                return data
        except Exception:  # noqa: BLE001, S110 (viser raises anything)
            pass
        await self.close(CloseCode.INVALID_DATA)
        return await super().recv(decode)


def _admit(
    token: str,
    answer: Callable[[Any, Request], Response | None],
    connection: Any,
    request: Request,
) -> Response | None:
    """Answer a request that has the token in its URL or in the cookie.

    Refuse all other requests, and requests from pages of other sites.
    """
    headers = request.headers
    port = urlsplit(f"//{headers.get('Host', '')}").netloc.rpartition(":")[2]
    cookie = f"tfcompose_view_{port}"  # a host's cookies go to all its ports
    in_address = parse_qs(urlsplit(request.path).query).get("token", [""])[-1]
    origin = headers.get("Origin")
    is_own_page = origin is None or urlsplit(origin).netloc == headers.get("Host")
    has_token = any(
        hmac.compare_digest(candidate.encode(), token.encode())
        for candidate in (in_address, _cookie(headers, cookie))
    )
    if not has_token or not is_own_page:
        return _refuse(http.HTTPStatus.FORBIDDEN, "open the address with its token")
    try:
        response = answer(connection, request)
    except OSError:  # the path is not a valid file name
        return _refuse(http.HTTPStatus.NOT_FOUND, "there is no such file")
    if response is not None:
        response.headers["Set-Cookie"] = f"{cookie}={token}; HttpOnly; SameSite=Strict; Path=/"
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Cache-Control"] = "no-store"
    return response


def _refuse(status: http.HTTPStatus, text: str) -> Response:
    body = f"{text}\n".encode()
    headers = Headers({"Content-Type": "text/plain", "Content-Length": str(len(body))})
    return Response(status, status.phrase, headers, body)


def _cookie(headers: Headers, name: str) -> str:
    cookies: SimpleCookie = SimpleCookie()
    for text in headers.get_all("Cookie"):
        with contextlib.suppress(CookieError):
            cookies.load(text)
    return cookies[name].value if name in cookies else ""
