"""Starts a sandboxed process and talks to it: its questions, its answer, and its output.

Data from the process are untrusted. Messages are limited in size, and its output is truncated. The
process has its own session and no terminal. It ends after a time limit, or with this process.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

from tfcompose.foundation.shape import fits

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

MOST_WALL_S: Final = 30.0
#: Time limit with --trust, in seconds. Files may be on a slow disk.
MOST_TRUSTED_WALL_S: Final = 600.0
MOST_ANSWER_BYTES: Final = 64 << 20
MOST_PRINTED_BYTES: Final = 1 << 20
#: Maximum number of lists and mappings in an answer, because each takes more memory than its text.
_MOST_CONTAINERS: Final = 4_000_000
#: Maximum number of characters of a path or a name in a question.
_LONGEST_QUESTION: Final = 4096


#: The reply to a question: a message and the bytes that follow it.
Reply = tuple[Any, bytes]


@dataclass(slots=True)
class Outcome:
    """The end of a sandboxed process, with or without an answer."""

    #: The answer, None without one.
    answer: Any = None
    #: The exit code.
    code: int = 0
    timed_out: bool = False
    #: The reason if it was killed because of an invalid message; otherwise empty.
    refused: str = ""
    #: Sandbox features that the kernel lacks.
    missing: tuple[str, ...] = ()
    #: The output of the process.
    printed: str = ""


class _RefusedError(Exception):
    """A message is invalid or too large."""


def run_confined(  # noqa: PLR0913 (what a process needs)
    module: str,
    request: Mapping[str, Any],
    answers: Mapping[str, Callable[[Any], Reply]],
    *,
    wall_s: float = MOST_WALL_S,
    shared: Sequence[int] = (),
    environment: Mapping[str, str] | None = None,
) -> Outcome:
    """Run a module's ``main`` in a separate process, and return the outcome.

    ``main`` gets the descriptors of its two pipes, followed by the descriptors in ``shared``. It
    reads the request and sends mappings with a single key: first ``missing``, with features that
    the kernel lacks; then questions, whose keys are those of ``answers``; finally ``answer``.
    """
    reads, to_child = os.pipe()
    from_child, writes = os.pipe()
    inherited = [reads, writes, *shared]
    program = f"import sys; sys.path[:] = {_module_path()!r}; from {module} import main"
    program += f"; main(*{inherited})"
    outcome, printed = Outcome(), bytearray()
    env = dict(os.environ if environment is None else environment)
    env.pop("PYTHONPYCACHEPREFIX", None)  # the process may not read that folder
    with (
        os.fdopen(to_child, "wb", buffering=0) as sink,
        os.fdopen(from_child, "rb") as source,
        subprocess.Popen(
            [sys.executable, "-c", program],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=inherited,
            start_new_session=True,
            env=env,
        ) as process,
    ):
        os.close(reads)
        os.close(writes)
        reader = threading.Thread(target=_collect, args=(process.stdout, printed), daemon=True)
        reader.start()
        watchdog = threading.Timer(wall_s, _end, (process, outcome))
        watchdog.daemon = True
        watchdog.start()
        try:
            outcome.answer = _converse(source, sink, request, answers, outcome)
            if outcome.answer is None:
                process.wait()  # the exit code tells the reason
        except _RefusedError as error:
            outcome.refused = str(error)
        finally:
            watchdog.cancel()
            process.kill()
            reader.join()
    outcome.code = process.returncode
    outcome.printed = printed.decode("utf-8", "replace")
    return outcome


def _module_path() -> list[str]:
    """Return Python's path without the working directory, which python -m adds."""
    package_folder, here = str(Path(__file__).parents[2]), os.path.realpath("")
    paths = [path for path in sys.path if path and os.path.realpath(path) != here]
    return paths if package_folder in paths else [*paths, package_folder]


def _end(process: subprocess.Popen[bytes], outcome: Outcome) -> None:
    outcome.timed_out = True
    process.kill()


def _collect(stream: IO[bytes], printed: bytearray) -> None:
    """Read a stream to its end, and keep only the beginning."""
    while chunk := os.read(stream.fileno(), 1 << 16):
        printed += chunk[: MOST_PRINTED_BYTES - len(printed)]


def _converse(
    source: IO[bytes],
    sink: IO[bytes],
    request: Mapping[str, Any],
    answers: Mapping[str, Callable[[Any], Reply]],
    outcome: Outcome,
) -> Any:
    """Return the answer to a request, None if the process ends without one."""
    _send(sink, request, b"")
    is_first = True  # no untrusted code has run before the first message
    while message := _receive(source):
        (key, value), *rest = message.items()
        if key == "answer" and not rest:
            return value
        if key == "missing" and is_first and fits(value, [str]):
            outcome.missing = tuple(value)
        elif key in answers and isinstance(value, str) and len(value) <= _LONGEST_QUESTION:
            _send(sink, *answers[key](value))
        else:
            raise _RefusedError("it asks what nothing answers")
        is_first = False
    return None


def _send(sink: IO[bytes], message: Any, data: bytes) -> None:
    rest = memoryview(json.dumps(message).encode() + b"\n" + data)
    with contextlib.suppress(BrokenPipeError):  # the process has ended
        while rest:
            rest = rest[sink.write(rest) :]


def _receive(source: IO[bytes]) -> dict[str, Any] | None:
    """Return the next message, None at the end of the stream."""
    line = source.readline(MOST_ANSWER_BYTES + 1)
    if len(line) > MOST_ANSWER_BYTES:
        raise _RefusedError(f"it answers with more than {MOST_ANSWER_BYTES >> 20} MB")
    if not line.endswith(b"\n"):
        return None
    if line.count(b"[") + line.count(b"{") > _MOST_CONTAINERS:
        raise _RefusedError(f"it answers with more than {_MOST_CONTAINERS:,} values")
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        message = None
    if not isinstance(message, dict) or not message:
        raise _RefusedError("its answer is none")
    return message
