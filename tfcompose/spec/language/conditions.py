"""``when`` and ``for``: conditions and loops of entries, evaluated before other keys are read.

An entry whose ``when`` is false is removed, and no process waits for it. An entry with ``for`` is
repeated for each value. Its name contains the variable, as in ``camera_${i}``. All resulting
entries have the places of the original entry.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any

from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.units import Quantity, format_value
from tfcompose.spec.language.expressions import (
    IDENTIFIER,
    MOST_ITEMS,
    RESERVED,
    ExpressionError,
    insertable_text,
    items,
)
from tfcompose.spec.language.reading import SpecRefusal
from tfcompose.spec.language.variables import NothingNewError, Variables

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.spec.language.expressions import Value
    from tfcompose.spec.load import Location, Path, Source

#: Sections whose entries may have ``when`` and ``for``.
SECTIONS = (
    "links",
    "joints",
    "ros2_control",
    "frames",
    "sensors",
    "parts",
    "containers",
    "processes",
    "hosts",
)
_KEYS = frozenset({"when", "for"})
Scope = dict[str, "Value"]


@dataclass(slots=True)
class Unfolded:
    """A source with the entries that remain after conditions and loops."""

    source: Source
    #: The values of loop variables, by (section, name).
    scopes: dict[Path, Mapping[str, Value]] = field(default_factory=dict)
    #: Findings about conditions and loops.
    findings: list[Finding] = field(default_factory=list)
    #: Paths of rejected conditions and loops.
    refused: list[Path] = field(default_factory=list)
    #: Conditions that removed entries, as text, by (section, name).
    conditions: dict[tuple[str, str], str] = field(default_factory=dict)


def unfold(source: Source, variables: Variables) -> Unfolded:
    """Return the source with loops unrolled and without entries whose conditions are false."""
    return _Unfolding(source, variables).unfold()


def holds(condition: Any, variables: Variables) -> bool:
    """Return whether a condition is true.

    Raises:
        ExpressionError: if the result is not a boolean.
    """
    return _decide(condition, variables, {})


def _decide(condition: Any, variables: Variables, scope: Scope) -> bool:
    value = (
        variables.value_in(condition, scope)
        if isinstance(condition, str) and "${" in condition
        else condition
    )
    if isinstance(value, bool):
        return value
    is_bare = isinstance(condition, str) and "${" not in condition
    advice = (
        f"when: ${{{condition}}}"
        if is_bare
        else "for example when: ${args.sim}, or ${args.cameras > 1}"
    )
    shown_value = (
        format_value(condition)
        if isinstance(condition, (str, dict, list))
        else format_value(value)
    )
    raise ExpressionError(f"when takes true or false, and {shown_value} is neither", advice)


class _Unfolding:
    def __init__(self, source: Source, variables: Variables) -> None:
        self.source = source
        self.variables = variables
        self.done = Unfolded(source)
        self.replaced = dict(source.replaced)
        self.gone: list[re.Pattern[str]] = []

    def unfold(self) -> Unfolded:
        data, inside, is_changed = dict(self.source.data), dict(self.source.places.inside), False
        for section in SECTIONS:
            entries = data.get(section)
            if not isinstance(entries, dict):
                continue
            if any(
                isinstance(entry, dict) and not _KEYS.isdisjoint(entry)
                for entry in entries.values()
            ):
                data[section], inside[section] = self._section(section, entries, inside[section])
                is_changed = True
        if not is_changed:
            return self.done
        self._drop_waits(data)
        places = self.source.places.with_inside(inside, self.source.places.keys)
        self.done.source = replace(self.source, data=data, places=places, replaced=self.replaced)
        return self.done

    def _section(
        self, section: str, entries: dict[str, Any], location: Location
    ) -> tuple[dict[str, Any], Location]:
        data: dict[str, Any] = {}
        inside: dict[Any, Location] = {}
        keys: dict[Any, Location] = {}
        for template, entry in entries.items():
            path: Path = (section, template)
            is_plain = not isinstance(entry, dict) or _KEYS.isdisjoint(entry)
            made = (
                [(template, entry, location.inside[template])]
                if is_plain
                else list(self._make_entries(path, entry))
            )
            for name, content, where in made:
                if name in data:
                    message = f"{template} and another entry are both {name}"
                    self._refuse(
                        path, ExpressionError(message, "give them other names"), on_key=True
                    )
                    continue
                data[name], inside[name], keys[name] = content, where, location.keys[template]
        return data, location.with_inside(inside, keys)

    def _make_entries(
        self, path: Path, entry: dict[str, Any]
    ) -> Iterator[tuple[str, dict[str, Any], Location]]:
        """Yield name, data and location of each entry that an entry expands to."""
        section, template = str(path[0]), str(path[1])
        location = self.source.places.nearest(path)
        decided = {
            key for key in _KEYS if entry.get(key) is not None
        }  # validation rejects a key without a value
        try:
            scopes = self._scopes(entry["for"], template) if "for" in decided else [{}]
        except ExpressionError as error:
            self._refuse((*path, "for"), error)
            return
        self.gone.append(
            re.compile(
                _HOLE.sub(".+", re.escape(template).replace(r"\$\{", "${").replace(r"\}", "}"))
                + "(/.*)?"
            )
        )
        for scope in scopes:
            try:
                name = (
                    insertable_text(self.variables.value_in(template, scope))
                    if scope
                    else template
                )
            except ExpressionError as error:
                self._refuse(path, error, on_key=True)
                continue
            try:
                if "when" in decided and not _decide(entry["when"], self.variables, scope):
                    self.done.conditions[section, name] = (
                        entry["when"]
                        if isinstance(entry["when"], str)
                        else format_value(entry["when"])
                    )
                    continue
            except ExpressionError as error:  # keep the entry, so that no names are missing
                self._refuse((*path, "when"), error)
            inner = {key: value for key, value in entry.items() if key not in decided}
            where = location.with_inside(
                {key: below for key, below in location.inside.items() if key not in decided},
                {key: below for key, below in location.keys.items() if key not in decided},
            )
            if scope:
                self.done.scopes[section, name] = scope
                inner, where = self._fill_keys(inner, where, scope)
                for old, spans in self.source.replaced.items():
                    if old[:2] == path:
                        self.replaced[(section, name) + old[2:]] = spans  # noqa: RUF005 (Python 3.10 cannot)
            yield name, inner, where

    def _scopes(self, loops: Any, template: str) -> list[Scope]:
        """Return the values of the loop variables for each iteration.

        Raises:
            ExpressionError: if the loops are invalid, or the name does not contain a variable.
        """
        if not isinstance(loops, dict) or not loops:
            raise ExpressionError(
                f"for is {format_value(loops)}",
                'for: {i: "${range(3)}"}, or for: {side: [left, right]}',
            )
        for name in loops:
            if (
                name in self.variables.declared
                or name in RESERVED
                or not IDENTIFIER.fullmatch(name)
            ):
                what = (
                    "a variable already"
                    if name in self.variables.declared
                    else RESERVED.get(name, "not a name")
                )
                raise ExpressionError(
                    f"for cannot take {name}: it is {what}", "another name, such as i"
                )
            if not re.search(rf"\$\{{[^{{}}]*\b{name}\b[^{{}}]*\}}", template):
                raise ExpressionError(
                    f"the name {template} is the same for each {name}",
                    f"put it into the name: {template}_${{{name}}}",
                )
        lists = [self._items(value) for value in loops.values()]
        count = 1
        for alternatives in lists:
            count *= len(alternatives)
        if count > MOST_ITEMS:
            raise ExpressionError(f"for makes {count:,} entries; at most {MOST_ITEMS:,}")
        return [dict(zip(loops, values, strict=True)) for values in product(*lists)]

    def _items(self, value: Any) -> list[Value]:
        if isinstance(value, str):
            return items(value, self.variables.lookup)
        if not isinstance(value, list):
            raise ExpressionError(
                f"{format_value(value)} is not a list of items",
                "a list, or ${range(3)}, or ${range(1, 4)}",
            )
        kept: list[Value] = []
        for element in value:
            if isinstance(element, (dict, list)) or element is None:
                raise ExpressionError(
                    f"{format_value(element)} cannot be an item of a loop", "a string, or a number"
                )
            item = self.variables.value_in(element, {}) if isinstance(element, str) else element
            kept.append(
                Quantity(item)
                if isinstance(item, (int, float)) and not isinstance(item, bool)
                else item
            )
        return kept

    def _fill_keys(self, value: Any, location: Location, scope: Scope) -> tuple[Any, Location]:
        """Return the mapping with the values of loop variables inserted into its keys."""
        if not isinstance(value, dict):
            return value, location
        data: dict[str, Any] = {}
        inside: dict[Any, Location] = {}
        keys: dict[Any, Location] = {}
        for key, item in value.items():
            name = key
            if "${" in key:
                try:
                    name = insertable_text(self.variables.value_in(key, scope))
                except ExpressionError as error:
                    span = location.keys[key].span
                    self.done.findings.append(
                        finding("TF105", str(error), span, help=error.advice)
                    )
            data[name], inside[name] = self._fill_keys(item, location.inside[key], scope)
            keys[name] = location.keys[key]
        return data, location.with_inside(inside, keys)

    def _refuse(self, path: Path, error: ExpressionError, *, on_key: bool = False) -> None:
        self.done.refused.append(path)
        if not isinstance(error, NothingNewError):
            refusal = SpecRefusal("TF105", path, str(error), error.advice, on_key)
            self.done.findings.append(refusal.finding(self.source))

    def _drop_waits(self, data: dict[str, Any]) -> None:
        """Remove waits for entries that a condition or a loop has removed."""
        present = {
            name
            for section in ("sensors", "containers", "processes")
            for name in data.get(section, ())
        }
        parts = tuple(f"{name}/" for name in data.get("parts", ()))

        def is_gone(name: str) -> bool:
            return (
                name not in present
                and not name.startswith(parts)
                and any(pattern.fullmatch(name) for pattern in self.gone)
            )

        for section, inside in (("sensors", ("driver",)), ("containers", ()), ("processes", ())):
            entries = data.get(section)
            for name, entry in list(entries.items()) if isinstance(entries, dict) else ():
                around = entry
                for step in inside:
                    around = around.get(step) if isinstance(around, dict) else None
                waits = around.get("after") if isinstance(around, dict) else None
                if isinstance(waits, dict) and any(is_gone(awaited) for awaited in waits):
                    kept = around | {
                        "after": {
                            awaited: what
                            for awaited, what in waits.items()
                            if not is_gone(awaited)
                        }
                    }
                    for step in reversed(inside):
                        kept = entry | {step: kept}
                    data[section] = data[section] | {name: kept}


_HOLE = re.compile(r"\$\{[^{}]*\}")
