"""The nodes of a process, by their full names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.findings import Finding, finding
from tfcompose.model import Node
from tfcompose.resolve.node_presets import node_preset, node_preset_names

if TYPE_CHECKING:
    from tfcompose.language.process import ProcessSpec, Started
    from tfcompose.language.robot import RobotSpec
    from tfcompose.load import Path, Source

#: The key among a process's parameters that names files with more of them.
FILE_KEY = "file"


def full_name(namespace: str, name: str) -> str:
    """Return a node's, topic's or service's full name: below the namespace unless it begins with a slash."""
    if name.startswith("/"):
        return name
    return "/" + "/".join(part for part in (namespace.strip("/"), name) if part)


def namespace_of(said: Started | None, namespace: str) -> str:
    """Return the namespace of a process's nodes, without a leading slash: its own, or the robot's ``namespace``."""
    if said is None or said.namespace is None:
        return namespace
    return full_name(namespace, said.namespace).strip("/")


def has_claims(spec: RobotSpec) -> bool:
    """Return whether anything is said of what nodes publish, or a process has several nodes."""
    return any(said.nodes or said.publishes or (said.node and said.node.preset) for said in spec.processes.values())


def names_files(params: dict[str, Any]) -> bool:
    """Return whether parameters name files."""
    return isinstance(params.get(FILE_KEY), (str, list))


def _usual(said: ProcessSpec) -> str | None:
    """Return the name that a known node has where tfcompose cannot give it another."""
    if said.node is None or said.node.preset is None or (said.run and said.run.package):
        return None
    return node_preset(said.node.preset).node if said.node.preset in node_preset_names() else None


def nodes_of(name: str, said: ProcessSpec, namespace: str, source: Source) -> tuple[tuple[Node, ...], list[Finding]]:
    """Return the nodes of a process, at least one, and what is wrong with them."""
    at: Path = ("processes", name)
    if not said.nodes:
        place = source.at(("processes", name, "node")) if said.node else source.at_key(at)
        own_name = (said.node.name if said.node else None) or _usual(said) or name
        return (Node(full_name(namespace, own_name), place, at, said.params, said.lifecycle),), []
    found = []
    for key in ("publishes",) if said.publishes else ():
        message = f"{name} has nodes, and {key} names none of them"
        found.append(finding("TF107", message, source.at_key((*at, key)), help="write it under one of its nodes"))
    for key in said.params:
        advice = f"write it under nodes: {{{next(iter(said.nodes))}: {{params: {{{key}: …}}}}}}"
        message = f"{name} has nodes, and the parameter {key} names none of them"
        found.append(finding("TF107", message, source.at_key((*at, "params", key)), help=advice))
    nodes = [
        Node(
            full_name(namespace, node),
            source.at_key((*at, "nodes", node)),
            (*at, "nodes", node),
            own.params,
            own.lifecycle,
        )
        for node, own in said.nodes.items()
    ]
    return tuple(nodes), found
