"""A plan's file that is broken is refused, with the path to what is wrong."""

import json
import re
from typing import Any

import pytest

from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.geometry import Pose
from tfcompose.model.plan import (
    GuardPolicy,
    Plan,
    PlanEdge,
    PlanJoint,
    PlanProcess,
    Ready,
    RosSettings,
    Simulation,
    SourceLine,
    StopRule,
    Sweep,
)
from tfcompose.model.plan.file import read_plan, write_plan

AT = SourceLine("r.yaml", 1)
EDGES = (
    PlanEdge("base", "a", "static", "static", "/s", Pose(), None, AT),
    PlanEdge(
        "base", "b", "joint", "joints", "/j", Pose(), 50.0, AT, PlanJoint("b_joint", "revolute")
    ),
)
PROCESSES = (
    PlanProcess("static", "static", owns=(("base", "a"),), stop=StopRule("SIGTERM", 2.0)),
    PlanProcess("joints", "joints"),
    PlanProcess("camera", "run", ready=Ready("topic", "/scan"), lifecycle={"/camera": "active"}),
    PlanProcess(
        "arm", "simulate", simulate=Simulation("joints", 20.0, sweep={"b": Sweep(2.0, -1.0, 1.0)})
    ),
)
GUARD = GuardPolicy(unknown_edges="error")
PLAN = Plan("rover", "", "base", RosSettings(), EDGES, PROCESSES, guard=GUARD)
MISSING = object()


def changed(path: tuple[str | int, ...], value: Any) -> str:
    """Return the plan's text with another value at the path, or without it."""
    data = json.loads(write_plan(PLAN))
    *above, last = path
    holder = data
    for step in above:
        holder = holder[step]
    if value is MISSING:
        del holder[last]
    else:
        holder[last] = value
    return json.dumps(data)


def refused(text: str) -> str:
    """Return the message of the one finding for a text that is no plan."""
    with pytest.raises(RejectedError) as rejected:
        read_plan(text, "plan.json")
    (finding,) = rejected.value.findings
    assert (finding.code, finding.span and finding.span.file) == ("TF902", "plan.json")
    return finding.message.removeprefix("not a valid plan: ")


def test_what_is_encoded_is_decoded() -> None:
    assert read_plan(write_plan(PLAN), "plan.json") == PLAN


#: Paths, and what is wrong there.
WRONG: tuple[tuple[tuple[str | int, ...], Any], ...] = (
    (("robot",), 7),
    (("base",), MISSING),
    (("ros", "clock"), "moon"),
    (("ros", "discovery"), "everywhere"),
    (("ros", "domain_id"), True),
    (("ros", "shared_frames"), "map"),
    (("guard", "mode"), "loose"),
    (("guard", "allow"), {}),
    (("claims",), None),
    (("edges",), {}),
    (("edges", 1), 7),
    (("edges", 1, "kind"), MISSING),
    (("edges", 1, "parent"), None),
    (("edges", 1, "pose", 0), [1, 2]),
    (("edges", 1, "pose", 1, 3), "1"),
    (("edges", 1, "rate"), 10**400),
    (("edges", 1, "source", 1), 1.5),
    (("edges", 1, "joint", "type"), "fixed"),
    (("edges", 1, "joint", "axis"), [0, 0, "1"]),
    (("processes", 0, "restart"), "maybe"),
    (("processes", 0, "max_restarts"), 1.5),
    (("processes", 0, "required"), 1),
    (("processes", 0, "stop", "signal"), "SIGFOO"),
    (("processes", 0, "stop", "timeout_s"), "3"),
    (("processes", 0, "owns", 0), ["base"]),
    (("processes", 0, "env"), {"A": 1}),
    (("processes", 0, "drives"), [{}]),
    (("processes", 0, "switches"), {"/a": {"publish_tf": None}}),
    (("processes", 0, "after"), {"camera": "born"}),
    (("processes", 2, "lifecycle", "/camera"), "on"),
    (("processes", 2, "ready", "kind"), "soon"),
    (("processes", 2, "log_level"), "loud"),
    (("processes", 3, "simulate", "rate"), 0),
    (("processes", 3, "simulate", "sweep", "b", "period_s"), -1.0),
    (("processes", 3, "simulate", "sweep", "b", "upper"), None),
)


def test_what_is_wrong_is_refused_with_the_path_to_it() -> None:
    for path, value in WRONG:
        step_path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
        match = re.search(r" - at `\$(.*)`$", refused(changed(path, value)))
        named = match[1] if match else ""
        # A key of a mapping of names is not named; a key that is missing, and a rule about
        # several, name what holds them.
        place = re.escape(named).replace(r"\[\.\.\.\]", r"\.[^.]+")
        assert named.startswith(step_path) or re.fullmatch(
            rf"{place}(\.[^.]+|\[\d\])?", step_path
        ), path


@pytest.mark.parametrize("quat_xyzw", [[0, 0, 0, 2], [0, 0, 0, 0]])
def test_a_quaternion_of_another_length_is_refused_with_its_edge(quat_xyzw: list[float]) -> None:
    assert "base → b" in refused(changed(("edges", 1, "pose", 1), quat_xyzw))


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999"])
def test_what_is_no_number_of_json_is_refused_at_its_place(number: str) -> None:
    text = changed(("edges", 1, "rate"), 12345.5).replace("12345.5", number)
    with pytest.raises(RejectedError) as rejected:
        read_plan(text, "plan.json")
    (finding,) = rejected.value.findings
    assert finding.span
    assert finding.code == "TF902"
    assert number == "1e999" or text[: finding.span.column - 1].endswith('"rate": ')


def test_keys_of_a_later_version_are_ignored() -> None:
    assert read_plan(changed(("processes", 2, "colour"), "blue"), "plan.json") == PLAN


def test_a_value_that_is_long_is_shown_in_part() -> None:
    assert len(refused(changed(("edges", 1, "kind"), "x" * 10_000))) < 200
