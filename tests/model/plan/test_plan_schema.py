"""The schema of plan.json accepts what build writes and refuses what ``up`` refuses."""

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest

from tfcompose.cli.schemas import schema_text
from tfcompose.model.plan import VERSION, Plan, PlanEdge, Ready
from tfcompose.model.plan.schema import field_comments

GOLDEN = Path(__file__).parents[2] / "golden"
PLANS = sorted(GOLDEN.glob("*/plan.json"))
SCHEMA = jsonschema.Draft202012Validator(json.loads(schema_text("plan")))
#: What a value may be instead, to be wrong nearly everywhere.
WRONG: tuple[Any, ...] = (None, "text", -1.5, 3, True, [], {}, [1], {"a": 1})


def is_read(plan: dict[str, Any]) -> bool:
    """Return whether it has a plan's form; names that lead nowhere are beyond a schema."""
    try:
        msgspec.convert(plan, Plan)
    except msgspec.ValidationError:
        return False
    return bool(plan.get("version") == VERSION)


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Give the path of every value below this one; of a list only of its first item."""
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value[:1])
        if isinstance(value, list)
        else ()
    )
    for key, inner in items:
        yield (*path, key)
        yield from places(inner, (*path, key))


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.parent.name)
def test_what_build_writes_is_valid(file: Path) -> None:
    SCHEMA.validate(json.loads(file.read_text("utf-8")))


@pytest.mark.parametrize("file", PLANS, ids=lambda file: file.parent.name)
def test_without_one_key_both_refuse_or_both_take_it(file: Path) -> None:
    full = json.loads(file.read_text("utf-8"))
    for path in places(full):
        plan = copy.deepcopy(full)
        holder = plan
        for key in path[:-1]:
            holder = holder[key]
        del holder[path[-1]]
        assert SCHEMA.is_valid(plan) == is_read(plan), path


def test_what_the_reader_refuses_for_its_kind_the_schema_refuses_too() -> None:
    """The reader is stricter about values, such as the length of a quaternion.

    It is laxer about none.
    """
    full = json.loads((GOLDEN / "two_rovers" / "plan.json").read_text("utf-8"))
    observed, mistaken = 0, []
    for path in places(full):
        for wrong in WRONG:
            plan = copy.deepcopy(full)
            holder = plan
            for key in path[:-1]:
                holder = holder[key]
            holder[path[-1]] = wrong
            if not SCHEMA.is_valid(plan):
                observed += 1
                mistaken += [(path, wrong)] if is_read(plan) else []
    assert observed > 200
    assert not mistaken


def test_a_comment_of_a_field_describes_its_key() -> None:
    edge = json.loads(schema_text("plan"))["$defs"]["PlanEdge"]["properties"]
    assert "description" not in edge["child"]
    assert edge["node"]["description"] == field_comments(PlanEdge)["node"]
    wrapped = field_comments(Ready)["text"]
    assert "#" not in wrapped
    assert wrapped.endswith("its output.")
