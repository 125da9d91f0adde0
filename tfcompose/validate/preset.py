"""A sensor's preset: its frames, body and driver as data.

``{name}`` stands for the sensor's name, and in a driver's parameters ``{prefix}`` for the robot's frame prefix.
"""

from __future__ import annotations

from typing import Any

from tfcompose.validate.bodies import Shape
from tfcompose.validate.fields import ANYTHING, BOOLEAN, MASS_, TEXT, choice
from tfcompose.validate.posed import Posed
from tfcompose.validate.schema import Model, key, listing, mapping, record

Condition = dict[str, Any]
CONDITION = mapping(ANYTHING)


class Option(Model):
    """One choice that the user has."""

    type: str = key(choice("set", "bool", "text"))
    values: tuple[str, ...] = key(listing(TEXT), (), "what a set may hold")
    default: Any = key(ANYTHING, None)
    about: str = key(TEXT, "")


class PresetFrame(Posed):
    """A frame inside the sensor, in its parent."""

    parent: str = key(TEXT)
    nominal: bool = key(BOOLEAN, default=False, about="calibration or the device overrides the value")
    driver: bool = key(BOOLEAN, default=False, about="the driver publishes this edge unless it is switched off")
    when: Condition = key(CONDITION, {}, "option → the value that it has, or, for a set, holds; all must be true")


class Body(Model):
    """The sensor's body, on one of its frames."""

    frame: str = key(TEXT)
    shape: Shape = key(record(Shape))
    mass: float | None = key(MASS_, None, "where the vendor's is credible; the inertia is computed")


class Chosen(Model):
    """A parameter's value when a condition holds, and otherwise."""

    when: Condition = key(CONDITION)
    value: Any = key(ANYTHING)
    otherwise: Any = key(ANYTHING)


class PresetDriver(Model):
    """The vendor's driver: what is started, and with what."""

    package: str = key(TEXT)
    executable: str = key(TEXT)
    node: str = key(TEXT)
    namespace: str = key(TEXT, "")
    params: dict[str, Any] = key(mapping(ANYTHING), {})
    enable: dict[str, Condition] = key(mapping(CONDITION), {}, "boolean parameters and when they are true")
    choose: dict[str, Chosen] = key(mapping(record(Chosen)), {}, "parameters with one of two values")
    take: dict[str, str] = key(mapping(TEXT), {}, "parameters that take an option's value, if it is given")
    switch: dict[str, Any] | None = key(mapping(ANYTHING), None, "parameters that keep it from publishing frames")


class Fact(Model):
    """Where the figures are from."""

    repo: str = key(TEXT)
    path: str = key(TEXT)
    commit: str = key(TEXT)


class PresetSpec(Model):
    """One model of sensor."""

    preset: int = key(choice(1), about="the version of this language")
    vendor: str = key(TEXT)
    model: str = key(TEXT)
    kind: str = key(TEXT)
    about: str = key(TEXT)
    mount: str = key(TEXT, about="the frame that a person bolts on")
    options: dict[str, Option] = key(mapping(record(Option)), {})
    frames: dict[str, PresetFrame] = key(mapping(record(PresetFrame)), {}, "name → where it is; the mount has no entry")
    body: Body | None = key(record(Body), None)
    driver: PresetDriver | None = key(record(PresetDriver), None)
    source: tuple[Fact, ...] = key(listing(record(Fact)), ())
