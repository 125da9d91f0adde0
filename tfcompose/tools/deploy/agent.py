"""Agent of a deployment, which runs on a host.

``connection`` sends the text of this file over ssh to the host's Python, which runs it. Therefore
this file needs only the standard library and not tfcompose. The agent answers requests in order
until its input ends. Each request is a line of JSON. If the input ends while a release is on
trial, the connection to the deploying computer is lost, and the agent returns to the previous
release.

The folder ``base`` on the host contains the folders ``releases/NAME``, the links ``current`` and
``previous``, and ``lock``. systemd starts the release ``current``; ``previous`` is the release
before it. For a release on trial, the agent writes a drop-in into the runtime directory or, for
the first release, a unit. This directory is empty after a reboot, so a host that loses power
starts the previous release.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import hashlib
import json
import os
import pwd
import queue
import shutil
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import io
    from collections.abc import Callable, Mapping

#: Time limits of systemctl to start or stop, and of other programs, in seconds.
UNIT_S, PROGRAM_S = 120.0, 60.0
#: Number of releases that are kept, including the current and the previous one.
KEPT = 5
#: The file in a release with the unit that starts it as the current release.
UNIT = "unit"
#: The maximum size of a text in bytes that the agent sends back for ``--diff``.
MOST_TEXT = 200_000
#: Program that prints the versions and variables of the host's Python, after sourcing the setup
#: files; modules of the current folder come last.
_PROBE = """
import os, sys
sys.path.sort(key=["", os.getcwd()].__contains__)
import json
try:
    from tfcompose import __version__ as version
except ImportError:
    version = None
names = ("ROS_DOMAIN_ID", "RMW_IMPLEMENTATION", "ROS_AUTOMATIC_DISCOVERY_RANGE",
         "ROS_LOCALHOST_ONLY", "ROS_DISTRO")
env = {name: os.environ[name] for name in names if os.environ.get(name)}
print(json.dumps({"tfcompose": version, "executable": sys.executable, "env": env}))
"""


class HostError(Exception):
    """Raised if this host cannot carry out a request; the message contains the reason."""


def digest_of(data: bytes) -> str:
    """Return the digest of a file's content, as a manifest contains it."""
    return hashlib.sha256(data).hexdigest()


