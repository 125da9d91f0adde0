"""Whatever the text is, there is a robot or there are findings; never another exception."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.render.formats import render_json
from tfcompose.compiler.render.text import render_text
from tfcompose.foundation.findings import RejectedError
from tfcompose.model.plan.file import read_plan

ROOT = Path(__file__).parents[2]
ROBOTS = [file.read_text("utf-8") for file in sorted((ROOT / "robots").glob("*.yaml"))]
PLANS = [
    file.read_text("utf-8") for file in sorted((ROOT / "tests" / "golden").glob("*/plan.json"))
]
PRESETS = library()

WORDS = sorted({word for text in ROBOTS for word in text.replace(":", " ").split()})
ODD = [
    "",
    "{}",
    "[]",
    "null",
    "~",
    "1e308",
    "-1",
    "0",
    ".inf",
    "'\"&<'",
    "${a",
    "${1/0}",
    "*wheel",
    "<<",
    "!x",
    "\t",
    "ü",
]
ODD += [
    "1e308 km",
    "driver",
    "none",
    "same",
    "zero",
    "{a: b}",
    "[1, 2, 3]",
    "x: y",
    "- ",
    "&a",
    "true",
    "9" * 320,
]


def settle(text: str, profiles: tuple[str, ...] = ()) -> None:
    """Compile, render and emit, as the command line does."""
    compiled = compile_robot(text, "r.yaml", PRESETS, profiles)
    assert compiled.robot or compiled.errors
    lines = text.splitlines()
    render_text(
        compiled.findings,
        lambda _, line: lines[line - 1] if line <= len(lines) else None,
        colour=True,
    )
    json.loads(render_json(compiled.findings))
    assert not [finding for finding in compiled.findings if finding.code == "TF903"]
    if compiled.robot and not compiled.errors:
        for file in emit(compiled.robot):
            file.text.encode()
            assert "nan" not in file.text.split()
            if file.path == "plan.json":
                read_plan(file.text, file.path)


@given(st.text())
def test_any_text_gives_findings_or_a_robot(text: str) -> None:
    settle(text)
    settle(f"tfcompose: 1\nrobot: r\n{text}")


@st.composite
def mutated(draw: st.DrawFn) -> str:
    """Return a robot with some words, lines or characters replaced, removed or doubled."""
    text = draw(st.sampled_from(ROBOTS))
    for _ in range(draw(st.integers(1, 4))):
        lines = text.split("\n")
        index = draw(st.integers(0, len(lines) - 1))
        kind = draw(st.integers(0, 4))
        if kind == 0:
            lines.insert(index, draw(st.sampled_from(lines)))
        elif kind == 1:
            del lines[index]
        else:
            words = lines[index].split(" ")
            which = draw(st.integers(0, len(words) - 1))
            words[which] = draw(
                st.sampled_from(WORDS) | st.sampled_from(ODD) | st.text(max_size=4)
            )
            lines[index] = " ".join(words)
        text = "\n".join(lines)
    return text


@given(mutated(), st.sampled_from([(), ("demo",)]))
@settings(max_examples=150, deadline=None)
def test_any_change_of_the_example_robots_gives_findings_or_a_robot(
    text: str, profiles: tuple[str, ...]
) -> None:
    settle(text, profiles)


leaves = (
    st.none()
    | st.booleans()
    | st.integers(-(10**400), 10**400)
    | st.floats()
    | st.sampled_from(WORDS)
)
keys = st.sampled_from(WORDS) | st.text(max_size=3)
values = st.recursive(
    leaves | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3),
    max_leaves=6,
)


@st.composite
def replaced(draw: st.DrawFn, texts: list[str]) -> Any:
    """Return the data of one of the JSON texts with one value somewhere replaced."""
    data = json.loads(draw(st.sampled_from(texts)))
    here = data
    while True:
        step = draw(st.sampled_from(sorted(here) if isinstance(here, dict) else range(len(here))))
        if (
            not here[step]
            or not isinstance(here[step], (dict, list))
            or draw(st.integers(0, 3)) == 0
        ):
            here[step] = draw(values)
            return data
        here = here[step]


@pytest.mark.parametrize("text", PLANS)
def test_a_plan_that_was_built_is_read(text: str) -> None:
    assert read_plan(text, "plan.json").edges


@given(replaced(PLANS))
@settings(max_examples=150, deadline=None)
def test_any_change_of_a_plan_is_read_or_refused(data: Any) -> None:
    try:
        read_plan(json.dumps(data), "plan.json")
    except RejectedError as error:
        assert {finding.code for finding in error.findings} == {"TF902"}  # noqa: PT017 (being read is fine too)


@pytest.mark.parametrize(
    "value", [10**400, -(10**400), 1e308, float("nan"), float("inf"), True, None, "1", [], {}]
)
@pytest.mark.parametrize("key", ["xyz", "quat_xyzw", "pose", "rate", "source", "owner", "joint"])
def test_a_plan_with_a_wrong_value_in_an_edge_never_crashes(key: str, value: Any) -> None:
    data = json.loads(PLANS[0])
    poses = {"xyz": [[value] * 3, [0, 0, 0, 1]], "quat_xyzw": [[0] * 3, [0, 0, 0, value]]}
    data["edges"][0] |= {"pose": poses[key]} if key in poses else {key: value}
    try:
        read_plan(json.dumps(data), "plan.json")
    except RejectedError as error:
        assert [finding.code for finding in error.findings] == ["TF902"]  # noqa: PT017 (being read is fine too)


@given(st.text())
def test_any_text_is_no_plan(text: str) -> None:
    with pytest.raises(RejectedError):
        read_plan(text, "plan.json")


SECTIONS = [
    "links",
    "joints",
    "frames",
    "sensors",
    "processes",
    "ros",
    "guard",
    "vars",
    "profiles",
    "base",
]


@given(
    st.dictionaries(
        st.sampled_from(SECTIONS),
        st.dictionaries(st.text(max_size=3), values, max_size=3) | values,
    )
)
@settings(max_examples=150, deadline=None)
def test_any_data_in_the_sections_gives_findings_or_a_robot(data: dict[str, Any]) -> None:
    settle(
        json.dumps({"tfcompose": 1, "robot": "r", **data}, ensure_ascii=False).replace(
            "NaN", ".nan"
        )
    )
