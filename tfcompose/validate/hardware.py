"""``ros2_control`` and ``xml`` in the language: what drives the joints, and what stands beside them as it is.

Words follow ros2_control's own: a hardware component is a system, an actuator or a sensor; a joint, sensor or gpio has
command interfaces and state interfaces, each with parameters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.validate.fields import BOOLEAN, TEXT, choice, integer
from tfcompose.validate.quantity import NUMBER, Quantity
from tfcompose.validate.schema import BROKEN, Model, Problems, Type, key, mapping, record, shown

if TYPE_CHECKING:
    from tfcompose.load import Path

Scalars = dict[str, Any]


def _scalar(value: Any, path: Path, problems: Problems) -> Any:
    """Return the text that stands in XML: a parameter has no type there."""
    if isinstance(value, Quantity):
        if value.dimension != NUMBER:
            return problems.refuse("TF104", path, f"{shown(value)} has a unit, and a parameter has none")
        value = value.value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (str, int)):
        return str(value)
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)  # noqa: PLR2004 (exact)
    return problems.refuse("TF103", path, f"{shown(value)} is no text, number, true or false")


PARAMS = mapping(Type(_scalar, {"type": ["string", "number", "boolean"]}))


def _interfaces(value: Any, path: Path, problems: Problems) -> Any:
    """Read names of interfaces, or interfaces with parameters."""
    if not isinstance(value, list):
        return _NAMED.read(value, path, problems)
    names = [TEXT.read(name, (*path, index), problems) for index, name in enumerate(value)]
    return BROKEN if BROKEN in names else {name: {} for name in names}


_NAMED = mapping(PARAMS)
INTERFACES = Type(_interfaces, {"anyOf": [{"type": "array", "items": {"type": "string"}}, _NAMED.schema]})


class ComponentSpec(Model):
    """A joint, sensor or gpio of a hardware component."""

    command: dict[str, Scalars] = key(
        INTERFACES, {}, "what it takes", (["velocity"], {"position": {"min": -1, "max": 1}})
    )
    state: dict[str, Scalars] = key(INTERFACES, {}, "what it gives", (["position", "velocity"],))
    params: Scalars = key(PARAMS, {})


class HardwareSpec(Model):
    """A hardware component of ros2_control."""

    plugin: str = key(TEXT, about="the class that drives it", examples=("mock_components/GenericSystem",))
    type: str = key(choice("system", "actuator", "sensor"), "system")
    params: Scalars = key(PARAMS, {}, "the plugin's parameters")
    rw_rate: int | None = key(integer(1, 100_000), None, "read and write so often in a second; left out: as all")
    is_async: bool | None = key(BOOLEAN, None, "read and write in a thread of its own")
    joints: dict[str, ComponentSpec] = key(mapping(record(ComponentSpec)), {}, "by the names of the robot's joints")
    sensors: dict[str, ComponentSpec] = key(mapping(record(ComponentSpec)), {})
    gpios: dict[str, ComponentSpec] = key(mapping(record(ComponentSpec)), {})


def _hardware(value: Any, path: Path, problems: Problems) -> Any:
    """Read a component, and refuse what ros2_control refuses of its type."""
    read = record(HardwareSpec).read(value, path, problems)
    if read is BROKEN:
        return read
    if read.type == "actuator" and len(read.joints) != 1:
        message = f"an actuator has one joint, and this one has {len(read.joints)}"
        problems.refuse("TF106", path, message, "type: system takes any number", on_key=True)
    for section in ("joints", "sensors", "gpios"):
        for name, component in getattr(read, section).items():
            if component.command and (read.type == "sensor" or section == "sensors"):
                advice = "type: system, or gpios" if read.type == "sensor" else "gpios take commands"
                problems.refuse("TF106", (*path, section, name, "command"), "a sensor takes no commands", advice)
    return read


HARDWARE = Type(_hardware, HardwareSpec)


def _xml(value: Any, path: Path, problems: Problems) -> Any:
    """Read raw blocks by name; one text alone is a block without a name."""
    return {"": value} if isinstance(value, str) else _BLOCKS.read(value, path, problems)


_BLOCKS = mapping(TEXT)
XML = Type(_xml, {"anyOf": [{"type": "string"}, _BLOCKS.schema]})
