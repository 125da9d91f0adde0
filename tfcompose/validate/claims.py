"""What nodes publish by themselves: claims on edges, written by hand or as presets of known nodes.

In a preset ``{map}``, ``{odom}`` … stand for the frames of the robot that have these roles.
"""

from __future__ import annotations

from typing import Any

from tfcompose.validate.fields import ANYTHING, BOOLEAN, TEXT, choice
from tfcompose.validate.preset import Fact
from tfcompose.validate.schema import Model, Problems, Type, key, listing, mapping, record

_PARAMETERS = mapping(ANYTHING)


def _off(value: Any, path: Any, problems: Problems) -> Any:
    if value == "none":
        return {}
    return _PARAMETERS.read(value, path, problems)


OFF = Type(_off, {"anyOf": [{"const": "none"}, _PARAMETERS.schema]})


class ClaimSpec(Model):
    """An edge that a node publishes by default, and the parameters that stop it."""

    parent: str = key(TEXT, about="a frame", examples=("odom",))
    child: str = key(TEXT, about="a frame", examples=("base_link",))
    off: dict[str, Any] = key(OFF, about="parameters that stop it; none: there are none", examples=("none",))
    on: dict[str, Any] = key(_PARAMETERS, {}, "parameters that start it")
    by_default: bool = key(BOOLEAN, default=True, about="false: it publishes the edge only if it is told to")
    static: bool = key(BOOLEAN, default=False, about="it sends the edge on /tf_static")
    chosen_by: dict[str, Any] = key(_PARAMETERS, {}, "parameters that choose this one out of several")


class Role(Model):
    """A frame that a node is told by name."""

    parameter: str | None = key(TEXT, None, "the parameter that holds its name; left out: it cannot be told")
    default: str = key(TEXT, about="the name without the parameter")


class NodePresetSpec(Model):
    """One node that publishes TF: which edges, from which parameters their names come, and how it is stopped."""

    preset: int = key(choice(1), about="the version of this language")
    node: str = key(TEXT, about="its own name")
    package: str = key(TEXT)
    about: str = key(TEXT)
    frames: dict[str, Role] = key(mapping(record(Role)), {}, "role → the parameter that names its frame")
    publishes: tuple[ClaimSpec, ...] = key(listing(record(ClaimSpec)))
    one_of: bool = key(BOOLEAN, default=False, about="it publishes one of the edges, never two")
    set: dict[str, Any] = key(_PARAMETERS, {}, "parameters without which the names would not be as they are told")
    hint: str = key(TEXT, "", "where its switch is, if not among the parameters that can be given at the start")
    source: tuple[Fact, ...] = key(listing(record(Fact)))
