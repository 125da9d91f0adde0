"""Parameter files of processes, overridden by parameters in the robot file."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.processes import FILE_KEY, names_files
from tfcompose.foundation.findings import Finding, Note, RejectedError, finding, nearest
from tfcompose.model.robot import AsInFile
from tfcompose.spec.language.variables import OF_FILES
from tfcompose.spec.load.params import NodeParams, ParamsFile, Word, load_params

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from tfcompose.compiler.resolve.draft import Draft
    from tfcompose.foundation.findings import Span
    from tfcompose.model.robot import Node, Process


def read_param_files(draft: Draft) -> Iterator[Finding]:
    """Read the parameter files of all processes, and override them with inline parameters.

    A file may be in a ROS package. Each part reads its own files.
    """
    robot, work = draft.robot, _ParamFiles(draft)
    names = {
        process.name
        for process in draft.processes
        if process.all_nodes or any(node.params for node in process.ros_nodes)
    }
    processes = list(robot.processes)
    for index, process in enumerate(processes):
        if process.name in names:
            processes[index] = work.process(process)
    source_data = dict(robot.source_data)
    if work.digests:
        source_data["parameter files"] = work.digests
    draft.robot = replace(robot, processes=tuple(processes), source_data=source_data)
    yield from work.findings


@dataclass(slots=True)
class _ParamFiles:
    draft: Draft
    findings: list[Finding] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    _files: dict[str, ParamsFile] = field(default_factory=dict)

    def process(self, process: Process) -> Process:
        other_params: dict[str, Any] = {}
        nodes = tuple(self._node(node, process, other_params) for node in process.ros_nodes)
        node_names = {node.name.lstrip("/") for node in nodes}
        other_params = {
            name: params
            for name, params in other_params.items()
            if name.lstrip("/") not in node_names
        }
        return replace(process, ros_nodes=nodes, other_params=other_params)

    def _node(self, node: Node, process: Process, other_params: dict[str, Any]) -> Node:
        """Return the node with its parameters.

        Other sections of its files are added to ``other_params``.
        """
        named: dict[str, Span] = {}
        sections: dict[str, dict[str, Any]] = {}
        places: dict[str, tuple[Span, ...]] = {}
        if process.all_nodes:
            for _, _, content in self._load_files(process.all_nodes, named):
                _add_sections(sections, content)
            common = self._inline(process.all_nodes, places)
            sections[_ANY] = _merge_params(sections.get(_ANY, {}), common)
        files = list(self._load_files(node, named))
        without = []
        for path, span, content in files:
            _add_sections(sections, content)
            for_node = any(matches(section.name, node.name) for section in content.nodes)
            if not for_node and not content.findings and not process.loads:
                without.append(_nothing(path, span, node, process, content.nodes))
        if len(without) == len(files):
            # A file for all nodes need not contain a section for each node.
            self.findings += without
        params_here: dict[str, Any] = {}
        for name, params in sections.items():
            if matches(name, node.name):
                params_here = _merge_params(params_here, params)
            other_params[name] = _merge_params(other_params.get(name, {}), _words(params))
        places |= {
            key: (named[value.span.file], value.span)
            for key, value in params_here.items()
            if isinstance(value, Word)
        }
        inline = self._inline(node, places)
        return replace(node, params=_merge_params(_words(params_here), inline), places=places)

    def _inline(self, node: Node, places: dict[str, tuple[Span, ...]]) -> dict[str, Any]:
        """Return the parameters from the robot file, and add their spans to ``places``."""
        has_files = names_files(node.params)
        for key in node.params:
            path = (*node.path, "params", key)
            if self.draft.spec.spans.has_key(path):
                places[key] = (self.draft.spec.key_span(path),)
        return {
            key: value for key, value in node.params.items() if not (has_files and key == FILE_KEY)
        }

    def _load_files(
        self, node: Node, named: dict[str, Span]
    ) -> Iterator[tuple[str, Span, ParamsFile]]:
        """Yield the files that a node names, and add the span of each name to ``named``."""
        for file, span in self._files_of(node):
            if not isinstance(file, str) or not file:
                self.findings.append(
                    finding("TF103", "params: file takes the names of files", span)
                )
            elif loaded := self._load(file, span):
                path, content = loaded
                named[path] = span
                yield path, span, content

    def _files_of(self, node: Node) -> list[tuple[Any, Span]]:
        """Return the parameter files that a node names, with the span of each name."""
        if not names_files(node.params):
            return []
        named, path = node.params[FILE_KEY], (*node.path, "params", FILE_KEY)
        paths = (
            [(named, path)]
            if isinstance(named, str)
            else [(file, (*path, i)) for i, file in enumerate(named)]
        )
        return [(file, self.draft.spec.span_of(path)) for file, path in paths]

    def _load(self, file: str, span: Span) -> tuple[str, ParamsFile] | None:
        """Return the path and the content of the parameter file."""
        call = OF_FILES.fullmatch(file)
        try:
            path = self.draft.packages.path_of(call[2] if call else file, span)
        except RejectedError as error:
            self.findings += error.findings
            return None
        if path in self._files:
            return path, self._files[path]
        note = Note("named here", span)
        if self.draft.read is None:
            self.findings.append(finding("TF001", f"{path}: files cannot be read here", span))
            return None
        try:
            text = self.draft.read(path)
            loaded = load_params(text, path)
        except RejectedError as error:
            self.findings += [
                replace(finding, notes=(*finding.notes, note)) for finding in error.findings
            ]
            return None
        self.findings += [
            replace(finding, notes=(*finding.notes, note)) for finding in loaded.findings
        ]
        self.digests[path] = hashlib.sha256(text.encode()).hexdigest()
        self._files[path] = loaded
        return path, loaded


#: The section of a parameter file that applies to every node.
_ANY = "/**"


def _add_sections(sections: dict[str, dict[str, Any]], content: ParamsFile) -> None:
    """Add the sections of a file, as rcl does: a repeated section keeps its first position."""
    for node in content.nodes:
        sections[node.name] = _merge_params(sections.get(node.name, {}), node.params)


def _nothing(
    path: str, span: Span, node: Node, process: Process, sections: Sequence[NodeParams]
) -> Finding:
    names = [section.name for section in sections]
    near = nearest(node.name.rpartition("/")[2], [name.rpartition("/")[2] for name in names])
    likely = next((section for section in sections if near and section.name.endswith(near)), None)
    notes = [Note(f"it has {likely.name}", likely.span)] if likely else []
    advice = (
        f"call it {node.name} there (/** means any node), or give the process that node: it has"
        f" {', '.join(names) or 'no node'}"
    )
    message = f"{path} has no parameters for {node.name}, the node of {process.name}"
    return finding("TF334", message, span, help=advice, notes=notes, severity="warning")


def matches(pattern: str, name: str) -> bool:
    """Return whether a pattern of a parameter file matches the node's name.

    ``*`` matches a single part of the name, ``**`` any number of parts.
    """
    return _matches(pattern.strip("/").split("/"), name.strip("/").split("/"))


def _matches(pattern: list[str], parts: list[str]) -> bool:
    if not pattern:
        return not parts
    if pattern[0] == "**":
        return any(_matches(pattern[1:], parts[skipped:]) for skipped in range(len(parts) + 1))
    return bool(parts) and pattern[0] in {"*", parts[0]} and _matches(pattern[1:], parts[1:])


def _merge_params(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Return ``below`` overridden by ``above``. Mappings are merged."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        merged[key] = (
            _merge_params(old, value)
            if isinstance(old, dict) and isinstance(value, dict)
            else value
        )
    return merged


def _words(value: Any) -> Any:
    if isinstance(value, Word):
        return AsInFile(value.text) if value.plain else value.text
    if isinstance(value, dict):
        return {key: _words(item) for key, item in value.items()}
    return [_words(item) for item in value] if isinstance(value, list) else value
