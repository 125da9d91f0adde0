"""The view's server admits holders of its token, without tracebacks for others."""

import http
import socket
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from http.client import HTTPConnection
from pathlib import Path
from typing import IO, Any

import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from tests.support import processes
from tests.support.browser import TOKEN
from tfcompose.cli.parser import parser_of
from tfcompose.tools.view import command as view

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
WRONG_TOKENS = ["", f"?token={TOKEN[:-1]}", "?token=", "?token=%C3%A9", f"?token={TOKEN}x"]


def opened(
    port: int, query: str = "", origin: str | None = None, **headers: str
) -> ClientConnection:
    """Return a websocket; raises InvalidStatus."""
    return connect(
        f"ws://127.0.0.1:{port}/{query}",
        origin=Origin(origin) if origin else None,
        subprotocols=[PROTOCOL],
        open_timeout=20,
        additional_headers=headers,
    )


def is_refused(port: int, query: str = "", origin: str | None = None, **headers: str) -> bool:
    """Return whether a websocket is refused with 403."""
    try:
        opened(port, query, origin, **headers).close()
    except InvalidStatus as error:
        if error.response.status_code != http.HTTPStatus.FORBIDDEN:
            raise
        return True
    return False


def receive_to_the_end(connection: Connection) -> None:
    """Receive until the other side closes; raises ConnectionClosed then."""
    while True:
        connection.recv(timeout=20)


def answer_of(port: int, path: str) -> tuple[int, bytes, str]:
    """Return status, body and cookie of the answer to a GET."""
    connection = HTTPConnection("127.0.0.1", port, timeout=20)
    with closing(connection):
        connection.request("GET", path)
        with connection.getresponse() as answer:
            cookie = (answer.headers["Set-Cookie"] or "").partition(";")[0]
            return answer.status, answer.read(), cookie


@pytest.mark.parametrize("query", WRONG_TOKENS)
def test_without_the_token_there_is_neither_page_nor_websocket(
    query: str, server: viser.ViserServer
) -> None:
    port = server.get_port()
    for path in ("/", "/index.html", "/none"):
        status, body, cookie = answer_of(port, path + query)
        assert (status, cookie) == (http.HTTPStatus.FORBIDDEN, "")
        assert b"test" not in body
        assert len(body) < 100
    assert is_refused(port, query)


def test_the_token_lets_in_and_then_the_cookie_does(server: viser.ViserServer) -> None:
    port = server.get_port()
    status, body, cookie = answer_of(port, f"/?token={TOKEN}")
    assert status == http.HTTPStatus.OK
    assert b"<html" in body
    assert str(port) in cookie, "browsers send a cookie to all ports of a host"
    assert not is_refused(port, Cookie=cookie)
    assert not is_refused(port, f"?token={TOKEN}")
    assert is_refused(port, Cookie=cookie[:-1])
    assert is_refused(port, Cookie='x="; tfcompose_view')


@pytest.mark.parametrize(
    "origin",
    ["https://example.org", "http://127.0.0.1.example.org:{port}", "null", "http://127.0.0.1:1"],
)
def test_a_page_of_another_site_or_port_is_refused_even_with_the_token(
    origin: str, server: viser.ViserServer
) -> None:
    port = server.get_port()
    assert is_refused(port, f"?token={TOKEN}", origin.format(port=port))
    assert not is_refused(port, f"?token={TOKEN}", f"http://127.0.0.1:{port}")


def test_a_path_that_is_no_name_of_a_file_is_not_found(server: viser.ViserServer) -> None:
    for path in ("x" * 7000, "%00", "%2e%2e/%2e%2e/etc/passwd"):
        status, _, _ = answer_of(server.get_port(), f"/{path}?token={TOKEN}")
        assert status == http.HTTPStatus.NOT_FOUND


@pytest.mark.parametrize(
    "data", [b"\xc1", b"", b"\x81\xa4type\xa4None", b"\x90", "text", b"\x00" * 10_000]
)
def test_bytes_that_are_no_message_end_one_connection_without_a_traceback(
    data: bytes | str, server: viser.ViserServer, capfd: pytest.CaptureFixture[str]
) -> None:
    query = f"?token={TOKEN}"
    with opened(server.get_port(), query) as second_connection:
        with opened(server.get_port(), query) as connection:
            connection.send(data)
            with pytest.raises(ConnectionClosed):
                receive_to_the_end(connection)
        assert len(second_connection.recv(timeout=20)) > 0
        second_connection.ping().wait(20)
    assert "Traceback" not in capfd.readouterr().err


@contextmanager
def running_view(file: Path, *options: str, stderr: IO[bytes] | None = None) -> Iterator[str]:
    """Run the command; yield the address that it prints."""
    argv = [sys.executable, "-m", "tfcompose", "view", file.name, "--port", "0", *options]
    running = processes.start(argv, cwd=file.parent, stdout=subprocess.PIPE, stderr=stderr)
    try:
        assert running.stdout
        yield running.stdout.readline().strip()
    finally:
        processes.end(running)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.2", "localhost"])
def test_the_command_prints_an_address_with_a_token_of_its_own(host: str, rover: Path) -> None:
    with running_view(rover, "--edit", "--host", host) as address:
        page, _, token = address.partition("?token=")
        assert len(token) > 40
        with pytest.raises(urllib.error.HTTPError) as caught:
            urllib.request.urlopen(page, timeout=30)  # noqa: S310 (on this machine)
        assert caught.value.code == http.HTTPStatus.FORBIDDEN
        caught.value.close()
        with urllib.request.urlopen(address, timeout=30) as answer:  # noqa: S310 (as above)
            assert answer.status == http.HTTPStatus.OK


def test_the_browser_is_opened_by_a_file_that_others_cannot_read(
    rover: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every user of a machine can read the arguments of a process."""
    opened: list[tuple[str, int, str]] = []

    def interrupt(url: str) -> Any:
        file = Path(url.removeprefix("file://"))
        opened.append((url, file.stat().st_mode & 0o777, file.read_text("utf-8")))
        raise KeyboardInterrupt

    monkeypatch.setattr("webbrowser.open", interrupt)
    with pytest.raises(KeyboardInterrupt):
        view.run(parser_of("view").parse_args([str(rover), "--port", "0", "--open"]))
    ((url, mode, text),) = opened
    address = capsys.readouterr().out.splitlines()[0]
    assert address in text
    assert (address.partition("=")[2] in url, mode) == (False, 0o600)
    assert not Path(url.removeprefix("file://")).exists()


NO_REQUESTS = [
    b"\x00\xff\r\n\r\n",
    b"",
    b"GET /\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost\r\n\r\n",
    b"x" * 100_000,
]


def test_bytes_that_are_no_request_end_one_connection_without_a_traceback(rover: Path) -> None:
    with tempfile.TemporaryFile() as errors, running_view(rover, stderr=errors) as address:
        port = int(address.partition("/?")[0].rpartition(":")[2])
        for data in NO_REQUESTS:
            with (
                socket.create_connection(("127.0.0.1", port), timeout=20) as connection,
                suppress(ConnectionResetError, BrokenPipeError),
            ):
                connection.sendall(data)
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(4096):
                    pass
        token = address.partition("/?")[2]
        assert answer_of(port, f"/?{token}")[0] == http.HTTPStatus.OK
        errors.seek(0)
        assert b"Traceback" not in errors.read()
