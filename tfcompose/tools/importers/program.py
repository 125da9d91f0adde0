"""Data of a program that a script or a launch file starts."""

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
    """The description given to a robot_state_publisher: a xacro file or a URDF text."""

    #: A xacro file; empty if ``text`` is given.
    file: str = ""
    #: Arguments of the xacro file.
    args: Mapping[str, str] = field(default_factory=dict)
    #: The text of a URDF.
    text: str = ""
    #: The prefix of frame names (``frame_prefix``).
    prefix: str = ""
    span: Span | None = None


@dataclass(frozen=True, slots=True)
class Program:
    """A program as the source starts it."""

    span: Span | None
    package: str | None = None
    executable: str | None = None
    #: The program's own arguments; without a package, the whole command.
    argv: tuple[str, ...] = ()
    #: Whether ``argv`` is a single text for a shell.
    shell: bool = False
    name: str | None = None
    label: str | None = None
    #: The absolute namespace; None if the source sets none.
    namespace: str | None = None
    #: Parameters and names of parameter files, in order. The last one wins.
    params: tuple[Mapping[str, Any] | str, ...] = ()
    remap: tuple[tuple[str, str], ...] = ()
    env: Mapping[str, str] = field(default_factory=dict)
    #: Further keys of the process, as in a robot file.
    keys: Mapping[str, Any] = field(default_factory=dict)
    #: The delay after the start of the launch file, in seconds.
    period_s: float = 0.0
    reader: Reader | None = None
    description: Description | None = None
    #: Descriptions of what is not imported.
    todo: tuple[str, ...] = ()
    #: Whether it is a container that loads components.
    loads: bool = False
    #: The class of a component; empty for other programs.
    plugin: str = ""
    #: Indices of the ``params`` that the source passes under the node's full name. All other
    #: parameters apply to every node.
    exact: range = range(0)
