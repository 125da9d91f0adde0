"""What one sensor makes of its preset: its options decided, its frames, and who publishes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, Note, RejectedError, Span, did_you_mean, finding

if TYPE_CHECKING:
    from tfcompose.language.preset import Option, PresetFrame, PresetSpec
    from tfcompose.language.robot import SensorSpec
    from tfcompose.load import Path, Source
    from tfcompose.resolve.library import Library

DRIVER, TFCOMPOSE = "driver", "tfcompose"


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor with its preset, and its options decided. ``tf`` is who publishes the frames that a driver can."""

    name: str
    spec: SensorSpec
    preset: PresetSpec
    options: dict[str, Any]
    tf: str = TFCOMPOSE

    def named(self, pattern: str) -> str:
        """Return a preset's name with the sensor's in it."""
        return filled(pattern, self.name, self.preset.words)

    def holds(self, condition: dict[str, Any]) -> bool:
        """Return whether every option has, or holds, the value that the condition names."""
        return holds(condition, self.options, self.tf)

    def frames(self) -> dict[str, PresetFrame]:
        """Return the frames that this sensor has, by their final names before any renaming."""
        return {self.named(name): frame for name, frame in self.preset.frames.items() if self.holds(frame.when)}

    def parent_of(self, name: str, frame: PresetFrame) -> str:
        """Return the frame's parent before any renaming: as the user says, or where its publisher hangs it."""
        own = self.spec.frames.get(name)
        if own and own.parent:
            return own.parent
        return self.named(frame.by_driver.parent if frame.by_driver and self.tf == DRIVER else frame.parent)

    def driven(self) -> dict[str, PresetFrame]:
        """Return those of its frames that the driver can publish."""
        return {name: frame for name, frame in self.frames().items() if frame.driver}


def filled(pattern: str, name: str, words: dict[str, str]) -> str:
    """Return the pattern with the sensor's name and the preset's words in it."""
    for word, means in words.items():
        pattern = pattern.replace(f"{{{word}}}", means)
    return pattern.replace("{name}", name)


def holds(condition: dict[str, Any], options: dict[str, Any], tf: str) -> bool:
    """Return whether every option has, or holds, the value that the condition names; ``tf`` counts as one."""
    for option, wanted in condition.items():
        value = tf if option == "tf" else options.get(option)
        every = wanted if isinstance(wanted, list) else [wanted]
        if not all(one in value if isinstance(value, (list, tuple)) else one == value for one in every):
            return False
    return True


def sensor_of(name: str, spec: SensorSpec, library: Library, source: Source) -> tuple[Sensor | None, list[Finding]]:
    """Return the sensor with its preset and options, or None and why not."""
    at: Path = ("sensors", name)
    span = source.at((*at, "preset"))
    try:
        plain = library.get(spec.preset)
        options, found = decided(plain, spec, at, source)
        choices = {key: options[key] for key, option in plain.options.items() if option.type == "choice"}
        preset = library.get(spec.preset, choices)
    except KeyError:
        return None, [_no_preset(spec.preset, library, span)]
    except RejectedError as error:
        return None, list(error.findings)
    hidden = library.hides(spec.preset)
    if hidden:
        message = f"{spec.preset} is {library.file(spec.preset)}, which stands before tfcompose's own preset"
        notes = [Note("its own", Span(hidden))]
        found.append(finding("TF607", message, span, notes=notes, help="give it another name", severity="warning"))
    sensor = Sensor(name, spec, preset, options, DRIVER)
    if _publisher(sensor) == TFCOMPOSE:
        sensor = Sensor(name, spec, preset, options, TFCOMPOSE)
    return sensor, found


def _no_preset(name: str, library: Library, span: Span) -> Finding:
    names = library.names
    vendor = name.partition("/")[0]
    same = [one for one in names if one.startswith(f"{vendor}/")]
    there = f"of {vendor} there is {', '.join(same)}" if same else "tfcompose presets lists them"
    return finding("TF601", f"no preset {name}", span, help=did_you_mean(name, same or names, there))


def _publisher(sensor: Sensor) -> str:
    """Return who publishes the frames that a driver can: as said, or as the vendor's driver does by default."""
    driver, own = sensor.preset.driver, sensor.spec.driver
    if driver is None or (own and own.process == "none"):
        return TFCOMPOSE
    if not sensor.driven():
        return TFCOMPOSE
    return sensor.spec.tf or driver.tf


def decided(preset: PresetSpec, spec: SensorSpec, at: Path, source: Source) -> tuple[dict[str, Any], list[Finding]]:
    """Return the value of each of the preset's options, and what is wrong with those that are given."""
    options = {key: option.default for key, option in preset.options.items()}
    found = []
    for key, value in spec.options.items():
        place = source.at((*at, "options", key))
        if key not in preset.options:
            there = f"{spec.preset} has {', '.join(preset.options)}" if preset.options else f"{spec.preset} has none"
            advice = did_you_mean(key, preset.options, there)
            found.append(finding("TF603", f"{spec.preset} has no option {key}", place, help=advice))
            continue
        chosen = _as_text(value) if preset.options[key].type == "choice" else value
        refusal = _refusal(preset.options[key], key, chosen, place)
        if refusal:
            found.append(refusal)
        else:
            options[key] = chosen
    return options, found


def _as_text(value: Any) -> Any:
    """Return what stands for a variant's name: a number or true as it is written."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, (int, float)) else value


def _refusal(option: Option, key: str, value: Any, place: Span) -> Finding | None:
    if option.type == "bool" and not isinstance(value, bool):
        return finding("TF603", f"the option {key} is {value!r}", place, help="true or false")
    if option.type == "text" and not isinstance(value, str):
        return finding("TF603", f"the option {key} is {value!r}, not a text", place, help="put it in quotes")
    if option.type == "choice" and value not in option.variants:
        advice = did_you_mean(str(value), option.variants, f"one of: {', '.join(option.variants)}")
        return finding("TF603", f"the option {key} cannot be {value!r}", place, help=advice)
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
