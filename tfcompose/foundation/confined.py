"""Starts a confined process and talks to it: what it asks, what it answers, what it prints.

Whatever comes from it is a stranger's: messages are bounded in size, and what it prints is cut. It
has a session of its own, no terminal, and ends with its time or with this process.
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
#: With --trust: files may be on a disk that does not answer.
MOST_TRUSTED_WALL_S: Final = 600.0
MOST_ANSWER_BYTES: Final = 64 << 20
MOST_PRINTED_BYTES: Final = 1 << 20
#: Lists and mappings of an answer: each takes memory that its text does not.
_MOST_CONTAINERS: Final = 4_000_000
#: Characters of a path or a name.
_LONGEST_QUESTION: Final = 4096


#: A question's answer: a message, and bytes that follow it.
Reply = tuple[Any, bytes]


@dataclass(slots=True)
class Outcome:
    """How a confined process ended: with an answer, or without."""

    #: What it sent; None if it sent nothing.
    answer: Any = None
    #: Its exit code.
    code: int = 0
    timed_out: bool = False
    #: Why it was ended because of what it sent; empty if it was not.
    refused: str = ""
    #: What the kernel lacks to confine it.
    missing: tuple[str, ...] = ()
    #: What it printed.
    printed: str = ""


class _RefusedError(Exception):
    """A message is none, or is too large."""


def run_confined(  # noqa: PLR0913 (what a process needs)
    module: str,
    request: Mapping[str, Any],
    answers: Mapping[str, Callable[[Any], Reply]],
    *,
    wall_s: float = MOST_WALL_S,
    shared: Sequence[int] = (),
    environment: Mapping[str, str] | None = None,
) -> Outcome:
    """Run a module's ``main`` in a process of its own, and return how that ended.

    ``main`` is given the descriptors of its two pipes, then those that are ``shared``. It reads
    the request, and sends mappings with one key: ``missing``, with what the kernel is missing,
    then questions, whose keys ``answers`` has, then ``answer``.
    """
    reads, to_child = os.pipe()
    from_child, writes = os.pipe()
    inherited = [reads, writes, *shared]
    program = f"import sys; sys.path[:] = {_module_path()!r}; from {module} import main"
    program += f"; main(*{inherited})"
    outcome, printed = Outcome(), bytearray()
    env = dict(os.environ if environment is None else environment)
    env.pop("PYTHONPYCACHEPREFIX", None)  # a folder that it may not read
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
                process.wait()  # its exit code says why
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
    """Return where modules are: not in the working folder, which python -m adds."""
    own, here = str(Path(__file__).parents[2]), os.path.realpath("")
    paths = [path for path in sys.path if path and os.path.realpath(path) != here]
    return paths if own in paths else [*paths, own]


def _end(process: subprocess.Popen[bytes], outcome: Outcome) -> None:
    outcome.timed_out = True
    process.kill()


def _collect(stream: IO[bytes], printed: bytearray) -> None:
    """Read a stream to its end, and keep the beginning."""
    while chunk := os.read(stream.fileno(), 1 << 16):
        printed += chunk[: MOST_PRINTED_BYTES - len(printed)]


def _converse(
    source: IO[bytes],
    sink: IO[bytes],
    request: Mapping[str, Any],
    answers: Mapping[str, Callable[[Any], Reply]],
    outcome: Outcome,
) -> Any:
    """Return the answer to a request, None if the process ends before."""
    _send(sink, request, b"")
    is_first = True  # then nothing of a stranger's has run
    while message := _receive(source):
        (key, value), *others = message.items()
        if key == "answer" and not others:
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
    with contextlib.suppress(BrokenPipeError):  # it has ended, and nothing more comes from it
        while rest:
            rest = rest[sink.write(rest) :]


def _receive(source: IO[bytes]) -> dict[str, Any] | None:
    """Return the next message, None at the end."""
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
