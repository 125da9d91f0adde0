"""Plans and messages survive writing and reading; wrong types are refused."""

import json
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.model.plan.codec import (
    FLAT,
    OMITTED,
    DecodeError,
    Rule,
    TaggedUnion,
    decode,
    encode,
)


def _even(number: int) -> None:
    if number % 2:
        raise ValueError("is odd")


class Point(NamedTuple):
    x: float
    y: float = 0.0


@dataclass(frozen=True)
class Part:
    name: str
    size: float | None = None


@dataclass(frozen=True)
class Machine:
    """One field of each type."""

    text: str
    count: Annotated[int, Rule(_even)]
    ratio: float
    on: bool
    word: Literal["a", "b", 1]
    maybe: int | None
    plain: str | int | float | bool
    many: tuple[Part, ...]
    pair: tuple[str, int]
    by_name: dict[str, Part]
    at: Point = field(metadata=FLAT)
    anything: Any = None
    more: Part | None = field(default=None, metadata=OMITTED)
    tags: tuple[str, ...] = field(default=(), metadata=OMITTED)


PARTS = st.builds(Part, st.text(), st.none() | st.floats(allow_nan=False, allow_infinity=False))
FINITE = st.floats(allow_nan=False, allow_infinity=False)
MACHINES = st.builds(
    Machine,
    text=st.text(),
    count=st.integers().map(lambda number: 2 * number),
    ratio=FINITE,
    on=st.booleans(),
    word=st.sampled_from(["a", "b", 1]),
    maybe=st.none() | st.integers(),
    plain=st.text() | st.integers() | FINITE | st.booleans(),
    many=st.lists(PARTS, max_size=3).map(tuple),
    pair=st.tuples(st.text(), st.integers()),
    by_name=st.dictionaries(st.text(), PARTS, max_size=3),
    at=st.builds(Point, FINITE, FINITE),
    more=st.none() | PARTS,
    tags=st.lists(st.text(), max_size=2).map(tuple),
)
ONE = Machine(
    "m",
    2,
    1.5,
    True,  # noqa: FBT003
    "a",
    None,
    3,
    (Part("p"),),
    ("q", 1),
    {"r": Part("r", 2.0)},
    Point(1.0, 2.0),
)
DATA = {
    "text": "m",
    "count": 2,
    "ratio": 1.5,
    "on": True,
    "word": "a",
    "maybe": None,
    "plain": 3,
    "many": [{"name": "p", "size": None}],
    "pair": ["q", 1],
    "by_name": {"r": {"name": "r", "size": 2.0}},
    "x": 1.0,
    "y": 2.0,
    "anything": None,
}


@given(MACHINES)
def test_what_is_encoded_is_decoded(machine: Machine) -> None:
    assert decode(Machine, json.loads(json.dumps(encode(machine)))) == machine


def test_fields_stand_in_order_with_flat_ones_and_without_defaults() -> None:
    assert json.dumps(encode(ONE)) == json.dumps(DATA)


def test_a_complete_number_stands_for_a_float_and_other_keys_are_ignored() -> None:
    found = decode(Machine, DATA | {"ratio": 2, "colour": "blue"})
    assert (found.ratio, type(found.ratio)) == (2.0, float)


#: What is of another type, and the path to it.
WRONG: tuple[tuple[dict[str, Any], str], ...] = (
    ({"text": 1}, "text"),
    ({"count": 3}, "count"),
    ({"count": True}, "count"),
    ({"count": 2.0}, "count"),
    ({"ratio": False}, "ratio"),
    ({"ratio": float("inf")}, "ratio"),
    ({"ratio": -(10**400)}, "ratio"),
    ({"on": 1}, "on"),
    ({"word": True}, "word"),
    ({"word": []}, "word"),
    ({"maybe": "x"}, "maybe"),
    ({"plain": None}, "plain"),
    ({"plain": float("nan")}, "plain"),
    ({"many": {}}, "many"),
    ({"many": [{"name": "p", "size": None}, 7]}, "many[1]"),
    ({"many": [{"size": 1.0}]}, "many[0].name"),
    ({"pair": ["q"]}, "pair"),
    ({"pair": ["q", "1"]}, "pair[1]"),
    ({"by_name": {"a b": {"name": None}}}, 'by_name["a b"].name'),
    ({"x": None}, "x"),
    ({"more": None}, "more"),
)


def test_what_is_of_another_type_is_refused_with_the_path_to_it() -> None:
    for change, path in WRONG:
        with pytest.raises(DecodeError) as refused:
            decode(Machine, DATA | change)
        assert str(refused.value).startswith(f"{path} is "), change
        assert len(str(refused.value)) < 150


@pytest.mark.parametrize("key", sorted(DATA))
def test_every_key_must_be_there_that_is_not_left_out_at_its_default(key: str) -> None:
    with pytest.raises(DecodeError, match=f"{key} is missing"):
        decode(Machine, {name: value for name, value in DATA.items() if name != key})


@dataclass(frozen=True)
class Went:
    where: str


@dataclass(frozen=True)
class Stayed:
    pass


@dataclass(frozen=True)
class Switch:
    do: Literal["on", "off"]


EVENTS = TaggedUnion[Went | Stayed]("event", (Went, Stayed))
REQUESTS = TaggedUnion[Switch]("do", (Switch,))


def test_a_message_is_recognised_by_its_tag() -> None:
    assert EVENTS.line(Went("home")) == '{"event": "Went", "where": "home"}\n'
    assert REQUESTS.line(Switch("off")) == '{"do": "off"}\n'
    for message in (Went("home"), Stayed()):
        assert EVENTS.read(EVENTS.line(message)) == message
    assert REQUESTS.read(b'{"do": "on"}') == Switch("on")


@pytest.mark.parametrize(
    "line", ["", "{", "[]", "7", "{}", '{"event": 1}', '{"event": "Lost"}', '{"event": "Went"}']
)
def test_a_line_that_is_no_message_is_refused(line: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 (JSON's own, or DecodeError)
        EVENTS.read(line)