class Agent:
    """Acts on the part of a robot that runs on this host.

    ``settings`` has the fields of ``connection.Settings``.
    """

    def __init__(self, settings: Mapping[str, Any], gone: threading.Event) -> None:
        self.name: str = settings["name"]
        self.unit: str = settings["unit"]
        self.python: str = settings["python"]
        self.setup: list[str] = settings["setup"]
        self.sourcing: str = settings["sourcing"]
        self.program: str = settings["program"]
        self.gone = gone
        self.lock: int | None = None
        self.trial: dict[str, Any] | None = None
        self.running: Path | None = None
        self.restarts = 0
        self.archive: io.BufferedRandom | None = None
        runtime = Path(f"/run/user/{os.getuid()}")
        if "XDG_RUNTIME_DIR" not in os.environ and runtime.is_dir():
            os.environ["XDG_RUNTIME_DIR"] = str(runtime)
        self._set_scope(system=settings["system"])

    def _set_scope(self, *, system: bool) -> None:
        """Use the folders of system units or of user units."""
        self.system = system
        home, runtime = Path.home(), Path(os.environ.get("XDG_RUNTIME_DIR", "/run"))
        self.base = (
            (Path("/var/lib") if system else home / ".local/share") / "tfcompose" / self.name
        )
        self.units = Path("/etc/systemd/system") if system else home / ".config/systemd/user"
        self.runtime = Path("/run/systemd/system") if system else runtime / "systemd/user"

    # Requests that change nothing

    def hostname(self) -> str:
        """Return the host's name, which chooses the overlay of a single robot."""
        return os.uname().nodename

    def probe(self) -> dict[str, Any]:
        """Return the host's Python, tfcompose, environment, systemd and folders."""
        facts: dict[str, Any] = {
            "tfcompose": None,
            "executable": sys.executable,
            "env": {},
        }
        facts["problems"] = []
        missing = [file for file in self.setup if not Path(file).expanduser().is_file()]
        if missing:
            facts["problems"].append(f"setup names {missing[0]}, which does not exist")
        else:
            done = self._program([self._executable(), "-c", _PROBE])
            try:
                facts |= json.loads(done.stdout.splitlines()[-1])
            except (ValueError, IndexError):
                facts["problems"].append(_last_line(done.stderr) or "its Python prints nothing")
        state = self._systemctl("is-system-running")
        if state.stdout.strip() in {"", "offline", "unknown"}:
            why = _last_line(state.stderr) or state.stdout.strip()
            facts["problems"].append(
                f"systemd is not running{'' if self.system else ' for this user'}: {why}"
            )
        if self.system and os.getuid() != 0:
            facts["problems"].append("system units need root")
        facts |= {
            "python": ".".join(map(str, sys.version_info[:3])),
            "base": str(self.base),
            "setup": [str(Path(file).expanduser()) for file in self.setup],
            "machine": (
                _read("/proc/sys/kernel/random/boot_id")
                + str(Path("/proc/self/ns/net").readlink())
            ),
            "lingers": self.system or self._lingers(),
        }
        return facts

    def clock(self) -> float:
        """Return the time of this host's clock, in Unix seconds."""
        return time.time()

    def state(self) -> dict[str, Any]:
        """Return the releases, the current release's digests, the unit, and the running release.

        ``unsettled`` is True if a trial was never ended. The running release is then not the
        current release.
        """
        release = self._release("current")
        unit = self._show_unit()
        self.restarts = _restarts(unit)
        status = self._status(unit)
        launcher = status["robot"]["launcher"] if status["robot"] else None
        return {
            "release": release,
            "previous": self._release("previous"),
            "files": self._manifest(release),
            "unit": _text(self.units / self.unit),
            "active": unit.get("ActiveState") in {"active", "activating", "reloading"},
            "enabled": unit.get("UnitFileState") == "enabled",
            "unsettled": (
                (self.runtime / self.unit).exists() or (self.runtime / f"{self.unit}.d").exists()
            ),
            "stranger": launcher if launcher and str(launcher) != unit.get("MainPID") else None,
            **status,
        }

    def texts(self, paths: list[str], *, any_size: bool = False) -> dict[str, str | None]:
        """Return the texts of files of the current release.

        The text is None if a file is missing, too large, or not text.
        """
        most = None if any_size else MOST_TEXT
        return {path: _text(self.base / "current" / path, most) for path in paths}

    def take_lock(self, who: str) -> dict[str, Any]:
        """Take the lock of this host until this process ends.

        If another deployment has the lock, return who holds it.
        """
        self.base.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(self.base / "lock", os.O_CREAT | os.O_RDWR, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(descriptor, 1000, 0).decode(errors="replace").strip()
            os.close(descriptor)
            return {"holder": holder or "somebody"}
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{who}, since {time.strftime('%H:%M:%S')}\n".encode(), 0)
        self.lock = descriptor
        return {"holder": None}

    # Requests for a new release

    def chunk(self, data: str) -> None:
        """Append a chunk to the archive of a release."""
        if self.archive is None:
            self.base.mkdir(parents=True, exist_ok=True)
            self.archive = tempfile.TemporaryFile(dir=self.base)  # noqa: SIM115 (it lives until it is unpacked)
        self.archive.write(base64.b64decode(data))

    def unpack(self, release: str, *, wheels: bool) -> None:
        """Unpack the archive; the release's folder gets its name only when it is complete.

        Raises:
            HostError: if no archive was sent, or the wheels cannot be installed.
        """
        folder, new = self.base / "releases" / release, self.base / "releases" / f".{release}.new"
        shutil.rmtree(new, ignore_errors=True)
        new.mkdir(parents=True)
        archive, self.archive = self.archive, None
        if archive is None:
            raise HostError("no archive was sent")
        with archive:
            archive.seek(0)
            with tarfile.open(fileobj=archive, mode="r:") as tar:
                if hasattr(tarfile, "data_filter"):  # since Python 3.10.12
                    tar.extraction_filter = tarfile.data_filter
                tar.extractall(new)  # noqa: S202 (made by ``release.Release``)
        for path in new.rglob("*"):
            if path.is_file():
                with path.open("rb") as stream:
                    os.fsync(stream.fileno())
        shutil.rmtree(folder, ignore_errors=True)
        new.rename(folder)
        if wheels:
            try:
                self._install(folder)
            except HostError:
                shutil.rmtree(folder, ignore_errors=True)
                raise

    def rehearse(self, release: str, host: str) -> list[dict[str, Any]]:
        """Return findings that prevent a start of the release on this host.

        Raises:
            HostError: if the host's tfcompose cannot check the plan.
        """
        folder = self.base / "releases" / release
        python = self._python_of(folder)
        done = self._program([*self._start(python), "rehearse", str(folder / "plan.json"), host])
        try:
            findings: list[dict[str, Any]] = json.loads(done.stdout.splitlines()[-1])
        except (ValueError, IndexError):
            raise HostError(
                f"its tfcompose cannot check the plan: {_last_line(done.stderr)}"
            ) from None
        return findings

    def discard(self, release: str) -> None:
        """Remove a release that was not started."""
        if release not in {self._release("current"), self._release("previous")}:
            shutil.rmtree(self.base / "releases" / release, ignore_errors=True)

    # Requests that change the running release

    def stop(self) -> None:
        """Stop the running release."""
        unit = self._show_unit()
        self.trial = {"active": unit.get("ActiveState") in {"active", "activating", "reloading"}}
        if unit.get("LoadState") == "loaded":
            self._must("stop", self.unit)

    def start(self, release: str) -> None:
        """Start a release on trial, with a drop-in for the existing unit or with a new unit."""
        self.running = folder = self.base / "releases" / release
        unit = self._unit_of(release).replace(f"{self.base}/current/", f"{folder}/")
        if (self.units / self.unit).is_file():
            starts = [line for line in unit.splitlines() if line.startswith("ExecStart=")]
            _write(
                self.runtime / f"{self.unit}.d" / "trial.conf",
                "\n".join(["[Service]", "ExecStart=", *starts, ""]),
            )
        else:
            _write(self.runtime / self.unit, unit)
        self._must("daemon-reload")
        self._systemctl("reset-failed", self.unit)
        self.restarts = 0
        self._must("start", self.unit)

    def follow(self, release: str, host: str) -> str:
        """Let the running launcher switch to a release on trial, and return its answer.

        If the launcher cannot switch, stop it and start the release.
        """
        self.trial = {"active": True, "host": host}
        _write(
            self.runtime / f"{self.unit}.d" / "trial.conf",
            f"# its launcher follows release {release}\n",
        )
        try:
            return self._follow(release, host)
        except HostError as error:
            self.stop()
            self.start(release)
            return f"restarted: {error}"

    def _follow(self, release: str, host: str) -> str:
        """Let the running launcher switch to a release that differs only in built files.

        Raises:
            HostError: if the launcher does not switch.
        """
        folder = self._launched_folder()
        if folder is None:
            raise HostError("its launcher does not run a release")
        self.running = self.base / "releases" / release
        argv = [
            "up",
            str(self.running / "plan.json"),
            "--host",
            host,
            "--update",
            "--build-dir",
            str(folder),
        ]
        done = self._tfcompose(argv, UNIT_S)
        if done.returncode != 0:
            raise HostError(_last_line(done.stderr) or "its launcher did not take the release")
        return done.stdout.strip().rpartition("; ")[2] or "nothing restarts"

    def wait(self, seconds: float) -> dict[str, Any]:
        """Return the status once the robot is ready or failed, or after the timeout."""
        end = time.monotonic() + seconds
        while not self.gone.is_set():
            left = end - time.monotonic()
            unit = self._show_unit()
            if left <= 0 or unit.get("ActiveState") == "inactive" or self._has_failed(unit):
                break
            argv = ["wait", "--ready", "--timeout", f"{left:.1f}", "--robot", self.name]
            begun = time.monotonic()
            if self._tfcompose(argv, left + PROGRAM_S).returncode == 0:
                break
            self.gone.wait(min(0.3, max(left, 0)) if time.monotonic() - begun < left else 0)
        return self._status(self._show_unit())

    def _status(self, unit: dict[str, str]) -> dict[str, Any]:
        """Return the launcher's answer, or None and a failed unit's last lines."""
        done = self._tfcompose(["ps", "--format", "json", "--robot", self.name], PROGRAM_S)
        try:
            robots = json.loads(done.stdout)
        except ValueError:
            robots = []
        failed = self._has_failed(unit)
        return {
            "robot": robots[0] if robots else None,
            "failed": failed,
            "lines": (
                self._journal()
                if failed or (not robots and unit.get("ActiveState") == "inactive")
                else []
            ),
        }

    def _has_failed(self, unit: dict[str, str]) -> bool:
        """Whether the unit has exited by itself since the agent last checked or started it."""
        return unit.get("ActiveState") == "failed" or _restarts(unit) > self.restarts

    def commit(self, release: str) -> None:
        """Keep the release on trial: ``current`` now points to it."""
        before = self._release("current")
        _write(self.units / self.unit, self._unit_of(release))
        _link(self.base / "current", f"releases/{release}")
        if before and before != release:
            _link(self.base / "previous", f"releases/{before}")
        if self.trial is not None:
            self.trial["before"] = before
        self._end_trial()
        self._must("enable", self.unit)
        self._prune()

    def settle(self) -> None:
        """Make the commit final, so that the end of the input no longer reverts it."""
        self.trial = None

    def back(self) -> dict[str, Any] | None:
        """Return to the release before the trial, and start it if it was running.

        This also works after ``commit``, until ``settle``. Return None if no release is on trial.
        """
        trial, self.trial, self.running = self.trial, None, None
        if trial is None:
            return None
        if "host" not in trial:
            self._systemctl("stop", self.unit)
        if "before" in trial:
            if trial["before"]:
                _link(self.base / "current", f"releases/{trial['before']}")
                _write(self.units / self.unit, self._unit_of(trial["before"]))
            else:
                self._systemctl("disable", self.unit)
                (self.units / self.unit).unlink(missing_ok=True)
                (self.base / "current").unlink(missing_ok=True)
        self._end_trial()
        release = self._release("current")
        if release and trial["active"]:
            self._return(release, trial.get("host"))
        return {"release": release, "active": bool(release and trial["active"])}

    def _return(self, release: str, host: str | None) -> None:
        """Run the current release again.

        If the launcher switched to the other release while it ran, let it switch back.
        """
        if host is not None:
            with contextlib.suppress(HostError):
                self._follow(release, host)
                self.running = None
                return
            self.running = None
            self._systemctl("stop", self.unit)
        self._must("start", self.unit)

    # Other requests

    def execute(self, argv: list[str]) -> None:
        """Replace this process by tfcompose with these arguments, in the robot's environment."""
        system = (
            Path("/etc/systemd/system", self.unit).is_file()
            and not (self.units / self.unit).is_file()
        )
        self._set_scope(system=self.system or system)
        command = self._command([*self._start(self._python_of(self.base / "current")), *argv])
        os.execvpe(command[0], command, self._environment())  # noqa: S606 (no shell: these are words)

    def _unit_of(self, release: str) -> str:
        text = _text(self.base / "releases" / release / UNIT)
        if text is None:
            raise HostError(f"release {release} has no unit")
        return text

    def _end_trial(self) -> None:
        shutil.rmtree(self.runtime / f"{self.unit}.d", ignore_errors=True)
        (self.runtime / self.unit).unlink(missing_ok=True)
        self._must("daemon-reload")

    def _install(self, folder: Path) -> None:
        """Install the release's wheels into a Python environment on top of the host's Python."""
        python = self._executable()
        wheels = sorted(map(str, (folder / "wheels").glob("*.whl")))
        for argv in (
            [python, "-I", "-m", "venv", "--system-site-packages", str(folder / "venv")],
            [
                str(folder / "venv/bin/python"),
                "-I",
                "-m",
                "pip",
                "install",
                "-q",
                "--no-index",
                "--no-deps",
                *wheels,
            ],
        ):
            done = self._program(argv, 600)
            if done.returncode != 0:
                why = _last_line(done.stderr) or _last_line(done.stdout)
                raise HostError(f"the wheels cannot be installed: {why}")

    def _executable(self) -> str:
        return str(Path(self.python).expanduser()) if "/" in self.python else self.python

    def _python_of(self, folder: Path) -> str:
        python_of_release = folder / "venv/bin/python"
        return str(python_of_release) if python_of_release.exists() else self._executable()

    def _start(self, python: str) -> list[str]:
        """Return the command line that starts tfcompose with a Python."""
        return [python, "-c", self.program]

    def _command(self, argv: list[str]) -> list[str]:
        files = [str(Path(file).expanduser()) for file in self.setup]
        return ["/bin/bash", "-c", self.sourcing, "bash", *files, "--", *argv] if files else argv

    def _program(
        self, argv: list[str], seconds: float = PROGRAM_S
    ) -> subprocess.CompletedProcess[str]:
        return _run(self._command(argv), seconds, self._environment())

    def _tfcompose(self, argv: list[str], seconds: float) -> subprocess.CompletedProcess[str]:
        python = self._python_of(self.running or self.base / "current")
        return self._program([*self._start(python), *argv], seconds)

    def _environment(self) -> dict[str, str]:
        """Return the environment with which commands find the run.

        It is the environment of a login, updated with the variables of the unit.
        """
        if not self.system:
            return dict(os.environ)
        return {
            **os.environ,
            "XDG_RUNTIME_DIR": f"/run/tfcompose/{self.name}",
            "ROS_LOG_DIR": str(self.base / "log"),
        }

    def _systemctl(self, *argv: str) -> subprocess.CompletedProcess[str]:
        return _run(
            ["systemctl", *([] if self.system else ["--user"]), *argv], UNIT_S, dict(os.environ)
        )

    def _must(self, *argv: str) -> None:
        done = self._systemctl(*argv)
        if done.returncode != 0:
            raise HostError(
                f"systemctl {' '.join(argv)}: {_last_line(done.stderr) or done.returncode}"
            )

    def _show_unit(self) -> dict[str, str]:
        argv = ("LoadState", "ActiveState", "UnitFileState", "MainPID", "NRestarts")
        lines = self._systemctl(
            "show", self.unit, f"--property={','.join(argv)}"
        ).stdout.splitlines()
        return {name: value for name, _, value in (line.partition("=") for line in lines)}

    def _journal(self) -> list[str]:
        scope = [] if self.system else ["--user"]
        argv = ["journalctl", *scope, "-u", self.unit, "-n", "12", "-o", "cat", "--no-pager"]
        return _run(argv, PROGRAM_S, dict(os.environ)).stdout.splitlines()

    def _lingers(self) -> bool:
        return Path("/var/lib/systemd/linger", pwd.getpwuid(os.getuid()).pw_name).exists()

    def _release(self, link: str) -> str | None:
        try:
            return str((self.base / link).readlink().name)
        except OSError:
            return None

    def _manifest(self, release: str | None) -> dict[str, str]:
        """Return the digests of a release's files by path, without files from wheels."""
        if release is None:
            return {}
        folder = self.base / "releases" / release
        files = (path for path in sorted(folder.rglob("*")) if path.is_file())
        named = ((path.relative_to(folder).as_posix(), path) for path in files)
        return {
            name: digest_of(path.read_bytes())
            for name, path in named
            if not name.startswith("venv/")
        }

    def _launched_folder(self) -> Path | None:
        """Return the folder of the running launcher's first plan, which contains its files."""
        pid = self._show_unit().get("MainPID") or "0"
        try:
            argv = Path("/proc", pid, "cmdline").read_bytes().split(b"\0")
        except OSError:
            return None
        plans = [
            Path(os.fsdecode(argument)) for argument in argv if argument.endswith(b"/plan.json")
        ]
        return plans[0].parent if plans and plans[0].is_relative_to(self.base) else None

    def _prune(self) -> None:
        launched = self._launched_folder()
        kept = {
            self._release("current"),
            self._release("previous"),
            launched.name if launched else None,
        } - {None}
        folders = sorted(
            (self.base / "releases").iterdir(), key=lambda path: path.stat().st_mtime, reverse=True
        )
        for folder in [folder for folder in folders if folder.name not in kept][
            max(KEPT - len(kept), 0) :
        ]:
            shutil.rmtree(folder, ignore_errors=True)


def _run(argv: list[str], seconds: float, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(
            argv,
            capture_output=True,
            check=False,
            env=env,
            stdin=subprocess.DEVNULL,
            text=True,
            timeout=seconds,
        )
    except OSError as error:
        return subprocess.CompletedProcess(argv, 127, "", f"{argv[0]}: {error.strerror}")
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(
            argv, 124, "", f"{argv[0]} does not end within {seconds:g} s"
        )


def _restarts(unit: Mapping[str, str]) -> int:
    return int(unit.get("NRestarts") or 0)


def _last_line(text: str) -> str:
    return next((line.strip() for line in reversed(text.splitlines()) if line.strip()), "")


def _read(file: str) -> str:
    with contextlib.suppress(OSError):
        return Path(file).read_text("utf-8").strip()
    return ""


def _text(file: Path, most: int | None = MOST_TEXT) -> str | None:
    try:
        data = file.read_bytes()
        return data.decode() if most is None or len(data) <= most else None
    except (OSError, ValueError):
        return None


def _write(file: Path, text: str) -> None:
    """Write a file atomically: readers see the old content or the new content."""
    file.parent.mkdir(parents=True, exist_ok=True)
    new = file.with_name(f".{file.name}.new")
    new.write_text(text, encoding="utf-8")
    new.replace(file)


def _link(link: Path, target: str) -> None:
    """Point a link to a target atomically."""
    new = link.with_name(f".{link.name}.new")
    new.unlink(missing_ok=True)
    new.symlink_to(target)
    new.replace(link)


#: Names of the requests.
_REQUESTS = (
    "probe",
    "hostname",
    "clock",
    "state",
    "texts",
    "take_lock",
    "chunk",
    "unpack",
    "rehearse",
    "discard",
    "stop",
    "start",
    "follow",
    "wait",
    "commit",
    "settle",
    "back",
    "execute",
)


def serve() -> None:
    """Answer requests on standard input until it ends; then revert a release on trial."""
    gone = threading.Event()
    requests: queue.Queue[bytes] = queue.Queue()

    def read() -> None:
        while line := sys.stdin.buffer.readline():
            requests.put(line)
            if b'"execute"' in line[:20]:
                return  # the remaining arguments are for tfcompose
        gone.set()
        requests.put(b"")

    threading.Thread(target=read, daemon=True).start()
    agent = Agent(json.loads(requests.get()), gone)
    try:
        while line := requests.get():
            name, arguments = json.loads(line)
            _send(_answer(getattr(agent, name) if name in _REQUESTS else None, arguments))
    except BrokenPipeError:
        pass
    finally:
        with contextlib.suppress(HostError):
            agent.back()


def _answer(do: Callable[..., Any] | None, arguments: dict[str, Any]) -> dict[str, Any]:
    if do is None:
        return {"error": "an unknown request"}
    try:
        return {"answer": do(**arguments)}
    except HostError as error:
        return {"error": str(error)}
    except OSError as error:
        return {"error": f"{error.strerror}: {error.filename}" if error.filename else str(error)}


def _send(answer: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    serve()
