"""One node: what is known of it, what the user told it, and what tfcompose tells it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.model import SHELL, AsInFile, Node, Process

if TYPE_CHECKING:
    from tfcompose.language.node_preset import ClaimSpec, NodePresetSpec
    from tfcompose.resolve.roles import Roles


def flat(params: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Return nested parameters by their full names, with dots."""
    found: dict[str, Any] = {}
    for key, value in params.items():
        found |= flat(value, f"{above}{key}.") if isinstance(value, dict) else {f"{above}{key}": _meant(value)}
    return found


def _meant(value: Any) -> Any:
    """Return a word of a parameter file as ROS reads it, as far as switches and names need it: true, false, or text."""
    if not isinstance(value, AsInFile):
        return value
    return {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}.get(
        value.lower(), str(value)
    )


@dataclass(slots=True)
class Told:
    """One node: what is known of it, what the user told it, and what tfcompose tells it."""

    process: Process
    node: Node
    claims: tuple[ClaimSpec, ...]
    preset: NodePresetSpec | None
    roles: Roles
    given: dict[str, Any]
    computed: dict[str, Any] = field(default_factory=dict)

    def ends(self, claim: ClaimSpec) -> tuple[str, str]:
        """Return the frames that the claim is about, parent and child."""
        return self.roles.fill(claim.parent), self.roles.fill(claim.child)

    def has(self, params: dict[str, Any]) -> bool:
        """Return whether the user gave exactly these parameters."""
        return bool(params) and all(self.given.get(key) == value for key, value in params.items())

    def is_published(self, claim: ClaimSpec) -> bool:
        """Return whether the node publishes the edge as the user has set it."""
        return (claim.by_default or self.has(claim.on)) and not self.has(claim.off)

    @property
    def can_be_told(self) -> bool:
        """Return whether parameters that tfcompose writes reach the node: launch files and shells have to pass them."""
        process = self.process
        if process.kind != "run":
            return False
        is_node = process.launch is None and process.argv[:2] != SHELL
        return is_node or "${params_file}" in " ".join(process.argv)
