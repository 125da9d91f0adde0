"""Stands for a confined process that was taken over: it answers with the lines of a file."""

import json
import os
from pathlib import Path

from tfcompose.foundation.sandbox import Channel


def main(reads: int, writes: int, *_: int) -> None:
    """Send the lines of the file hostile.jsonl, in the working folder, as they are."""
    channel = Channel(reads, writes)
    channel.receive()
    for line in Path("hostile.jsonl").read_bytes().splitlines():
        os.write(writes, line + b"\n")
        if next(iter(json.loads(line)), "") in {"read", "list", "find"}:
            os.read(reads, 1 << 16)
    os._exit(0)
