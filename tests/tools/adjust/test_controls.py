"""Keys of ``nudge --interactive``: the steps that they mean, and the rows of the screen."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from tests.support.plans import compiled_plan
from tfcompose.cli.terminal import plain
from tfcompose.foundation.geometry import Pose
from tfcompose.tools.adjust.controls import Controls, Step, apply_steps

MOUNTS = "\n".join(f"  mount_{number}: {{parent: base_link}}" for number in range(12))
PLAN = compiled_plan(f"""\
tfcompose: 1
robot: rover
frames:
  base_link: {{parent: odom, owner: drive, rate: 20 Hz}}
  odom: {{}}
{MOUNTS}
processes:
  drive: {{simulate: {{fixed: {{xyz: [0, 0, 0]}}, rate: 20 Hz}}}}
""")
FORWARD = Step("mount_0", "x", 0.001)


def controls(*keys: str) -> Controls:
    made = Controls("rover.0", PLAN, "mount_0")
    for key in keys:
        made.press(key)
    return made


@pytest.mark.parametrize(
    ("keys", "steps"),
    [
        (["up"] * 30, [Step("mount_0", "x", 0.03)]),
        (["up", "up", "down"], [FORWARD]),
        (["right", "-", "down"], [Step("mount_0", "y", -0.0001)]),
        (["left", "+", "up"], [Step("mount_0", "yaw", math.radians(1))]),
        (["up", "l", "up"], [FORWARD, Step("mount_0", "x", 0.001, local=True)]),
        (["up", "tab", "up"], [FORWARD, Step("mount_1", "x", 0.001)]),
        (["backtab", "+", "+", "+", "up"], [Step("mount_11", "x", 0.1)]),
        (["up", "u", "up"], [FORWARD, Step("mount_0", "undo"), FORWARD]),
        (["r", "up", "r", "r"], [FORWARD, Step("mount_0", "reset")]),
        (["", "?", "é"], []),
    ],
)
def test_keys_mean_steps_and_a_held_key_is_one_step(keys: list[str], steps: list[Step]) -> None:
    taken = controls(*keys).take_steps()
    assert [replace(step, value=0) for step in taken] == [replace(step, value=0) for step in steps]
    assert [step.value for step in taken] == pytest.approx([step.value for step in steps])


def test_steps_that_cancel_out_and_an_undo_of_nothing_change_no_edge() -> None:
    steps = controls("up", "down", "tab", "u", "r", "r").take_steps()
    edges = apply_steps(PLAN, [*steps, Step("gone", "x", 1.0), Step("base_link", "x", 1.0)])
    assert [edge for edge in edges.values() if edge not in PLAN.edges] == []
    assert edges.keys() == {"mount_0", "mount_1"}


def test_an_undo_takes_back_a_held_key() -> None:
    steps = controls(*["up"] * 5, "right", *["down"] * 3, "u").take_steps()
    (edge,) = apply_steps(PLAN, steps).values()
    assert (edge.pose, edge.earlier) == (Pose((0.005, 0, 0)), (Pose(),))


@pytest.mark.parametrize("columns", [8, 40, 80, 200])
@pytest.mark.parametrize("rows", [2, 5, 10, 24, 60])
def test_the_rows_fit_and_show_the_chosen_mount(columns: int, rows: int) -> None:
    made = controls(*["tab"] * 9, "up")
    edges = apply_steps(PLAN, made.take_steps())
    made.follow(replace(PLAN, edges=tuple(edges.get(edge.child, edge) for edge in PLAN.edges)))
    lines = [plain(line) for line in made.rows(columns, rows)]
    assert len(lines) <= rows
    assert max(map(len, lines)) <= columns
    if columns >= 80 and rows >= 8:
        (chosen,) = [line for line in lines if line.startswith("▸")]
        assert ("mount_9" in chosen, "adjusted by 1 mm" in chosen) == (True, True)
        assert any("xyz 0.001 0 0 m" in line for line in lines)
        assert any("[x]" in line for line in lines)


def test_a_mount_that_vanished_is_no_longer_chosen() -> None:
    made = controls()
    made.follow(replace(PLAN, edges=tuple(edge for edge in PLAN.edges if edge.child != "mount_0")))
    made.press("up")
    assert made.steps == [Step("mount_1", "x", 0.001)]
    made.follow(replace(PLAN, edges=()))
    made.press("tab")
    assert made.rows(80, 24)
