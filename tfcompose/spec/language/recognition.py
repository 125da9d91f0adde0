"""Recognition of this language's files by their text, before anything in it is repeated to people.

A robot file names others: what it includes, its parts, what its tools read. Named by a stranger
these can be a file of passwords, and findings about it would print it. So nothing of a text is
repeated unless half of the keys at the begin of its lines are keys of this language.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

from tfcompose.foundation.findings import RejectedError, Span, finding
from tfcompose.foundation.tool import shipped_tools
from tfcompose.spec.language.node_preset import NodePresetSpec
from tfcompose.spec.language.preset import PresetSpec
from tfcompose.spec.language.robot import RobotSpec
from tfcompose.spec.load import Source, load

if TYPE_CHECKING:
    from collections.abc import Collection

    from tfcompose.spec.language.spec import Spec

#: A key at the begin of a line, or the first one of a mapping in braces.
_KEY = re.compile(r"""^(?:\{\s*)?["']?([A-Za-z_][\w-]*)["']?\s*:(?=[\s{\[]|$)""", re.MULTILINE)
#: Versions of the core's language and of tools', which only their files say, wherever that is.
_SURE = re.compile(
    r"""^\s*\{?\s*["']?(?:"""
    + "|".join(("tfcompose", "preset", *shipped_tools().languages()))
    + r""")["']?\s*:\s*\d""",
    re.MULTILINE,
)
#: Text that says nothing: blank lines, comments, an empty mapping.
_NOTHING = re.compile(r"(?:\s|#[^\n]*(?:\n|\Z)|---|\{\s*\})*")


@cache
def _keys() -> frozenset[str]:
    """Return the keys at the top of robot files and presets."""
    models = (RobotSpec, PresetSpec, NodePresetSpec)
    return frozenset().union(*(model.model_fields for model in models), shipped_tools().keys())


def is_recognized(text: str, keys: Collection[str] = ()) -> bool:
    """Return whether a text is that of a robot file, a preset or a tool's file, however broken.

    ``keys`` are others.
    """
    if _SURE.search(text):
        return True
    there = set(_KEY.findall(text))
    known = there & frozenset(keys or _keys())
    return bool(there) and 2 * len(known) >= len(there)


def load_named(text: str, file: str, of: type[Spec] | None = None) -> Source:
    """Return what a file says that another file names, as ``load`` does.

    ``of`` is its model, if it is no robot.

    Raises:
        RejectedError: as ``load`` does; of a file of something else it says nothing but that.
    """
    keys = of.model_fields.keys() if of else ()
    if not is_recognized(text, keys) and not _NOTHING.fullmatch(text):
        advice = "it has none of a robot file's keys, such as links, frames or sensors"
        raise RejectedError(
            [finding("TF002", "this is not a robot file", Span(file), help=advice)]
        )
    return load(text, file)
