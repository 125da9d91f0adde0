"""constraints.txt: the versions that the README's commands install, for each Python.

``python -m tests.support.constraints`` resolves them anew with uv, of the extra ``lint``: the
newest that pyproject.toml allows, for all Pythons, or for each range of them where a package has
dropped the older.
"""

from __future__ import annotations

import re
import subprocess
import sys

from tests.support.house import ROOT

FILE = ROOT / "constraints.txt"
#: The extras of the README's two commands, and of the linters.
EXTRAS = ("ros", "test", "lint")

#: A package's name, its version, and the environments for which that is.
LINE = re.compile(r"([a-z0-9]+(?:-[a-z0-9]+)*)==([0-9][\w.+!]*)(?: ; ([\w .'<>=!*()]+))?")

_HEAD = """\
# The versions that the README's commands install, written by python -m tests.support.constraints.
"""
_OPTIONS = ["--universal", "--python-version", "3.10", "--no-annotate", "--no-header", "--quiet"]


def pins(text: str) -> list[tuple[str, str, str]]:
    """Return each name, version and marker of a file of constraints.

    Raises:
        ValueError: if a line says anything else, such as an address.
    """
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    matches = [LINE.fullmatch(line) for line in lines]
    if None in matches:
        raise ValueError(f"no name with a version: {lines[matches.index(None)]}")
    return [(match[1], match[2], match[3] or "") for match in matches if match]


def resolved() -> str:
    """Return the file's text, as the registry's packages are now."""
    extras = [argument for extra in EXTRAS for argument in ("--extra", extra)]
    command = [sys.executable, "-m", "uv", "pip", "compile", "pyproject.toml", *extras, *_OPTIONS]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    lines = sorted(
        f"{name}=={version}{marker and f' ; {marker}'}"
        for name, version, marker in pins(done.stdout)
    )
    return _HEAD + "\n".join(lines) + "\n"


if __name__ == "__main__":
    FILE.write_text(resolved(), "utf-8")
