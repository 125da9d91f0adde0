"""Ways out of the sandbox, tried in a confined process: by Python, ctypes and compiled code.

``python -m tests.support.escapes --outside`` prints the table: each try, how it ended with the
sandbox, and how without.
"""

import ctypes
import errno
import fcntl
import functools
import mmap
import multiprocessing.shared_memory
import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from tfcompose.foundation.confined import run_confined
from tfcompose.foundation.sandbox import Channel, Readable, confine, limit

#: What stands for no harm where a call is let through: no address, no descriptor, no process.
_NONE, _BAD_FD = 0, -1
#: Calls that are made with arguments that do nothing; by their numbers on x86-64.
CALLS = {
    "ptrace": 101,
    "process_vm_readv": 310,
    "process_vm_writev": 311,
    "kcmp": 312,
    "pidfd_open": 434,
    "pidfd_getfd": 438,
    "pidfd_send_signal": 424,
    "tkill": 200,
    "rt_sigqueueinfo": 129,
    "rt_tgsigqueueinfo": 297,
    "vfork": 58,
    "execve": 59,
    "execveat": 322,
    "clone3": 435,
    "openat2": 437,
    "creat": 85,
    "open_by_handle_at": 304,
    "name_to_handle_at": 303,
    "memfd_create": 319,
    "memfd_secret": 447,
    "shmget": 29,
    "shmat": 30,
    "shmctl": 31,
    "semget": 64,
    "semop": 65,
    "semctl": 66,
    "msgget": 68,
    "msgctl": 71,
    "mq_open": 240,
    "mq_unlink": 241,
    "io_uring_setup": 425,
    "bpf": 321,
    "perf_event_open": 298,
    "userfaultfd": 323,
    "keyctl": 250,
    "add_key": 248,
    "request_key": 249,
    "mount": 165,
    "umount2": 166,
    "open_tree": 428,
    "move_mount": 429,
    "fsopen": 430,
    "fsconfig": 431,
    "fspick": 433,
    "mount_setattr": 442,
    "open_tree_attr": 467,
    "pivot_root": 155,
    "chroot": 161,
    "setns": 308,
    "unshare": 272,
    "setxattrat": 463,
    "removexattrat": 466,
    "file_setattr": 469,
    "fchmodat2": 452,
    "settimeofday": 164,
    "clock_settime": 227,
    "clock_adjtime": 305,
    "adjtimex": 159,
    "acct": 163,
    "quotactl": 179,
    "sethostname": 170,
    "setdomainname": 171,
    "syslog": 103,
    "swapon": 167,
    "swapoff": 168,
    "reboot": 169,
    "kexec_load": 246,
    "init_module": 175,
    "finit_module": 313,
    "delete_module": 176,
    "iopl": 172,
    "ioperm": 173,
    "modify_ldt": 154,
    "arch_prctl": 158,
    "personality": 135,
    "seccomp": 317,
    "landlock_create_ruleset": 444,
    "landlock_add_rule": 445,
    "landlock_restrict_self": 446,
    "ioprio_set": 251,
    "migrate_pages": 256,
    "move_pages": 279,
    "mbind": 237,
    "process_madvise": 440,
    "process_mrelease": 448,
    "timer_create": 222,
    "timerfd_create": 283,
    "signalfd4": 289,
    "eventfd2": 290,
    "epoll_create1": 291,
    "inotify_init1": 294,
    "fanotify_init": 300,
    "lookup_dcookie": 212,
    "mlock": 149,
    "mlockall": 151,
    "pipe2": 293,
    "splice": 275,
    "tee": 276,
    "vmsplice": 278,
    "sendfile": 40,
    "copy_file_range": 326,
    "sched_setparam": 142,
    "sched_setattr": 314,
    "setpriority": 141,
    "setpgid": 109,
    "setsid": 112,
    "vhangup": 153,
    "setuid": 105,
    "setgroups": 116,
    "capset": 126,
    "utimensat": 280,
    "fallocate": 285,
    "flock": 73,
    "sync_file_range": 277,
    "fsync": 74,
    "getxattr": 191,
    "listxattr": 194,
    "socket": 41,
    "socketpair": 53,
    "connect": 42,
    "sendmsg": 46,
    "recvmsg": 47,
    "ustat": 136,
    "remap_file_pages": 216,
    "mincore": 27,
}

