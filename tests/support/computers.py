"""Computers for tests of deploy.

Namespaces with a network, a process table and an sshd of their own.

Each has an address in a network that only these computers are in, a home, a runtime directory and
shared memory. One more, the office, is where commands run. systemd does not run in them: a
stand-in for systemctl starts units.
"""

from __future__ import annotations

import contextlib
import os
import random
import shlex
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from typing_extensions import Self

from tests.support import processes
from tests.support.house import ROOT
from tests.support.waiting import TIMEOUT_S, until

if TYPE_CHECKING:
    from collections.abc import Sequence

PROGRAMS = Path(__file__).with_name("host_programs")
SSHD = shutil.which("sshd", path="/usr/sbin:/sbin:/usr/bin")
#: A time that is two seconds ahead, for the Python of a computer; a namespace cannot have another
#: wall clock.
SHIFTED = "import time\n_time = time.time\ntime.time = lambda: _time() + 2\n"
#: What a computer has of its own; nothing of it outlives the process, nor that who started it.
_NAMESPACES = (
    "unshare",
    "--net",
    "--pid",
    "--mount",
    "--uts",
    "--ipc",
    "--fork",
    "--kill-child",
    "--mount-proc",
)
#: Makes the namespaces, and says so on standard output; then becomes sshd, or whatever it is
#: given.
_INIT = """
set -e
mount --make-rprivate /
mount -t tmpfs tmpfs /run
mount -t tmpfs tmpfs /dev/shm
mkdir -p /run/sshd
ip link set lo up
# As on a computer, process numbers differ from boot to boot: DDS participants are named by them.
echo {number} > /proc/sys/kernel/ns_last_pid
{more}
echo ready
exec "$@"
"""


def missing() -> str:
    """Return what this machine lacks to have such computers; empty if it lacks nothing."""
    if SSHD is None:
        return "no sshd"
    lacking = [
        name
        for name in ("ip", "nsenter", "setpriv", "ssh-keygen", "unshare")
        if shutil.which(name) is None
    ]
    if lacking:
        return f"no {lacking[0]}"
    tried = processes.run(
        ["unshare", "--net", "ip", "link", "add", "name", "br0", "type", "bridge"]
    )
    return "" if tried.returncode == 0 else "no right to make network namespaces"


