"""Where presets are: those of tfcompose, of the user's folders, and of installed Python packages."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from importlib import import_module

from tfcompose.cli.terminal import read_text
from tfcompose.resolve import Library

PRESETS = os.path.join(os.path.dirname(os.path.dirname(__file__)), "presets")
#: A package names, under this group, the module whose folder holds its presets.
GROUP = "tfcompose.presets"


@dataclass(frozen=True, slots=True)
class Folders:
    """Presets in folders of this machine."""

    def has(self, path: str) -> bool:
        """Return whether the file is there."""
        return os.path.isfile(path)

    def is_folder(self, path: str) -> bool:
        """Return whether the folder is there."""
        return os.path.isdir(path)

    def read(self, path: str) -> str:
        """Return its text; raises RejectedError."""
        return read_text(path)

    def models(self, folder: str) -> list[str]:
        """Return the names, vendor/model, of the presets in the folder."""
        if not os.path.isdir(folder):
            return []
        with os.scandir(folder) as inside:
            vendors = sorted(vendor.name for vendor in inside if vendor.is_dir() and vendor.name != "nodes")
        files = [(vendor, file) for vendor in vendors for file in sorted(os.listdir(os.path.join(folder, vendor)))]
        return [f"{vendor}/{file.removesuffix('.yaml')}" for vendor, file in files if file.endswith(".yaml")]

    def packages(self) -> list[str]:
        """Return the folders that installed Python packages bring."""
        return _packages()


@cache
def _packages() -> list[str]:
    find_spec = import_module("importlib.util").find_spec
    folders: list[str] = []
    for entry in import_module("importlib.metadata").entry_points(group=GROUP):
        try:
            spec = find_spec(entry.value)
        except ImportError:
            continue
        folders += (spec.submodule_search_locations or []) if spec else []
    return folders


def library() -> Library:
    """Return the presets that are known without a robot file: tfcompose's own, then those of packages."""
    return Library((PRESETS,), Folders(), PRESETS)
