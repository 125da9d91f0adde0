"""Slotted classes of fields that are made quickly, frozen or not.

``dataclasses`` imports ``inspect``, and writes and compiles six methods for each class: that was a third of what
``lint`` cost. Here only ``__init__`` is written, for each class of which there are objects; the other methods are the
same functions for all. The classes are dataclasses to ``dataclasses`` itself, to type checkers, and to those who use
them.
"""

from __future__ import annotations

from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:  # to a type checker they are the real ones
    from collections.abc import Callable
    from dataclasses import dataclass as dataclass  # noqa: PLC0414 (exported)
    from dataclasses import field as field  # noqa: PLC0414 (exported)
    from dataclasses import replace as replace  # noqa: PLC0414 (exported)
else:

    def dataclass(*, frozen: bool = False, slots: bool, eq: bool = True) -> Callable[[type], type]:
        """Return what makes a class a dataclass: slotted, frozen or not, equal by its fields or by identity."""
        if not slots:
            raise TypeError("slots=True: these classes have slots")
        equal = {"__eq__": _equal, "__hash__": _hash if frozen else None}
        methods = (_FROZEN if frozen else _OPEN) | (equal if eq else {})
        return lambda cls: _made(cls, methods)

    def field(**how: Any) -> _Field:
        """Return what is said of a field, in ``dataclasses``' words: default, default_factory, init, repr, compare."""
        return _Field(**how)

    def replace(one: Any, /, **changes: Any) -> Any:
        """Return a new object of the same class with other values of some fields."""
        own = getattr(type(one), "__own_fields__", None)
        if own is None:
            return import_module("dataclasses").replace(one, **changes)
        values = {name: getattr(one, name) for name, said in own.items() if said.init and name not in changes}
        return type(one)(**values, **changes)


_MISSING: Any = object()


class _Field:
    """What is said of a field."""

    __slots__ = ("compare", "default", "default_factory", "init", "repr", "type")

    def __init__(
        self,
        *,
        default: Any = _MISSING,
        default_factory: Any = _MISSING,
        init: bool = True,
        repr: bool = True,  # noqa: A002 (its name there)
        compare: bool = True,
    ) -> None:
        self.default, self.default_factory = default, default_factory
        self.init, self.repr, self.compare = init, repr, compare
        self.type: Any = None


class _Late:
    """An attribute of a class that ``dataclasses`` looks for; made when it does."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, _: object, cls: type) -> Any:
        real = import_module("dataclasses")
        own: dict[str, _Field] = cls.__own_fields__  # type: ignore[attr-defined]
        body: dict[str, Any] = {"__annotations__": {name: said.type for name, said in own.items()}, "__doc__": ""}
        for name, said in own.items():
            given = {key: getattr(said, key) for key in ("default", "default_factory", "init", "repr", "compare")}
            body[name] = real.field(**{key: value for key, value in given.items() if value is not _MISSING})
        frozen = cls.__setattr__ is _refuse
        made = getattr(real.dataclass(repr=False, eq=False, frozen=frozen)(type(cls.__name__, (), body)), self.name)
        setattr(cls, self.name, made)  # from now on it is found without this
        return made


def _made(cls: type, methods: dict[str, Any]) -> type:
    """Return the class anew, with slots for its fields and with those of the methods that it does not write itself.

    Raises:
        TypeError: if a default can be changed, or is said with ``dataclasses.field``.
    """
    new = {
        name: _field_of(cls, name, kind) for name, kind in cls.__annotations__.items() if "ClassVar" not in str(kind)
    }
    inherited: dict[str, _Field] = getattr(cls, "__own_fields__", {})
    own = inherited | new
    body = {key: value for key, value in vars(cls).items() if key not in {*new, "__dict__", "__weakref__"}}
    body |= {name: method for name, method in methods.items() if name not in body}
    body["__slots__"] = tuple(name for name in new if name not in inherited)
    body["__own_fields__"] = own
    body["__match_args__"] = tuple(name for name, said in own.items() if said.init)
    body["__dataclass_fields__"] = _Late("__dataclass_fields__")
    body["__dataclass_params__"] = _Late("__dataclass_params__")
    body["__qualname__"] = cls.__qualname__
    made: Any = type(cls)(cls.__name__, cls.__bases__, body)
    if "__init__" not in vars(cls):
        made.__init__ = _init_at_first_use(made)
    return made  # type: ignore[no-any-return]


def _field_of(cls: type, name: str, kind: Any) -> _Field:
    said = vars(cls).get(name, _MISSING)
    if type(said).__module__ == "dataclasses":
        raise TypeError(f"{cls.__name__}.{name}: take field from tfcompose.frozen")
    if not isinstance(said, _Field):
        if said is not _MISSING and type(said).__hash__ is None:
            raise TypeError(f"{cls.__name__}.{name}: a default that can be changed; take default_factory")
        said = _Field(default=said)
    said.type = kind
    return said


def _init_at_first_use(cls: type) -> Callable[..., None]:
    """Return the method that is written when the first object is made: a run makes objects of half the classes."""

    def init(self: Any, *values: Any, **named: Any) -> None:
        cls.__init__ = _init_of(cls)  # type: ignore[misc]
        cls.__init__(self, *values, **named)  # type: ignore[misc]

    return init


def _init_of(cls: Any) -> Callable[..., None]:
    """Return the method that takes the fields in their order and sets them once."""
    given: dict[str, Any] = {"_set": object.__setattr__}
    head, body = ["self"], ["pass"]
    for name, said in cls.__own_fields__.items():
        value = name
        if said.default_factory is not _MISSING:
            given[f"_{name}"] = said.default_factory
            value = f"_{name}() if {name} is _{name} else {name}" if said.init else f"_{name}()"
        elif said.default is not _MISSING:
            given[f"_{name}"] = said.default
            value = name if said.init else f"_{name}"
        elif not said.init:
            continue
        if said.init:
            head.append(f"{name}=_{name}" if f"_{name}" in given else name)
        body.append(f"_set(self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        body.append("self.__post_init__()")
    exec(f"def __init__({', '.join(head)}):\n " + "\n ".join(body), given)  # noqa: S102 (names of fields only)
    init: Callable[..., None] = given["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    return init


def _values(self: Any) -> tuple[Any, ...]:
    """Return the values that are compared."""
    cls = type(self)
    read = _READERS.get(cls)
    if read is None:
        names = [name for name, said in cls.__own_fields__.items() if said.compare]
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
    own = type(self).__own_fields__
    values = (f"{name}={getattr(self, name)!r}" for name, said in own.items() if said.repr)
    return f"{type(self).__qualname__}({', '.join(values)})"


def _refuse(self: Any, name: str, *_: object) -> NoReturn:
    raise import_module("dataclasses").FrozenInstanceError(f"cannot change {name} of a {type(self).__name__}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, name) for name in type(self).__own_fields__]


def _set_state(self: Any, state: list[Any]) -> None:
    for name, value in zip(type(self).__own_fields__, state, strict=True):
        object.__setattr__(self, name, value)


_OPEN: dict[str, Any] = {"__repr__": _shown}
_FROZEN: dict[str, Any] = {
    "__repr__": _shown,
    "__setattr__": _refuse,
    "__delattr__": _refuse,
    "__getstate__": _state,
    "__setstate__": _set_state,
}
