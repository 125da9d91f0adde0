"""The control socket: other commands send requests to the launcher and receive its notices.

A request is a line of JSON, as defined in ``tfcompose.model.messages``, and so is its answer. A
client that requests events receives the recent events first, then each new event. The launcher
answers only the user who runs the robot.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import struct
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import msgspec

from tfcompose.foundation import procfs
from tfcompose.model.messages import REQUESTS, UNREADABLE, EventsRequest, Refusal, line_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tfcompose.launcher.runtime_dir import RuntimeDir
    from tfcompose.model.messages import ProcessMessage, Request

A = TypeVar("A")

#: Maximum length of a request, and of unsent notices to a client, in bytes. A longer request is
#: rejected. A client with more unsent notices is disconnected.
LONGEST_REQUEST = 64 * 1024
LONGEST_BACKLOG = 1024 * 1024
#: Number of notices kept for clients that connect later.
KEPT_LINES = 500
#: Maximum time for the launcher's answer, in seconds.
ANSWER_S = 20.0


class RequestRefusedError(Exception):
    """The launcher rejects a request; the message is the reason."""


@dataclass(slots=True, eq=False)
class Client:
    """A connected client."""

    connection: socket.socket
    listens: bool = False
    received: bytearray = field(default_factory=bytearray)
    unsent: bytearray = field(default_factory=bytearray)


@contextlib.contextmanager
def _socket_address(runtime_dir: RuntimeDir) -> Iterator[str]:
    """Yield a short address of the socket, because Linux limits it to 107 bytes."""
    folder = os.open(runtime_dir.folder, os.O_DIRECTORY | os.O_RDONLY)
    try:
        yield f"{procfs.descriptor(folder)}/{runtime_dir.socket.name}"
    finally:
        os.close(folder)


def listen(runtime_dir: RuntimeDir) -> socket.socket:
    """Return the listening socket of a robot whose lock this process holds.

    Replaces a socket left behind.
    """
    with contextlib.suppress(FileNotFoundError):
        runtime_dir.socket.unlink()
    listener = socket.socket(socket.AF_UNIX)
    with _socket_address(runtime_dir) as address:
        before = os.umask(0o177)
        try:
            listener.bind(address)
        finally:
            os.umask(before)
    listener.listen(16)
    listener.setblocking(False)  # noqa: FBT003 (its only argument)
    return listener


def connect(runtime_dir: RuntimeDir) -> socket.socket:
    """Return a connection to the robot's launcher.

    Raises:
        OSError: if no launcher runs the robot, or the launcher is suspended (Ctrl-Z).
    """
    _ensure_it_runs(runtime_dir)
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(ANSWER_S)
    try:
        with _socket_address(runtime_dir) as address:
            connection.connect(address)
    except BaseException:
        connection.close()
        raise
    return connection


def _is_suspended(pid: int) -> bool:
    """Return whether the process is suspended, for example by Ctrl-Z."""
    try:
        return procfs.stat(pid).state == "T"
    except OSError:
        return False


def _ensure_it_runs(runtime_dir: RuntimeDir) -> None:
    holder = runtime_dir.holder()
    if holder is None:
        return
    if _is_suspended(holder.pid):
        raise ConnectionError(
            f"its launcher {holder.pid} is stopped; kill -CONT {holder.pid} resumes it"
        )


def ask(runtime_dir: RuntimeDir, request: Request, answer: type[A]) -> A:
    """Return the launcher's answer to a request, as an ``answer``.

    Raises:
        RequestRefusedError: with the launcher's reason, if the launcher rejects the request.
        OSError: if no launcher runs the robot, or the launcher does not answer.
    """
    with connect(runtime_dir) as connection:
        connection.sendall(line_of(request))
        try:
            with connection.makefile("rb") as lines:
                line = lines.readline()
        except TimeoutError:
            _ensure_it_runs(runtime_dir)  # it can be suspended since connect() looked
            raise
    if not line:
        raise ConnectionResetError("the launcher has ended")
    try:
        data = msgspec.json.decode(line)
        if "error" in data:
            raise RequestRefusedError(msgspec.convert(data, Refusal).error)
        return msgspec.convert(data, answer)
    except (*UNREADABLE, TypeError) as error:
        raise ConnectionError(
            f"this version of tfcompose cannot read its launcher's answer: {error}"
        ) from None


class Control:
    """The launcher's end of the socket. ``answer`` returns the answer to a request."""

    def __init__(
        self,
        listener: socket.socket,
        selector: selectors.BaseSelector,
        answer: Callable[[Request], ProcessMessage],
    ) -> None:
        self._listener = listener
        self._selector = selector
        self._answer = answer
        self._clients: set[Client] = set()
        self._lines: deque[bytes] = deque(maxlen=KEPT_LINES)
        selector.register(listener, selectors.EVENT_READ, self._accept)

    def publish(self, line: str) -> None:
        """Send a line to all listening clients, and keep it for clients that connect later."""
        sent = f"{line}\n".encode()
        self._lines.append(sent)
        for client in [client for client in self._clients if client.listens]:
            self._send(client, sent)

    def listen(self, listener: socket.socket) -> None:
        """Accept requests at another socket from now on. Connected clients stay connected."""
        self._selector.unregister(self._listener)
        self._listener.close()
        self._listener = listener
        self._selector.register(listener, selectors.EVENT_READ, self._accept)

    def close(self) -> None:
        """Send pending notices, and close the connections."""
        for client in list(self._clients):
            client.connection.settimeout(0.5)
            with contextlib.suppress(OSError):
                client.connection.sendall(client.unsent)
            self._leave(client)
        self._selector.unregister(self._listener)
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return
        _, uid, _ = struct.unpack(
            "3i", connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
        )
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
        if data == b"" or len(client.received) > LONGEST_REQUEST:
            self._leave(client)
            return
        client.received += data or b""
        while b"\n" in client.received and client in self._clients:
            line, _, rest = bytes(client.received).partition(b"\n")
            client.received[:] = rest
            self._take(client, line)
        if client in self._clients:
            self._push(client)

    def _take(self, client: Client, line: bytes) -> None:
        try:
            request = REQUESTS.decode(line)
        except UNREADABLE as error:
            self._send(client, line_of(Refusal(f"not a request: {error}")))
            return
        if isinstance(request, EventsRequest):
            client.listens = True
            for kept in self._lines:
                self._send(client, kept)
        else:
            self._send(client, line_of(self._answer(request)))

    def _send(self, client: Client, line: bytes) -> None:
        client.unsent += line
        if len(client.unsent) > LONGEST_BACKLOG:
            self._leave(client)
        else:
            self._push(client)

    def _push(self, client: Client) -> None:
        try:
            sent = client.connection.send(client.unsent) if client.unsent else 0
        except BlockingIOError:
            sent = 0
        except OSError:
            self._leave(client)
            return
        del client.unsent[:sent]
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.unsent else 0)
        if self._selector.get_key(client.connection).events != events:
            self._selector.modify(client.connection, events, lambda: self._serve(client))

    def _leave(self, client: Client) -> None:
        if client in self._clients:
            self._clients.discard(client)
            self._selector.unregister(client.connection)
            client.connection.close()
