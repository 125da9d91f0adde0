"""A robot under ``tfcompose up``, what it has printed so far, and its processes."""

from __future__ import annotations

import os
import re
import signal
import sys
from typing import TYPE_CHECKING

import psutil

from tests.support import processes
from tests.support.waiting import TIMEOUT_S, complete_lines, until

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

#: How many lines a finding has at most, with its notes and its help.
FINDING_LINES = 8


class RunningRobot:
    """``tfcompose up WORD…`` in a folder, where its output is a file."""

    def __init__(
        self,
        folder: Path,
        *words: str,
        env: Mapping[str, str] | None = None,
        output: str = "output.txt",
    ) -> None:
        self.folder, self.output = folder, folder / output
        command = [sys.executable, "-m", "tfcompose", "up", *words]
        with self.output.open("wb") as out:
            self.popen = processes.start(
                command, cwd=folder, stdout=out, stderr=out, env={**os.environ, **(env or {})}
            )

    @property
    def text(self) -> str:
        """What it has printed; its end may be half a character yet."""
        return self.output.read_text(encoding="utf-8", errors="replace")

    def lines(self, *words: str, after: int = 0) -> list[str]:
        """Return the lines behind so many that hold all the words."""
        lines = complete_lines(self.output)[after:]
        return [line for line in lines if all(word in line for word in words)]

    def says(
        self, *words: str, after: int = 0, times: int = 1, notes: tuple[str, ...] = ()
    ) -> str:
        """Wait for a line behind so many with all the words, or several; return the first.

        Of a finding its lines must also hold the notes.
        """

        def matching_lines() -> list[str]:
            lines = complete_lines(self.output)[after:]
            blocks = {
                index: "\n".join(lines[index : index + FINDING_LINES])
                for index, line in enumerate(lines)
                if all(word in line for word in words)
            }
            return [
                lines[index]
                for index, text in blocks.items()
                if all(note in text for note in notes)
            ]

        until(lambda: len(matching_lines()) >= times or self.popen.poll() is not None)
        assert len(matching_lines()) >= times, (words, notes, self.text)
        return matching_lines()[0]

    def codes(self) -> list[str]:
        """Return the codes of what was found."""
        return re.findall(r"\[(TF\d{3})\]", self.text)

    def below(self, *, recursive: bool = True) -> list[psutil.Process]:
        """Return its processes, and theirs."""
        return psutil.Process(self.popen.pid).children(recursive=recursive)

    def child(self, name: str) -> psutil.Process:
        """Wait until one of its processes runs, and return it.

        ``up`` prints "started" when it has forked: until the fork has executed its own
        command, /proc shows the command line of the launcher.
        """

        def running() -> list[psutil.Process]:
            below = self.below(recursive=False)
            return [process for process in below if name in command_of(process)[-1:]]

        assert until(lambda: bool(running())), (name, self.text)
        return running()[0]

    def wait(self) -> int:
        """Wait until it has ended by itself, and return its exit code."""
        return self.popen.wait(TIMEOUT_S)

    def end(self) -> int:
        """Interrupt it if it runs, and return its exit code."""
        if self.popen.poll() is None:
            self.popen.send_signal(signal.SIGINT)
        try:
            return self.wait()
        finally:
            processes.end(self.popen)


def command_of(process: psutil.Process) -> list[str]:
    """Return the words of a process's command; none if it has ended."""
    try:
        return process.cmdline()
    except psutil.NoSuchProcess:
        return []
