"""The control socket: other commands ask the launcher, and hear what it tells.

One request is one line of JSON, ``{"do": …}``; each answer is one line, too. Whoever asks for events hears the last
ones again, and then each as it comes. Only the user who runs the robot is heard.
"""

from __future__ import annotations

import contextlib
import json
import os
import selectors
import socket
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from tfcompose.ipc import REQUESTS, EventsRequest, Refusal
from tfcompose.plan.codec import decode, encode
from tfcompose.run.launcher.processes import STATE, fields_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.ipc import Request
    from tfcompose.run.place import Place

A = TypeVar("A")

#: A longer request is refused; a listener that is so far behind is let go; bytes.
LONGEST_REQUEST = 64 * 1024
LONGEST_BACKLOG = 1024 * 1024
#: How long the launcher may take to answer, in seconds.
ANSWER_S = 20.0


class RefusedError(Exception):
    """Raised where the launcher does not do what it is asked; the message is its reason."""


@dataclass(slots=True, eq=False)
class Client:
    """Somebody at the other end."""

    connection: socket.socket
    listens: bool = False
    taken: bytearray = field(default_factory=bytearray)
    owed: bytearray = field(default_factory=bytearray)


@contextlib.contextmanager
def _at(place: Place) -> Iterator[str]:
    """Give the socket's address: a short one, because Linux takes only 107 bytes."""
    folder = os.open(place.folder, os.O_DIRECTORY | os.O_RDONLY)
    try:
        yield f"/proc/self/fd/{folder}/{place.socket.name}"
    finally:
        os.close(folder)


def listen(place: Place) -> socket.socket:
    """Return the listening socket of a robot whose lock this process holds; one that was left there is replaced."""
    with contextlib.suppress(FileNotFoundError):
        place.socket.unlink()
    listener = socket.socket(socket.AF_UNIX)
    with _at(place) as address:
        before = os.umask(0o177)
        try:
            listener.bind(address)
        finally:
            os.umask(before)
    listener.listen(16)
    listener.setblocking(False)  # noqa: FBT003 (its only argument)
    return listener


def connect(place: Place) -> socket.socket:
    """Return a connection to whoever runs the robot.

    Raises:
        OSError: if nobody does, or whoever does was stopped (by Ctrl-Z) and cannot answer.
    """
    _ensure_it_runs(place)
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(ANSWER_S)
    try:
        with _at(place) as address:
            connection.connect(address)
    except BaseException:
        connection.close()
        raise
    return connection


def _ensure_it_runs(place: Place) -> None:
    holder = place.holder()
    if holder is None:
        return
    with contextlib.suppress(FileNotFoundError, ProcessLookupError, IndexError):
        if fields_of(holder.pid)[STATE] == "T":
            raise ConnectionError(f"its launcher {holder.pid} is stopped; kill -CONT {holder.pid} lets it go on")


def ask(place: Place, request: Request, answer: type[A]) -> A:
    """Return the launcher's answer to one request, of the class that answers it.

    Raises:
        RefusedError: with the launcher's reason, if it does not do it.
        OSError: if nobody runs the robot, or does not answer.
    """
    with connect(place) as connection:
        connection.sendall(REQUESTS.line(request).encode())
        with connection.makefile("rb") as lines:
            line = lines.readline()
    if not line:
        raise ConnectionResetError("the launcher has ended")
    try:
        data = json.loads(line)
        if "error" in data:
            raise RefusedError(decode(Refusal, data).error)
        return decode(answer, data)
    except (ValueError, TypeError) as error:
        raise ConnectionError(f"its launcher answers what this tfcompose does not understand: {error}") from None


class Control:
    """The launcher's end. ``answer`` is given each request and returns the object that is sent back."""

    def __init__(
        self, listener: socket.socket, selector: selectors.BaseSelector, answer: Callable[[Request], object]
    ) -> None:
        self._listener = listener
        self._selector = selector
        self._answer = answer
        self._clients: set[Client] = set()
        self._told: list[str] = []
        selector.register(listener, selectors.EVENT_READ, self._accept)

    def tell(self, line: str, *, keep: bool) -> None:
        """Send a line to all who listen; ``keep`` it for those who come later."""
        if keep:
            self._told.append(line)
            del self._told[:-500]
        for client in [client for client in self._clients if client.listens]:
            self._send(client, line)

    @property
    def heard(self) -> bool:
        """Whether somebody listens."""
        return any(client.listens for client in self._clients)

    def close(self) -> None:
        """Send what is left, and leave."""
        for client in list(self._clients):
            client.connection.settimeout(0.5)
            with contextlib.suppress(OSError):
                client.connection.sendall(client.owed)
            self._leave(client)
        self._selector.unregister(self._listener)
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return
        _, uid, _ = struct.unpack("3i", connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
        if uid not in {os.getuid(), 0}:
            connection.close()
            return
        connection.setblocking(False)  # noqa: FBT003 (its only argument)
        client = Client(connection)
        self._clients.add(client)
        self._selector.register(connection, selectors.EVENT_READ, lambda: self._serve(client))

    def _serve(self, client: Client) -> None:
        try:
            data = client.connection.recv(16 * 1024)
        except BlockingIOError:
            data = None
        except OSError:
            data = b""
        if data == b"" or len(client.taken) > LONGEST_REQUEST:
            self._leave(client)
            return
        client.taken += data or b""
        while b"\n" in client.taken and client in self._clients:
            line, _, rest = bytes(client.taken).partition(b"\n")
            client.taken[:] = rest
            self._take(client, line)
        if client in self._clients:
            self._push(client)

    def _take(self, client: Client, line: bytes) -> None:
        try:
            request = REQUESTS.read(line)
        except (ValueError, RecursionError) as error:
            self._send(client, json.dumps(encode(Refusal(f"not a request: {error}"))))
            return
        if isinstance(request, EventsRequest):
            client.listens = True
            for told in self._told:
                self._send(client, told)
        else:
            self._send(client, json.dumps(encode(self._answer(request))))

    def _send(self, client: Client, line: str) -> None:
        client.owed += line.encode() + b"\n"
        if len(client.owed) > LONGEST_BACKLOG:
            self._leave(client)
        else:
            self._push(client)

    def _push(self, client: Client) -> None:
        try:
            sent = client.connection.send(client.owed) if client.owed else 0
        except BlockingIOError:
            sent = 0
        except OSError:
            self._leave(client)
            return
        del client.owed[:sent]
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.owed else 0)
        if self._selector.get_key(client.connection).events != wanted:
            self._selector.modify(client.connection, wanted, lambda: self._serve(client))

    def _leave(self, client: Client) -> None:
        if client in self._clients:
            self._clients.discard(client)
            self._selector.unregister(client.connection)
            client.connection.close()
