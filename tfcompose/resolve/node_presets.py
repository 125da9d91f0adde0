"""Presets of nodes by name. They are a part of the program, beside its code, and are read when one is named."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.load import load
from tfcompose.validate import validate_node_preset

if TYPE_CHECKING:
    from tfcompose.validate.claims import NodePresetSpec

FOLDER = Path(__file__).parents[1] / "presets" / "nodes"


@cache
def node_preset_names() -> tuple[str, ...]:
    """Return the names of all presets of nodes, sorted."""
    return tuple(sorted(file.stem for file in FOLDER.glob("*/*.yaml")))


@cache
def node_preset(name: str) -> NodePresetSpec:
    """Return the preset.

    Raises:
        KeyError: if there is none of that name.
        RejectedError: if the preset itself is wrong.
    """
    if name not in node_preset_names():
        raise KeyError(name)
    file = next(FOLDER.glob(f"*/{name}.yaml"))
    return validate_node_preset(load(file.read_text("utf-8"), f"presets/nodes/{file.parent.name}/{file.name}"))
