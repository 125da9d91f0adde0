"""The plan as a JSON file, in which fields with default values are left out."""

from __future__ import annotations

import graphlib
import json
import re
from collections import Counter
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

import msgspec

from tfcompose.foundation.findings import Finding, RejectedError, Span, finding
from tfcompose.foundation.geometry import norm
from tfcompose.model.plan import VERSION, Plan

if TYPE_CHECKING:
    from collections.abc import Iterator

#: A robot's name, which becomes part of topics, systemd units and programs; and a process's name,
#: which includes the part's name for a process of a part.
_ROBOT = re.compile(r"[a-z][a-z0-9_]*")
_PROCESS = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(?:/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
#: A host's name, which becomes part of folders, systemd units and nodes.
_HOST = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
#: Control characters, and unpaired surrogates.
_CONTROL = re.compile("[\\x00-\\x1f\\x7f-\\x9f\\ud800-\\udfff]")
#: Tolerance for the length of a quaternion. Written quaternions are normalised to the last bit.
_UNIT = 1e-6
#: Maximum number of characters of a value, and of a quoted value, in an error.
_LONGEST_SHOWN, _LONGEST_QUOTED = 60, 100
_BYTE = re.compile(r"\(byte (\d+)\)")
#: Keys below which text may contain line breaks and tabs, because programs receive it.
_FOR_PROGRAMS = frozenset({"argv", "env", "switches", "component"})


def write_plan(plan: Plan) -> str:
    """Return the plan as JSON text.

    Each edge and each process has its own line. The same plan always gives the same bytes.
    """
    lines = []
    for key, value in ({"version": VERSION} | _data(plan)).items():
        text = _rows(value) if isinstance(value, list) else _json(value)
        lines.append(f"  {_json(key)}: {text}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _data(value: Any) -> Any:
    """Return a value of a plan as JSON data."""
    if is_dataclass(value):
        held = {field: getattr(value, field.name) for field in fields(value)}
        return {field.name: _data(part) for field, part in held.items() if part != _default(field)}
    if isinstance(value, dict):
        return {key: _data(part) for key, part in value.items()}
    return [_data(part) for part in value] if isinstance(value, (list, tuple)) else value


def _default(of: Field[Any]) -> Any:
    return of.default if of.default_factory is MISSING else of.default_factory()


def read_plan(text: str, file: str) -> Plan:
    """Return the plan that ``write_plan`` wrote.

    Raises:
        RejectedError: with a TF902 finding, if the text is not a plan of this version.
    """
    try:
        data = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError, UnicodeEncodeError) as error:
        raise RejectedError([_bad(f"not a plan: {error}", _place(error, text, file))]) from None
    if not isinstance(data, dict) or "edges" not in data or "processes" not in data:
        raise RejectedError([_bad("not a plan: it has no edges or processes", Span(file))])
    if data.get("version") != VERSION or data["version"] is True:
        message = (
            f"the plan has version {_shorten(data.get('version'))}; this tfcompose reads version"
            f" {VERSION}"
        )
        raise RejectedError([_bad(message, Span(file))])
    try:
        plan = msgspec.convert(data, Plan)
    except msgspec.ValidationError as error:
        raise RejectedError([_bad(f"not a valid plan: {_short(error)}", Span(file))]) from None
    wrong = [*_wrong_text(data), *_wrong_names(plan)]
    if wrong:
        raise RejectedError([_bad(f"not a valid plan: {error}", Span(file)) for error in wrong])
    return plan


def _place(error: Exception, text: str, file: str) -> Span:
    """Return the place where the text stops being JSON.

    msgspec's message contains its byte offset.
    """
    byte = _BYTE.search(str(error))
    lines = (
        text.encode(errors="replace")[: int(byte[1])].decode(errors="replace").split("\n")
        if byte
        else [""]
    )
    line, column = len(lines), len(lines[-1]) + 1
    return Span(file, line, column, line, column + 1)


def has_refused_character(text: str, *, is_for_program: bool) -> bool:
    """Return whether a plan with this text is refused for a control character.

    Lines and tabs may be in a text for a program.
    """
    characters = set(_CONTROL.findall(text))
    return bool(characters - {"\n", "\t"} if is_for_program else characters)


def _wrong_text(data: Any) -> Iterator[str]:
    """Yield faults of texts, which must not contain control characters.

    Control characters would move a terminal's cursor or begin a new line.
    """
    waiting: list[tuple[Any, tuple[str, ...]]] = [
        (data, ())
    ]  # unknown data may be nested too deep for recursion
    while waiting:
        value, path = waiting.pop()
        if isinstance(value, str):
            if has_refused_character(value, is_for_program=bool(_FOR_PROGRAMS & {*path})):
                yield f"{'.'.join(path)} holds a control character: {json.dumps(value)[:60]}"
        elif isinstance(value, dict):
            for key, item in reversed(value.items()):
                waiting += [(item, (*path, key)), (key, (*path, "a key"))]
        elif isinstance(value, list):
            waiting += reversed(
                [(item, (*path, str(number))) for number, item in enumerate(value)]
            )


def _wrong_names(plan: Plan) -> Iterator[str]:
    """Yield faults of names.

    Names that no robot file can have, unknown names, and outside files.
    """
    if not _ROBOT.fullmatch(plan.robot):
        yield f"robot is {_shorten(plan.robot)}, not a name of lower case letters, digits and _"
    counts = Counter(process.name for process in plan.processes)
    for name, times in counts.items():
        if not _PROCESS.fullmatch(name):
            yield f"a process is named {_shorten(name)}, not with letters, digits, _, - and ."
        if times > 1:
            yield f"{times} processes are named {name}"
    yield from (
        f"the owner of {edge.name} is {_shorten(edge.owner)}, which is not a process"
        for edge in plan.edges
        if edge.owner not in counts
    )
    yield from (
        f"{process.name} waits for {_shorten(awaited)}, which is not a process"
        for process in plan.processes
        for awaited in process.after
        if awaited not in counts
    )
    if all(awaited in counts for process in plan.processes for awaited in process.after):
        yield from _wrong_order(plan)
    for ready, name in ((process.ready, process.name) for process in plan.processes):
        if ready and ready.kind == "log" and (error := _regex_error(ready.text)):
            yield f"{name} is ready at {_shorten(ready.text)}, not a regular expression: {error}"
    yield from _wrong_components(plan)
    poses = {edge.name: edge.pose for edge in plan.edges}
    poses |= {
        process.name: process.simulate.pose for process in plan.processes if process.simulate
    }
    yield from (
        f"the pose of {name} has a quaternion of length {norm(pose.quat_xyzw):g}, not 1"
        for name, pose in poses.items()
        if abs(norm(pose.quat_xyzw) - 1) > _UNIT
    )
    yield from _wrong_files(plan)
    yield from (
        f"a host is named {_shorten(name)}, not with letters, digits, _, - and ."
        for name in _wrong_hosts(plan)
    )


def _wrong_components(plan: Plan) -> Iterator[str]:
    """Yield faults of components: each container must be a process with a node."""
    containers = {
        process.name for process in plan.processes if process.nodes and not process.component
    }
    for process in plan.processes:
        component = process.component
        if (process.kind == "component") != (component is not None):
            yield (
                f"{process.name} is of kind {process.kind}, and {'a' if component else 'no'}"
                " component"
            )
        elif component and component.container not in containers:
            yield (
                f"the container of {process.name} is {_shorten(component.container)}, which is no"
                " process with a node"
            )
        elif component and not process.nodes:
            yield f"{process.name} is a component without a node"


def _wrong_order(plan: Plan) -> Iterator[str]:
    try:
        graphlib.TopologicalSorter(
            {process.name: process.after for process in plan.processes}
        ).prepare()
    except graphlib.CycleError as error:
        yield f"processes wait for each other: {', '.join(map(_shorten, error.args[1]))}"


def _wrong_files(plan: Plan) -> Iterator[str]:
    files = (
        plan.description,
        *(
            file
            for process in plan.processes
            for file in (process.params_file, process.description)
        ),
    )
    for file in dict.fromkeys(filter(None, files)):
        path = PurePosixPath(file)
        if path.is_absolute() or ".." in path.parts:
            yield f"the file {_shorten(file)} is not in the plan's folder"


def _wrong_hosts(plan: Plan) -> Iterator[str]:
    """Yield hosts whose names cannot be part of folders and systemd units."""
    return (name for name in plan.hosts if not _HOST.fullmatch(name))


def _regex_error(pattern: str) -> str:
    try:
        re.compile(pattern)
    except (re.error, RecursionError, OverflowError) as error:
        return str(error)
    return ""


def _bad(message: str, span: Span) -> Finding:
    return finding("TF902", message, span, help="build it again: tfcompose build robot.yaml")


def _short(error: msgspec.ValidationError) -> str:
    """Return msgspec's message, with long quoted values shortened."""
    what, separator, place = str(error).rpartition(" - at ")
    return (
        f"{what}{separator}{place}"
        if len(what) <= _LONGEST_QUOTED
        else f"{what[:_LONGEST_QUOTED]}…{separator}{place}"
    )


def _shorten(value: Any) -> str:
    """Return a value as an error shows it, shortened."""
    text = _json(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"


_json = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


def _rows(rows: list[Any]) -> str:
    return "[\n" + ",\n".join(f"    {_json(row)}" for row in rows) + "\n  ]" if rows else "[]"
