"""Stand-ins for joint states: positions, sweeps, and what is refused."""

import math

import pytest

from tests.support.findings import words
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.model.plan import Simulation, Sweep
from tfcompose.model.plan.file import read_plan

ARM = """
tfcompose: 1
robot: arm
links: {base_link: {}, a: {}, b: {}, c: {}, d: {}}
joints:
  turn: {type: continuous, parent: base_link, child: a}
  lift: {type: prismatic, parent: a, child: b, limit: {lower: 0.1, upper: 0.5, velocity: 0.05, effort: 1}}
  bend: {type: revolute, parent: b, child: c, limit: {lower: -90 deg, upper: 30 deg, velocity: 2, effort: 1}}
  follow: {type: revolute, parent: c, child: d, limit: {lower: -1, upper: 1, velocity: 2, effort: 1}, %s}
processes: {states: {simulate: {joints: %s}}}
"""  # noqa: E501 (a text as its reader has it)
ROTATION = Sweep(6.0)
LIFT = Sweep(math.pi * 0.4 / 0.05, 0.1, 0.5)
BEND = Sweep(6.0, -math.pi / 2, math.pi / 6)


def compiled(joints: str) -> Compiled:
    return compile_robot(ARM % ("mimic: {joint: bend}", joints), "arm.yaml", library())


def simulation(joints: str) -> Simulation | None:
    done = compiled(joints)
    assert not done.errors, done.errors
    assert done.robot
    text = next(file.text for file in emit(done.robot) if file.path == "plan.json")
    return read_plan(text, "plan.json").process("states").simulate


def approx(sweeps: dict[str, Sweep]) -> object:
    return {
        n: (pytest.approx(s.period_s), pytest.approx(s.lower), pytest.approx(s.upper))
        for n, s in sweeps.items()
    }


def tuples(sweeps: dict[str, Sweep]) -> object:
    return {name: (sweep.period_s, sweep.lower, sweep.upper) for name, sweep in sweeps.items()}


@pytest.mark.parametrize(
    ("source_text", "joints", "sweeps"),
    [
        ("zero", {"turn": 0.0, "lift": 0.3, "bend": 0.0}, {}),
        ("{lift: 20 cm}", {"turn": 0.0, "lift": 0.2, "bend": 0.0}, {}),
        (
            "sweep",
            {"turn": 0.0, "lift": 0.3, "bend": 0.0},
            {"turn": ROTATION, "lift": LIFT, "bend": BEND},
        ),
        (
            "{turn: 90 deg, bend: sweep}",
            {"turn": math.pi / 2, "lift": 0.3, "bend": 0.0},
            {"bend": BEND},
        ),
    ],
)
def test_every_independent_joint_moves_within_its_limits_and_speed(
    source_text: str, joints: dict[str, float], sweeps: dict[str, Sweep]
) -> None:
    """A joint that mimics one is left out.

    Where 0 is beyond the limits the middle counts, as elsewhere in ROS.
    """
    simulated = simulation(source_text)
    assert simulated
    assert simulated.joints == pytest.approx(joints)
    assert tuples(simulated.sweep) == approx(sweeps)


UNLIMITED = """
tfcompose: 1
robot: arm
rules: {TF704: off}
links: {base_link: {}, a: {}, b: {}, c: {}}
joints:
  bend: {type: revolute, parent: base_link, child: a}
  half: {type: revolute, parent: a, child: b, limit: {lower: -1, velocity: 0.1, effort: 1}}
  lift: {type: prismatic, parent: b, child: c}
processes: {states: {simulate: {joints: %s}}}
"""


def test_without_limits_a_rotation_sweeps_all_round_and_a_slide_stays() -> None:
    done = compile_robot(UNLIMITED % "sweep", "arm.yaml", library())
    assert not done.errors
    assert done.robot
    text = next(file.text for file in emit(done.robot) if file.path == "plan.json")
    simulated = read_plan(text, "plan.json").process("states").simulate
    assert simulated
    assert simulated.joints == {"bend": 0.0, "half": 0.0, "lift": 0.0}
    sweeps = {"bend": Sweep(6.0, -math.pi, math.pi), "half": Sweep(math.pi / 0.1, -1.0, 0.0)}
    assert tuples(simulated.sweep) == approx(sweeps)


def test_a_slide_without_limits_cannot_sweep() -> None:
    (finding,) = compile_robot(UNLIMITED % "{lift: sweep}", "arm.yaml", library()).errors
    assert finding.code == "TF106"
    assert "lift" in words(finding)


@pytest.mark.parametrize(
    ("source_text", "code", "words"),
    [
        ("swep", "TF106", "sweep"),
        ("{bend: swep}", "TF106", "sweep"),
        ("{bend: 3 kg}", "TF104", ""),
        ("{bent: sweep}", "TF703", "bend"),
        ("{follow: sweep}", "TF703", "bend"),
        ("[1, 2]", "TF103", ""),
    ],
)
def test_what_is_not_understood_is_refused_once(source_text: str, code: str, words: str) -> None:
    (finding,) = compiled(source_text).errors
    assert finding.code == code
    assert words in (finding.help or "")


@pytest.mark.parametrize(
    ("rates", "requested", "rate_hz"),
    [
        (["", ""], "", 20.0),
        ([", rate: 50 Hz", ""], "", 50.0),
        ([", rate: 5 Hz", ", rate: 8 Hz"], "", 8.0),
        ([", rate: 50 Hz", ""], ", rate: 30 Hz", 30.0),
    ],
)
def test_a_simulated_owner_sends_at_the_rate_that_its_edges_declare(
    rates: list[str], requested: str, rate_hz: float
) -> None:
    text = f"""tfcompose: 1
robot: r
frames:
  odom: {{}}
  base_link: {{parent: odom, owner: ekf{rates[0]}}}
  tool: {{parent: base_link, owner: ekf{rates[1]}}}
processes: {{ekf: {{simulate: {{circle: {{}}{requested}}}}}}}
"""
    done = compile_robot(text, "r.yaml", library())
    assert done.robot
    (ekf,) = [process for process in done.robot.processes if process.name == "ekf"]
    assert ekf.simulate
    assert ekf.simulate.rate == rate_hz
