"""Keys of which a mapping holds one: how a process runs, how a rotation is written, which shape a body has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tfcompose.load.places import Path

ROTATIONS = frozenset({"rpy", "quat_xyzw", "axis_angle", "matrix", "look"})
RUNNING = frozenset({"run", "simulate", "external"})
COMMANDS = (
    *(frozenset({"argv", key}) for key in ("package", "executable", "args", "launch")),
    *(frozenset({"launch", key}) for key in ("package", "executable")),
)
READY = frozenset({"edges", "topic", "service", "lifecycle", "log", "exit", "time"})
SHAPES = frozenset({"box", "cylinder", "sphere", "capsule", "mesh"})
MASSES = frozenset({"mass", "density"})
SIMULATIONS = frozenset({"circle", "fixed", "joints"})

PARTS = frozenset({"spec", "urdf", "xacro"})

_POSES: tuple[tuple[str, ...], ...] = (
    ("frames", "*"),
    ("links", "*"),
    ("links", "*", "visual"),
    ("links", "*", "collision"),
    ("links", "*", "inertial"),
    ("joints", "*"),
    ("sensors", "*"),
    ("parts", "*"),
    ("sensors", "*", "frames", "*"),
    ("processes", "*", "simulate", "fixed"),
)
_PROCESSES: tuple[tuple[str, ...], ...] = (("processes", "*"), ("sensors", "*", "driver"))

#: Where a mapping stands (``*`` is any name), and the keys of which it can hold one.
CHOICES: tuple[tuple[tuple[str, ...], frozenset[str]], ...] = (
    *((place, ROTATIONS) for place in _POSES),
    *(((*place, "run"), choice) for place in _PROCESSES for choice in COMMANDS),
    *((place, RUNNING) for place in _PROCESSES),
    *(((*place, "ready"), READY) for place in _PROCESSES),
    *((("processes", "*"), frozenset({"nodes", key})) for key in ("node", "lifecycle")),
    (("processes", "*", "simulate"), SIMULATIONS),
    (("links", "*", "visual"), SHAPES),
    (("links", "*", "collision"), SHAPES),
    (("links", "*", "inertial"), MASSES),
    (("parts", "*"), PARTS),
)


def choices_at(path: Path, data: dict[str, Any]) -> list[frozenset[str]]:
    """Return the choices that a mapping at the path makes: of each, it holds a key with a value."""
    return [
        keys
        for pattern, keys in CHOICES
        if len(pattern) == len(path)
        and all(want in {"*", step} for want, step in zip(pattern, path, strict=True))
        and any(data.get(key) is not None for key in keys)
    ]
