"""On which machine, and as which process, a publisher runs, as far as its id tells.

With Fast DDS an id begins with the vendor's number (01 0f), two bytes for the host, and the lower half of the process
id (``GuidUtils``, Fast DDS 2.14). Two machines can have the same two bytes, so a process is named only where one fits.
"""

from __future__ import annotations

from pathlib import Path

_VENDOR = b"\x01\x0f"
_WORD = 1 << 16
#: Of a command line so much is shown.
_SHOWN = 80


def origin(gid: bytes, own_gid: bytes) -> str:
    """Return where the publisher runs: ``on this machine as pid 7: …``, ``on another machine``; empty if unknown.

    ``own_gid`` is an id of this process's own.
    """
    if gid[:2] != _VENDOR or own_gid[:2] != _VENDOR:
        return ""
    if gid[2:4] != own_gid[2:4]:
        return "on another machine"
    fitting = [(pid, line) for pid in _candidates(int.from_bytes(gid[4:6], "little")) if (line := _command(pid))]
    if len(fitting) != 1:
        return "on this machine"
    pid, line = fitting[0]
    return f"on this machine as pid {pid}: {line}"


def carries(gid: bytes, own_gid: bytes, variable: str) -> bool | None:
    """Return whether the publisher's process has ``variable`` (NAME=VALUE) in its environment; None: nobody can say."""
    if gid[:2] != _VENDOR or own_gid[:2] != _VENDOR:
        return None
    if gid[2:4] != own_gid[2:4]:
        return False
    found = [_environment(pid) for pid in _candidates(int.from_bytes(gid[4:6], "little")) if _command(pid)]
    return any(variable.encode() in one.split(b"\0") for one in found)


def told(gid: bytes, own_gid: bytes, name: str) -> str:
    """Return an environment variable of the publisher's process; empty where it has none, or nobody can say."""
    if gid[:4] != own_gid[:4] or gid[:2] != _VENDOR:
        return ""
    begin = f"{name}=".encode()
    found = {
        word.removeprefix(begin).decode(errors="replace")
        for pid in _candidates(int.from_bytes(gid[4:6], "little"))
        for word in _environment(pid).split(b"\0")
        if word.startswith(begin)
    }
    return found.pop() if len(found) == 1 else ""


def _environment(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/environ").read_bytes()
    except OSError:
        return b""


def _candidates(low: int) -> range:
    try:
        most = int(Path("/proc/sys/kernel/pid_max").read_text(encoding="ascii"))
    except (OSError, ValueError):
        most = _WORD
    return range(low, most + 1, _WORD)


def _command(pid: int) -> str:
    """Return the process's command line, empty where there is none, and the process's own threads left out."""
    try:
        raw = Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return ""
    line = " ".join(raw.decode(errors="replace").replace("\0", " ").split())
    shown = "".join(c if c.isprintable() else "?" for c in line)
    return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}…"
