"""An edge that somebody published who may not, or in a way that it may not: whether it is so, and what is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tfcompose.plan import Plan, PlanEdge

NAMELESS = "a publisher without a node name"
LOOP, SELF, TWO_WRITERS = "TF820", "TF821", "TF822"
REPEATED, BACK, WRONG_CLOCK = "TF823", "TF824", "TF825"


@dataclass(frozen=True, slots=True)
class Offence:
    """One edge that was published by somebody who may not, or in a way that it may not.

    ``nodes`` are those of which one did it: a single one where the rmw says who sent a message, none where the sender
    has no name. A ``namesake`` has the owner's name and is not the owner. ``loop`` holds the frames of a loop that the
    edge closes, ``detail`` what was seen of stamps, or who the other writer is. ``recorded`` says that it is from a
    recording, in which nobody has a name.
    """

    code: str
    parent: str
    child: str
    nodes: tuple[str, ...]
    static: bool
    edge: PlanEdge | None
    namesake: bool = False
    loop: tuple[str, ...] = ()
    detail: str = ""
    recorded: bool = False

    @property
    def who(self) -> str:
        """The offender, as people read it."""
        if len(self.nodes) > 1:
            return f"one of {', '.join(self.nodes)}"
        name = self.nodes[0] if self.nodes else "somebody" if self.recorded else NAMELESS
        return f"another {name}" if self.namesake else name

    @property
    def whom(self) -> str:
        """The offender, as the one to do something about: one without a name was told of just before."""
        if not self.nodes and not self.recorded and not self.namesake:
            return "it"
        return f"the other {self.nodes[0]}" if self.namesake and len(self.nodes) == 1 else self.who

    @property
    def name(self) -> str:
        """The edge that was seen."""
        return f"{self.parent} → {self.child}"

    @property
    def is_owners(self) -> bool:
        """Whether the edge's owner did it."""
        return self.edge is not None and self.edge.node in self.nodes and not self.namesake

    @property
    def of_stamps(self) -> bool:
        """Whether it is about stamps, and over as soon as these are right."""
        return self.code in {REPEATED, BACK, WRONG_CLOCK}

    def over(self, more: int = 0) -> str:
        """Return the sentence that says that it has ended, and that so many ``more`` of its kind have."""
        named = f"{self.name} and {more} more edges" if more else self.name
        if self.of_stamps:
            return f"{self.who} stamps {named} as it should again"
        return f"{named} {'are' if more else 'is'} no longer published by {self.who}"


def code_of(edge: PlanEdge, parent: str, *, static: bool, owner: bool, sure: bool) -> str:
    """Return what is wrong with a planned edge that came below ``parent``, on /tf_static or not; empty if nothing is.

    ``owner`` says that its owner may have sent it, ``sure`` that nobody else can have.
    """
    if not edge.may_hang_on(parent):
        return "TF802"
    if not owner:
        return "TF801"
    return "TF809" if sure and static != (edge.kind == "static") else ""


def relays_of(plan: Plan) -> frozenset[str]:
    """Return the nodes that may pass on what others own: the guards of all hosts, where they are strict."""
    hosts = {None, *(process.host for process in plan.processes)}
    return frozenset(node for host in hosts for node in plan.guards_of(host))


def may_be_owners(edge: PlanEdge, nodes: Sequence[str], relays: frozenset[str] = frozenset()) -> bool:
    """Return whether one of the nodes is the edge's owner, or passes on what the owner sends."""
    return edge.node in nodes or not relays.isdisjoint(nodes)
