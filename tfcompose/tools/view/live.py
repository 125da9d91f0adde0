"""A running tree for the view: poses of frames, edges with errors, and publishers.

The caller feeds observers of a ``LiveTree``, which returns data for a scene and a panel. It reads
no clock and no topic and does not depend on a browser. Frames have the names of the robot file; on
the tree they may have a prefix.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tfcompose.foundation.text import duration
from tfcompose.guard.verdict.verify import state_of
from tfcompose.tf.live.state import who
from tfcompose.tools.view.judgement import Judgement, PlanJudge
from tfcompose.tools.view.picture import ShownTree

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from tfcompose.foundation.geometry import Offset
    from tfcompose.guard.verdict.verify import Difference
    from tfcompose.model.plan import Plan
    from tfcompose.model.robot import Robot
    from tfcompose.tf.live.edges import EdgeState, EdgeStream, TreeObserver
    from tfcompose.tf.ros.tf_codec import Row

    Topics = tuple[str, str]

#: Publishers that were there before are found within this time; until then nothing is missing.
FOUND_S = 2.5
_MISSING = frozenset({"TF804", "TF811"})
#: How long a silence that is over is shown after it.
OVER_S = 3.0


class LiveTree(ShownTree):
    """Follows a running robot.

    Args:
        robot: as it is in the file.
        plan: what its processes publish.
        observers: by topics (moving, fixed): those of the plan.
        tolerance: how far a pose may be off.
    """

    def __init__(
        self, robot: Robot, plan: Plan, observers: Mapping[Topics, TreeObserver], tolerance: Offset
    ) -> None:
        super().__init__(robot)
        self.judgement = Judgement()
        self._observers = observers
        self._judge = PlanJudge(robot, plan, tolerance)
        self._states: dict[str, list[EdgeState]] = {}

    def _newest(self) -> dict[str, Row]:
        return {child: stream.row for child, stream in self._streams().items()}

    def _streams(self) -> dict[str, EdgeStream]:
        """Return the stream from which came what is newest of each frame, as tf2 has it.

        Without what it refuses.
        """
        newest: dict[str, EdgeStream] = {}
        for observer in self._observers.values():
            for stream in observer.streams:
                if stream.rejected_row is stream.row:
                    continue
                other = newest.get(stream.child)
                if other is None or stream.arrivals.last_ns >= other.arrivals.last_ns:
                    newest[stream.child] = stream
        return {self._pictures.name(child): stream for child, stream in newest.items()}

    def judge(self, listened_s: float) -> Judgement:
        """Judge the received messages after this many seconds of listening.

        Return the findings.
        """
        states = {
            topics: state_of(observer, topics) for topics, observer in self._observers.items()
        }
        edges: dict[str, list[EdgeState]] = {}
        for state in states.values():
            for edge in state.edges:
                edges.setdefault(self._pictures.name(edge.child), []).append(edge)
        self._states = edges  # at once: a window reads it in a thread of its own
        streams = self._streams()
        self.judgement = self._judge.judge(
            states,
            lambda difference: _counts(difference, listened_s),
            lambda edge: streams.get(self._pictures.name(edge.child)) is edge.stream,
        )
        return self.judgement

    def about(self, frame: str) -> list[str]:
        """Return text about the edge above a frame.

        A line for each publisher, then findings.
        """
        edges = self._pictures.edges
        lines = [line for state in self._states.get(frame, ()) for line in _published_lines(state)]
        if not lines and frame in edges:
            lines = [f"nothing came from {edges[frame].owner} yet"]
        return lines + self.judgement.about(frame)


def _counts(difference: Difference, listened_s: float) -> bool:
    """Return whether it is so now.

    Neither of a publisher that has left, nor of what may still come, nor of a silence that ended
    a while ago.
    """
    if difference.over and difference.live is not None:
        since_s = difference.live.timing.since_gap_s
        if since_s is not None and since_s > OVER_S:
            return False
    if (
        difference.fault is not None
        and difference.live is not None
        and difference.live.present is False
    ):
        return False
    return listened_s >= FOUND_S or difference.code not in _MISSING


def _published_lines(edge: EdgeState) -> Iterator[str]:
    """Yield who publishes an edge, in which parent, how often, and how old the newest pose is."""
    kind = (
        "fixed"
        if edge.stream.static
        else f"{edge.timing.rate:.3g} Hz"
        if edge.timing.rate
        else "once"
    )
    age = edge.age_s if edge.data_age_s is None else edge.data_age_s
    gone = ", has left" if edge.present is False else ""
    yield f"{who(edge)} in {edge.parent}, {kind}, {duration(age)} old{gone}"
