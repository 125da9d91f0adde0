"""The confined process that reads launch files.

A launch file is a program, so it runs in a separate process with few rights. The process has no
network, cannot start programs, write files or signal other processes, and can read only permitted
files. The kernel refuses everything else (``sandbox``). An audit hook of Python reports the
operation that a launch file attempts, with its line. ROS's own ``launch`` reads launch files of
ROS 2; ``launch_ros1`` reads launch files of ROS 1.
"""

from __future__ import annotations

import builtins
import errno
import importlib
import io
import os
import re
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.sandbox import Channel, Readable, confine, limit, take_spare_memory
from tfcompose.tools.importers import launch_records, launch_ros1
from tfcompose.tools.importers.launch_records import (
    PACKAGE,
    FailedError,
    LaunchRecording,
    jsonable,
    with_package,
)
from tfcompose.tools.importers.launch_writes import SavedFiles

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_RECORDS = 20_000
_HIGHEST = 12
_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")

#: Python audit events that a launch file may not cause.
_REFUSED = frozenset(
    {
        "os.system",
        "os.exec",
        "os.fork",
        "os.forkpty",
        "os.posix_spawn",
        "os.spawn",
        "os.startfile",
        "pty.spawn",
        "subprocess.Popen",
        "socket.connect",
        "socket.bind",
        "socket.sendto",
        "socket.sendmsg",
        "socket.getaddrinfo",
        "socket.gethostbyname",
        "socket.gethostbyaddr",
        "os.remove",
        "os.rename",
        "os.rmdir",
        "os.mkdir",
        "os.link",
        "os.symlink",
        "os.truncate",
        "os.chmod",
        "os.chown",
        "os.kill",
        "os.killpg",
        "shutil.rmtree",
        "shutil.move",
        "shutil.copyfile",
        "shutil.copytree",
        "socket.__new__",
        "ctypes.dlopen",
        "ctypes.dlsym",
        "ctypes.dlsym/handle",
        "ctypes.call_function",
        "ctypes.cdata",
        "ctypes.cdata/buffer",
        "ctypes.string_at",
        "ctypes.addressof",
    }
)
#: Audit events that read a path.
_READS = frozenset({"open", "os.listdir", "os.scandir"})
#: Packages whose programs the import names but never runs. If such a package is missing, the
#: import does not report it.
_TOOLS = {"xacro"}


class LaunchPackages:
    """Finds packages that the user names, that are installed, or that contain the launch file.

    It reports missing packages to ``recording``.
    """

    def __init__(self, packages: dict[str, str], prefixes: list[str]) -> None:
        self.recording: LaunchRecording | None = None
        self._packages, self._prefixes = packages, prefixes
        self._missed: set[str] = set(_TOOLS)
        self._folders: dict[tuple[str, Path], str | None] = {}

    def find(self, name: str, file: str) -> str | None:
        """Return the folder of a package that a launch file names; None if it is not found."""
        key = name, Path(file).parent
        if key not in self._folders:
            self._folders[key] = self._find(name, file)
        if self._folders[key] is None and name not in self._missed and self.recording:
            self._missed.add(name)
            self.recording.record("package", self.recording.here(), name=name)
        return self._folders[key]

    def _find(self, name: str, file: str) -> str | None:
        installed = (f"{prefix}/share/{name}" for prefix in self._prefixes)
        for share in (self._packages.get(name), *installed):
            if share and Path(share).is_dir():
                return str(Path(share).absolute())
        for above in list(Path(file).absolute().parents)[:_HIGHEST]:
            for folder in (above, above / name):
                manifest = folder / "package.xml"
                if not manifest.is_file():
                    continue
                match = _NAME.search(manifest.read_text("utf-8", "replace"))
                if match and match[1] == name:
                    return str(folder)
        return None


# Confinement


