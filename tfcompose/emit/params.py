"""Parameter files for nodes: YAML, keyed by the node's fully qualified name."""

from __future__ import annotations

import json
from typing import Any


def params_file(node: str, params: dict[str, Any]) -> str:
    """Return the file's text. Texts are always quoted, so that ROS cannot take one for a number or a bool."""
    return "\n".join([f"{json.dumps(node)}:", "  ros__parameters:", *_mapping(params, "    "), ""])


def _mapping(values: dict[str, Any], indent: str) -> list[str]:
    lines = []
    for key, value in values.items():
        if isinstance(value, dict) and value:
            lines += [f"{indent}{json.dumps(key, ensure_ascii=False)}:", *_mapping(value, indent + "  ")]
        else:
            lines.append(f"{indent}{json.dumps(key, ensure_ascii=False)}: {json.dumps(value, ensure_ascii=False)}")
    return lines
