"""One process of a plan, as other supervisors start it."""

import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in
from tests.support.processes import Started
from tests.support.robots import ROVER
from tests.support.waiting import until
from tfcompose.launcher.program import anywhere

pytestmark = pytest.mark.ros

HELLO = (
    ROVER
    + "  hello: {run: [sh, -c, 'echo $GREETING; exec sleep 180'], env: {GREETING: good day}}\n"
)


@pytest.fixture
def units(domain: object, tmp_path: Path) -> Path:
    """The robot's units, exported."""
    assert domain
    (tmp_path / "robot.yaml").write_text(HELLO, "utf-8")
    done = tfcompose_in(tmp_path, "export", "systemd", "robot.yaml", "-o", ".")
    assert done.returncode == 0, done.stderr
    return tmp_path / "systemd"


def arguments_of(unit: Path) -> list[str]:
    """Return what follows the program in the unit's command."""
    (line,) = re.findall(r"^ExecStart=(.*)$", unit.read_text("utf-8"), re.MULTILINE)
    words = shlex.split(line)
    assert words[:3] == anywhere(sys.executable)
    return words[3:]


def test_a_foreign_process_is_supervised_in_the_plans_environment(
    units: Path, start: Callable[..., Started]
) -> None:
    hello = start(*arguments_of(units / "rover-hello.service"))
    assert until(lambda: "good day" in hello.output)
    assert until(
        lambda: Path(f"/proc/{hello.process.pid}/exe").readlink() != Path(sys.executable).resolve()
    ), "nobody stands between"


@pytest.mark.parametrize(
    ("name", "expected", "code"),
    [("nobody", "has no process nobody", 2), ("missing", "no-such-program of missing", 1)],
)
def test_what_cannot_be_started_is_reported(
    name: str, expected: str, code: int, units: Path, start: Callable[..., Started]
) -> None:
    plan = units.parent / "plan.json"
    text = (
        plan.read_text("utf-8")
        .replace('"hello"', '"missing"')
        .replace('["sh", ', '["no-such-program", ')
    )
    plan.write_text(text, "utf-8")
    run = start("exec", plan, name)
    assert run.process.wait(60) == code
    assert until(lambda: expected in "".join(run.errors)), run.errors
    assert "Traceback" not in "".join(run.errors)
