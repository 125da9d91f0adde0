"""An interactive shell on a terminal, which an emulator reads."""

from __future__ import annotations

import codecs
import contextlib
import fcntl
import os
import pty
import struct
import sys
import termios
import threading
from typing import TYPE_CHECKING

import psutil
import pyte

from tests.support import processes
from tests.support.waiting import until

if TYPE_CHECKING:
    import subprocess
    from pathlib import Path

#: Runs a program with this terminal as its own, as a window has it.
_OWNER = (
    "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); os.execvp(sys.argv[1],"
    " sys.argv[1:])"
)
PROMPT = "shell$ "
#: How each shell is started without files of the user's, with that prompt.
COMMANDS = {
    "bash": ["bash", "--norc", "-i"],
    "zsh": ["zsh", "-f", "-i"],
    "fish": ["fish", "--no-config", "-i", "-C", f"function fish_prompt; echo -n '{PROMPT}'; end"],
}


class Shell:
    """An interactive shell on a terminal of 80 columns.

    What it shows is on ``screen``, and all bytes in ``text``.
    """

    def __init__(self, folder: Path, shell: str = "bash", **environment: str) -> None:
        self.screen = pyte.Screen(80, 24)
        #: The screen is read while a thread feeds it.
        self._lock = threading.Lock()
        self._fault = ""
        self._stream = pyte.Stream(self.screen)
        self._master, slave = pty.openpty()
        self.text = ""
        self.resize(80, 24)
        env = (
            os.environ
            | {"TERM": "xterm-256color", "PS1": PROMPT, "CI": "", "NO_COLOR": ""}
            | environment
        )
        command = [sys.executable, "-c", _OWNER, *COMMANDS[shell]]
        self.process: subprocess.Popen[str] = processes.start(
            command, stdin=slave, stdout=slave, stderr=slave, cwd=folder, env=env
        )
        self._slave = slave
        self.reads = threading.Event()
        self.reads.set()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.shows(PROMPT)

    def _read(self) -> None:
        decoder = codecs.getincrementaldecoder("utf-8")("replace")
        with contextlib.suppress(OSError):
            while data := os.read(self._master, 1 << 16):
                self.reads.wait()
                text = decoder.decode(data)
                self.text += text
                try:
                    with self._lock:
                        self._stream.feed(text)
                except Exception as error:  # noqa: BLE001 (or the screen would seem frozen)
                    self._fault = f"{type(error).__name__}: {error}"

    def type(self, text: str) -> None:
        """Type it, with a key for each character."""
        os.write(self._master, text.encode())

    @property
    def screen_text(self) -> str:
        """What the screen shows."""
        with self._lock:
            return "\n".join(self.screen.display)

    @property
    def colours(self) -> set[str]:
        """The colours of the text on the screen."""
        with self._lock:
            return {char.fg for line in self.screen.buffer.values() for char in line.values()}

    def shows(self, *words: str) -> None:
        """Wait until the screen shows them all."""
        assert until(lambda: all(word in self.screen_text for word in words)), (
            self._fault,
            self.screen_text,
        )

    def resize(self, columns: int, rows: int) -> None:
        """Give the window another size."""
        with self._lock:
            self.screen.resize(rows, columns)
        fcntl.ioctl(self._master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def up(self, *words: str) -> None:
        """Type ``tfcompose up`` of the folder's robot."""
        self.type(f"{sys.executable} -m tfcompose up robot.yaml {' '.join(words)}\n")

    def view(self) -> psutil.Process:
        """Return the process that shows the live view: the shell's own child."""
        return psutil.Process(self.process.pid).children()[0]

    def below(self) -> list[psutil.Process]:
        """Return the processes that it started, and those that they did."""
        return psutil.Process(self.process.pid).children(recursive=True)

    def close(self) -> None:
        """End it, and all that it started."""
        self.reads.set()
        with contextlib.suppress(psutil.Error):
            for process in self.below():
                process.kill()
        processes.end(self.process)
        os.close(self._slave)
        self._reader.join(5)
        os.close(self._master)
