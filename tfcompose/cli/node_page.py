"""One preset of a node that publishes TF: as plain data, and as a page for people."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from tfcompose.resolve.presets import node_preset, node_preset_names

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.language.node_preset import ClaimSpec

_ROLE = re.compile(r"\{(\w+)\}")


def rows() -> list[dict[str, str]]:
    """Return all presets of nodes as rows of a list, by package."""
    known = sorted(((name, node_preset(name)) for name in node_preset_names()), key=lambda one: one[1].package)
    return [
        {"name": name, "vendor": preset.package, "model": preset.node, "kind": "node", "about": preset.about}
        for name, preset in known
    ]


def facts(name: str) -> dict[str, Any]:
    """Return the preset as plain data; the frames of a claim have the names that they have by default."""
    preset = node_preset(name)
    usual = {role: frame.default for role, frame in preset.frames.items()}
    return {
        "name": name,
        "package": preset.package,
        "node": preset.node,
        "kind": "node",
        "about": preset.about,
        "frames": {
            role: {"parameter": frame.parameter, "default": frame.default} for role, frame in preset.frames.items()
        },
        "one_of": preset.one_of,
        "publishes": [_claim(claim, usual) for claim in preset.publishes],
        "set": preset.set,
        "hint": preset.hint,
        "source": [
            {key: getattr(fact, key) for key in ("repository", "path", "commit") if getattr(fact, key)}
            for fact in preset.source
        ],
    }


def _claim(claim: ClaimSpec, usual: Mapping[str, str]) -> dict[str, Any]:
    def named(value: Any) -> Any:
        if isinstance(value, str):
            return _ROLE.sub(lambda role: usual.get(role[1], role[0]), value)
        return {key: named(item) for key, item in value.items()} if isinstance(value, dict) else value

    return {
        "parent": named(claim.parent),
        "child": named(claim.child),
        "topic": "/tf_static" if claim.static else "/tf",
        "by_default": claim.by_default,
        "on": named(claim.on),
        "off": named(claim.off),
        "chosen_by": named(claim.chosen_by),
    }


def text(preset: dict[str, Any]) -> str:
    """Return the page."""
    parts = [f"{preset['name']}  the node {preset['node']} of {preset['package']}\n{preset['about']}"]
    parts.append("publishes" + (", one of these" if preset["one_of"] else ""))
    parts[-1] += "".join(f"\n  {_claim_text(claim)}" for claim in preset["publishes"])
    if preset["frames"]:
        width = max(map(len, preset["frames"]))
        lines = [f"  {role:<{width}}  {_role_text(frame)}" for role, frame in preset["frames"].items()]
        parts.append("frames\n" + "\n".join(lines))
    if preset["set"]:
        parts.append(f"told as well\n  {_pairs(preset['set'])}")
    if preset["hint"]:
        parts.append(f"note\n  {preset['hint']}")
    sources = [" ".join(str(part) for part in fact.values()) for fact in preset["source"]]
    parts.append("source\n" + "\n".join(f"  {source}" for source in sources))
    return "\n\n".join(parts) + "\n"


def _claim_text(claim: dict[str, Any]) -> str:
    how = [claim["topic"]]
    if claim["chosen_by"]:
        how.append(f"with {_pairs(claim['chosen_by'])}")
    elif not claim["by_default"]:
        how.append(f"only with {_pairs(claim['on'])}")
    how.append(f"off: {_pairs(claim['off'])}" if claim["off"] else "no switch")
    return f"{claim['parent']} → {claim['child']}  {', '.join(how)}"


def _role_text(frame: dict[str, Any]) -> str:
    if frame["parameter"] is None:
        return f"{frame['default']}, which cannot be told"
    return f"{frame['parameter']}, by default {frame['default']}"


def _pairs(values: dict[str, Any]) -> str:
    return ", ".join(
        f"{key}: {str(value).lower() if isinstance(value, bool) else value}" for key, value in values.items()
    )
