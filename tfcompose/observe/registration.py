"""Which types can be moved to another frame, and be turned into each other: tf2_ros's registries, by their names.

A package that brings a type of its own adds it here as it would to tf2_ros. What is added holds for the whole program.
"""

from __future__ import annotations

import sys
from copy import deepcopy
from typing import TYPE_CHECKING, Any, ClassVar

from tfcompose.observe.exceptions import TypeException
from tfcompose.observe.stamped import Header
from tfcompose.observe.transforms import TRANSFORMS

if TYPE_CHECKING:
    from collections.abc import Callable

    #: Moves an object by a TransformStamped.
    Move = Callable[[Any, Any], Any]
    Turn = Callable[[Any], Any]


class TransformRegistration:
    """The functions that move objects of a type; messages that are known from the start go by their type's name."""

    _moves: ClassVar[dict[type, Move]] = {}

    def add(self, key: type, callback: Move) -> None:
        """Let ``Buffer.transform`` move objects of a type: ``callback(object, transform)`` returns the moved one."""
        self._moves[key] = callback

    def get(self, key: type) -> Move:
        """Return the function that moves objects of a type.

        Raises:
            TypeException: if there is none.
        """
        move = self._moves.get(key) or TRANSFORMS.get(key.__name__)
        if move is None:
            known = [*TRANSFORMS, *(each.__name__ for each in self._moves)]
            raise TypeException(f"a {key.__name__} cannot be transformed; what can is {', '.join(known)}")
        return move

    def print_me(self) -> None:
        """Print the names of the types that can be moved."""
        sys.stdout.write("\n".join([*TRANSFORMS, *(each.__name__ for each in self._moves)]) + "\n")


class ConvertRegistration:
    """The functions that turn objects of one type into another: directly, or by way of a message."""

    _to_msg: ClassVar[dict[type, Turn]] = {}
    _from_msg: ClassVar[dict[type, Turn]] = {}
    _direct: ClassVar[dict[tuple[type, type], Turn]] = {}

    def add_to_msg(self, key: type, callback: Turn) -> None:
        """Add what makes a message of an object of this type."""
        self._to_msg[key] = callback

    def add_from_msg(self, key: type, callback: Turn) -> None:
        """Add what makes an object of this type of a message."""
        self._from_msg[key] = callback

    def add_convert(self, key: tuple[type, type], callback: Turn) -> None:
        """Add what makes an object of the second type of one of the first."""
        self._direct[key] = callback

    def get_to_msg(self, key: type) -> Turn:
        """Return what makes a message; a message is one.

        Raises:
            TypeException: if there is nothing.
        """
        return self._to_msg.get(key) or _itself(key)

    def get_from_msg(self, key: type) -> Turn:
        """Return what makes an object of this type of a message.

        Raises:
            TypeException: if there is nothing.
        """
        return self._from_msg.get(key) or _itself(key)

    def get_convert(self, key: tuple[type, type]) -> Turn:
        """Return what makes an object of the second type of one of the first.

        Raises:
            TypeException: if there is nothing.
        """
        if key not in self._direct:
            raise TypeException(f"nothing turns a {key[0].__name__} into a {key[1].__name__}")
        return self._direct[key]


def convert(a: Any, b_type: type) -> Any:
    """Return an object as one of another type: directly, as a copy of itself, or by way of a message.

    Raises:
        TypeException: if nothing is registered that does it.
    """
    registry = ConvertRegistration()
    try:
        return registry.get_convert((type(a), b_type))(a)
    except TypeException:
        if type(a) is b_type:
            return deepcopy(a)
    made = registry.get_from_msg(b_type)(registry.get_to_msg(type(a))(a))
    if type(made) is not b_type:
        raise TypeException(f"nothing turns a {type(a).__name__} into a {b_type.__name__}")
    return made


def Stamped(obj: Any, stamp: Any, frame_id: str) -> Any:  # noqa: N802 (tf2_ros's name)
    """Return the object with a header: ROS's where the program has loaded it."""
    made = getattr(sys.modules.get("std_msgs.msg"), "Header", Header)
    obj.header = made(stamp=stamp, frame_id=frame_id)
    return obj


def _itself(key: type) -> Turn:
    if key.__name__ not in TRANSFORMS:
        raise TypeException(f"a {key.__name__} cannot be turned into a message, nor made of one")
    return lambda message: message
