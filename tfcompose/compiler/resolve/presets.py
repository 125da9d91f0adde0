"""Presets: their files, their contents with all they extend, and a sensor's options.

A preset is looked up when it is used. Folders are listed only for a wrong name, or to list all
presets. Presets of nodes are part of the program, next to its code.
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
    """A sensor with its preset and the values of its options."""

    name: str
    spec: SensorSpec
    preset: PresetSpec
    options: dict[str, Any]
    #: The publisher of the frames that a driver can publish.
    tf: str = TFCOMPOSE

    def fill_name(self, pattern: str) -> str:
        """Return a preset's name with the sensor's name inserted."""
        return fill_name(pattern, self.name, self.preset.words)

    def holds(self, condition: dict[str, Any]) -> bool:
        """Return whether every option has, or holds, the value that the condition names."""
        return holds(condition, self.options, self.tf)

    def frames(self) -> dict[str, PresetFrame]:
        """Return the sensor's frames by their final names, before any renaming of parts."""
        return {
            self.fill_name(name): frame
            for name, frame in self.preset.frames.items()
            if self.holds(frame.when)
        }

    def parent_of(self, name: str, frame: PresetFrame) -> str:
        """Return the frame's parent before any renaming.

        As the user gives it, or as its publisher sends it.
        """
        own = self.spec.frames.get(name)
        if own and own.parent:
            return own.parent
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
    for option, wanted in condition.items():
        value = tf if option == "tf" else options.get(option)
        every = wanted if isinstance(wanted, list) else [wanted]
        chosen = value if isinstance(value, (list, tuple)) else [value]
        if not all(item in chosen for item in every):
            return False
    return True


def sensor_of(
    name: str, declared: SensorSpec, library: Library, spec: RobotSpec
) -> Generator[Finding, None, Sensor | None]:
    """Return the sensor with its preset and options, or None if it has no preset."""
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
    there = (
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
        else did_you_mean(name, same or names, there)
    )
    return finding("TF601", f"unknown preset {name}", span, help=advice)


def _publisher(sensor: Sensor) -> str:
    """Return who publishes the frames that a driver can.

    As said, or as the vendor's driver does by default.
    """
    driver, own = sensor.preset.driver, sensor.spec.driver
    if driver is None or (own and own.process == "none"):
        return TFCOMPOSE
    if not sensor.driver_frames():
        return TFCOMPOSE
    return sensor.spec.tf or driver.tf


def decide_options(
    preset: PresetSpec, declared: SensorSpec, path: Path, spec: RobotSpec
) -> tuple[dict[str, Any], list[Finding]]:
    """Return the values of the preset's options, and findings about the given ones."""
    options = {key: option.default for key, option in preset.options.items()}
    findings = []
    for key, value in declared.options.items():
        span = spec.span_of((*path, "options", key))
        if key not in preset.options:
            there = (
                f"{declared.preset} has {', '.join(preset.options)}"
                if preset.options
                else f"{declared.preset} has none"
            )
            advice = did_you_mean(key, preset.options, there)
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
    """Return the value for a variant's name: a number or true as written."""
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
    known = ", ".join(option.values)
    if not isinstance(value, list):
        return finding(
            "TF603", f"the option {key} is not a list", span, help=f"a list of some of: {known}"
        )
    for item in value:
        if item not in option.values:
            advice = did_you_mean(str(item), option.values, f"one of: {known}")
            return finding("TF603", f"the option {key} cannot hold {item!r}", span, help=advice)
    return None


#: vendor/model; a model that begins with _ is there to be extended only, and nodes/ holds no
#: sensors.
_NAME = re.compile(r"(?!nodes/)[A-Za-z0-9][A-Za-z0-9_.-]*/_?[A-Za-z0-9][A-Za-z0-9_.-]*")
_DEEPEST = 8


class Storage(Protocol):
    """The folders and files of presets."""

    def has(self, path: str) -> bool:
        """Return whether the file exists."""

    def is_folder(self, path: str) -> bool:
        """Return whether the folder exists."""

    def read(self, path: str) -> str:
        """Return its text; raises RejectedError."""

    def models(self, folder: str) -> list[str]:
        """Return the names, vendor/model, of the presets in the folder."""

    def packages(self) -> list[str]:
        """Return the folders of presets in installed Python packages.

        The lookup is slow, so it happens only when needed.
        """


