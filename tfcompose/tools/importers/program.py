"""A program that a script or a launch file starts, as the source has it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.foundation.findings import Span
    from tfcompose.tools.importers.static_transforms import Reader

JOINT_PUBLISHERS = frozenset({"joint_state_publisher", "joint_state_publisher_gui"})
#: The package of the stock containers of components.
CONTAINERS = "rclcpp_components"


@dataclass(frozen=True, slots=True)
class Description:
    """What a robot_state_publisher is given.

    A xacro ``file`` with ``args``, or the text of a URDF.

    ``prefix`` is written in front of its frames.
    """

    file: str = ""
    args: Mapping[str, str] = field(default_factory=dict)
    text: str = ""
    prefix: str = ""
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Program:
    """A program as the source starts it.

    ``argv`` are its own arguments, or the whole command without a package; ``shell`` says that it
    is one text for a shell. ``params`` are parameters, and names of files, in order: the last one
    counts. ``namespace`` is absolute, or None where nothing is said. ``keys`` are further keys of
    the process, as in a robot file; ``period_s`` is how long after the launch it is started.
    ``todo`` is what of it could not be taken. It is a container of components if it ``loads``
    them, and a component where it has a ``plugin``, its class. ``exact`` are the indices of
    parameters that are given under the node's full name, others are given to every node.
    """

    span: Span | None
    package: str | None = None
    executable: str | None = None
    argv: tuple[str, ...] = ()
    shell: bool = False
    name: str | None = None
    label: str | None = None
    namespace: str | None = None
    params: tuple[Mapping[str, Any] | str, ...] = ()
    remap: tuple[tuple[str, str], ...] = ()
    env: Mapping[str, str] = field(default_factory=dict)
    keys: Mapping[str, Any] = field(default_factory=dict)
    period_s: float = 0.0
    reader: Reader | None = None
    description: Description | None = None
    todo: tuple[str, ...] = ()
    loads: bool = False
    plugin: str = ""
    exact: range = range(0)
