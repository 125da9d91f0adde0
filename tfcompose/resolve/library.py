"""The presets that are known: where they are, and what one says with all that it extends.

A preset is found when it is used; folders are listed only where a name is wrong, or where all are asked for.
"""

from __future__ import annotations

import posixpath
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from tfcompose.findings import RejectedError, finding
from tfcompose.language import validate_preset
from tfcompose.language.overlay import lay_over, without
from tfcompose.language.preset import PresetSpec
from tfcompose.load import load

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tfcompose.load import Source


#: vendor/model; a model that begins with _ is there to be extended only, and nodes/ holds no sensors.
_NAME = re.compile(r"(?!nodes/)[A-Za-z0-9][A-Za-z0-9_.-]*/_?[A-Za-z0-9][A-Za-z0-9_.-]*")
_DEEPEST = 8


class Shelves(Protocol):
    """What a library is told about folders: whether a file is there, what it holds, and which files there are."""

    def has(self, path: str) -> bool:
        """Return whether the file is there."""

    def is_folder(self, path: str) -> bool:
        """Return whether the folder is there."""

    def read(self, path: str) -> str:
        """Return its text; raises RejectedError."""

    def models(self, folder: str) -> list[str]:
        """Return the names, vendor/model, of the presets in the folder."""

    def packages(self) -> list[str]:
        """Return the folders that installed Python packages bring; this is looked up late, as it takes long."""


@dataclass(slots=True)
class Library:
    """Presets in folders; an earlier folder stands before a later one, and packages stand last."""

    folders: tuple[str, ...]
    shelves: Shelves
    own: str = ""
    _sources: dict[str, Source] = field(default_factory=dict)
    _specs: dict[tuple[str, tuple[tuple[str, str], ...]], PresetSpec] = field(default_factory=dict)
    _files: dict[str, str | None] = field(default_factory=dict)

    def over(self, folders: Iterable[str]) -> Library:
        """Return a library with these folders before its own."""
        return Library((*map(posixpath.normpath, folders), *self.folders), self.shelves, self.own)

    @property
    def names(self) -> list[str]:
        """The names of all presets, in order."""
        known = {name for folder in self._all() for name in self.shelves.models(folder)}
        return sorted(name for name in known if "/_" not in name and _NAME.fullmatch(name))

    def file(self, name: str) -> str | None:
        """Return the preset's file, or None where there is none of that name."""
        if name not in self._files:
            self._files[name] = self._find(name, self.folders) or self._find_late(name)
        return self._files[name]

    def hides(self, name: str) -> str | None:
        """Return the file of tfcompose's own preset that another one of this name stands before, or None."""
        mine = self._find(name, (self.own,)) if self.own else None
        return mine if mine and self.file(name) != mine else None

    def source(self, name: str, deep: int = 0) -> Source:
        """Return what the preset says, laid over what it extends.

        Raises:
            KeyError: if there is none of that name.
            RejectedError: if it, or what it extends, is no preset.
        """
        if name not in self._sources:
            file = self.file(name)
            if file is None:
                raise KeyError(name)
            own = load(self.shelves.read(file), file)
            self._sources[name] = self._extended(own, name, deep)
        return self._sources[name]

    def get(self, name: str, choices: Mapping[str, str] | None = None) -> PresetSpec:
        """Return the preset; ``choices`` are the options that lay a variant over it.

        Raises:
            KeyError: if there is none of that name.
            RejectedError: if the preset itself is wrong.
        """
        taken = tuple(sorted((choices or {}).items()))
        if (name, taken) not in self._specs:
            source = self.source(name)
            for option, value in taken:
                variant = source.part(("options", option, "variants", value))
                source = lay_over(source, variant, is_overlay=False, of=PresetSpec)
            self._specs[name, taken] = validate_preset(source)
        return self._specs[name, taken]

    def _extended(self, own: Source, name: str, deep: int) -> Source:
        base = own.data.get("extends")
        if not isinstance(base, str):
            return own
        at = own.at(("extends",))
        if deep > _DEEPEST:
            raise RejectedError([finding("TF606", f"{name} extends itself, by way of others", at)])
        if base == name:  # it stands before one of the same name, and changes it
            later = self._later(own.file)
            below = self._extended(load(self.shelves.read(later), later), name, deep + 1) if later else None
        else:
            below = self.source(base, deep + 1) if self.file(base) else None
        if below is None:
            raise RejectedError([finding("TF606", f"{name} extends {base}, which is not there", at)])
        return lay_over(without(below, "extends"), own, is_overlay=False, of=PresetSpec)

    def _later(self, file: str) -> str | None:
        """Return the file of the preset that stands behind this file's, under the same name."""
        folder, name = _split(file)
        behind = (*self.folders, *self.shelves.packages())
        return self._find(name, behind[behind.index(folder) + 1 :])

    def _all(self) -> tuple[str, ...]:
        return (*self.folders, *self.shelves.packages())

    def _find(self, name: str, folders: Iterable[str]) -> str | None:
        paths = (posixpath.join(folder, f"{name}.yaml") for folder in folders) if _NAME.fullmatch(name) else ()
        return next((path for path in paths if self.shelves.has(path)), None)

    def _find_late(self, name: str) -> str | None:
        return self._find(name, self.shelves.packages()) if _NAME.fullmatch(name) else None


def _split(file: str) -> tuple[str, str]:
    """Return the folder and the name, vendor/model, of a preset's file."""
    rest, model = posixpath.split(file.removesuffix(".yaml"))
    folder, vendor = posixpath.split(rest)
    return folder, f"{vendor}/{model}"
