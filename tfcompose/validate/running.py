"""What a process runs: an executable, a launch file, a command, or a stand-in for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.expression import inserted
from tfcompose.validate.fields import POSITION, RATE_, SIZE, TEXT, TURN_RATE_, choice, text
from tfcompose.validate.posed import Posed
from tfcompose.validate.quantity import Quantity
from tfcompose.validate.schema import BROKEN, Model, Problems, Type, key, listing, mapping, record, shown

if TYPE_CHECKING:
    from tfcompose.load import Path

LIST = {"type": "array", "items": {"type": "string"}}


def _word(value: Any, path: Path, problems: Problems) -> Any:
    return TEXT.read(inserted(value) if isinstance(value, Quantity) else value, path, problems)


#: A text; a computed number is written as one.
WORD = Type(_word, TEXT.schema)


def _arguments(value: Any, path: Path, problems: Problems) -> Any:
    """Read a command's arguments: words, or names with values, as launch files take them."""
    if not isinstance(value, dict):
        return listing(WORD).read(value, path, problems)
    words = [_argument(name, item, (*path, name), problems) for name, item in value.items()]
    return BROKEN if BROKEN in words else tuple(words)


def _argument(name: str, value: Any, path: Path, problems: Problems) -> Any:
    if value is BROKEN or isinstance(value, (dict, list)):
        return value if value is BROKEN else problems.refuse("TF103", path, f"{shown(value)} is no text or number")
    if isinstance(value, Quantity):
        value = int(value.value) if value.value == int(value.value) else value.value
    return f"{name}:={value if isinstance(value, str) else shown(value)}"


ARGUMENTS = Type(_arguments, {"anyOf": [LIST, {"type": "object"}]})


class Run(Model):
    """An installed executable, a launch file, or a command, word by word; no shell reads it."""

    package: str | None = key(TEXT, None, examples=("slam_toolbox",))
    executable: str | None = key(TEXT, None, examples=("async_slam_toolbox_node",))
    launch: str | None = key(
        text(r"[^/]+/[^/]+(/[^/]+)*", "package/file.launch.py"),
        None,
        "a package's launch file, run as one process",
        ("nav2_bringup/navigation_launch.py",),
    )
    args: tuple[str, ...] = key(
        ARGUMENTS, (), "words; for a launch file name: value", (["--verbose"], {"use_composition": False})
    )
    argv: tuple[str, ...] = key(listing(WORD), (), "the whole command instead of package and executable")


class Circle(Model):
    """A body that drives on a circle, counter-clockwise."""

    radius: float = key(SIZE, 1.0)
    speed: float = key(TURN_RATE_, 0.5)


SWEEP = "sweep"


def _positions() -> Type:
    """Return the type of ``zero``, ``sweep``, or joints with a position or ``sweep``."""
    words = choice("zero", SWEEP)
    word = choice(SWEEP)
    one = Type(
        lambda value, path, problems: (word if isinstance(value, str) and value.isalpha() else POSITION).read(
            value, path, problems
        ),
        {"anyOf": [word, POSITION]},
    )
    several = mapping(one)

    def read(value: Any, path: Path, problems: Problems) -> Any:
        if not isinstance(value, str):
            return several.read(value, path, problems)
        said = words.read(value, path, problems)
        return {} if said == "zero" else said

    return Type(read, {"anyOf": [words, several]})


class Simulate(Model):
    """A stand-in for the owner: one of circle, fixed and joints."""

    circle: Circle | None = key(record(Circle), None, "drives its edge on a circle")
    fixed: Posed | None = key(record(Posed), None, "sends one pose again and again")
    joints: dict[str, float | str] | str | None = key(
        _positions(), None, "zero, sweep, or joints with a position or sweep; the others are at 0"
    )
    rate: float = key(RATE_, 20.0)
