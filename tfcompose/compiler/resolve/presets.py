"""Presets: their files, their content including extended presets, and a sensor's options.

A preset's file is read only when the preset is used. Folders are listed only for a wrong name, or
to list all presets. Presets of nodes belong to the program and are stored next to its code.
"""

from __future__ import annotations

import pathlib
import posixpath
import re
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

from tfcompose.foundation.findings import (
    Finding,
    Note,
    RejectedError,
    Span,
    did_you_mean,
    finding,
    nearest,
)
from tfcompose.spec.language import load_named, validate_file, validate_preset
from tfcompose.spec.language.node_preset import NodePresetSpec
from tfcompose.spec.language.overlay import extended_preset, lay_over, without
from tfcompose.spec.language.preset import PresetSpec
from tfcompose.spec.load import load

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Mapping

    from tfcompose.spec.language.preset import PresetFrame, PresetOption
    from tfcompose.spec.language.process import NamedNode
    from tfcompose.spec.language.robot import RobotSpec, SensorSpec
    from tfcompose.spec.load import Path, Source


DRIVER, TFCOMPOSE = "driver", "tfcompose"


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor, with its preset and the values of the preset's options."""

    name: str
    spec: SensorSpec
    preset: PresetSpec
    options: dict[str, Any]
    #: The publisher of frames that the driver can publish.
    tf: str = TFCOMPOSE

    def fill_name(self, pattern: str) -> str:
        """Return a name pattern of the preset with the sensor's name inserted."""
        return fill_name(pattern, self.name, self.preset.words)

    def holds(self, condition: dict[str, Any]) -> bool:
        """Return whether every option has, or contains, the value in the condition."""
        return holds(condition, self.options, self.tf)

    def frames(self) -> dict[str, PresetFrame]:
        """Return the sensor's frames by their names, before any renaming."""
        return {
            self.fill_name(name): frame
            for name, frame in self.preset.frames.items()
            if self.holds(frame.when)
        }

    def parent_of(self, name: str, frame: PresetFrame) -> str:
        """Return the parent of a frame, before any renaming.

        The robot file's parent takes precedence, then the parent that the frame's publisher uses.
        """
        override = self.spec.frames.get(name)
        if override and override.parent:
            return override.parent
        return self.fill_name(
            frame.by_driver.parent if frame.by_driver and self.tf == DRIVER else frame.parent
        )

    def driver_frames(self) -> dict[str, PresetFrame]:
        """Return the sensor's frames that the driver can publish."""
        return {name: frame for name, frame in self.frames().items() if frame.driver}


def fill_name(pattern: str, name: str, words: dict[str, str]) -> str:
    """Return the pattern with the sensor's name and the preset's words inserted."""
    for hole, means in words.items():
        pattern = pattern.replace(f"{{{hole}}}", means)
    return pattern.replace("{name}", name)


def holds(condition: dict[str, Any], options: dict[str, Any], tf: str) -> bool:
    """Return whether every option has, or contains, the value in the condition.

    ``tf`` counts as an option.
    """
    for option, expected in condition.items():
        value = tf if option == "tf" else options.get(option)
        every = expected if isinstance(expected, list) else [expected]
        chosen = value if isinstance(value, (list, tuple)) else [value]
        if not all(item in chosen for item in every):
            return False
    return True


def sensor_of(
    name: str, declared: SensorSpec, library: Library, spec: RobotSpec
) -> Generator[Finding, None, Sensor | None]:
    """Return the sensor with its preset and options, None without a valid preset."""
    path: Path = ("sensors", name)
    span = spec.span_of((*path, "preset"))
    try:
        plain = library.get(declared.preset)
        options, refusals = decide_options(plain, declared, path, spec)
        choices = {
            key: options[key] for key, option in plain.options.items() if option.type == "choice"
        }
        preset = library.get(declared.preset, choices)
    except KeyError:
        yield _no_preset(declared.preset, library, span)
        return None
    except RejectedError as error:
        yield from error.findings
        return None
    yield from refusals
    hidden = library.hides(declared.preset)
    if hidden:
        message = (
            f"{declared.preset} is {library.file(declared.preset)}, which takes precedence over"
            " tfcompose's own preset"
        )
        notes = [Note("its own", Span(hidden))]
        yield finding("TF607", message, span, notes=notes, help="give it another name")
    sensor = Sensor(name, declared, preset, options, DRIVER)
    if _publisher(sensor) == TFCOMPOSE:
        sensor = Sensor(name, declared, preset, options, TFCOMPOSE)
    return sensor


