"""The example robots: no finding in any of them, and nothing in a demo that needs hardware."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.support.cli import tfcompose_in

ROOT = Path(__file__).parents[2]
ROBOTS = sorted(path.name for path in (ROOT / "robots").glob("*.yaml"))
WITH_DEMO = [name for name in ROBOTS if "\n  demo:" in (ROOT / "robots" / name).read_text("utf-8")]
#: What tfcompose itself starts.
OWN = {"static", "joints", "guard", "simulate"}


def tfcompose(*words: str) -> subprocess.CompletedProcess[str]:
    """Run it as a person does who stands in the project's folder."""
    return tfcompose_in(ROOT, *words)


@pytest.mark.parametrize("robot", ROBOTS)
def test_lint_finds_nothing_in_an_example_with_any_profile(robot: str) -> None:
    done = tfcompose("lint", "--fail-on", "warning", f"robots/{robot}")
    assert done.returncode == 0, done.stdout
    assert len(done.stdout.splitlines()) == 1


@pytest.mark.parametrize("robot", WITH_DEMO)
def test_a_demo_starts_nothing_but_what_tfcompose_brings_along(robot: str, tmp_path: Path) -> None:
    built = tfcompose("build", f"robots/{robot}", "--profile", "demo", "-o", str(tmp_path))
    assert built.returncode == 0, built.stderr
    plan = json.loads((tmp_path / "plan.json").read_text("utf-8"))
    assert {process["kind"] for process in plan["processes"]} <= OWN
    assert all(
        edge["owner"] in {process["name"] for process in plan["processes"]}
        for edge in plan["edges"]
    )


def test_every_robot_of_the_gallery_has_a_demo() -> None:
    assert set(WITH_DEMO) >= {
        "car_roof.yaml",
        "field_rover.yaml",
        "house_robot.yaml",
        "picker.yaml",
    }
