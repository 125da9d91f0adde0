"""Language of ``fleet.yaml``, version 1.

A fleet file contains robots, their Zenoh routers, and the edges that they share.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator

from tfcompose.foundation.units import Rate
from tfcompose.model.plan.middleware import ENDPOINT
from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.validate import validate_file
from tfcompose.spec.language.values import Matches, Name, Namespace, Text, Texts

if TYPE_CHECKING:
    from tfcompose.spec.load import Source

_ARROW = re.compile(r"\s*(?:→|->)\s*")

#: The name of a robot. It is a part of Zenoh keys and frame names.
RobotName = Annotated[
    Text,
    Matches(r"[A-Za-z][A-Za-z0-9_-]*", "a robot's name: a letter, then letters, digits, _ and -"),
]
Edge = Annotated[
    Text,
    Matches(
        r"[^\s→>]+\s*(→|->)\s*[^\s→>]+",
        "an edge: parent → child (or ->); as an entry of share also parent → child at 5 Hz",
    ),
]


class SharedEdge(Spec):
    """A shared edge with its maximum rate."""

    edge: Edge = key(..., "parent → child, with the frame names on the robot", "odom → base_link")
    rate: Rate = key(5.0, "the maximum rate; a fixed edge is sent twice a second", "5 Hz")

    @property
    def ends(self) -> tuple[str, str]:
        """The parent and the child, with their names on the robot."""
        parent, child = _ARROW.split(self.edge.strip())
        return parent, child


def _by_name(value: Any) -> Any:
    """Expand ``parent → child at 5 Hz`` to a mapping."""
    if not isinstance(value, str):
        return value
    edge, separator, rate = value.partition(" at ")
    return {"edge": edge.strip(), "rate": rate.strip()} if separator else {"edge": edge}


Shared = Annotated[SharedEdge, BeforeValidator(_by_name, Text | SharedEdge)]


class FleetMember(Spec):
    """The robot's entry in a fleet file, with the edges it shares."""

    file: Text = key(..., "the fleet file, relative to this file", "fleet.yaml")
    robot: Text | None = key(
        None, "the robot's name in the fleet; default: the name of the robot", "r1"
    )


def _by_file(value: Any) -> Any:
    return {"file": value} if isinstance(value, str) else value


Member = Annotated[FleetMember, BeforeValidator(_by_file, Text | FleetMember)]


class FleetRobot(Spec):
    """A robot: its router, and the edges that it shares."""

    router: Annotated[
        Text, Matches(ENDPOINT, "an endpoint of Zenoh such as tcp/10.0.0.2:7447")
    ] = key(..., "the address of the robot's Zenoh router", "tcp/10.0.0.11:7447")
    share: tuple[Shared, ...] | None = key(
        None, "the edges that this robot shares; default: those of the fleet", ["map → odom"]
    )
    namespace: Namespace = key("", "the namespace of the robot's /tf and /tf_static", "robot1")
    prefix: Text | None = key(
        None,
        "the prefix of its frames in the fleet, unless they have it already; default: NAME/",
        "r1/",
    )


class FleetSpec(Spec):
    """A fleet of robots."""

    BEGIN: ClassVar[str] = "a fleet file begins with fleet: 1"
    HABITS: ClassVar[dict[str, str]] = {"tfcompose": BEGIN}

    fleet: Literal[1] = key(..., "the version of this language", 1)
    name: Name = key("fleet", "the name; fleets with different names are separate", "warehouse")
    robots: dict[RobotName, FleetRobot] = key(
        ...,
        "the robots by name",
        {"r1": {"router": "tcp/10.0.0.11:7447"}, "r2": {"router": "tcp/10.0.0.12:7447"}},
    )
    share: tuple[Shared, ...] = key(
        (), "the edges that each robot shares", ["map → odom", "odom → base_link at 5 Hz"]
    )
    shared_frames: Texts = key(
        ("map",), "frames that are the same for all robots, without a prefix", ["map", "dock"]
    )

    def edges_of(self, robot: str) -> tuple[SharedEdge, ...]:
        """Return the edges that a robot shares."""
        share = self.robots[robot].share
        return self.share if share is None else share

    def final(self, robot: str, frame: str) -> str:
        """Return the name of a robot's frame in the fleet."""
        robot_prefix = self.robots[robot].prefix
        prefix = f"{robot}/" if robot_prefix is None else robot_prefix
        return (
            frame
            if frame in self.shared_frames or frame.startswith(prefix)
            else f"{prefix}{frame}"
        )

    def key_of(self, robot: str) -> str:
        """Return the Zenoh key of a robot.

        The key for its edges ends with ``/tf`` or ``/tf_static``.
        """
        return f"tfcompose/fleet/{self.name}/{robot}"


def validate_fleet(source: Source) -> FleetSpec:
    """Return the validated fleet.

    Raises:
        RejectedError: with all findings, if the file has errors.
    """
    return validate_file(FleetSpec, source)
