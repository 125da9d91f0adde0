"""A plan's file that is broken is refused, with the edge or process and the key."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tfcompose.findings import RejectedError
from tfcompose.geometry import Pose
from tfcompose.plan import Plan, PlanEdge, PlanProcess, RosSettings
from tfcompose.plan.file import read_plan, write_plan

EDGES = [PlanEdge("base", child, "static", "static", "/s", Pose(), None, ("r.yaml", 1)) for child in ("a", "b")]
PLAN = Plan("rover", "", "base", RosSettings(), tuple(EDGES), (PlanProcess("static", "static"),))


@pytest.mark.parametrize(
    ("section", "change", "message"),
    [
        ("edges", {"kind": None}, "edges 2, base → b: kind is missing"),
        ("edges", {"parent": None}, "edges 2, None → b: parent is missing"),
        ("edges", {"xyz": [1, 2]}, "edges 2, base → b: xyz is not 3 finite numbers"),
        ("edges", 7, "edges 2 is 7, not a mapping"),
        (
            "processes",
            {"restart": "maybe"},
            "processes 1, static: restart is 'maybe', not one of no, on-failure, always",
        ),
    ],
)
def test_the_edge_or_process_is_named(section: str, change: Any, message: str) -> None:
    data = json.loads(write_plan(PLAN))
    row = data[section][-1]
    if not isinstance(change, dict):
        data[section][-1] = change
    else:
        for key, value in change.items():
            if value is None:
                del row[key]
            else:
                row[key] = value
    with pytest.raises(RejectedError) as rejected:
        read_plan(json.dumps(data), "plan.json")
    assert [one.message for one in rejected.value.findings] == [f"not a whole plan: {message}"]