_OWN = "tfcompose help presets shows how to write one"


def _no_preset(name: str, library: Library, span: Span) -> Finding:
    names = library.names
    vendor = name.partition("/")[0]
    same = [name for name in names if name.startswith(f"{vendor}/")]
    otherwise = (
        f"presets of {vendor}: {', '.join(same)}"
        if same
        else f"tfcompose presets lists them; {_OWN}"
    )
    models = [
        candidate
        for candidate in names
        if candidate.rpartition("/")[2] == name.rpartition("/")[2].lower()
    ]
    advice = (
        f"did you mean {' or '.join(models)}?"
        if models and not same
        else did_you_mean(name, same or names, otherwise)
    )
    return finding("TF601", f"unknown preset {name}", span, help=advice)


def _publisher(sensor: Sensor) -> str:
    """Return the publisher of frames that the driver can publish.

    This is the value of ``tf``, otherwise the default of the vendor's driver.
    """
    driver, override = sensor.preset.driver, sensor.spec.driver
    if driver is None or (override and override.process == "none"):
        return TFCOMPOSE
    if not sensor.driver_frames():
        return TFCOMPOSE
    return sensor.spec.tf or driver.tf


def decide_options(
    preset: PresetSpec, declared: SensorSpec, path: Path, spec: RobotSpec
) -> tuple[dict[str, Any], list[Finding]]:
    """Return the values of the preset's options, and findings about invalid values."""
    options = {key: option.default for key, option in preset.options.items()}
    findings = []
    for key, value in declared.options.items():
        span = spec.span_of((*path, "options", key))
        if key not in preset.options:
            otherwise = (
                f"{declared.preset} has {', '.join(preset.options)}"
                if preset.options
                else f"{declared.preset} has none"
            )
            advice = did_you_mean(key, preset.options, otherwise)
            findings.append(
                finding("TF603", f"{declared.preset} has no option {key}", span, help=advice)
            )
            continue
        chosen = _as_text(value) if preset.options[key].type == "choice" else value
        refusal = _refusal(preset.options[key], key, chosen, span)
        if refusal:
            findings.append(refusal)
        else:
            options[key] = chosen
    return options, findings


