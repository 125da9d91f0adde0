"""Parameter files that a process names.

What they say to its nodes, with the inline parameters laid over it.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.compiler.resolve.processes import FILE_KEY, full_name, names_files
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
    """Lay the parameters of processes over those in files; processes of parts have theirs.

    A file may be in a package.
    """
    robot, work = draft.robot, _Work(draft)
    names = {
        process.name
        for process in draft.processes
        if any(node.params for node in process.ros_nodes)
    }
    processes = list(robot.processes)
    for index, process in enumerate(processes):
        if process.name in names:
            processes[index] = work.process(process)
    source_data = dict(robot.source_data)
    if work.digests:
        source_data["parameter files"] = work.digests
    draft.robot = replace(robot, processes=tuple(processes), source_data=source_data)
    yield from work.found


@dataclass(slots=True)
class _Work:
    draft: Draft
    found: list[Finding] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    _known: dict[str, ParamsFile] = field(default_factory=dict)

    def process(self, process: Process) -> Process:
        return replace(
            process, ros_nodes=tuple(self._node(node, process) for node in process.ros_nodes)
        )

    def _node(self, node: Node, process: Process) -> Node:
        params: dict[str, Any] = {}
        places: dict[str, tuple[Span, ...]] = {}
        without: list[Finding] = []
        files = self._files_of(node)
        for file, place in files:
            if isinstance(file, str) and file:
                given = self._params_in(file, place, node, process, without)
                places |= {
                    key: (place, value.at)
                    for key, value in given.items()
                    if isinstance(value, Word)
                }
                params = _laid_over(params, _words(given))
            else:
                self.found.append(finding("TF103", "params: file takes the names of files", place))
        if len(without) == len(
            files
        ):  # a file that all nodes are given need not have something for each
            self.found += without
        has_files = names_files(node.params)
        inline = {
            key: value for key, value in node.params.items() if not (has_files and key == FILE_KEY)
        }
        paths = {key: (*node.path, "params", key) for key in inline}
        places |= {
            key: (self.draft.spec.at_key(path),)
            for key, path in paths.items()
            if self.draft.spec.spans.has_key(path)
        }
        return replace(node, params=_laid_over(params, inline), places=places)

    def _files_of(self, node: Node) -> list[tuple[Any, Span]]:
        """Return the parameter files that a node names, each with the place of its name."""
        if not names_files(node.params):
            return []
        named, at = node.params[FILE_KEY], (*node.path, "params", FILE_KEY)
        paths = (
            [(named, at)]
            if isinstance(named, str)
            else [(one, (*at, i)) for i, one in enumerate(named)]
        )
        return [(file, self.draft.spec.at(path)) for file, path in paths]

    def _params_in(
        self, file: str, at: Span, node: Node, process: Process, without: list[Finding]
    ) -> dict[str, Any]:
        """Return what a file says to the node, in words.

        ``without`` gets a finding if it says nothing to it.
        """
        call = OF_FILES.fullmatch(file)
        try:
            path = self.draft.packages.path_of(call[2] if call else file, at)
        except RejectedError as error:
            self.found += error.findings
            return {}
        loaded = self._load(path, at)
        if loaded is None:
            return {}
        namespace = (
            self.draft.robot.ros.namespace if process.namespace is None else process.namespace
        )
        meant = [one for one in loaded.nodes if matches(full_name(namespace, one.name), node.name)]
        if not meant and not loaded.found:
            without.append(_nothing(path, at, node, process, loaded.nodes))
        params: dict[str, Any] = {}
        for one in meant:
            params = _laid_over(params, one.params)
        return params

    def _load(self, path: str, at: Span) -> ParamsFile | None:
        if path in self._known:
            return self._known[path]
        note = Note("named here", at)
        if self.draft.read is None:
            self.found.append(finding("TF001", f"{path}: files cannot be read here", at))
            return None
        try:
            text = self.draft.read(path)
            loaded = load_params(text, path)
        except RejectedError as error:
            self.found += [replace(one, notes=(*one.notes, note)) for one in error.findings]
            return None
        self.found += [replace(one, notes=(*one.notes, note)) for one in loaded.found]
        self.digests[path] = hashlib.sha256(text.encode()).hexdigest()
        self._known[path] = loaded
        return loaded


def _nothing(
    path: str, at: Span, node: Node, process: Process, there: Sequence[NodeParams]
) -> Finding:
    names = [one.name for one in there]
    near = nearest(node.name.rpartition("/")[2], [name.rpartition("/")[2] for name in names])
    meant = next((one for one in there if near and one.name.endswith(near)), None)
    notes = [Note(f"it has {meant.name}", meant.at)] if meant else []
    advice = (
        f"call it {node.name} there, or give the process that node: it has"
        f" {', '.join(names) or 'no node'}"
    )
    message = f"{path} has no parameters for {node.name}, the node of {process.name}"
    return finding("TF334", message, at, help=advice, notes=notes, severity="warning")


def matches(pattern: str, name: str) -> bool:
    """Return whether a pattern of a parameter file means the node.

    * is one part of a name, ** any number of them.
    """
    return _matches(pattern.strip("/").split("/"), name.strip("/").split("/"))


def _matches(pattern: list[str], parts: list[str]) -> bool:
    if not pattern:
        return not parts
    if pattern[0] == "**":
        return any(_matches(pattern[1:], parts[skipped:]) for skipped in range(len(parts) + 1))
    return bool(parts) and pattern[0] in {"*", parts[0]} and _matches(pattern[1:], parts[1:])


def _laid_over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Return parameters with others laid over them; mappings merge."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        merged[key] = (
            _laid_over(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
        )
    return merged


def _words(value: Any) -> Any:
    if isinstance(value, Word):
        return AsInFile(value.text) if value.plain else value.text
    if isinstance(value, dict):
        return {key: _words(item) for key, item in value.items()}
    return [_words(item) for item in value]