#: Those to which no length is a length: they would take the machine's name away.
_HARMLESS = {"sethostname": (_NONE, -1), "setdomainname": (_NONE, -1)}


class Try:
    """What the tries need: the C library, and what others have that must not be reached."""

    def __init__(self, request: Mapping[str, Any], descriptor: int = -1) -> None:
        self.tree, self.secret, self.victim = request["tree"], request["secret"], request["victim"]
        self.port, self.shared = request["port"], request["shared"]
        self.descriptor = descriptor
        self.libc = ctypes.CDLL(None, use_errno=True)
        self.native = ctypes.CDLL(request["native"]) if request["native"] else None

    def call(self, number: int, *arguments: Any) -> int:
        """Make a system call.

        Raises:
            OSError: if the kernel refuses it.
        """
        ctypes.set_errno(0)
        self.libc.syscall.restype = ctypes.c_long
        result = self.libc.syscall(ctypes.c_long(number), *map(_as_argument, arguments))
        if result < 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        return int(result)

    def machine(self, function: str, *arguments: int) -> int:
        """Make a system call by an instruction."""
        if self.native is None:
            raise OSError(errno.ENOSYS, "no compiler")
        called = getattr(self.native, function)
        called.restype = ctypes.c_long
        result = called(*map(ctypes.c_long, arguments))
        if result < 0:
            raise OSError(-result, os.strerror(-result))
        return int(result)

    def path(self, name: str) -> str:
        return f"{self.tree}/{name}"


def _as_argument(value: Any) -> Any:
    return value if isinstance(value, bytes) else ctypes.c_long(value)


def _open(path: str, flags: int = os.O_RDONLY) -> None:
    os.close(os.open(path, flags))


def _thread(work: Callable[[], Any]) -> None:
    """Do work in another thread, and raise what it raises."""
    raised: list[BaseException] = []

    def run() -> None:
        try:
            work()
        except OSError as error:
            raised.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    if raised:
        raise raised[0]


def _relative(t: Try) -> None:
    os.chdir(os.path.dirname(t.secret))
    open(os.path.basename(t.secret)).close()


def _by_descriptor(t: Try) -> None:
    folder = os.open(t.tree, os.O_RDONLY)
    _open(f"/proc/self/fd/{folder}/../{os.path.basename(t.secret)}")


def _below(t: Try) -> None:
    folder = os.open(t.tree, os.O_RDONLY)
    os.close(os.open(f"../{os.path.basename(t.secret)}", os.O_RDONLY, dir_fd=folder))


def _reopened(t: Try) -> None:
    handle = os.open(t.secret, os.O_PATH)
    _open(f"/proc/self/fd/{handle}")


def _locked(path: str, kind: int) -> None:
    with open(path, "rb") as file:
        fcntl.lockf(file, kind | fcntl.LOCK_NB)


def _control(path: str, command: int, argument: int = 0) -> None:
    with open(path, "rb") as file:
        fcntl.fcntl(file, command, argument)


def _ioctl(path: str, number: int) -> None:
    with open(path, "rb") as file:
        fcntl.ioctl(file, number, b"\0" * 8)


def _spawned() -> None:
    os.waitpid(os.posix_spawn("/bin/true", ["true"], {}), 0)


def _forked() -> None:
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)


def _system() -> None:
    code = os.system("true")
    if code:
        raise OSError(errno.EPERM, f"exit code {code}")