def _as_text(value: Any) -> Any:
    """Return the value as text in a variant's name."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, (int, float)) else value


def _refusal(option: PresetOption, key: str, value: Any, span: Span) -> Finding | None:
    if option.type == "bool" and not isinstance(value, bool):
        return finding("TF603", f"the option {key} is {value!r}", span, help="true or false")
    if option.type == "text" and not isinstance(value, str):
        return finding(
            "TF603", f"the option {key} is {value!r}, not a string", span, help="put it in quotes"
        )
    if option.type == "choice" and value not in option.variants:
        advice = did_you_mean(str(value), option.variants, f"one of: {', '.join(option.variants)}")
        return finding("TF603", f"the option {key} cannot be {value!r}", span, help=advice)
    if option.type != "set":
        return None
    values = ", ".join(option.values)
    if not isinstance(value, list):
        return finding(
            "TF603", f"the option {key} is not a list", span, help=f"a list of some of: {values}"
        )
    for item in value:
        if item not in option.values:
            advice = did_you_mean(str(item), option.values, f"one of: {values}")
            return finding("TF603", f"the option {key} cannot hold {item!r}", span, help=advice)
    return None


#: A name, vendor/model. A model that begins with _ can only be extended. nodes/ holds no sensors.
_NAME = re.compile(r"(?!nodes/)[A-Za-z0-9][A-Za-z0-9_.-]*/_?[A-Za-z0-9][A-Za-z0-9_.-]*")
_DEEPEST = 8


class Storage(Protocol):
    """Access to the folders and files of presets."""

    def has(self, path: str) -> bool:
        """Return whether the file exists."""

    def is_folder(self, path: str) -> bool:
        """Return whether the folder exists."""

    def read(self, path: str) -> str:
        """Return the text of the file.

        Raises:
            RejectedError: if the file cannot be read.
        """

    def models(self, folder: str) -> list[str]:
        """Return the names, vendor/model, of the presets in the folder."""

    def packages(self) -> list[str]:
        """Return the preset folders in installed Python packages.

        This lookup is slow, so callers do it only when needed.
        """


@dataclass(slots=True)
class Library:
    """Presets in folders.

    Earlier folders take precedence; folders of Python packages come last.
    """

    folders: tuple[str, ...]
    storage: Storage
    #: The folder of the presets that come with tfcompose; empty: none.
    built_in: str = ""
    _sources: dict[str, Source] = field(default_factory=dict)
    _specs: dict[tuple[str, tuple[tuple[str, str], ...]], PresetSpec] = field(default_factory=dict)
    _files: dict[str, str | None] = field(default_factory=dict)

    def over(self, folders: Iterable[str]) -> Library:
        """Return a library that searches ``folders`` first."""
        return Library(
            (*map(posixpath.normpath, folders), *self.folders), self.storage, self.built_in
        )

    @property
    def names(self) -> list[str]:
        """The names of all presets, sorted."""
        models = {name for folder in self._all() for name in self.storage.models(folder)}
        return sorted(name for name in models if "/_" not in name and _NAME.fullmatch(name))

    def file(self, name: str) -> str | None:
        """Return the preset's file, None if no preset has this name."""
        if name not in self._files:
            self._files[name] = self._find(name, self.folders) or self._find_late(name)
        return self._files[name]

    def hides(self, name: str) -> str | None:
        """Return the file of the built-in preset that another preset with this name shadows.

        None if no preset is shadowed.
        """
        mine = self._find(name, (self.built_in,)) if self.built_in else None
        return mine if mine and self.file(name) != mine else None

    def source(self, name: str, deep: int = 0) -> Source:
        """Return the content of the preset, merged over the preset that it extends.

        Raises:
            KeyError: if no preset has this name.
            RejectedError: if the preset, or a preset that it extends, is invalid.
        """
        if name not in self._sources:
            file = self.file(name)
            if file is None:
                raise KeyError(name)
            extension = load_named(self.storage.read(file), file)
            self._sources[name] = self._extend(extension, name, deep)
        return self._sources[name]

    def get(self, name: str, choices: Mapping[str, str] | None = None) -> PresetSpec:
        """Return the preset. ``choices`` are the options that select a variant.

        Raises:
            KeyError: if no preset has this name.
            RejectedError: if the preset is invalid.
        """
        options = tuple(sorted((choices or {}).items()))
        if (name, options) not in self._specs:
            source = self.source(name)
            for option, value in options:
                variant = source.part(("options", option, "variants", value))
                source = lay_over(source, variant, is_overlay=False, of=PresetSpec)
            self._specs[name, options] = validate_preset(source)
        return self._specs[name, options]

    def _extend(self, extension: Source, name: str, deep: int) -> Source:
        base = extended_preset(extension)
        if base is None:
            return extension
        span = extension.span_of(("extends",))
        if deep > _DEEPEST:
            raise RejectedError(
                [finding("TF606", f"{name} extends itself, by way of others", span)]
            )
        if base == name:  # it extends the preset that it shadows
            later = self._later(extension.file)
            below = (
                self._extend(load_named(self.storage.read(later), later), name, deep + 1)
                if later
                else None
            )
        else:
            below = self.source(base, deep + 1) if self.file(base) else None
        if below is None:
            raise RejectedError(
                [finding("TF606", f"{name} extends {base}, which does not exist", span)]
            )
        return lay_over(without(below, "extends"), extension, is_overlay=False, of=PresetSpec)

    def _later(self, file: str) -> str | None:
        """Return the preset file that this file shadows, or None."""
        folder, name = _split(file)
        behind = (*self.folders, *self.storage.packages())
        return self._find(name, behind[behind.index(folder) + 1 :])

    def _all(self) -> tuple[str, ...]:
        return (*self.folders, *self.storage.packages())

    def _find(self, name: str, folders: Iterable[str]) -> str | None:
        paths = (
            (posixpath.join(folder, f"{name}.yaml") for folder in folders)
            if _NAME.fullmatch(name)
            else ()
        )
        return next((path for path in paths if self.storage.has(path)), None)

    def _find_late(self, name: str) -> str | None:
        return self._find(name, self.storage.packages()) if _NAME.fullmatch(name) else None


