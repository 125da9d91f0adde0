"""Names of the core and of the tools that ship, as ``tfcompose/data/names.json`` holds them.

``python -m tests.support.names --write`` writes the file. It is read where a tool of another
package must not take one of these names, and where a tool is absent, to say what installs it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from tfcompose.cli.documentation import TOPICS
from tfcompose.cli.parser import COMMANDS
from tfcompose.cli.schemas import LANGUAGES
from tfcompose.foundation.catalogue import CATALOGUE
from tfcompose.foundation.tool import shipped_tools
from tfcompose.launcher.program import PROCESSES
from tfcompose.spec.language.robot import RobotSpec

FILE = Path(__file__).parents[2] / "tfcompose" / "data" / "names.json"


def names() -> str:
    """Return the file's text."""
    rows: dict[str, Any] = {
        "tfcompose": {
            "install": "",
            "names": {
                "command": sorted({*COMMANDS, *PROCESSES}),
                "key": sorted(RobotSpec.model_fields),
                "language": sorted(LANGUAGES),
                "topic": sorted(TOPICS),
            },
        }
    }
    for tool in shipped_tools().tools:
        kinds: dict[str, list[str]] = {}
        for kind, name in tool.names():
            kinds.setdefault(kind, []).append(name)
        kinds["rule"] = [CATALOGUE[code].name for code in tool.code_names()]
        install = f"tfcompose[{tool.extra}]" if tool.extra else "tfcompose"
        rows[tool.name] = {"install": install, "names": kinds}
    return json.dumps(rows, indent=1) + "\n"


def main(argv: list[str]) -> None:
    """Print the file, or write it."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.names", description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the file")
    if parser.parse_args(argv).write:
        FILE.write_text(names(), encoding="utf-8")
    else:
        sys.stdout.write(names())


if __name__ == "__main__":
    main(sys.argv[1:])
