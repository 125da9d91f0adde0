"""Conversion of a node's parameters to the form of a robot file."""

from __future__ import annotations

import posixpath
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.param_files import matches
from tfcompose.compiler.resolve.processes import FILE_KEY
from tfcompose.foundation.findings import RejectedError
from tfcompose.foundation.reach import OutsideError
from tfcompose.foundation.reading import is_file
from tfcompose.foundation.yaml_text import flow, parameter
from tfcompose.model.robot import value_of_word
from tfcompose.spec.load.params import Word, load_params
from tfcompose.tools.importers.draft import path_from
from tfcompose.tools.importers.launch_records import PACKAGE
from tfcompose.tools.importers.texts import MadeFile, Text, concatenate

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from tfcompose.model.files import Target
    from tfcompose.spec.load.params import NodeParams
    from tfcompose.tools.importers.draft import ImportDraft
    from tfcompose.tools.importers.program import Program

#: Parameters by the name of their node and a number, which separates several sections for the same
#: node.
_Sections = dict[tuple[str, int], dict[str, Any]]
#: The section of a parameter file that applies to every node.
_ANY = "/**"
_NODE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
#: Maximum size of a parameter file.
MOST_BYTES = 16_000_000


def node_in_files(params: Sequence[Mapping[str, Any] | str], draft: ImportDraft) -> str | None:
    """Return the only node that the parameter files name; None if there are others or none."""
    files = [file for file in params if isinstance(file, str)]
    nodes = [node.name for file in files for node in _nodes_in(file, draft) or ()]
    names = {node.rpartition("/")[2] for node in nodes if "*" not in node}
    name = names.pop() if len(names) == 1 else ""
    return name if _NODE.fullmatch(name) else None


@dataclass(frozen=True, slots=True)
class ImportedParams:
    """Parameters of a process in the form of a robot file."""

    #: Parameter files, and parameters that override their values.
    common: dict[str, Any] = field(default_factory=dict)
    #: Parameters under the node's name, for a node that keeps its name.
    of_node: dict[str, Any] = field(default_factory=dict)
    #: Arguments for parameters that a robot file has no key for.
    argv: list[str] = field(default_factory=list)
    #: Descriptions of parameters that are not imported.
    left: list[str] = field(default_factory=list)
    #: The value of use_sim_time that the node gets; None if nothing sets it.
    clock: Any = None


def params_of(
    program: Program, target: Target, node: str, draft: ImportDraft, *, keeps_name: bool
) -> ImportedParams:
    """Return the parameters of a node.

    rcl keeps sections in the order in which their names first appear. If several sections apply to
    a node, the last section wins. For a component, launch passes each parameter separately. In a
    robot file, inline parameters override the values of parameter files. Therefore a parameter is
    inline only if the files do not already give its value. If ``keeps_name``, inline parameters
    apply to every node of the process.
    """
    files: list[str] = []
    left = []
    full = f"{(program.namespace or '').rstrip('/')}/{node}"
    sections: _Sections = {}
    of_files: _Sections = {}
    for index, param_set in enumerate(program.params):
        if not isinstance(param_set, str):
            params = {key: bring_files(value, draft) for key, value in param_set.items()}
            by_node = [(full if index in program.exact else _ANY, params)]
        elif param_set.startswith(PACKAGE):
            left.append(f"the parameters of {param_set}: the package was not found")
            continue
        elif param_set not in draft.made and not is_file(posixpath.join(target.top, param_set)):
            left.append(f"the parameters of {param_set}, which does not exist")
            continue
        else:
            files.append(
                draft.bring(param_set) if param_set in draft.made else path_from(target, param_set)
            )
            nodes = _nodes_in(param_set, draft)
            if nodes is None and any(sections.values()):
                left.append(
                    f"{param_set} overrides the parameters before it: here they override the file"
                )
            by_node = [(each.name, dict(_by_full_name(each.params, ""))) for each in nodes or ()]
            for name, params in by_node:
                of_files.setdefault((name, 0), {}).update(params)
        for name, params in by_node:
            sections.setdefault((name, index if program.plugin else 0), {}).update(params)
    common: dict[str, Any] = {}
    if keeps_name:
        in_file = of_files.setdefault((_ANY, 0), {})
        common = _other_than(in_file, sections.get((_ANY, 0), {}))
        in_file |= common
    counting = _that_count(sections, full)
    node_params = _other_than(_that_count(of_files, full), counting)
    argv = _file_parameter(common) + _file_parameter(node_params)
    if argv and program.plugin:
        left.append(f"the parameter {FILE_KEY}")
        argv = []
    named: dict[str, Any] = {FILE_KEY: files[0] if len(files) == 1 else files} if files else {}
    common, node_params = (
        (_values(common), _values(node_params)) if keeps_name else (_values(node_params), {})
    )
    clock = value_in(counting.get("use_sim_time"))
    return ImportedParams(named | common, node_params, argv, left, clock)


def _other_than(excluded: Mapping[str, Any], params: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in params.items() if value is not excluded.get(key)}


def _file_parameter(params: dict[str, Any]) -> list[str]:
    """Remove the parameter with the same name as the key for files; return it as arguments."""
    if not isinstance(params.get(FILE_KEY), (str, list)):
        return []
    value = params.pop(FILE_KEY)
    text = concatenate(["'", value, "'"]) if isinstance(value, str) else flow(value)
    return ["--ros-args", "-p", concatenate([f"{FILE_KEY}:=", text])]


def bring_files(value: Any, draft: ImportDraft) -> Any:
    """Replace the placeholder path at the end of a text by the path of the written file."""
    if isinstance(value, list):
        return [bring_files(item, draft) for item in value]
    made = next((path for path in draft.made if str(value).endswith(path)), None)
    if made is None or not isinstance(value, str):
        return value
    return Text.of((value.removesuffix(made), MadeFile(draft.bring(made))))


def _values(params: Mapping[str, Any]) -> dict[str, Any]:
    return {key: parameter(value_in(value)) for key, value in params.items()}


def _that_count(sections: _Sections, node: str) -> dict[str, Any]:
    """Return the parameters that a node gets from sections."""
    of_sections = (params for (name, _), params in sections.items() if matches(name, node))
    return {key: value for params in of_sections for key, value in params.items()}


def value_in(value: Any) -> Any:
    """Return a parameter's value; parse it if it is the text of a file."""
    if isinstance(value, list):
        return list(map(value_in, value))
    if isinstance(value, Word):
        return value_of_word(value.text) if value.plain else value.text
    return value


def _by_full_name(params: Mapping[str, Any], above: str) -> Iterator[tuple[str, Any]]:
    for key, value in params.items():
        if isinstance(value, dict):
            yield from _by_full_name(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _nodes_in(file: str, draft: ImportDraft) -> list[NodeParams] | None:
    """Return the parameters of nodes in a parameter file.

    Return None if the file has none, does not exist, or may not be read.
    """
    try:
        text = draft.made.get(file) or draft.reach.read(file, MOST_BYTES).decode()
        return load_params(text, file).nodes or None
    except (OSError, OutsideError, UnicodeDecodeError, RejectedError):
        return None
