"""Language of injected faults: what a case does to its robot, or to what was recorded of it."""

import re
from typing import Annotated, ClassVar

from pydantic import AfterValidator, Field

from tfcompose.foundation.units import Duration, JointPosition, Number, Rate, invalid
from tfcompose.spec.language.pose import Rotated
from tfcompose.spec.language.spec import Checked, Spec, key
from tfcompose.spec.language.values import Matches, NodeName, Text, Xyz

_ARROW = re.compile(r"\s*(?:→|->)\s*")
#: Two frames: a parent and a child, or any frame and another one whose pose is in it.
FramePair = Annotated[
    Text, Matches(r"\s*[^\s→>]+\s*(→|->)\s*[^\s→>]+\s*", "two frames: parent → child (or ->)")
]


def split_pair(pair: str) -> tuple[str, str]:
    """Return the two frames of a ``FramePair``."""
    first, second = _ARROW.split(pair.strip())
    return first, second


def _is_share(value: float) -> float:
    if not 0 < value <= 1:
        raise invalid("TF106", f"{value:g} is not a share", "more than 0, and at most 1")
    return value


def _is_possible_rate(value: float) -> float:
    if value > _MOST_HZ:
        raise invalid("TF106", f"{value:g} Hz is faster than a fault can send", "at most 10 kHz")
    return value


def _is_possible_shift(value: float) -> float:
    if value > _MOST_S:
        raise invalid("TF106", f"{value:g} s is too long to shift a stamp", "at most 1000000 s")
    return value


#: The greatest rate, and the greatest shift: seconds of a stamp are a number of 32 bits.
_MOST_HZ, _MOST_S = 10_000, 1_000_000

Share = Annotated[Number, AfterValidator(_is_share)]
SentRate = Annotated[Rate, AfterValidator(_is_possible_rate)]
Shift = Annotated[Duration, AfterValidator(_is_possible_shift)]


class PublishSpec(Rotated):
    """A node that publishes an edge on /tf."""

    edge: FramePair = key(..., "the edge that it publishes", "odom → base_link")
    rate: SentRate = key(50.0, "its rate; default: 50 Hz", "50 Hz")
    as_: NodeName = Field(
        "/injected",
        alias="as",
        description="the full name of the node, which a recording does not have; default:"
        " /injected",
        examples=["/old_odometry"],
    )
    xyz: Xyz = key((0.0, 0.0, 0.0), "position: x forward, y left, z up", [1, 0, 0])


class ShiftSpec(Spec):
    """An edge, and a time."""

    edge: FramePair = key(..., "the edge", "odom → base_link")
    by: Shift = key(..., "by how much", "300 ms")


class DropSpec(Spec):
    """An edge whose messages are lost."""

    edge: FramePair = key(..., "the edge", "odom → base_link")
    share: Share = key(1.0, "the share of messages that is lost; default: all", 0.5)


class RenameSpec(Spec):
    """A frame, and its wrong name."""

    frame: Text = key(..., "the frame", "laser")
    to: Text = key(..., "its name from then on", "lasr")


class JumpSpec(Rotated):
    """An edge, and by how much its pose is off."""

    edge: FramePair = key(..., "the edge", "odom → base_link")
    xyz: Xyz = key((0.0, 0.0, 0.0), "the offset, in the child frame", [0.5, 0, 0])


class DynamicSpec(Spec):
    """A fixed edge that is sent on /tf."""

    edge: FramePair = key(..., "the fixed edge", "base_link → laser")
    rate: SentRate = key(10.0, "how often; default: 10 Hz", "10 Hz")


class JointFault(Spec):
    """A joint, and where it is."""

    name: Text = key(..., "the joint", "arm_joint")
    position: JointPosition = key(..., "its position, for example beyond its limits", "200 deg")


#: The faults, by their keys.
KINDS = (
    "publish",
    "kill",
    "stop",
    "late",
    "ahead",
    "clock",
    "drop",
    "jitter",
    "rename",
    "jump",
    "dynamic",
    "joint",
)


class InjectionSpec(Checked):
    """A fault, and when it begins."""

    EXCLUSIVE: ClassVar[tuple[frozenset[str], ...]] = (frozenset(KINDS),)

    publish: PublishSpec | None = key(
        None,
        "a node publishes an edge, beside its owner",
        {"edge": "odom → base_link", "rate": "50 Hz", "as": "/old_odometry"},
    )
    kill: Text | None = key(
        None, "a process is killed; in a recording, its edges end", "base_drive"
    )
    stop: Text | None = key(
        None, "a process hangs (SIGSTOP); in a recording, its edges end", "base_drive"
    )
    late: ShiftSpec | None = key(
        None, "stamps are earlier", {"edge": "odom → base_link", "by": "300 ms"}
    )
    ahead: ShiftSpec | None = key(
        None, "stamps are in the future", {"edge": "odom → base_link", "by": "1 s"}
    )
    clock: FramePair | None = key(
        None, "stamps are of another clock, which begins at 0", "odom → base_link"
    )
    drop: DropSpec | None = key(
        None, "messages are lost", {"edge": "odom → base_link", "share": 0.5}
    )
    jitter: ShiftSpec | None = key(
        None,
        "messages arrive later, by a random time up to ``by``",
        {"edge": "odom → base_link", "by": "50 ms"},
    )
    rename: RenameSpec | None = key(
        None, "a frame has another name", {"frame": "laser", "to": "lasr"}
    )
    jump: JumpSpec | None = key(
        None, "a pose jumps", {"edge": "odom → base_link", "xyz": [0.5, 0, 0]}
    )
    dynamic: DynamicSpec | None = key(
        None, "a fixed edge is sent on /tf instead", {"edge": "base_link → laser"}
    )
    joint: JointFault | None = key(
        None, "a joint is at a position", {"name": "arm_joint", "position": "200 deg"}
    )
    at: Duration | None = key(
        None,
        "when it begins, after the first transform of the recording, or after the started tree is"
        " complete; default: at once",
        "1 s",
    )

    @property
    def kind(self) -> str | None:
        """The key of the fault; None: there is none."""
        return next((name for name in KINDS if getattr(self, name) is not None), None)

    @property
    def edge(self) -> str | None:
        """The edge of the robot that the fault changes; None: none, or several."""
        for fault in (self.late, self.ahead, self.drop, self.jitter, self.jump, self.dynamic):
            if fault is not None:
                return fault.edge
        return self.clock

    @property
    def fault(self) -> object:
        """The value of that key."""
        return getattr(self, self.kind or "at")
