"""Texts of a robot file that its plan could not hold."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, finding
from tfcompose.model.plan.file import has_refused_character
from tfcompose.model.process_keys import EXTRA_ARGUMENTS
from tfcompose.spec.language.spec import Spec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.spec.load import Path

#: Keys whose texts are for programs, and may hold lines and tabs.
_FOR_PROGRAMS = frozenset({"run", "env", "component", EXTRA_ARGUMENTS.name})
#: Keys whose texts are in other files than the plan, or in none.
_NOT_IN_PLAN = frozenset({"params", "description"})


def check_texts(draft: Draft) -> Iterator[Finding]:
    """Yield a finding for each text with control characters that the plan's readers refuse."""
    spec = draft.spec
    sections: dict[Path, Any] = {
        (name,): getattr(spec, name) for name in ("args", "containers", "processes", "guard")
    }
    sections |= {
        ("sensors", name, "driver"): sensor.driver for name, sensor in spec.sensors.items()
    }
    for section, value in sections.items():
        for path, text in _texts_in(value, section):
            if not spec.spans.has(path):  # run: [echo, hello]
                path = tuple(step for step in path if step != "argv")  # noqa: PLW2901 (the same)
            is_for_program = bool(_FOR_PROGRAMS & {*path[2:]})
            if has_refused_character(text, is_for_program=is_for_program):
                name = ".".join(map(str, path))
                message = f"{name} holds a control character: {json.dumps(text)[:60]}"
                advice = "remove it; a node can take such a text as a parameter"
                yield finding("TF106", message, spec.span_of(path), help=advice)


def _texts_in(value: Any, path: Path) -> Iterator[tuple[Path, str]]:
    """Yield the texts that a value holds with their paths; a mapping's keys among them."""
    if isinstance(value, str):
        yield path, value
    elif isinstance(value, (Spec, dict)) or is_dataclass(value):
        for key, inner in _items(value):
            if key not in _NOT_IN_PLAN:
                yield (*path, key), key
                yield from _texts_in(inner, (*path, key))
    elif isinstance(value, (tuple, list)):
        for index, inner in enumerate(value):
            yield from _texts_in(inner, (*path, index))


def _items(value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        yield from ((str(key), inner) for key, inner in value.items())
        return
    names = value.model_fields_set if isinstance(value, Spec) else [f.name for f in fields(value)]
    yield from ((name, getattr(value, name)) for name in sorted(names))
