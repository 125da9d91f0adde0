"""Presets of nodes by name. They are a part of the program, beside its code, and are read when one is named."""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING

from tfcompose.language import validate_node_preset
from tfcompose.load import load

if TYPE_CHECKING:
    from tfcompose.language.node_preset import NodePresetSpec

FOLDER = os.path.join(os.path.dirname(os.path.dirname(__file__)), "presets", "nodes")


@cache
def _places() -> dict[str, str]:
    """Return where each preset is below the folder: PACKAGE/NAME.yaml, by its name."""
    found = [
        f"{package}/{file}" for package in sorted(os.listdir(FOLDER)) for file in os.listdir(f"{FOLDER}/{package}")
    ]
    return {place.rpartition("/")[2].removesuffix(".yaml"): place for place in found if place.endswith(".yaml")}


@cache
def node_preset_names() -> tuple[str, ...]:
    """Return the names of all presets of nodes, sorted."""
    return tuple(sorted(_places()))


@cache
def node_preset(name: str) -> NodePresetSpec:
    """Return the preset.

    Raises:
        KeyError: if there is none of that name.
        RejectedError: if the preset itself is wrong.
    """
    place = _places()[name]
    with open(os.path.join(FOLDER, place), encoding="utf-8") as file:
        return validate_node_preset(load(file.read(), f"presets/nodes/{place}"))
