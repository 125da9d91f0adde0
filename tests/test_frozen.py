"""Classes of ``tfcompose.frozen`` are what ``dataclasses`` makes, and cost less to make."""

from __future__ import annotations

import copy
import dataclasses
import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, fields
from pathlib import Path
from typing import Any, ClassVar

import pytest

from tfcompose import frozen
from tfcompose.diagnostic import Note, Span
from tfcompose.model import Robot


def made_by(module: Any) -> Any:
    dataclass, field = module.dataclass, module.field

    @dataclass(frozen=True, slots=True)
    class Thing:
        """A thing."""

        name: str
        size: float = 1.0
        parts: list[str] = field(default_factory=list)
        place: str = field(default="", compare=False, repr=False)

        @property
        def area(self) -> float:
            return self.size**2

    return Thing


QUICK, REAL = made_by(frozen), made_by(dataclasses)


@pytest.mark.parametrize("thing", [QUICK, REAL], ids=["ours", "dataclasses"])
def test_it_holds_compares_shows_and_replaces_as_a_dataclass_does(thing: Any) -> None:
    one = thing("a", size=2, place="here")
    assert (one.name, one.size, one.parts, one.place, one.area) == ("a", 2, [], "here", 4)
    assert one == thing("a", 2, [], "there") != thing("b", 2)
    assert one != ("a", 2, [], "here")
    assert repr(one).endswith("Thing(name='a', size=2, parts=[])")
    assert thing("a").parts is not thing("a").parts
    for module in (frozen, dataclasses):
        assert module.replace(one, name="b") == thing("b", 2)
    assert dataclasses.is_dataclass(type(one))
    assert dataclasses.asdict(one) == {"name": "a", "size": 2, "parts": [], "place": "here"}
    assert [item.name for item in fields(thing)] == ["name", "size", "parts", "place"]
    assert fields(thing)[0] is fields(thing)[0], "made once"
    match one:
        case thing("a", size):
            assert size == 2
        case _:
            pytest.fail("no match")
    too_few_and_too_many: list[tuple[Any, ...]] = [(), ("a", 1, [], "", 5)]
    for wrong in too_few_and_too_many:
        with pytest.raises(TypeError, match=r"__init__\(\)"):
            thing(*wrong)
    with pytest.raises(TypeError):
        hash(one)  # of its list


@pytest.mark.parametrize("thing", [QUICK, REAL], ids=["ours", "dataclasses"])
def test_nothing_changes_it_and_it_has_no_other_attributes(thing: Any) -> None:
    one = thing("a")
    with pytest.raises(FrozenInstanceError):
        one.name = "b"
    with pytest.raises(FrozenInstanceError):
        del one.name
    with pytest.raises((FrozenInstanceError, TypeError)):  # dataclasses itself stumbles here
        one.other = 1
    assert not hasattr(one, "__dict__")


def test_it_can_be_hashed_copied_and_pickled() -> None:
    note = Note("a", Span("r.yaml", 3))
    again = pickle.loads(pickle.dumps(note))  # noqa: S301 (our own bytes)
    assert again == copy.deepcopy(note) == note
    assert len({again, note, Note("b")}) == 2


def test_two_classes_with_the_same_values_are_not_equal() -> None:
    assert made_by(frozen)("a") != QUICK("a")


@pytest.mark.parametrize("make", [frozen.dataclass, dataclasses.dataclass], ids=["ours", "dataclasses"])
def test_what_is_not_frozen_can_be_changed_and_has_no_hash(make: Any) -> None:
    made = make(slots=True)(type("Counter", (), {"__annotations__": {"count": int}, "__doc__": "Counts."}))
    one = made(1)
    one.count = 2
    assert one == made(2) != made(1)
    assert repr(one) == "Counter(count=2)"
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)


@pytest.mark.parametrize("module", [frozen, dataclasses], ids=["ours", "dataclasses"])
@pytest.mark.parametrize("is_frozen", [True, False], ids=["frozen", "open"])
def test_fields_are_inherited_computed_and_left_out_as_in_dataclasses(module: Any, is_frozen: bool) -> None:  # noqa: FBT001
    @module.dataclass(frozen=is_frozen, slots=True)
    class Base:
        """Has a name."""

        LIMIT: ClassVar[int] = 3
        name: str

    @module.dataclass(frozen=is_frozen, slots=True)
    class Long(Base):
        """Has a length too."""

        size: int = 2
        length: int = module.field(init=False, default=0)

        def __post_init__(self) -> None:
            object.__setattr__(self, "length", len(self.name) * self.size)

    made: Any = Long
    one = made("abc")
    assert (one.name, one.size, one.length, one.LIMIT) == ("abc", 2, 9 - 3, 3)
    assert [item.name for item in fields(made)] == ["name", "size", "length"]
    assert module.replace(one, name="a").length == 2
    assert not hasattr(one, "__dict__")
    with pytest.raises(TypeError):
        made("abc", 2, 6)


@pytest.mark.parametrize("module", [frozen, dataclasses], ids=["ours", "dataclasses"])
@pytest.mark.parametrize("is_frozen", [True, False], ids=["frozen", "open"])
def test_without_eq_an_object_is_equal_to_itself_alone(module: Any, is_frozen: bool) -> None:  # noqa: FBT001
    body: dict[str, Any] = {"__annotations__": {"name": str}, "__doc__": ""}
    made = module.dataclass(frozen=is_frozen, slots=True, eq=False)(type("Key", (), body))
    one, other = made("a"), made("a")
    assert len({one, other, one}) == 2
    assert one != other


@pytest.mark.parametrize("default", [[], {}, dataclasses.field(default=1)], ids=["list", "dict", "a foreign field"])
def test_a_default_that_would_be_shared_or_misread_is_refused(default: Any) -> None:
    with pytest.raises(TypeError, match=r"Thing\.parts"):
        frozen.dataclass(slots=True)(type("Thing", (), {"__annotations__": {"parts": list}, "parts": default}))


def test_making_one_costs_less_than_half() -> None:
    code = """
import sys, time
sys.path.insert(0, sys.argv[1])
import dataclasses
from tfcompose import frozen
def seconds(make):
    began = time.process_time()
    for _ in range(200):
        make(frozen=True, slots=True)(type("A", (), {"__doc__": "", "__annotations__": dict.fromkeys("abcdef", int)}))
    return time.process_time() - began
print(min(seconds(frozen.dataclass) / seconds(dataclasses.dataclass) for _ in range(3)))
"""
    words = [sys.executable, "-c", code, str(Path(__file__).parents[1])]
    said = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60)
    if sys.version_info < (3, 13):  # which writes the methods of a class in one go
        assert float(said.stdout) < 0.6


def test_the_robot_is_one_of_them() -> None:
    assert Robot.__repr__ is QUICK.__repr__