@dataclass
class Computer:
    """A release folder; ``folder`` survives a power loss, the runtime directory does not.

    ``variables`` are in the environment of its user from the next boot on.
    """

    name: str
    address: str
    folder: Path
    variables: dict[str, str] = field(default_factory=dict)
    process: subprocess.Popen[str] | None = None

    @property
    def home(self) -> Path:
        """The home of its user."""
        return self.folder / "home"

    @property
    def base(self) -> Path:
        """What deploy keeps there."""
        return self.home / ".local/share/tfcompose"

    def inside(self) -> int:
        """Return the process number, here, of its first process."""
        assert self.process is not None
        children = (
            Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        )
        return int(children[0]) if children else 0

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a program on it, as its user."""
        return processes.run(self._inside(words), check=False)

    def start(self, *words: str) -> processes.Started:
        """Start a program on it, as its user; it is killed at the end of the test."""
        pipes = dict.fromkeys(("stdout", "stderr"), subprocess.PIPE)
        return processes.Started(processes.start(self._inside(words), **pipes))

    def _inside(self, words: Sequence[str]) -> list[str]:
        env = shlex.join(f"{name}={value}" for name, value in self.environment().items())
        script = f"exec env -i {env} {shlex.join(words)}"
        return ["nsenter", "-t", str(self.inside()), "-a", "sh", "-c", script]

    def environment(self) -> dict[str, str]:
        """Return the environment of its user."""
        return {
            "HOME": str(self.home),
            "PATH": f"{PROGRAMS}:{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin",
            "XDG_RUNTIME_DIR": f"/run/{self.name}",
            "PYTHONPATH": str(ROOT),
            "PYTHONPYCACHEPREFIX": os.environ.get("PYTHONPYCACHEPREFIX") or str(ROOT / ".pyc"),
            **self.variables,
        }

    def lose_power(self) -> None:
        """Kill everything on it at once; nothing is flushed, no connection is closed."""
        if self.process is not None and self.process.poll() is None:
            os.kill(self.inside(), signal.SIGKILL)
            self.process.communicate(timeout=TIMEOUT_S)
        self.process = None


@dataclass
class Computers:
    """Some computers and the office in one network, below a folder."""

    folder: Path
    names: Sequence[str]
    port: int = 2222
    computers: dict[str, Computer] = field(default_factory=dict)
    office: subprocess.Popen[str] | None = None

    def __enter__(self) -> Self:
        """Start them."""
        self.home.joinpath(".ssh").mkdir(parents=True)
        key = self.home / ".ssh/id_ed25519"
        for file in (key, self.folder / "host_key"):
            processes.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", file], check=True)
        bridge = (
            "ip link add br0 type bridge mcast_snooping 0; ip addr add 10.77.0.1/24 dev br0; ip"
            " link set br0 up"
        )
        self.office = self._started("office", bridge, ["sleep", "infinity"])
        try:
            for number, name in enumerate(self.names):
                self.computers[name] = Computer(name, f"10.77.0.{number + 2}", self.folder / name)
                self.boot(name)
            host_key = (self.folder / "host_key.pub").read_text()
            lines = [
                f"[{computer.address}]:{self.port} {host_key}"
                for computer in self.computers.values()
            ]
            (self.home / ".ssh/known_hosts").write_text("".join(lines))
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """End everything on them."""
        for computer in self.computers.values():
            computer.lose_power()
        if self.office is not None:
            self.office.kill()
            self.office.communicate()

    @property
    def home(self) -> Path:
        """The home of who deploys."""
        return self.folder / "office"

    def boot(self, name: str) -> None:
        """Start a computer; what is enabled there is started."""
        computer = self.computers[name]
        computer.home.mkdir(parents=True, exist_ok=True)
        config = computer.folder / "sshd_config"
        environment = " ".join(
            f'"{variable}={value}"' for variable, value in computer.environment().items()
        )
        config.write_text(
            f"ListenAddress {computer.address}\nPort {self.port}\nHostKey"
            f" {self.folder / 'host_key'}\nPidFile none\nAuthorizedKeysFile"
            f" {self.home / '.ssh/id_ed25519.pub'}\nStrictModes no\nUsePAM"
            f" no\nPasswordAuthentication no\nSetEnv {environment}\n"
        )
        until_linked = (
            "while ! ip addr add {0}/24 dev eth0 2>/dev/null; do sleep 0.02; done; ip link set"
            " eth0 up"
        )
        run = f"mkdir -m 700 /run/{name}"
        assert SSHD
        words = [SSHD, "-D", "-e", "-f", str(config)]
        computer.process = self._started(
            name, f"{run}; echo linked; {until_linked.format(computer.address)}", words, computer
        )
        answers = ["timeout", "1", "bash", "-c", f"</dev/tcp/{computer.address}/{self.port}"]
        assert until(lambda: self.office_run(*answers).returncode == 0), (
            self.folder / f"{name}.log"
        ).read_text()
        computer.run("systemctl", "--user", "boot")

    def _started(
        self, name: str, more: str, words: list[str], computer: Computer | None = None
    ) -> subprocess.Popen[str]:
        log = (self.folder / f"{name}.log").open("w")
        with contextlib.closing(log):
            namespaces = [str(shutil.which("setpriv")), "--pdeathsig", "KILL", *_NAMESPACES]
            script = _INIT.format(more=more, number=random.randrange(1000, 30000))
            process = subprocess.Popen(
                [*namespaces, "sh", "-c", script, "sh", *words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                start_new_session=True,
                text=True,
            )
        processes.share(process)
        assert process.stdout is not None
        line = process.stdout.readline()
        if computer is not None:
            computer.process = process
            hardware = (  # the same after each boot
                f"02:00:00:00:00:{computer.address.rpartition('.')[2]:0>2}"
            )
            link = [
                "ip",
                "link",
                "add",
                f"to-{name}",
                "type",
                "veth",
                "peer",
                "name",
                "eth0",
                "address",
                hardware,
            ]
            # The kernel takes a network away, and the link with it, after its last process.
            self.office_run("ip", "link", "del", f"to-{name}")
            inside = str(computer.inside())
            assert until(lambda: self.office_run(*link, "netns", inside).returncode == 0)
            self.office_run("ip", "link", "set", f"to-{name}", "master", "br0", "up")
            line = process.stdout.readline()
        assert line == "ready\n", (self.folder / f"{name}.log").read_text()
        return process

    def office_run(
        self, *words: str, timeout_s: float = 2 * TIMEOUT_S
    ) -> subprocess.CompletedProcess[str]:
        """Run a program in the office."""
        return processes.run(
            self.in_office(*words), env=self.environment(), check=False, timeout_s=timeout_s
        )

    def in_office(self, *words: str) -> list[str]:
        """Return the command that runs a program in the office's network."""
        assert self.office is not None
        children = (
            Path(f"/proc/{self.office.pid}/task/{self.office.pid}/children").read_text().split()
        )
        return ["nsenter", "-t", children[0], "--net", *words]

    def environment(self) -> dict[str, str]:
        """Return the environment of who deploys."""
        return {**os.environ, "HOME": str(self.home), "PYTHONPATH": str(ROOT)}
