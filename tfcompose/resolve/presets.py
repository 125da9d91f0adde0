"""Presets by name, and what one sensor makes of one: its frames, its driver's parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tfcompose.diagnostic import Diagnostic, RejectedError, Span, did_you_mean, finding
from tfcompose.load import load
from tfcompose.validate import validate_preset

if TYPE_CHECKING:
    from collections.abc import Callable

    from tfcompose.load import Path, Source
    from tfcompose.validate.preset import Option, PresetFrame, PresetSpec
    from tfcompose.validate.spec import SensorSpec


class Library:
    """The presets that are known: their names, and a reader that gives the text and the file of one."""

    def __init__(self, names: tuple[str, ...], read: Callable[[str], tuple[str, str]]) -> None:
        self.names = names
        self._read = read
        self._known: dict[str, PresetSpec] = {}

    def get(self, name: str) -> PresetSpec:
        """Return the preset.

        Raises:
            KeyError: if there is none of that name.
            RejectedError: if the preset itself is wrong.
        """
        if name not in self.names:
            raise KeyError(name)
        if name not in self._known:
            text, file = self._read(name)
            self._known[name] = validate_preset(load(text, file))
        return self._known[name]


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor with its preset, and its options decided."""

    name: str
    spec: SensorSpec
    preset: PresetSpec
    options: dict[str, Any]

    def named(self, pattern: str) -> str:
        """Return a preset's name with the sensor's in it."""
        return pattern.replace("{name}", self.name)

    def holds(self, condition: dict[str, Any]) -> bool:
        """Return whether every option has, or holds, the value that the condition names."""
        for option, wanted in condition.items():
            value = self.options.get(option)
            if not (wanted in value if isinstance(value, (list, tuple)) else wanted == value):
                return False
        return True

    def frames(self) -> dict[str, PresetFrame]:
        """Return the frames that this sensor has, by their final names before any renaming."""
        return {self.named(name): frame for name, frame in self.preset.frames.items() if self.holds(frame.when)}


def sensor_of(name: str, spec: SensorSpec, library: Library, source: Source) -> tuple[Sensor | None, list[Diagnostic]]:
    """Return the sensor with its preset and options, or None and why not."""
    at: Path = ("sensors", name)
    try:
        preset = library.get(spec.preset)
    except KeyError:
        advice = did_you_mean(spec.preset, library.names, f"there is {', '.join(library.names)}")
        span = source.at((*at, "preset"))
        return None, [finding("TF601", f"no preset {spec.preset}", span, help=advice)]
    except RejectedError as error:
        return None, list(error.diagnostics)
    options = {key: option.default for key, option in preset.options.items()}
    found = []
    for key, value in spec.options.items():
        place = source.at((*at, "options", key))
        if key not in preset.options:
            there = f"{spec.preset} has {', '.join(preset.options)}" if preset.options else f"{spec.preset} has none"
            advice = did_you_mean(key, preset.options, there)
            found.append(finding("TF603", f"{spec.preset} has no option {key}", place, help=advice))
            continue
        refusal = _refusal(preset.options[key], key, value, place)
        if refusal:
            found.append(refusal)
        else:
            options[key] = value
    return Sensor(name, spec, preset, options), found


def _refusal(option: Option, key: str, value: Any, place: Span) -> Diagnostic | None:
    if option.type == "bool" and not isinstance(value, bool):
        return finding("TF603", f"the option {key} is {value!r}", place, help="true or false")
    if option.type == "text" and not isinstance(value, str):
        return finding("TF603", f"the option {key} is {value!r}, not a text", place, help="put it in quotes")
    if option.type != "set":
        return None
    known = ", ".join(option.values)
    if not isinstance(value, list):
        return finding("TF603", f"the option {key} is no list", place, help=f"a list of some of: {known}")
    for item in value:
        if item not in option.values:
            advice = did_you_mean(str(item), option.values, f"there is {known}")
            return finding("TF603", f"the option {key} cannot hold {item!r}", place, help=advice)
    return None


def driver_parameters(sensor: Sensor, *, publishes: bool, prefix: str = "") -> dict[str, Any]:
    """Return the parameters that make the driver do what the spec says; ``publishes`` leaves its TF switched on.

    ``prefix`` is written in front of its frames; parameters that hold it are left out where there is none.
    """
    driver = sensor.preset.driver
    if driver is None:
        return {}
    written = {k: v for k, v in driver.params.items() if prefix or not (isinstance(v, str) and "{prefix}" in v)}
    named = {k: sensor.named(v).replace("{prefix}", prefix) if isinstance(v, str) else v for k, v in written.items()}
    enabled = {name: sensor.holds(condition) for name, condition in driver.enable.items()}
    chosen = {k: c.value if sensor.holds(c.when) else c.otherwise for k, c in driver.choose.items()}
    taken = {k: sensor.options[option] for k, option in driver.take.items() if sensor.options.get(option) is not None}
    return named | enabled | chosen | taken | ({} if publishes else driver.switch or {})
