"""Tree of a recording for the view: poses of frames at any time, and findings.

The tree keeps all transforms of a bag as numbers, with 64 bytes for each. A frame has its last
recorded pose before the chosen time. A fixed edge is valid at any time, as in tf2. Before its
first message, a fixed edge has the pose of this message.
"""

from __future__ import annotations

from array import array
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tfcompose.foundation.signals import Stop
from tfcompose.foundation.text import duration
from tfcompose.guard.verdict.verify import state_of
from tfcompose.tf.bags import BagFeed
from tfcompose.tf.live.edges import TreeObserver
from tfcompose.tf.live.feed import follow
from tfcompose.tf.tf2.exceptions import rejection_of
from tfcompose.tools.view.judgement import Judgement, PlanJudge
from tfcompose.tools.view.picture import ShownTree

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from tfcompose.foundation.geometry import Offset
    from tfcompose.model.plan import Plan
    from tfcompose.model.robot import Robot
    from tfcompose.tf.ros.tf_codec import Row

    Topics = tuple[str, str]

_NUMBERS = 7
_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class _Track:
    """The recorded transforms of a frame, in the order of recording.

    Each transform has its parent, and whether it was fixed.
    """

    times_ns: array[int] = field(default_factory=lambda: array("q"))
    poses: array[float] = field(default_factory=lambda: array("d"))
    parents: array[int] = field(default_factory=lambda: array("l"))
    is_fixed: bytearray = field(default_factory=bytearray)

    def add(self, at_ns: int, row: Row, parent: int, *, static: bool) -> None:
        if self.times_ns and at_ns < self.times_ns[-1]:
            at_ns = self.times_ns[-1]  # the files of a bag may overlap in time
        self.times_ns.append(at_ns)
        self.poses.extend(row[4:11])
        self.parents.append(parent)
        self.is_fixed.append(static)

    def index_at(self, at_ns: int) -> int | None:
        """Return the index of the transform that was valid at a time; None before the first."""
        index = bisect_right(self.times_ns, at_ns) - 1
        return index if index >= 0 else 0 if self.is_fixed[0] else None


class RecordingObserver(TreeObserver):
    """Observes a tree, and also keeps every transform, by frame."""

    def __init__(self) -> None:
        super().__init__()
        self.tracks: dict[str, _Track] = {}
        self.parents: dict[str, int] = {}

    def take(
        self,
        rows: Iterable[Row],
        *,
        static: bool,
        gid: bytes | None,
        received_ns: int,
        clock_ns: int | None = None,
    ) -> None:
        """Add a message."""
        rows = tuple(rows)
        super().take(rows, static=static, gid=gid, received_ns=received_ns, clock_ns=clock_ns)
        for row in rows:
            parent, child = row[0].removeprefix("/"), row[1].removeprefix("/")
            if rejection_of(parent, child, row[4:]) is None:
                number = self.parents.setdefault(parent, len(self.parents))
                self.tracks.setdefault(child, _Track()).add(
                    received_ns, row, number, static=static
                )


class Recorded:
    """The contents of a bag on some pairs of topics (moving, fixed).

    Raises:
        BagError: if the bag cannot be read, or contains none of the topics.
    """

    def __init__(self, path: str, topics: Iterable[Topics]) -> None:
        self.observers = {pair: RecordingObserver() for pair in topics}
        follow(BagFeed(path, self.observers), Stop())
        begins = [observer.begun_ns for observer in self.observers.values() if observer.begun_ns]
        self.begin_ns = min(begins, default=0)
        self.end_ns = max((observer.last_ns for observer in self.observers.values()), default=0)

    @property
    def length_s(self) -> float:
        """The time from the first transform to the last, in seconds."""
        return (self.end_ns - self.begin_ns) / _SECOND_NS


class BagTree(ShownTree):
    """A recorded tree at a time, ``at_s`` seconds after the first transform.

    Args:
        robot: the robot of the file. plan: the plan of this robot. recorded: the contents of the
        bag on the plan's topics. tolerance: the largest accepted deviation of a pose.
    """

    def __init__(self, robot: Robot, plan: Plan, recorded: Recorded, tolerance: Offset) -> None:
        super().__init__(robot)
        self.at_s = 0.0
        self._recorded = recorded
        self._rows: dict[str, tuple[_Track, int, Row]] = {}
        states = {
            topics: state_of(observer, topics) for topics, observer in recorded.observers.items()
        }
        self.judgement: Judgement = PlanJudge(robot, plan, tolerance).judge(states, lambda _: True)
        self._rates = {
            self._pictures.name(edge.child): edge.timing.rate
            for state in states.values()
            for edge in state.edges
        }

    @property
    def _at_ns(self) -> int:
        return self._recorded.begin_ns + round(self.at_s * _SECOND_NS)

    def _newest(self) -> Mapping[str, Row]:
        newest: dict[str, tuple[_Track, int, Row]] = {}
        for observer in self._recorded.observers.values():
            names = list(observer.parents)
            for child, track in observer.tracks.items():
                index = track.index_at(self._at_ns)
                if index is None:
                    continue
                name = self._pictures.name(child)
                best, before = newest.get(name), self._rows.get(name)
                if best is not None and best[0].times_ns[best[1]] > track.times_ns[index]:
                    continue
                if before is not None and before[0] is track and before[1] == index:
                    newest[name] = before
                    continue
                x, y, z, qx, qy, qz, qw = track.poses[index * _NUMBERS : (index + 1) * _NUMBERS]
                row: Row = (names[track.parents[index]], child, 0, 0, x, y, z, qx, qy, qz, qw)
                newest[name] = (track, index, row)
        self._rows = newest
        return {name: row for name, (_, _, row) in newest.items()}

    def about(self, frame: str) -> list[str]:
        """Return text about the edge above a frame at the chosen time, then its findings."""
        if frame in self._rows:
            track, index, row = self._rows[frame]
            rate = self._rates.get(frame)
            kind = "fixed" if track.is_fixed[index] else f"{rate:.3g} Hz" if rate else "once"
            age_s = (self._at_ns - track.times_ns[index]) / _SECOND_NS
            age = f"recorded {duration(age_s)} {'before' if age_s >= 0 else 'later'}"
            lines = [f"in {row[0]}, {kind}, {age}"]
        else:
            lines = (
                [f"nothing was recorded yet at {self.at_s:.2f} s"]
                if frame in self._pictures.edges
                else []
            )
        return lines + self.judgement.about(frame)