@dataclass(slots=True)
class Library:
    """Presets in folders. Earlier folders take precedence, and packages come last."""

    folders: tuple[str, ...]
    storage: Storage
    own: str = ""
    _sources: dict[str, Source] = field(default_factory=dict)
    _specs: dict[tuple[str, tuple[tuple[str, str], ...]], PresetSpec] = field(default_factory=dict)
    _files: dict[str, str | None] = field(default_factory=dict)

    def over(self, folders: Iterable[str]) -> Library:
        """Return a library that searches these folders first."""
        return Library((*map(posixpath.normpath, folders), *self.folders), self.storage, self.own)

    @property
    def names(self) -> list[str]:
        """The names of all presets, in order."""
        known = {name for folder in self._all() for name in self.storage.models(folder)}
        return sorted(name for name in known if "/_" not in name and _NAME.fullmatch(name))

    def file(self, name: str) -> str | None:
        """Return the preset's file, or None if there is no preset of that name."""
        if name not in self._files:
            self._files[name] = self._find(name, self.folders) or self._find_late(name)
        return self._files[name]

    def hides(self, name: str) -> str | None:
        """Return the built-in preset's file that another one of this name shadows, or None."""
        mine = self._find(name, (self.own,)) if self.own else None
        return mine if mine and self.file(name) != mine else None

    def source(self, name: str, deep: int = 0) -> Source:
        """Return the preset's contents, laid over the preset that it extends.

        Raises:
            KeyError: if no preset has that name.
            RejectedError: if it, or what it extends, is no preset.
        """
        if name not in self._sources:
            file = self.file(name)
            if file is None:
                raise KeyError(name)
            own = load_named(self.storage.read(file), file)
            self._sources[name] = self._extend(own, name, deep)
        return self._sources[name]

    def get(self, name: str, choices: Mapping[str, str] | None = None) -> PresetSpec:
        """Return the preset; ``choices`` are the options that lay a variant over it.

        Raises:
            KeyError: if no preset has that name.
            RejectedError: if the preset itself is wrong.
        """
        options = tuple(sorted((choices or {}).items()))
        if (name, options) not in self._specs:
            source = self.source(name)
            for option, value in options:
                variant = source.part(("options", option, "variants", value))
                source = lay_over(source, variant, is_overlay=False, of=PresetSpec)
            self._specs[name, options] = validate_preset(source)
        return self._specs[name, options]

    def _extend(self, own: Source, name: str, deep: int) -> Source:
        base = extended_preset(own)
        if base is None:
            return own
        span = own.span_of(("extends",))
        if deep > _DEEPEST:
            raise RejectedError(
                [finding("TF606", f"{name} extends itself, by way of others", span)]
            )
        if base == name:  # it stands before one of the same name, and changes it
            later = self._later(own.file)
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
        return lay_over(without(below, "extends"), own, is_overlay=False, of=PresetSpec)

    def _later(self, file: str) -> str | None:
        """Return the preset file of the same name that this file shadows."""
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
    """Return the folder and the name, vendor/model, of a preset's file."""
    rest, model = posixpath.split(file.removesuffix(".yaml"))
    folder, vendor = posixpath.split(rest)
    return folder, f"{vendor}/{model}"


_NODE_PRESETS = pathlib.Path(__file__).parents[2] / "data" / "presets" / "nodes"


@cache
def _node_files() -> dict[str, pathlib.Path]:
    """Return the file of each preset of a node, PACKAGE/NAME.yaml, by its name."""
    return {file.stem: file for file in sorted(_NODE_PRESETS.glob("*/*.yaml"))}


@cache
def node_preset_names() -> tuple[str, ...]:
    """Return the names of all presets of nodes, sorted."""
    return tuple(sorted(_node_files()))


@cache
def node_preset(name: str) -> NodePresetSpec:
    """Return the preset of this name, or of PACKAGE/NAME.

    Raises:
        KeyError: if no preset has that name.
        RejectedError: if the preset itself is wrong.
    """
    package, _, short = name.rpartition("/")
    file = _node_files()[short]
    place = f"presets/nodes/{file.parent.name}/{file.name}"
    preset = validate_file(NodePresetSpec, load(file.read_text("utf-8"), place))
    if package not in {"", preset.package}:
        raise KeyError(name)
    return preset


def is_node_preset(name: str) -> bool:
    """Return whether there is a preset of this name, or of PACKAGE/NAME."""
    try:
        node_preset(name)
    except KeyError:
        return False
    except RejectedError:
        pass
    return True


def unknown_node_preset(name: str, span: Span) -> Finding:
    """Return the finding for an unknown name of a node's preset."""
    names = node_preset_names()
    return finding(
        "TF601",
        f"unknown node preset {name}",
        span,
        help=did_you_mean(name.rpartition("/")[2], names, f"its frames: {', '.join(names)}"),
    )


def preset_of(node: NamedNode | None) -> str | None:
    """Return the name of a node's preset, None if it has none.

    A node whose own name is a preset's PACKAGE/NAME has that preset.
    """
    if node is None or node.preset is not None:
        return node.preset if node else None
    if node.name is not None and "/" in node.name and is_node_preset(node.name):
        return node.name
    return None


def start_advice(node: NamedNode | None, otherwise: str) -> str:
    """Return advice for a process without a program to start.

    If its node's name is close to a preset's PACKAGE/NAME, suggest that preset.
    """
    package, _, short = (node.name or "" if node else "").rpartition("/")
    near = nearest(
        short, [name for name in node_preset_names() if node_preset(name).package == package]
    )
    return f"did you mean node: {package}/{near}? Otherwise {otherwise}" if near else otherwise


def name_of(node: NamedNode | None) -> str | None:
    """Return the name given to a node, None if it is its preset's name."""
    if node is None or (node.preset is None and preset_of(node)):
        return None
    return node.name
