"""Uses of arguments.

The strings of a robot file that name them, and the purpose of each string.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.spec.language.expressions import environment_in, names_in

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.spec.load import Path, Source

HOLE = re.compile(r"\$\{([^{}]*)\}")
#: Keys whose values a process receives at its start.
_PLACES = ("env", "params", "remap")


@dataclass(slots=True)
class ArgumentUses:
    """The places where a robot file uses its arguments and environment variables."""

    #: Strings that a process receives at its start, by process and place.
    texts: dict[tuple[str, str], str] = field(default_factory=dict)
    #: Conditions by process.
    conditions: dict[str, str] = field(default_factory=dict)
    #: Arguments and variables that are also used in other places.
    fixed: set[str] = field(default_factory=set)

    def fix(self, text: str) -> None:
        """Record that a string in another place uses its arguments and variables."""
        self.fixed |= names_of(text)


def names_of(text: str) -> set[str]:
    """Return arguments and environment variables in a text: ``args.NAME``, ``env(NAME)``."""
    variables = (environment_in(hole.strip()) for hole in HOLE.findall(text))
    return set(names_in(text)) | {f"env({variable[0]})" for variable in variables if variable}


def uses_of(source: Source) -> ArgumentUses:
    """Return the uses in a robot file that has not been validated yet."""
    uses = ArgumentUses()
    for path, text in _strings(source.data):
        place = None if path[:1] == ("profiles",) else _place(path, source.data)
        if place is None:
            uses.fix(text)
        elif place[1] == "when":
            uses.conditions[place[0]] = text.strip().removeprefix("${").removesuffix("}")
        else:
            uses.texts[place] = text
    return uses


def _strings(value: Any, path: Path = ()) -> Iterator[tuple[Path, str]]:
    """Yield strings with expressions, including keys, with their paths."""
    if isinstance(value, str) and "${" in value:
        yield path, value
    elif isinstance(value, (dict, list)):
        for step, item in value.items() if isinstance(value, dict) else enumerate(value):
            if isinstance(step, str) and "${" in step:
                yield (), step
            yield from _strings(item, (*path, step))


def _place(path: Path, data: Mapping[str, Any]) -> tuple[str, str] | None:
    """Return the process and the place in it, None for a string in any other place."""
    if len(path) < 3 or path[0] not in {  # noqa: PLR2004
        "processes",
        "containers",
    }:
        return None
    process = data[path[0]][path[1]]
    name, key = str(path[1]), path[2]
    if not isinstance(process, dict) or "for" in process:
        return None
    is_composition = path[0] == "containers" or "component" in process
    if not is_composition and not isinstance(process.get("run"), (dict, list)):
        return None
    if key == "when":
        return name, "when"
    if key == "run":
        match path[3:]:
            case ("args", step) if isinstance(process["run"], dict):
                step = list(process["run"]["args"]).index(step) if isinstance(step, str) else step
                return name, f"args.{step}"
            case (int(step),) if isinstance(process["run"], list):
                return name, f"args.{step}"
        return None
    is_node = is_composition or (
        isinstance(process["run"], dict) and "launch" not in process["run"]
    )
    if key == "env" or (
        key in _PLACES and is_node and path[3] != "file" and "nodes" not in process
    ):
        return (
            (name, f"{key}.{'.'.join(map(str, path[3:]))}")
            if not isinstance(path[-1], int)
            else None
        )
    return None
