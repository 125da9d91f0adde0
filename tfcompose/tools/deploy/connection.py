"""Connections to the agents on hosts, with asyncssh."""

from __future__ import annotations

import asyncio
import contextlib
import json
import shlex
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import asyncssh

from tfcompose.foundation.findings import Finding, finding
from tfcompose.launcher.program import ANYWHERE
from tfcompose.model.systemd import SOURCING

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import PlanHost

#: The timeouts in seconds for a connection to a host, and for its answer to a short request.
CONNECT_S, ANSWER_S = 10.0, 180.0
#: The interval of keepalives in seconds, and the number of missed ones that ends a connection.
ALIVE_EVERY_S, ALIVE_MISSES = 2.0, 3
#: The number of clock readings. The fastest answer is the most exact one.
CLOCK_READINGS = 5
#: The program with which Python starts on a host. It reads a length from the first line of its
#: input, then that many bytes, and runs them.
START = (
    "import sys; sys.exit('Python %d.%d is older than 3.10' % sys.version_info[:2]) if"
    " sys.version_info < (3, 10) else"
    " exec(compile(sys.stdin.buffer.read(int(sys.stdin.buffer.readline())), 'tfcompose agent',"
    " 'exec'), {'__name__': '__main__'})"
)


@dataclass(frozen=True, slots=True)
class Settings:
    """The agent's settings, sent before any request."""

    #: The name of the robot's part on the host: ROBOT.HOST.
    name: str
    #: The file name of the unit.
    unit: str
    python: str = "python3"
    #: Setup files to source, in order.
    setup: tuple[str, ...] = ()
    #: Whether the unit belongs to the system's systemd instead of the user's.
    system: bool = False
    #: A line of bash. It sources the files before ``--`` and then executes the command after it.
    sourcing: str = SOURCING
    #: The Python code that starts tfcompose.
    program: str = ANYWHERE


def agent_command(python: str) -> str:
    """Return the shell command that starts the agent.

    Python does not import modules from the user's folders.
    """
    program = f"~/{shlex.quote(python[2:])}" if python.startswith("~/") else shlex.quote(python)
    return f"exec {program} -I -c {shlex.quote(START)}"


def agent_input(settings: Settings) -> bytes:
    """Return the beginning of the agent's input: its program and its settings."""
    agent = Path(__file__).with_name("agent.py").read_bytes()
    return f"{len(agent)}\n".encode() + agent + f"{json.dumps(asdict(settings))}\n".encode()


def settings_of(robot: str, name: str, host: PlanHost, *, system: bool = False) -> Settings:
    """Return the settings for the agent of a robot's host."""
    share = f"{robot}.{name}"
    return Settings(
        share, f"tfcompose-{share}.service", host.python or "python3", host.setup, system
    )


class LostError(Exception):
    """Raised if a host no longer answers; the message describes the symptom."""


class RefusedError(Exception):
    """Raised if a host cannot carry out a request; the message contains the reason."""


class ConnectedHost:
    """A connected host. ``span`` is its location in the robot file."""

    def __init__(
        self,
        name: str,
        connection: asyncssh.SSHClientConnection,
        process: asyncssh.SSHClientProcess[bytes],
        span: Span | None,
    ) -> None:
        self.name = name
        self.span = span
        self._connection = connection
        self._process = process
        self._order = asyncio.Lock()

    async def ask(self, request: str, timeout_s: float = ANSWER_S, **arguments: Any) -> Any:
        """Return the agent's answer.

        Raises:
            LostError: if the host no longer answers. RefusedError: if the host cannot carry out
            the request.
        """
        async with self._order:
            try:
                self._process.stdin.write(f"{json.dumps([request, arguments])}\n".encode())
                answer = await asyncio.wait_for(self._answer(), timeout_s)
            except asyncio.TimeoutError:
                raise LostError(f"did not answer within {timeout_s:g} s") from None
            except (OSError, asyncssh.Error, ValueError) as error:
                raise LostError(f"lost its connection: {error}") from None
        if answer is None:
            raise LostError("lost its connection")
        if "error" in answer:
            raise RefusedError(answer["error"])
        return answer["answer"]

    async def _answer(self) -> dict[str, Any] | None:
        """Return the next answer, or None at the end; skip output of the login shell."""
        line = b""
        while part := await self._process.stdout.readline():  # a part of a long line
            line += part
            if line.endswith(b"\n"):
                with contextlib.suppress(ValueError):
                    answer = json.loads(line)
                    if isinstance(answer, dict) and not {"answer", "error"}.isdisjoint(answer):
                        return answer
                line = b""
        return None

    async def clock_offset_s(self) -> float:
        """Return by how much the host's clock is ahead of this computer's clock, in seconds.

        The value is from the fastest of several answers.
        """
        readings: list[tuple[float, float]] = []
        for _ in range(CLOCK_READINGS):
            before = time.time()
            remote_s: float = await self.ask("clock")
            after = time.time()
            readings.append((after - before, remote_s - (before + after) / 2))
        return min(readings)[1]

    async def execute(self, argv: list[str]) -> asyncssh.SSHClientProcess[bytes]:
        """Replace the agent by tfcompose with these arguments, and return its process."""
        self._process.stdin.write(f'["execute", {json.dumps({"argv": argv})}]\n'.encode())
        return self._process

    async def close(self) -> None:
        """End the connection and the agent, which reverts a release on trial."""
        try:
            self._process.stdin.write_eof()
            await asyncio.wait_for(self._process.wait_closed(), ANSWER_S)
        except (OSError, asyncssh.Error, asyncio.TimeoutError):
            pass
        self._connection.close()
        await self._connection.wait_closed()