def _grown(descriptor: int) -> None:
    """Write to an open file behind its end."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    os.write(descriptor, b"x")
    os.pwrite(descriptor, b"x", 1 << 20)


def _connected(port: int) -> None:
    socket.create_connection(("127.0.0.1", port), timeout=2).close()


def _scarce() -> None:
    mmap.mmap(-1, 4096, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | 0x2000).close()


def _imported(t: Try) -> None:
    sys.path.insert(0, os.path.dirname(t.secret))
    try:
        __import__("outsider")
    except ImportError as error:
        raise OSError(errno.EACCES, str(error)) from None


def _by_python(t: Try) -> dict[str, Callable[[], Any]]:
    folder = os.path.dirname(t.secret)
    return {
        "open a file beside the tree": lambda: _open(t.secret),
        "the same through ..": lambda: _open(f"{t.tree}/../{os.path.basename(t.secret)}"),
        "the same through a link in the tree": lambda: _open(t.path("link")),
        "the same after chdir": lambda: _relative(t),
        "the same from a folder's descriptor": lambda: _below(t),
        "the same through /proc/self/fd": lambda: _by_descriptor(t),
        "the same through O_PATH": lambda: _reopened(t),
        "the same in a thread": lambda: _thread(lambda: _open(t.secret)),
        "the same by mmap": lambda: mmap.mmap(
            os.open(t.secret, os.O_RDONLY), 0, access=mmap.ACCESS_READ
        ),
        "import a module beside the tree": lambda: _imported(t),
        "list the folder above": lambda: os.listdir(folder),
        "list /": lambda: os.listdir("/"),
        "scan the home": lambda: list(os.scandir(os.path.expanduser("~"))),
        "open /etc/passwd": lambda: _open("/etc/passwd"),
        "open the own environment in /proc": lambda: _open("/proc/self/environ"),
        "open another's environment": lambda: _open(f"/proc/{t.victim}/environ"),
        "open another's standard input": lambda: _open(f"/proc/{t.victim}/fd/0"),
        "open another's memory": lambda: _open(f"/proc/{t.victim}/mem"),
        "open another's folder by /proc": lambda: os.listdir(f"/proc/{t.victim}/cwd"),
        "write the own memory by /proc": lambda: _open("/proc/self/mem", os.O_RDWR),
        "reopen standard output": lambda: _open("/proc/self/fd/1", os.O_WRONLY),
        "open the terminal": lambda: _open("/dev/tty", os.O_RDWR),
        "open a disk": lambda: _open("/dev/vda"),
        "read the kernel's log": lambda: _open("/dev/kmsg"),
        "open shared memory of others": lambda: _open(f"/dev/shm/{t.shared}"),
        "shared memory by its module": lambda: multiprocessing.shared_memory.SharedMemory(
            t.shared
        ),
        "write a file of the tree": lambda: open(t.path("kept"), "r+").close(),
        "append to it": lambda: open(t.path("kept"), "a").close(),
        "make a file": lambda: open(t.path("new"), "w").close(),
        "make a nameless file": lambda: _open(t.tree, os.O_TMPFILE | os.O_RDWR),
        "a temporary file": lambda: tempfile.TemporaryFile().close(),
        "truncate a file": lambda: os.truncate(t.path("kept"), 0),
        "remove a file": lambda: os.unlink(t.path("kept")),
        "remove a folder": lambda: os.rmdir(t.path("folder")),
        "remove a tree": lambda: shutil.rmtree(t.path("folder")),
        "rename a file": lambda: os.rename(t.path("kept"), t.path("moved")),
        "make a folder": lambda: os.mkdir(t.path("made")),
        "make a link": lambda: os.link(t.path("kept"), t.path("linked")),
        "link what is beside the tree": lambda: os.link(t.secret, t.path("linked")),
        "make a symbolic link": lambda: os.symlink("kept", t.path("linked")),
        "make a pipe": lambda: os.mkfifo(t.path("pipe")),
        "make a device": lambda: os.mknod(t.path("null"), 0o020666, os.makedev(1, 3)),
        "copy a file": lambda: shutil.copyfile(t.path("kept"), t.path("copy")),
        "change a mode": lambda: os.chmod(t.path("kept"), 0o777),
        "change an owner": lambda: os.chown(t.path("kept"), 0, 0),
        "change a time": lambda: os.utime(t.path("kept"), (0, 0)),
        "set an extended attribute": lambda: os.setxattr(t.path("kept"), "user.a", b"1"),
        "read an extended attribute": lambda: os.getxattr(t.path("kept"), "user.a"),
        "list extended attributes": lambda: os.listxattr(t.path("kept")),
        "change a file's flags": lambda: _ioctl(t.path("kept"), 0x40086602),
        "clone a file": lambda: _ioctl(t.path("kept"), 0x40049409),
        "type into the terminal": lambda: _ioctl(t.path("kept"), 0x5412),
        "lock a file": lambda: _locked(t.path("kept"), fcntl.LOCK_SH),
        "lock it as flock does": lambda: fcntl.flock(
            os.open(t.path("kept"), os.O_RDONLY), fcntl.LOCK_EX
        ),
        "lease a file": lambda: _control(t.path("kept"), fcntl.F_SETLEASE, fcntl.F_RDLCK),
        "be told of a folder": lambda: fcntl.fcntl(
            os.open(t.tree, os.O_RDONLY), fcntl.F_NOTIFY, fcntl.DN_MODIFY
        ),
        "own a descriptor's signals": lambda: _control(t.path("kept"), fcntl.F_SETOWN, t.victim),
        "choose a descriptor's signal": lambda: _control(t.path("kept"), 10, signal.SIGKILL),
        "set a descriptor's flags": lambda: _control(t.path("kept"), fcntl.F_SETFL, os.O_NONBLOCK),
        "enlarge a pipe": lambda: fcntl.fcntl(1, 1031, 1 << 20),
        "grow an open file": lambda: _grown(t.descriptor),
        "truncate an open file": lambda: os.ftruncate(1, 0),
        "start a shell": _system,
        "fork": _forked,
        "spawn a program": _spawned,
        "run a program": lambda: subprocess.run(["true"], check=True),
        "become a program": lambda: os.execv("/bin/true", ["true"]),
        "become it by a descriptor": lambda: os.execve(
            os.open(sys.executable, os.O_RDONLY), ["p", "-V"], {}
        ),
        "signal another": lambda: os.kill(t.victim, 0),
        "signal the parent": lambda: os.kill(os.getppid(), 0),
        "signal everybody": lambda: os.kill(-1, 0),
        "signal a group": lambda: os.killpg(os.getpgid(t.victim), 0),
        "signal by a process's descriptor": lambda: signal.pidfd_send_signal(
            os.pidfd_open(t.victim), 0
        ),
        "signal a thread of another": lambda: t.call(234, t.victim, t.victim, 0),
        "another's priority": lambda: os.setpriority(os.PRIO_PROCESS, t.victim, 1),
        "the own priority": lambda: os.nice(1),
        "another's processors": lambda: os.sched_setaffinity(t.victim, {0}),
        "the own processors": lambda: os.sched_setaffinity(0, {0}),
        "another's schedule": lambda: os.sched_setscheduler(
            t.victim, os.SCHED_IDLE, os.sched_param(0)
        ),
        "the own schedule": lambda: os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0)),
        "another's limits": lambda: resource.prlimit(t.victim, resource.RLIMIT_NOFILE),
        "raise the own limits": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1, 1)),
        "another session": os.setsid,
        "another group": lambda: os.setpgid(0, 0),
        "another user": lambda: os.setuid(os.getuid()),
        "other groups": lambda: os.setgroups([]),
        "connect": lambda: _connected(t.port),
        "a TCP socket": lambda: socket.socket().close(),
        "a UDP socket": lambda: socket.socket(type=socket.SOCK_DGRAM).close(),
        "a local socket": lambda: socket.socket(socket.AF_UNIX).close(),
        "a netlink socket": lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW).close(),
        "a pair of sockets": socket.socketpair,
        "look up a name": _resolve_name,
        "memory in a file": lambda: os.close(os.memfd_create("x")),
        "memory that is locked": _scarce,
        "another root": lambda: os.chroot(t.tree),
        "set the clock": lambda: t.call(227, 99, 0),
        "change the host's name": lambda: socket.sethostname(socket.gethostname()),
    }


def _resolve_name() -> None:
    try:
        socket.getaddrinfo("localhost", 80, family=socket.AF_INET, flags=socket.AI_NUMERICSERV)
    except socket.gaierror as error:
        raise OSError(errno.EACCES, str(error)) from None


def _by_ctypes(t: Try) -> dict[str, Callable[[], Any]]:
    def made(name: str) -> Callable[[], Any]:
        arguments = _HARMLESS.get(name, (_BAD_FD, _NONE, _NONE, _NONE, _NONE, _NONE))
        return lambda: t.call(CALLS[name], *arguments)

    named = {f"syscall {name}": made(name) for name in CALLS}
    return named | {
        "libc open for writing": lambda: _checked(t.libc.open(t.path("kept").encode(), os.O_RDWR)),
        "libc open with a high bit set": lambda: t.call(
            257, -100, t.path("kept").encode(), os.O_RDWR | 1 << 40
        ),
        "libc fopen beside the tree": lambda: _checked(
            t.libc.open(t.secret.encode(), os.O_RDONLY)
        ),
        "libc system": lambda: _checked(-1 if t.libc.system(b"true") else 0),
        "libc fork": lambda: _checked(_quit_in_child(t.libc.fork())),
        "libc dlopen beside the tree": lambda: _dlopen(os.path.dirname(t.secret) + "/outsider.so"),
        "a namespace by clone": lambda: _quit_in_child(
            t.call(56, 0x10000000 | signal.SIGCHLD, 0, 0, 0, 0)
        ),
        "a process by clone": lambda: _quit_in_child(t.call(56, signal.SIGCHLD, 0, 0, 0, 0)),
        "prctl: outlive the parent": lambda: t.call(157, 1, 0, 0, 0, 0),
        "prctl: be dumpable": lambda: t.call(157, 4, 1, 0, 0, 0),
        "prctl: be traced by anybody": lambda: t.call(157, 0x59616D61, -1, 0, 0, 0),
        "prctl: another command line": lambda: t.call(157, 35, 8, 0, 0, 0),
        "madvise: poison memory": lambda: t.call(28, 0, 0, 100),
        "mmap: huge pages": lambda: t.call(9, 0, 2 << 20, 3, 0x22 | 0x40000, -1, 0),
        "prlimit64 of the parent": lambda: t.call(302, os.getppid(), resource.RLIMIT_NOFILE, 0, 0),
        "sched_getaffinity of another": lambda: t.call(
            204, t.victim, 128, ctypes.addressof(_BUFFER)
        ),
        "a number that no call has": lambda: t.call(9999),
    }


_BUFFER = ctypes.create_string_buffer(128)


def _dlopen(path: str) -> None:
    try:
        ctypes.CDLL(path)
    except OSError as error:
        raise OSError(
            errno.EACCES if "ermission" in str(error) else errno.ENOENT, str(error)
        ) from None


def _quit_in_child(pid: int) -> int:
    if pid == 0:
        os._exit(0)
    return pid


def _checked(result: int) -> int:
    if result < 0:
        raise OSError(ctypes.get_errno() or errno.EPERM, "refused")
    return result


def _by_machine_code(t: Try) -> dict[str, Callable[[], Any]]:
    path = ctypes.create_string_buffer(t.path("kept").encode())
    address = ctypes.addressof(path)
    tries: dict[str, Callable[[], Any]] = {}
    calls = {
        "open for writing": (2, address, os.O_RDWR),
        "socket": (41, 2, 1, 0),
        "kill": (62, t.victim, 0),
        "x32's getpid": (0x40000000 | 39,),
        "x32's open": (0x40000000 | 2, address, os.O_RDWR),
    }
    for function in ("direct", "written"):
        for name, arguments in calls.items():
            padded = (*arguments, *[0] * (4 - len(arguments)))
            tries[f"{function}: {name}"] = functools.partial(t.machine, function, *padded)
    return tries | {
        "32-bit getpid": lambda: t.machine("of_32_bit", 20, 0, 0, 0),
        "32-bit open": lambda: t.machine("of_32_bit", 5, address, os.O_RDWR, 0),
        "32-bit kill": lambda: t.machine("of_32_bit", 37, t.victim, 0, 0),
        "32-bit socketcall": lambda: t.machine("of_32_bit", 102, 1, address, 0),
        "32-bit fork": lambda: _quit_in_child(t.machine("of_32_bit", 2, 0, 0, 0)),
    }


def tries_of(t: Try) -> dict[str, Callable[[], Any]]:
    """Return all tries, by what they try."""
    return _by_python(t) | _by_ctypes(t) | _by_machine_code(t)


def main(reads: int, writes: int, descriptor: int) -> None:
    """Make the tries that a request names, and answer with how each ended."""
    channel = Channel(reads, writes)
    request = channel.receive()
    limit(60)
    t = Try(request, descriptor)
    if request["confined"]:
        channel.send({"missing": confine(Readable(request["paths"]))})
    tries, results = tries_of(t), {}
    for name in request["names"]:
        try:
            tries[name]()
            results[name] = "done"
        except OSError as error:
            results[name] = errno.errorcode.get(error.errno or 0, str(error))
        except Exception as error:  # noqa: BLE001 (a library's own)
            results[name] = type(error).__name__
    channel.send({"answer": results})
    os._exit(0)


@contextmanager
def victims(folder: Path) -> Iterator[dict[str, Any]]:
    """Yield a request for tries: a tree, a file beside it, a process, a server, shared memory."""
    tree = folder / "tree"
    (tree / "folder").mkdir(parents=True)
    (tree / "kept").write_text("kept", encoding="utf-8")
    (folder / "secret").write_text("secret", encoding="utf-8")
    (folder / "outsider.py").write_text("", encoding="utf-8")
    (tree / "link").symlink_to(folder / "secret")
    library = _compiled(tree)
    with ExitStack() as stack:
        process = stack.enter_context(subprocess.Popen(["sleep", "300"], stdin=subprocess.PIPE))
        stack.callback(process.kill)
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        # Not made by its module, whose resource tracker would go on as a child of the tests.
        shared = Path(f"/dev/shm/tfcompose_{process.pid}")
        shared.write_bytes(bytes(16))
        stack.callback(shared.unlink)
        yield {
            "tree": str(tree),
            "secret": str(folder / "secret"),
            "victim": process.pid,
            "port": server.getsockname()[1],
            "shared": shared.name,
            "native": library,
            "confined": True,
            "paths": [str(tree), *{sys.base_prefix, sys.prefix, "/usr/lib", "/lib"}],
        }


def _compiled(tree: Path) -> str:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return ""
    library = tree / "escape.so"
    source = Path(__file__).with_name("escape.c")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, source], check=True)
    return str(library)


def ends_of(request: Mapping[str, Any], names: list[str]) -> dict[str, str]:
    """Return how tries ended, by name."""
    with tempfile.TemporaryFile() as file:
        outcome = run_confined(
            "tests.support.escapes",
            {**request, "names": names},
            {},
            wall_s=60,
            shared=[file.fileno()],
        )
    if outcome.answer is None:
        return dict.fromkeys(names, f"ended with {outcome.code} {outcome.printed}")
    return dict(outcome.answer)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place, victims(Path(place)) as request:
        names = list(tries_of(Try(request)))
        inside, is_compared = ends_of(request, names), "--outside" in sys.argv
        for name in names:
            outside = ends_of({**request, "confined": False}, [name]) if is_compared else {}
            print(f"| {name} | {inside[name]} | {outside.get(name, '')} |")  # noqa: T201
