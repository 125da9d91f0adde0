"""Output to a reader that is slow, stopped, or gone."""

import os
import pty
from pathlib import Path

import pytest

from tfcompose.launcher.output import KEPT, NonBlockingOutput


def test_a_reader_that_does_not_read_costs_bounded_memory_and_learns_of_it() -> None:
    reader, writer = os.pipe()
    stream = NonBlockingOutput(writer)
    for number in range(20_000):
        stream.write(f"line {number:06d} of a process that floods a pager\n", log=True)
    stream.write("said by the launcher\n")
    assert len(stream._owed) <= KEPT + 1000
    os.set_blocking(reader, False)
    text = b""
    while stream.owes:
        text += os.read(reader, 1 << 16)
        stream.push()
    stream.write("and on\n")
    text += os.read(reader, 1 << 16)
    stream.close()
    os.close(writer)
    os.close(reader)
    lines = text.decode().splitlines()
    left_out = 20_002 - (len(lines) - 1)
    assert left_out > 10_000
    assert lines[-2].startswith(f"… {left_out} lines were too fast")
    assert "said by the launcher" in lines
    assert lines[-1] == "and on"


def test_a_stopped_terminal_blocks_nothing_but_the_shell_keeps_blocking() -> None:
    master, slave = pty.openpty()
    stream = NonBlockingOutput(slave)
    for _ in range(5000):  # a write that waits, waits for ever
        stream.write("x" * 100 + "\n", log=True)
    assert os.get_blocking(slave)
    stream.finish(0.01)
    stream.close()
    os.close(slave)
    os.close(master)


def test_a_reader_that_is_gone_is_an_error() -> None:
    reader, writer = os.pipe()
    stream = NonBlockingOutput(writer)
    os.close(reader)
    with pytest.raises(BrokenPipeError):
        stream.write("text\n")
    stream.close()
    os.close(writer)


def test_a_full_disk_behind_the_output_is_no_error() -> None:
    with Path("/dev/full").open("wb", buffering=0) as full:
        stream = NonBlockingOutput(full.fileno())
        for _ in range(10):
            stream.write("text\n")
        assert stream.left_out == 10
        stream.close()
