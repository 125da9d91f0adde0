"""The program in processes that are forked from one that has loaded its modules.

Each is as a process of its own is, but begins in milliseconds: nothing has been called yet, only
imported. What a start itself loads or costs, no such process shows.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from select import select
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

if __name__ != "__main__":  # the process that forks runs this file alone
    from tests.support import processes
    from tests.support.waiting import TIMEOUT_S

if TYPE_CHECKING:
    from collections.abc import Iterator

#: What most commands load.
MODULES = (
    *("tfcompose.cli.parser", "tfcompose.cli.compiling", "tfcompose.cli.linting"),
    *("tfcompose.compiler.compile", "tfcompose.compiler.emit", "tfcompose.launcher.preflight"),
    "tfcompose.spec.language.json_schema",
)


class Preloaded:
    """The process that forks; ``site`` is first on its PYTHONPATH."""

    def __init__(self, folder: Path, site: Path | None) -> None:
        self._folder = folder
        env = os.environ | {"PYTHONPATH": str(site or "")}
        command = [sys.executable, __file__]
        self._process = processes.start(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env, cwd=folder
        )
        processes.share(self._process)

    def end(self) -> None:
        """End the process that forks."""
        processes.end(self._process)

    def run(
        self, path: str | Path, cwd: Path, *arguments: object, **environment: str
    ) -> subprocess.CompletedProcess[str]:
        """Run tfcompose with these folders first on its path."""
        words = [str(word) for word in arguments]
        request = {
            "words": words,
            "cwd": str(cwd),
            "path": str(path),
            "environment": os.environ | environment,
            "folder": str(self._folder),
        }
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        ended = select([self._process.stdout], [], [], TIMEOUT_S)[0]
        assert ended, f"it does not end: {words}"
        code = int(self._process.stdout.readline())
        output, errors = (
            (self._folder / name).read_text("utf-8") for name in ("stdout", "stderr")
        )
        return subprocess.CompletedProcess(words, code, output, errors)


@contextmanager
def preloaded(site: Path | None = None) -> Iterator[Preloaded]:
    """Give a process that forks, until the end of the block."""
    with TemporaryDirectory() as folder:
        made = Preloaded(Path(folder), site)
        try:
            yield made
        finally:
            made.end()


def _serve() -> None:
    from importlib import import_module  # noqa: PLC0415 (after the path is clean)

    for module in MODULES:
        import_module(module)
    from tfcompose.foundation.tool import installed_tools  # noqa: PLC0415 (the same)

    for line in sys.stdin:
        assert not installed_tools.cache_info().currsize, (
            "a module looks for tools where it is loaded"
        )
        request = json.loads(line)
        pid = os.fork()
        if not pid:
            _become(request)
        _, status = os.waitpid(pid, 0)
        sys.stdout.write(f"{os.waitstatus_to_exitcode(status)}\n")
        sys.stdout.flush()


def _become(request: dict[str, Any]) -> None:
    """Run as a process of its own would, and end."""
    for number, name in ((1, "stdout"), (2, "stderr")):
        file = os.open(f"{request['folder']}/{name}", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, number)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["environment"])
    os.environ["PYTHONPATH"] = request["path"]
    sys.path[:0] = request["path"].split(os.pathsep)
    sys.argv = ["tfcompose", *request["words"]]
    code = 1
    try:
        from tfcompose.__main__ import run  # noqa: PLC0415 (after the path is clean)

        code = run()
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:  # noqa: BLE001 (as Python does at a process's end)
        sys.excepthook(*sys.exc_info())
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    del sys.path[0]
    _serve()