def _split(file: str) -> tuple[str, str]:
    """Return the folder and the name, vendor/model, of a preset file."""
    rest, model = posixpath.split(file.removesuffix(".yaml"))
    folder, vendor = posixpath.split(rest)
    return folder, f"{vendor}/{model}"


_NODE_PRESETS = pathlib.Path(__file__).parents[2] / "data" / "presets" / "nodes"


@cache
def _node_files() -> dict[str, pathlib.Path]:
    """Return the files of all presets of nodes, PACKAGE/NAME.yaml, by name."""
    return {file.stem: file for file in sorted(_NODE_PRESETS.glob("*/*.yaml"))}


@cache
def node_preset_names() -> tuple[str, ...]:
    """Return the names of all presets of nodes, sorted."""
    return tuple(sorted(_node_files()))


@cache
def node_preset(name: str) -> NodePresetSpec:
    """Return the preset of a node by its name or by PACKAGE/NAME.

    Raises:
        KeyError: if no preset has this name.
        RejectedError: if the preset is invalid.
    """
    package, _, short = name.rpartition("/")
    file = _node_files()[short]
    place = f"presets/nodes/{file.parent.name}/{file.name}"
    preset = validate_file(NodePresetSpec, load(file.read_text("utf-8"), place))
    if package not in {"", preset.package}:
        raise KeyError(name)
    return preset


def is_node_preset(name: str) -> bool:
    """Return whether a preset of a node has this name or this PACKAGE/NAME."""
    try:
        node_preset(name)
    except KeyError:
        return False
    except RejectedError:
        pass
    return True


def unknown_node_preset(name: str, span: Span) -> Finding:
    """Return the finding for an unknown preset of a node."""
    names = node_preset_names()
    return finding(
        "TF601",
        f"unknown node preset {name}",
        span,
        help=did_you_mean(name.rpartition("/")[2], names, f"its frames: {', '.join(names)}"),
    )


def preset_of(node: NamedNode | None) -> str | None:
    """Return the name of the node's preset, None without a preset.

    If the node's name is the PACKAGE/NAME of a preset, the node has that preset.
    """
    if node is None or node.preset is not None:
        return node.preset if node else None
    if node.name is not None and "/" in node.name and is_node_preset(node.name):
        return node.name
    return None


def start_advice(node: NamedNode | None, otherwise: str) -> str:
    """Return advice for a process without a program.

    If the node's name is similar to a preset's PACKAGE/NAME, the advice suggests that preset.
    """
    package, _, short = (node.name or "" if node else "").rpartition("/")
    near = nearest(
        short, [name for name in node_preset_names() if node_preset(name).package == package]
    )
    return f"did you mean node: {package}/{near}? Otherwise {otherwise}" if near else otherwise


def name_of(node: NamedNode | None) -> str | None:
    """Return the node's name, None if that name is only the name of its preset."""
    if node is None or (node.preset is None and preset_of(node)):
        return None
    return node.name
