"""Findings of ``verify`` about an observed tree, by frame of the scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.foundation.geometry import offset_of
from tfcompose.foundation.text import list_names
from tfcompose.guard.verdict.publishers import find_floods
from tfcompose.guard.verdict.tree import rejected_transforms
from tfcompose.guard.verdict.verify import differences, group_differences, group_finding
from tfcompose.model.plan.topics import parts_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from tfcompose.foundation.findings import Finding, Span
    from tfcompose.foundation.geometry import Offset
    from tfcompose.guard.verdict.verify import Difference
    from tfcompose.model.plan import Plan
    from tfcompose.model.robot import Robot
    from tfcompose.tf.live.edges import EdgeState
    from tfcompose.tf.live.state import TreeState

    Topics = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Judgement:
    """Findings about a tree, by frame and for the whole tree, and deviations from the plan."""

    findings: tuple[Finding, ...] = ()
    of_frame: Mapping[str, tuple[Finding, ...]] = field(default_factory=dict)
    off: Mapping[str, Offset] = field(default_factory=dict)

    @property
    def wrong(self) -> frozenset[str]:
        """The frames with an error on their edge."""
        return frozenset(
            frame
            for frame, findings in self.of_frame.items()
            if any(finding.severity == "error" for finding in findings)
        )

    @property
    def summary(self) -> str:
        """The text for a tree without findings."""
        return (
            f"elsewhere than declared: {list_names(sorted(self.off))}"
            if self.off
            else "all edges as expected"
        )

    def about(self, frame: str) -> list[str]:
        """Return a line for each finding about the edge above a frame."""
        off = [f"off by {self.off[frame].text}"] if frame in self.off else []
        return off + [
            f"{finding.code} {finding.message}" for finding in self.of_frame.get(frame, ())
        ]


class PlanJudge:
    """Compares observed trees with the plan of a robot.

    Poses may deviate by the tolerance. Frames have their names from the robot file.
    """

    def __init__(self, robot: Robot, plan: Plan, tolerance: Offset) -> None:
        self._plan = plan
        self._parts = parts_of(plan)
        self._tolerance = tolerance
        self._names = {robot.final(frame): frame for frame in robot.frames}
        self._places: dict[str, Span] = {
            robot.final(edge.child): edge.span for edge in robot.edges
        }

    def judge(
        self,
        states: Mapping[Topics, TreeState],
        counts: Callable[[Difference], bool],
        holds: Callable[[EdgeState], bool] = lambda _: False,
    ) -> Judgement:
        """Return findings about the states of the plan's topics.

        ``counts`` decides if a difference becomes a finding. A difference that does not count
        still marks its frame as off, if ``holds`` returns True for the edge: then no newer
        transform has arrived.
        """
        findings: list[Finding] = []
        of_frame: dict[str, list[Finding]] = {}
        off: dict[str, Offset] = {}
        for topics, part in self._parts.items():
            state = states[topics]
            different = differences(state, part, self._tolerance)
            kept = [difference for difference in different if counts(difference)]
            about = [
                ([edge.child], rejected)
                for edge in state.edges
                if edge.stream.rejected is not None
                for rejected in rejected_transforms(edge)
            ]
            about += [
                (list(_children(group)), self._finding(group, state))
                for group in group_differences(kept)
            ]
            about += [([], finding) for finding in find_floods(state)]
            for children, finding in about:
                findings.append(finding)
                for child in dict.fromkeys(children):
                    of_frame.setdefault(self._names.get(child, child), []).append(finding)
            left = [
                difference
                for difference in different
                if difference.live is not None and holds(difference.live)
            ]
            off |= {
                self._names.get(child, child): far
                for difference in (*kept, *left)
                for child, far in _off(difference)
            }
        return Judgement(
            tuple(findings), {frame: tuple(some) for frame, some in of_frame.items()}, off
        )

    def _finding(self, group: Sequence[Difference], state: TreeState) -> Finding:
        edge = group[0].edge
        return group_finding(
            group, state, self._plan, self._places.get(edge.child) if edge else None
        )


def _children(group: Sequence[Difference]) -> Iterator[str]:
    for difference in group:
        if difference.edge is not None:
            yield difference.edge.child
        elif difference.live is not None:
            yield difference.live.child


def _off(difference: Difference) -> Iterator[tuple[str, Offset]]:
    """Yield a frame that is not at its planned pose, and the distance."""
    if difference.edge is None or difference.live is None:
        return
    if difference.off is not None:
        yield difference.edge.child, difference.off
    elif difference.driver is not None:
        yield difference.edge.child, offset_of(difference.edge.pose, difference.live.stream.pose)
