"""Processes of tfcompose that a case starts and ends."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def end_process(process: subprocess.Popen[bytes], number: int, timeout_s: float) -> int:
    """End a process by a signal if it runs, or kill it after a time; return its exit code."""
    if process.poll() is None:
        process.send_signal(number)
    try:
        return process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def own_command(module: str) -> list[str]:
    """Return the command that runs a module's ``main``, and imports nothing from this folder."""
    package = str(Path(__file__).absolute().parents[3])
    path = f"sys.path[:] = [*filter(None, sys.path), {package!r}]"
    code = f"import sys; {path}; from {module} import main; sys.exit(main())"
    return [sys.executable, "-c", code]
