"""Slotted dataclasses that are made in a quarter of the time, frozen or not.

``dataclasses`` writes and compiles six methods for each class, and that was a third of what ``lint`` cost. Here only
``__init__`` is written, for each class of which there are objects; the other methods are the same functions for all.
The classes are dataclasses to ``fields`` and ``replace``, to type checkers, and to those who use them.
"""

from __future__ import annotations

from dataclasses import MISSING, FrozenInstanceError, fields
from dataclasses import dataclass as _dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import Field
    from dataclasses import dataclass as dataclass  # noqa: PLC0414 (exported: to a type checker it is the real one)
else:

    def dataclass(**how: bool) -> Callable[[type], type]:
        """Return what makes a class a dataclass; quickly, if it is to have slots and may be frozen, and no more."""
        if how == {"frozen": True, "slots": True}:
            return _frozen
        return _slotted if how == {"slots": True} else _dataclass(**how)


def _frozen(cls: type) -> Any:
    for name, method in _METHODS.items():
        if name not in vars(cls):
            setattr(cls, name, method)
    made: Any = _dataclass(init=False, repr=False, eq=False, slots=True)(cls)
    made.__init__ = _init_at_first_use(made)
    return made


def _slotted(cls: type) -> Any:
    cls.__eq__ = _equal  # type: ignore[assignment,method-assign]
    cls.__repr__ = _shown  # type: ignore[assignment,method-assign]
    cls.__hash__ = None  # type: ignore[assignment] # it changes
    return _dataclass(repr=False, eq=False, slots=True)(cls)


def _init_at_first_use(cls: type) -> Callable[..., None]:
    """Return the method that is written when the first object is made: a run makes objects of half the classes."""

    def init(self: Any, *values: Any, **named: Any) -> None:
        cls.__init__ = _init_of(cls)  # type: ignore[misc]
        cls.__init__(self, *values, **named)  # type: ignore[misc]

    return init


def _init_of(cls: type) -> Callable[..., None]:
    """Return the method that takes the fields in their order and sets them once."""
    given: dict[str, Any] = {"_set": object.__setattr__}
    head, body = ["self"], ["pass"]
    for field in fields(cls):
        head.append(_parameter(field, given))
        made = f"_{field.name}() if {field.name} is _{field.name} else {field.name}"
        value = field.name if field.default_factory is MISSING else made
        body.append(f"_set(self, {field.name!r}, {value})")
    exec(f"def __init__({', '.join(head)}):\n " + "\n ".join(body), given)  # noqa: S102 (names of fields only)
    init: Callable[..., None] = given["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    return init


def _parameter(field: Field[Any], given: dict[str, Any]) -> str:
    default = field.default if field.default_factory is MISSING else field.default_factory
    if default is MISSING:
        return field.name
    given[f"_{field.name}"] = default
    return f"{field.name}=_{field.name}"


def _values(self: Any) -> tuple[Any, ...]:
    """Return the values that are compared."""
    cls = type(self)
    read = _READERS.get(cls)
    if read is None:
        names = [field.name for field in fields(cls) if field.compare]
        read = attrgetter(*names) if len(names) > 1 else lambda one: tuple(getattr(one, name) for name in names)
        _READERS[cls] = read
    values: tuple[Any, ...] = read(self)
    return values


#: How the values of a class are read, once it was asked for.
_READERS: dict[type, Callable[[Any], tuple[Any, ...]]] = {}


def _equal(self: Any, other: object) -> Any:
    return _values(self) == _values(other) if type(other) is type(self) else NotImplemented


def _hash(self: Any) -> int:
    return hash(_values(self))


def _shown(self: Any) -> str:
    values = (f"{field.name}={getattr(self, field.name)!r}" for field in fields(self) if field.repr)
    return f"{type(self).__qualname__}({', '.join(values)})"


def _refuse(self: Any, name: str, *_: object) -> NoReturn:
    raise FrozenInstanceError(f"cannot change {name} of a {type(self).__name__}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, field.name) for field in fields(self)]


def _set_state(self: Any, state: list[Any]) -> None:
    for field, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)


_METHODS: dict[str, Callable[..., Any]] = {
    "__eq__": _equal,
    "__hash__": _hash,
    "__repr__": _shown,
    "__setattr__": _refuse,
    "__delattr__": _refuse,
    "__getstate__": _state,
    "__setstate__": _set_state,
}
