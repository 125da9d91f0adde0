"""Parameter files for nodes: YAML, keyed by the node's fully qualified name."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from tfcompose.model import AsInFile
from tfcompose.plan import known_at_launch

if TYPE_CHECKING:
    from tfcompose.model import Process

#: What JSON lets stand in a text and YAML takes for the end of a line, or does not allow at all.
_ESCAPED = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")


def file_params(process: Process) -> dict[str, dict[str, Any]]:
    """Return what the process's parameter file holds, by node: all but the paths that only the launcher knows."""
    if process.kind != "run":
        return {}
    nodes = {node.name: _known(node.params) for node in process.ros_nodes}
    return {node: params for node, params in nodes.items() if params}


def _known(params: dict[str, Any]) -> dict[str, Any]:
    kept = {}
    for key, value in params.items():
        if not known_at_launch(value):
            kept[key] = value
        elif isinstance(value, dict) and (rest := _known(value)):
            kept[key] = rest
    return kept


def params_file(nodes: dict[str, dict[str, Any]]) -> str:
    """Return the file's text. Texts are always quoted, so that ROS cannot take one for a number or a bool."""
    lines = []
    for node, params in nodes.items():
        lines += [f"{_text(node)}:", "  ros__parameters:", *mapping(params, "    ")]
    return "\n".join([*lines, ""])


def mapping(values: dict[str, Any], indent: str) -> list[str]:
    """Return the mapping as lines of YAML; lists and texts as JSON, which is YAML as well."""
    lines = []
    for key, value in values.items():
        if isinstance(value, dict) and value:
            lines += [f"{indent}{_text(key)}:", *mapping(value, indent + "  ")]
        else:
            lines.append(f"{indent}{_text(key)}: {_text(value)}")
    return lines


#: A word that YAML takes for one, wherever it stands.
_PLAIN = re.compile(r"[A-Za-z0-9_.+-]+")


def _text(value: Any) -> str:
    """Return the value as JSON that is YAML as well; a word of somebody's parameter file as it stood there."""
    if isinstance(value, AsInFile) and _PLAIN.fullmatch(value):
        return str(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    return _ESCAPED.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(value, ensure_ascii=False))
