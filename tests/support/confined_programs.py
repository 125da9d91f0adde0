"""Programs that run confined, and do what a stranger's might: named by a request."""

import os
import signal
import sys
import threading
import time
from typing import Any

from tfcompose.foundation.sandbox import Channel, Readable, confine, limit


def main(reads: int, writes: int) -> None:
    """Run the program that a request names."""
    channel = Channel(reads, writes)
    request = channel.receive()
    limit(20)
    channel.send({"missing": confine(Readable(request.get("paths", ())))})
    _PROGRAMS[request["program"]](channel, request, writes)
    sys.stdout.flush()
    channel.send({"answer": "the end"})
    os._exit(0)


def _flood(_channel: Any, _request: Any, _writes: int) -> None:
    for _ in range(200):
        os.write(1, b"x" * 65_536)
        os.write(2, b"\x1b]52;c;aWQ=\x07\n")


def _ask(channel: Any, request: Any, _writes: int) -> None:
    channel.send({"double": request["value"]})
    message = channel.receive()
    channel.send({"answer": [message, channel.receive_bytes(message["bytes"]).decode()]})
    time.sleep(60)


def _raw(_channel: Any, request: Any, writes: int) -> None:
    text = request["text"].encode() * request.get("times", 1) + b"\n"
    while text:
        text = text[os.write(writes, text) :]


def _wait(_channel: Any, _request: Any, writes: int) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    os.close(writes)
    time.sleep(60)


def _raise(*_: Any) -> None:
    raise KeyError("whatever")


def _exit(*_: Any) -> None:
    os._exit(7)


def _abort(*_: Any) -> None:
    os.abort()


def _grow(*_: Any) -> None:
    kept = []
    while True:
        kept.append(bytearray(64 << 20))


def _read(channel: Any, request: Any, _writes: int) -> None:
    """Do what programs do that mean no harm."""
    import numpy as np  # noqa: PLC0415 (when confined)

    made: list[float] = []
    thread = threading.Thread(target=lambda: made.append(float(np.linalg.inv(np.eye(200))[0, 0])))
    thread.start()
    thread.join()
    time.sleep(0.001)
    with open(request["file"], encoding="utf-8") as file:  # noqa: PTH123
        channel.send({"answer": [file.read(), os.environ["SETTING"], sys.stdout.isatty(), made]})
    os._exit(0)


_PROGRAMS = {
    "flood": _flood,
    "ask": _ask,
    "raw": _raw,
    "wait": _wait,
    "raise": _raise,
    "exit": _exit,
    "abort": _abort,
    "grow": _grow,
    "read": _read,
}