async def connect_host(
    name: str, host: PlanHost, settings: Settings, span: Span | None
) -> ConnectedHost | Finding:
    """Connect to a host and start its agent; return a finding if this fails."""
    user, _, address = host.ssh.rpartition("@")
    options: dict[str, Any] = {"username": user} if user else {}
    options |= {"port": host.port} if host.port is not None else {}
    try:
        connection = await asyncio.wait_for(
            asyncssh.connect(
                address.strip("[]"),
                connect_timeout=CONNECT_S,
                login_timeout=CONNECT_S,
                keepalive_interval=ALIVE_EVERY_S,
                keepalive_count_max=ALIVE_MISSES,
                **options,
            ),
            2 * CONNECT_S,
        )
    except asyncssh.HostKeyNotVerifiable as error:
        advice = f"log in once, and compare its key: ssh {_in_words(host)}"
        return _unreachable(name, f"its key is not trusted ({error})", span, advice)
    except asyncssh.PermissionDenied:
        advice = f"allow your key there: ssh-copy-id {_in_words(host)}"
        return _unreachable(
            name, f"{host.ssh} asks for a password, and deploy needs a key", span, advice
        )
    except asyncio.TimeoutError:
        return _unreachable(name, f"{host.ssh} did not answer within {CONNECT_S:g} s", span)
    except (OSError, asyncssh.Error) as error:
        return _unreachable(
            name,
            f"{host.ssh}:"
            f" {error.strerror if isinstance(error, OSError) and error.strerror else error}",
            span,
        )
    python = settings.python
    try:
        process = await connection.create_process(
            agent_command(python), encoding=None, window=2**21, max_pktsize=2**15
        )
        process.stdin.write(agent_input(settings))
        connected_host = ConnectedHost(name, connection, process, span)
        await connected_host.ask("clock", 2 * CONNECT_S)
    except (OSError, asyncssh.Error, LostError, RefusedError) as error:
        why = await _stderr_of(process) or str(error)
        connection.close()
        message = f"{name} cannot run {python}: {why}"
        return finding(
            "TF914",
            message,
            span,
            help=f"hosts: {{{name}: {{python: FILE}}}}, Python 3.10 or newer",
        )
    return connected_host


async def hostname_of(
    name: str, host: PlanHost, settings: Settings, span: Span | None
) -> str | Finding:
    """Return the hostname of a host, or a finding if it cannot be reached."""
    connected_host = await connect_host(name, host, settings, span)
    if isinstance(connected_host, Finding):
        return connected_host
    try:
        hostname: str = await connected_host.ask("hostname")
    except (LostError, RefusedError) as error:
        return _unreachable(name, str(error), span)
    finally:
        await connected_host.close()
    return hostname


async def _stderr_of(process: asyncssh.SSHClientProcess[bytes]) -> str:
    try:
        text = await asyncio.wait_for(process.stderr.read(), 1.0)
    except (OSError, asyncssh.Error, asyncio.TimeoutError):
        return ""
    lines = [line.strip() for line in text.decode(errors="replace").splitlines() if line.strip()]
    return lines[-1] if lines else ""


def _in_words(host: PlanHost) -> str:
    return f"-p {host.port} {host.ssh}" if host.port is not None else host.ssh


def _unreachable(name: str, why: str, span: Span | None, advice: str = "") -> Finding:
    return finding("TF913", f"{name} cannot be reached: {why}", span, help=advice)
