"""The command line, run in the test's own process.

Most of what it claims needs none of its own.
"""

import contextlib
import io
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

from tfcompose.cli import compiling, main, reading


def tfcompose(*words: object, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Run a command, which is to end with this code, and return what it printed."""
    done = tfcompose_in(Path.cwd(), *words)
    assert done.returncode == code, done.stdout + done.stderr
    return done


def tfcompose_in(
    folder: Path, *words: object, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a command in this folder, with these variables too.

    Return how it ended, and what it printed.
    """
    output, errors = (
        io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2)
    )
    texts = [str(word) for word in words]
    for remembered in (
        reading._lines,
        compiling._is_pointer,
        compiling.moments,
    ):  # of files by names that are relative
        remembered.cache_clear()
    streams = contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors)
    with inside(folder), mock.patch.dict(os.environ, environment), streams[0], streams[1]:
        try:
            returned = main(texts)
        except SystemExit as end:
            returned = int(end.code or 0)
    return subprocess.CompletedProcess(
        texts, returned, *(stream.buffer.getvalue().decode() for stream in (output, errors))
    )


@contextlib.contextmanager
def inside(folder: str | Path) -> Iterator[None]:
    """Work in this folder."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
