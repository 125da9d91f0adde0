"""Processes of tfcompose forked from the launcher, which has imported their modules.

Importing ROS takes 0.2 s of CPU time and 30 MB. A forked process shares the launcher's memory
pages. It is the launcher's child and looks like a separate program: /proc shows the command line
and the environment that an exec would have set, because a run recognises its processes by these. A
process that has imported ROS can be forked if ROS is not initialised. No thread may run except the
threads of LTTng, which supports forks.
"""

from __future__ import annotations

import atexit
import ctypes
import fcntl
import gc
import io
import mmap
import os
import re
import signal
import sys
import traceback
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, NoReturn

from tfcompose.foundation import procfs
from tfcompose.foundation.signals import SIGNALS
from tfcompose.launcher.child import end_with, output_pairs
from tfcompose.launcher.kernel_settings import has_settings
from tfcompose.launcher.program import HERE

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping

    from tfcompose.launcher.child import ChildCommand

#: Prefixes of variables that no library reads before a process initialises ROS.
_READ_LATE = ("ROS_", "TFCOMPOSE_", "FASTRTPS_DEFAULT_", "FASTDDS_DEFAULT_", "PYTHONUNBUFFERED")
_LIBC = ctypes.CDLL(None, use_errno=True)
_LIBC.sbrk.restype = ctypes.c_void_p
_PR_SET_NAME = 15
_PR_SET_MM, _PR_SET_MM_MAP = 35, 14
_NO_FILE = 0xFFFFFFFF
_STDERR = 2
#: LTTng's library. A Python wheel adds a hash to its name.
_LTTNG = re.compile(r"/liblttng-ust(-[0-9a-f]{8})?\.so")
#: Size of sigset_t, in bytes.
_SIGSET_SIZE = 128
#: mallopt(3): limits the number of arenas. Each thread could have its own, initially empty arena,
#: and DDS has ten threads.
_M_ARENA_MAX, _ARENAS = -8, 2
#: Memory with the command line and the environment that /proc shows; never released.
_regions: list[mmap.mmap] = []


class ForkedProcess:
    """A forked child, with the methods of ``subprocess.Popen`` that the launcher uses."""

    def __init__(self, pid: int, stdout: int, stderr: int) -> None:
        self.pid = pid
        self.stdout = io.FileIO(stdout)
        self.stderr = io.FileIO(stderr)

    def wait(self) -> int:
        """Wait for the process to end. Return its exit code, or minus the number of the signal."""
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


class Forker:
    """Forks tfcompose's processes from this process. Create it before this process joins ROS."""

    def __init__(self, load: Callable[[], None], run: Callable[[], int]) -> None:
        """Call ``load``, which imports the shared modules.

        A forked process calls ``run`` with its command in ``sys.argv``. ``run`` returns the exit
        code.
        """
        load()
        self._run = run
        self._env = dict(os.environ)
        self._threads = procfs.threads()
        self._tracing = Tracing()
        gc.collect()
        gc.freeze()  # a garbage collection would copy shared pages

    def can_start(self, command: ChildCommand) -> bool:
        """Return whether a fork of this process can become the command.

        A fork keeps the interpreter and the environment that it read at its start. A command with
        other such settings needs a new program.
        """
        process = command.process
        plain = process is None or not (process.emulate_tty or has_settings(process))
        return (
            plain
            and command.is_built_in
            and command.argv[: len(HERE)] == HERE
            and not _differs_early(self._env, command.env)
            and procfs.threads() <= self._threads
        )

    def start(self, command: ChildCommand, pass_fds: tuple[int, ...]) -> ForkedProcess:
        """Fork the process of the command, as ``child.spawn`` starts other processes.

        Raises:
            OSError: if it cannot be forked.
        """
        launcher = os.getpid()
        with output_pairs(os.pipe) as ((out, its_out), (err, its_err)):
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
            try:
                with self._tracing.forked():
                    pid = os.fork()
                if pid == 0:
                    self._become(command, launcher, (its_out, its_err), pass_fds, mask)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        return ForkedProcess(pid, out, err)

    def _become(
        self,
        command: ChildCommand,
        launcher: int,
        output: tuple[int, int],
        pass_fds: tuple[int, ...],
        mask: Collection[int],
    ) -> NoReturn:
        """Become the command's process, and exit with its exit code.

        The launcher's objects stay alive. If one were collected here, it could close a descriptor
        number that is now in use for something else.
        """
        code = 1
        try:
            gc.freeze()
            atexit._clear()  # noqa: SLF001 (as multiprocessing does in what it forks)
            _leave(launcher, output, pass_fds)
            folder = command.folder if command.folder.is_dir() else "/"
            os.chdir(folder)
            os.environ.clear()
            os.environ.update(command.env)
            signal.pthread_sigmask(signal.SIG_SETMASK, {*mask, *SIGNALS})
            if not show_as(command.argv, command.env):
                os.execve(command.argv[0], command.argv, command.env)  # noqa: S606 (our own program)
            _LIBC.mallopt(_M_ARENA_MAX, _ARENAS)
            sys.orig_argv[:] = command.argv
            sys.argv[:] = command.argv[1:]
            code = self._run()
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:  # noqa: BLE001 (the interpreter would print it)
            traceback.print_exc()
        finally:
            with suppress(BaseException):
                atexit._run_exitfuncs()  # noqa: SLF001 (as above)
            os._exit(code)


