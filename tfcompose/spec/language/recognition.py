"""Recognition of this language's files by their text, before findings repeat any of it.

A robot file names other files: includes, parts, and files of tools. In a robot file from an
untrusted source, such a name can be the path of a password file, and findings about that file
would print its content. So findings repeat text of a file only if at least half of the keys at the
start of its lines are keys of this language.
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

#: A key at the start of a line, or the first key of a mapping in braces.
_KEY = re.compile(r"""^(?:\{\s*)?["']?([A-Za-z_][\w-]*)["']?\s*:(?=[\s{\[]|$)""", re.MULTILINE)
#: A version key of the core's languages or of tools'. Only their files contain one.
_SURE = re.compile(
    r"""^\s*\{?\s*["']?(?:"""
    + "|".join(("tfcompose", "preset", *shipped_tools().languages()))
    + r""")["']?\s*:\s*\d""",
    re.MULTILINE,
)
#: Text without content: blank lines, comments, an empty mapping.
_NOTHING = re.compile(r"(?:\s|#[^\n]*(?:\n|\Z)|---|\{\s*\})*")


@cache
def _keys() -> frozenset[str]:
    """Return the top-level keys of robot files and presets."""
    models = (RobotSpec, PresetSpec, NodePresetSpec)
    return frozenset().union(*(model.model_fields for model in models), shipped_tools().keys())


def is_recognized(text: str, keys: Collection[str] = ()) -> bool:
    """Return whether a text is a robot file, a preset or a tool's file, possibly broken.

    ``keys`` are further valid keys.
    """
    if _SURE.search(text):
        return True
    text_keys = set(_KEY.findall(text))
    keys_of_robots = text_keys & frozenset(keys or _keys())
    return bool(text_keys) and 2 * len(keys_of_robots) >= len(text_keys)


def load_named(text: str, file: str, of: type[Spec] | None = None) -> Source:
    """Return the content of a file that another file names, as ``load`` does.

    ``of`` is the model of the file, if it is not a robot file.

    Raises:
        RejectedError: as in ``load``. For any other kind of file, the finding repeats no text.
    """
    keys = of.model_fields.keys() if of else ()
    if not is_recognized(text, keys) and not _NOTHING.fullmatch(text):
        advice = "it has none of a robot file's keys, such as links, frames or sensors"
        raise RejectedError(
            [finding("TF002", "this is not a robot file", Span(file), help=advice)]
        )
    return load(text, file, (of or RobotSpec).BEGIN)
