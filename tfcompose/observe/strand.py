"""An edge as one publisher sends it, and what is kept of it: its newest transform, its stamps, how often it comes."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from tfcompose.geometry import Pose
from tfcompose.tf2.exceptions import DENORMALISED, Rejection, rejection_of

if TYPE_CHECKING:
    from tfcompose.observe.tally import Tally
    from tfcompose.ros.tf_codec import Row

#: A frame that stays in each parent for so many transforms, or more, in the mean, is handed over.
SOME_IN_TURN = 3
_SECOND_NS = 1_000_000_000


@dataclass(slots=True)
class Strand:
    """An edge, as one publisher sends it on one kind of topic.

    Frames have the names that tf2 gives them: without the slash that some nodes write in front.

    Attributes:
        parent: the frame in which the pose is given.
        child: the frame whose pose it is.
        static: whether it came on /tf_static.
        gid: the publisher's id, 16 bytes; None where that is not known, as in a bag.
        row: the newest transform.
        stamp_ns: the newest message's stamp.
        newest_ns: the largest stamp so far.
        oldest_ns: the stamp of the first message.
        first_ns: when the first message came, by the receiver's clock.
        lag_ns: how old the newest message's stamp was when it came; negative: ahead of the receiver's clock.
        stamps_back: how many stamps were before the one that came before them.
        stamps_repeated: how many stamps were the one that came before them.
        refused: why tf2 does not take it, the newest time that it did not.
        refused_row: the newest that it did not take.
        refusals: how many were not taken.
        slashed: whether a name came with a slash in front.
        turns: the edges that put this frame in other parents, from the same publisher, and this one; None if none does.
        begun: how often this one came after another of them.
        tally: the arrivals; ``tally.count`` are all, ``tally.last_ns`` is when the newest came.
    """

    parent: str
    child: str
    static: bool
    gid: bytes | None
    tally: Tally
    first_ns: int
    row: Row
    newest_ns: int = -1
    stamp_ns: int = -1
    oldest_ns: int = -1
    lag_ns: int = 0
    stamps_back: int = 0
    stamps_repeated: int = 0
    refused: Rejection | None = None
    refused_row: Row | None = None
    refusals: int = 0
    slashed: bool = False
    turns: Turns | None = None
    begun: int = 0

    @property
    def pose(self) -> Pose:
        """The newest pose of the child in the parent, as it was sent; nothing is normalised."""
        return Pose(self.row[4:7], self.row[7:11])

    @property
    def speed(self) -> float:
        """How fast its stamps go on: seconds of them in a second, 1 where that cannot be said."""
        took_ns, stamped_ns = self.tally.last_ns - self.first_ns, self.newest_ns - self.oldest_ns
        return stamped_ns / took_ns if took_ns > 0 and stamped_ns > 0 else 1.0

    def take(self, row: Row, received_ns: int, clock_ns: int) -> None:
        """Note a transform; ``clock_ns`` is the time that its stamp is compared with."""
        stamp_ns = row[2] * _SECOND_NS + row[3]
        self.row = row
        if stamp_ns > self.newest_ns:
            if self.newest_ns < 0:
                self.oldest_ns = stamp_ns
            self.newest_ns = stamp_ns
        elif stamp_ns < self.stamp_ns:
            self.stamps_back += 1
        elif stamp_ns == self.stamp_ns:
            self.stamps_repeated += 1
        self.stamp_ns = stamp_ns
        self.lag_ns = clock_ns - stamp_ns
        if self.turns is not None and self.turns.take(self) and self.turns.are_taken:
            self.tally.began_again(received_ns)
        else:
            self.tally.arrived(received_ns, None if self.static else self.lag_ns)
        _, _, _, _, px, py, pz, x, y, z, w = row
        far = px + py + pz
        sound = abs(x * x + y * y + z * z + w * w - 1) < DENORMALISED and isfinite(far)
        if not sound or self.parent == self.child or not self.parent or not self.child:
            self.refuse()

    def refuse(self) -> None:
        """Count the newest transform as one that tf2 does not take, if that is so."""
        why = rejection_of(self.parent, self.child, self.row[4:])
        if why is not None:
            self.refused, self.refused_row, self.refusals = why, self.row, self.refusals + 1


@dataclass(slots=True)
class Turns:
    """The edges with which one publisher puts one frame now in this parent, now in that: who holds it, who has it."""

    strands: list[Strand]
    holder: Strand

    def join(self, strand: Strand) -> None:
        """Count an edge among them."""
        self.strands.append(strand)
        if len(self.strands) > 1:
            for each in self.strands:
                each.turns = self

    def take(self, strand: Strand) -> bool:
        """Note that a transform of one of them came, and return whether the one before was another's."""
        if strand is self.holder:
            return False
        self.holder = strand
        strand.begun += 1
        return True

    @property
    def are_taken(self) -> bool:
        """Whether the frame changes hands, now and then; where one comes between the others, it jumps to and fro."""
        return all((each.begun - 1) * SOME_IN_TURN <= each.tally.count for each in self.strands)
