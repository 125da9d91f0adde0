"""Tree of a running robot for the view: poses of frames, wrong edges and publishers.

A ``LiveTree`` returns data for a scene and a panel. The caller passes messages to its observers,
so that the tree reads no clock and no topic, and does not depend on a browser. Frames have their
names from the robot file. In the running tree, their names may have a prefix.
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

#: The time in seconds within which running publishers are discovered. Before this time, no edge
#: counts as missing.
FOUND_S = 2.5
_MISSING = frozenset({"TF804", "TF811"})
#: The time in seconds for which the view shows a silence after its end.
OVER_S = 3.0


class LiveTree(ShownTree):
    """Follows a running robot.

    Args:
        robot: the robot of the file.
        plan: the plan of this robot.
        observers: an observer for each pair of topics (moving, fixed) of the plan.
        tolerance: the largest accepted deviation of a pose.
    """

    def __init__(
        self, robot: Robot, plan: Plan, observers: Mapping[Topics, TreeObserver], tolerance: Offset
    ) -> None:
        super().__init__(robot)
        self.judgement = Judgement()
        self._observers = observers
        self._tolerance = tolerance
        self._judge = PlanJudge(robot, plan, tolerance)
        self._states: dict[str, list[EdgeState]] = {}

    def follow(self, robot: Robot, plan: Plan) -> None:
        """Compare with another version of the robot, with the same frames and other poses."""
        self.show_robot(robot)
        self._judge = PlanJudge(robot, plan, self._tolerance)

    def _newest(self) -> dict[str, Row]:
        return {child: stream.row for child, stream in self._streams().items()}

    def _streams(self) -> dict[str, EdgeStream]:
        """Return, for each frame, the stream of its newest transform in tf2.

        Transforms that tf2 would reject do not count.
        """
        newest: dict[str, EdgeStream] = {}
        for observer in self._observers.values():
            for stream in observer.streams:
                if stream.rejected_row is stream.row:
                    continue
                current = newest.get(stream.child)
                if current is None or stream.arrivals.last_ns >= current.arrivals.last_ns:
                    newest[stream.child] = stream
        return {self._pictures.name(child): stream for child, stream in newest.items()}

    def judge(self, listened_s: float) -> Judgement:
        """Return the findings about the received messages.

        ``listened_s`` is the time of listening, in seconds.
        """
        states = {
            topics: state_of(observer, topics) for topics, observer in self._observers.items()
        }
        edges: dict[str, list[EdgeState]] = {}
        for state in states.values():
            for edge in state.edges:
                edges.setdefault(self._pictures.name(edge.child), []).append(edge)
        self._states = edges  # a single assignment, because each window reads it in its own thread
        streams = self._streams()
        self.judgement = self._judge.judge(
            states,
            lambda difference: _counts(difference, listened_s),
            lambda edge: streams.get(self._pictures.name(edge.child)) is edge.stream,
        )
        return self.judgement

    def about(self, frame: str) -> list[str]:
        """Return text about the edge above a frame.

        It has a line for each publisher, then the findings.
        """
        edges = self._pictures.edges
        lines = [line for state in self._states.get(frame, ()) for line in _published_lines(state)]
        if not lines and frame in edges:
            lines = [f"nothing came from {edges[frame].owner} yet"]
        return lines + self.judgement.about(frame)


def _counts(difference: Difference, listened_s: float) -> bool:
    """Return whether the view shows a difference now.

    It does not show differences of publishers that have left, missing edges while publishers may
    still be discovered, and silences that ended some time ago.
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
    """Yield a line for each publisher of an edge: node, parent, rate, age of the newest pose."""
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