class Tracing:
    """LTTng's functions around a fork, if ROS is built with LTTng.

    Its threads restart in the child.
    """

    def __init__(self) -> None:
        self._signals = ctypes.create_string_buffer(_SIGSET_SIZE)
        self._library, self._prefix = None, ""
        for file in procfs.mapped_files():
            if _LTTNG.search(file):
                with suppress(OSError):
                    self._library = ctypes.CDLL(file, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        if self._library:
            # The first prefix is that of version 2.13 and newer.
            named = hasattr(self._library, "lttng_ust_before_fork")
            self._prefix = "lttng_ust_" if named else "ust_"

    @contextmanager
    def forked(self) -> Iterator[None]:
        """Have LTTng hold its locks during the block, in which this process forks."""
        parent = os.getpid()
        self._call("before_fork")
        try:
            yield
        finally:
            self._call("after_fork_parent" if os.getpid() == parent else "after_fork_child")

    def _call(self, function: str) -> None:
        if self._library:
            getattr(self._library, f"{self._prefix}{function}")(self._signals)


def _differs_early(ours: Mapping[str, str], theirs: Mapping[str, str]) -> bool:
    """Return whether variables differ that are read before ROS is initialised."""
    differing = {name for name, _ in ours.items() ^ theirs.items()}
    return not all(name.startswith(_READ_LATE) for name in differing)


def _leave(launcher: int, output: tuple[int, int], pass_fds: tuple[int, ...]) -> None:
    """Drop the launcher's session, signal handlers, descriptors and output."""
    os.setsid()
    end_with(launcher, signal.SIGKILL)
    signal.set_wakeup_fd(-1)
    for caught in signal.valid_signals():
        if callable(signal.getsignal(caught)):
            signal.signal(caught, signal.SIG_DFL)
    if signal.getsignal(signal.SIGINT) == signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    nothing = os.open(os.devnull, os.O_RDONLY)
    # First move them away from 0 to 2, which may be pipes of a launcher without output.
    standard = [fcntl.fcntl(fd, fcntl.F_DUPFD, _STDERR + 1) for fd in (nothing, *output)]
    for number, fd in enumerate(standard):
        os.dup2(fd, number)
    for fd in procfs.descriptors():
        if fd > _STDERR and fd not in pass_fds:
            with suppress(OSError):
                os.close(fd)
    for fd in pass_fds:
        os.set_inheritable(fd, True)  # noqa: FBT003 (that is its signature)
    sys.stdout, sys.stderr = (
        io.TextIOWrapper(
            io.FileIO(number, "w", closefd=False), errors="backslashreplace", write_through=True
        )
        for number in (1, _STDERR)
    )


class _MemoryMap(ctypes.Structure):
    """struct prctl_mm_map (prctl(2), PR_SET_MM_MAP)."""

    _fields_ = (
        *(
            (name, ctypes.c_uint64)
            for name in (
                *("start_code", "end_code", "start_data", "end_data", "start_brk", "brk"),
                *("start_stack", "arg_start", "arg_end", "env_start", "env_end", "auxv"),
            )
        ),
        ("auxv_size", ctypes.c_uint32),
        ("exe_fd", ctypes.c_uint32),
    )


def show_as(argv: Collection[str], env: Mapping[str, str]) -> bool:
    """Make /proc show this command line and environment for this process, as after an exec.

    Return whether the kernel supports this. It requires no privileges, only
    CONFIG_CHECKPOINT_RESTORE, which distributions enable in their kernels.
    """
    arguments = b"".join(os.fsencode(argument) + b"\0" for argument in argv)
    variables = b"".join(os.fsencode(f"{name}={value}") + b"\0" for name, value in env.items())
    region = mmap.mmap(
        -1, len(arguments) + len(variables) + 1, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
    )  # /proc shows only anonymous pages
    region.write(arguments + variables)
    begin = ctypes.addressof(ctypes.c_char.from_buffer(region))
    between, end = begin + len(arguments), begin + len(arguments) + len(variables)
    parts = dict(
        zip(
            ("arg_start", "arg_end", "env_start", "env_end"),
            (begin, between, between, end),
            strict=True,
        )
    )
    memory = _MemoryMap(**procfs.memory_parts(), **parts, exe_fd=_NO_FILE)
    size, done = ctypes.c_ulong(ctypes.sizeof(memory)), ctypes.c_ulong(0)
    where = ctypes.byref(memory)
    memory.brk = _LIBC.sbrk(0)
    if _LIBC.prctl(_PR_SET_MM, _PR_SET_MM_MAP, where, size, done) != 0:
        return False
    _regions.append(region)
    _LIBC.prctl(_PR_SET_NAME, os.path.basename(os.fsencode(sys.executable)), 0, 0, 0)  # noqa: PTH119 (bytes)
    return True
