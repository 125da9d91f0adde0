"""What starting costs, as ratios in one run.

``python tests/benchmarks/bench_start.py``, or name the file to pytest.

Whole processes and the processor's time for them, which a busy machine changes little; the
commands that are compared take turns, so that a busy moment meets all of them; medians; compiled
files are there before the first one that counts.
"""

from __future__ import annotations

import compileall
import resource
import statistics
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
RUNS = 21
COMMANDS = {
    "pass": ["-c", "pass"],
    "a model and yaml": [
        "-c",
        "import yaml, pydantic\nclass A(pydantic.BaseModel):\n    a: int = 1",
    ],
    "lint": ["-m", "tfcompose", "lint", str(ROOT / "robots" / "autonomous_robot.yaml")],
    "--help": ["-m", "tfcompose", "--help"],
}
#: Each command's limit: at most so many times what the other one costs.
LIMITS = {"lint": (2.0, "a model and yaml"), "--help": (2.0, "pass")}


def measure(runs: int = RUNS) -> dict[str, float]:
    """Return the median seconds of each command, its own and the kernel's for it."""
    compileall.compile_dir(ROOT / "tfcompose", quiet=2)
    seconds: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for run in range(runs + 1):
        for name, words in COMMANDS.items():
            began = _spent()
            subprocess.run(
                [sys.executable, *words], check=True, stdout=subprocess.DEVNULL, cwd=ROOT
            )
            if run:  # the first run warms the disk
                seconds[name].append(_spent() - began)
    return {name: statistics.median(taken) for name, taken in seconds.items()}


def _spent() -> float:
    """Return the seconds of all processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def test_lint_costs_at_most_twice_a_model_and_yaml_and_help_twice_nothing() -> None:
    found = measure()
    for name, (limit, other) in LIMITS.items():
        assert found[name] <= limit * found[other], found


if __name__ == "__main__":
    medians = measure()
    for name, seconds in medians.items():
        limit, other = LIMITS.get(name, (0.0, name))
        ratio = f"  {seconds / medians[other]:.2f} times {other}, at most {limit}" if limit else ""
        sys.stdout.write(f"{name:18} {1000 * seconds:7.1f} ms{ratio}\n")