def _watch(  # noqa: C901 (one hook after another)
    recording: LaunchRecording, null: int, readable: Readable | None
) -> SavedFiles:
    """Add an audit hook that refuses and reports forbidden operations of a launch file.

    The hook ignores frequent operations that have no effect on the import. It keeps the files that
    the launch file writes in memory.

    If ``readable`` is set, the launch file may read only these paths.
    """
    noted: set[str] = set()
    saved = SavedFiles(recording, null)

    def note(what: str) -> None:
        if what not in noted:
            noted.add(what)
            recording.todo(recording.here(), f"{what}: not done")

    def audit(event: str, args: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+")
        flags = (
            event == "open"
            and isinstance(args[2], int)
            and args[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        )
        if event in _REFUSED or ((writes or flags) and not isinstance(args[0], int)):
            what = next(
                (
                    str(argument)
                    for argument in args
                    if isinstance(argument, (str, bytes, os.PathLike, list, tuple))
                ),
                "",
            )
            note(f"{'open for writing' if event == 'open' else event} {what}".strip())
            raise PermissionError(f"{event} is not done while launch files are read")
        if event in _READS and not may_read(args[0]):
            note(f"{event} {os.fsdecode(args[0])}, which it may not read")
            raise PermissionError(errno.EACCES, "Reading it is not allowed", os.fsdecode(args[0]))

    def may_read(path: Any) -> bool:
        if isinstance(path, int) or path is None or readable is None:
            return True
        real = os.path.realpath(os.fsdecode(path))
        return any(
            real == root or real.startswith(f"{root.rstrip('/')}/")
            for root in (*readable.paths, *readable.listed)
        )

    def run(command: Any, *_args: Any, **more: Any) -> Any:
        argv = command.split() if isinstance(command, str) else list(map(str, command))
        try:
            output = launch_records.of_command(argv, " ".join(argv))
        except FailedError:
            note(f"the command {' '.join(argv)}")
            output = ""
        is_text = more.get("text") or more.get("universal_newlines") or more.get("encoding")
        return subprocess.CompletedProcess(argv, 0, output if is_text else output.encode(), "")

    def system(command: Any) -> int:
        note(f"os.system({command!r})")
        return 0

    def open_file(file: Any, mode: str = "r", *args: Any, **more: Any) -> Any:
        path = with_package(os.fspath(file)) if isinstance(file, (str, os.PathLike)) else file
        if path == os.devnull:
            return plain_open(os.dup(null), mode, *args, **more)
        kept = saved.open(path, mode) if isinstance(path, (str, int)) else None
        if kept is not None:
            return kept
        if str(path).startswith(PACKAGE):
            return io.StringIO(launch_records.file_text(str(path)))
        return plain_open(file, mode, *args, **more)

    plain_open = builtins.open
    hooks: list[tuple[Any, str, Any]] = [
        (os, "system", system),
        (os, "write", saved.write),
        (os, "makedirs", saved.folder),
        (os, "mkdir", saved.folder),
        (Path, "mkdir", saved.folder),
        (subprocess, "run", run),
        (subprocess, "call", lambda *a, **k: run(*a, **k).returncode),
        (subprocess, "check_call", lambda *a, **k: run(*a, **k).returncode),
        (subprocess, "check_output", lambda *a, **k: run(*a, **k).stdout),
        (subprocess, "getoutput", lambda argv, **k: run(argv, text=True, **k).stdout),
        (os, "popen", lambda argv, *_a, **_k: io.StringIO(run(argv, text=True).stdout)),
        (builtins, "open", open_file),
        (io, "open", open_file),
        (tempfile, "mktemp", saved.temporary),
        (tempfile, "mkstemp", saved.open_descriptor),
        (tempfile, "NamedTemporaryFile", saved.open_named),
    ]
    for owner, name, hook in hooks:
        setattr(owner, name, hook)
    if readable is not None:
        sys.addaudithook(audit)
    return saved


def answer(request: dict[str, Any], null: int, readable: Readable | None) -> dict[str, Any]:
    """Read a launch file and return the result.

    The result contains the records in order. If reading stopped, it also contains the reason and
    the line.
    """
    packages = LaunchPackages(request["packages"], request["prefixes"])
    stopped, line = "", 0
    recording: LaunchRecording | None = None
    saved: SavedFiles | None = None
    try:
        recording, read = _reader(request, packages)
        packages.recording = recording
        sys.dont_write_bytecode = True
        saved = _watch(recording, null, readable)
        read()
    except FailedError as error:
        stopped, line = error.reason, error.line
    except MemoryError:
        take_spare_memory()
        stopped = "it needs too much memory"
    except RecursionError:
        stopped = "it goes too deep"
    except BaseException as error:  # noqa: BLE001 (whatever a launch file raises is a finding)
        stopped = f"{type(error).__name__}: {error}"
    if saved is not None:
        saved.finish()
    records = recording.records[:MOST_RECORDS] if recording else []
    return {
        "records": jsonable(records),
        "stopped": stopped,
        "line": line,
        "decided": sorted(recording.decided) if recording else [],
        "files": recording.files if recording else {},
    }


def _reader(
    request: dict[str, Any], packages: LaunchPackages
) -> tuple[LaunchRecording, Callable[[], None]]:
    """Return the recording, and the function that reads a launch file into it.

    Raises:
        FailedError: if ROS's launch cannot be imported.
    """
    file, every_branch = request["file"], request["every_branch"]
    if request["reader"] == "xml":
        recording = launch_ros1.Ros1Recording(packages.find, every_branch=every_branch)
        recording.arguments |= request["arguments"]
        return recording, lambda: launch_ros1.read(file, recording)
    warnings.simplefilter("ignore")  # launch's warnings are for authors of launch files
    try:
        modules = importlib.import_module("tfcompose.tools.importers.launch_modules")
        recorder = importlib.import_module("tfcompose.tools.importers.launch_recorder")
        kind = importlib.import_module("tfcompose.tools.importers.launch_context").RecordingContext
        recorder.attach()
    except Exception as error:  # noqa: BLE001 (a broken installation raises what it likes)
        raise FailedError(f"{type(error).__name__}: {error}") from None
    context = kind(packages.find, every_branch=every_branch)
    context.launch_configurations.update(request["arguments"])
    modules.attach(context)
    return context, lambda: recorder.include(file, context)


def main(reads: int, writes: int) -> None:
    """Serve one request."""
    channel = Channel(reads, writes)
    request = channel.receive()
    limit(request["wall_s"])
    tempfile.tempdir = request["temporary"]  # otherwise Python tests folders by writing to them
    null = os.open(os.devnull, os.O_RDWR)  # after this, the process cannot open files for writing
    readable = Readable(*request["readable"]) if request["readable"] else None
    channel.send({"missing": confine(readable) if readable else []})
    answered = answer(request, null, readable)
    sys.stdout.flush()
    channel.send({"answer": answered})
    os._exit(0)
