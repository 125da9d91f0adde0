"""A process before it becomes a command line, its nodes, and the edges that they claim."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from tfcompose.model.fields import narrow
from tfcompose.model.plan import PlanClaim, PlanHost, PlanProcess, switch_text
from tfcompose.model.plan.topics import GLOBAL

STATIC, JOINTS, GUARD = "static", "joints", "guard"
BUILT_IN = (STATIC, JOINTS, GUARD)
#: Beginning of a command that a shell runs.
SHELL = ("/bin/sh", "-c")
#: Beginning of a command that runs a launch file.
ROS2_LAUNCH = ("ros2", "launch")

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.foundation.findings import Span
    from tfcompose.model.plan import LifecycleState, LogLevel


class AsInFile(str):
    """An unquoted value from a parameter file; ROS determines its type."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Node:
    """A ROS node of a process; ``name`` is its full name."""

    name: str
    span: Span
    #: The path of the mapping with its parameters.
    path: tuple[str | int, ...] = ()
    params: dict[str, Any] = field(default_factory=dict)
    #: The state into which the guard brings the node.
    lifecycle: LifecycleState | None = None
    #: Full names of parameters that contradict the tree.
    contradicting: frozenset[str] = frozenset()
    #: Spans of the top-level parameters in the robot file. For a parameter from a parameter file,
    #: the span of the file's name and the span in the file.
    places: Mapping[str, tuple[Span, ...]] = field(default_factory=dict, compare=False)

    @property
    def flat_params(self) -> dict[str, Any]:
        """The parameters by full name, with dots."""
        return {name: _read_as_ros(value) for name, value in self.flat_texts.items()}

    @property
    def flat_texts(self) -> dict[str, Any]:
        """The parameters by full name, with values of parameter files as text."""
        return _flat(self.params)


def _flat(params: dict[str, Any], above: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in params.items():
        flat |= (
            _flat(value, f"{above}{key}.") if isinstance(value, dict) else {f"{above}{key}": value}
        )
    return flat


_TRUTHS = {
    form: truth
    for text, truth in {
        **dict.fromkeys(("y", "yes", "true", "on"), True),
        **dict.fromkeys(("n", "no", "false", "off"), False),
    }.items()
    for form in (text, text.capitalize(), text.upper())
}
_HEX = re.compile(r"[+-]?0[xX][0-9A-Fa-f]+")
_OCTAL = re.compile(r"[+-]?0[0-7]*")
_DECIMAL = re.compile(r"[+-]?[1-9][0-9]*")
_DOUBLE = re.compile(
    r"[+-]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|\.?(?:inf|nan))", re.IGNORECASE
)


def value_of_word(text: str) -> bool | float | str:
    """Return the value that rcl reads from an unquoted word: ``on`` is true, 012 is ten."""
    if text in _TRUTHS:
        return _TRUTHS[text]
    for form, base in ((_HEX, 16), (_OCTAL, 8), (_DECIMAL, 10)):
        if form.fullmatch(text):
            return int(text, base)
    if _DOUBLE.fullmatch(text):
        special = text.lower().endswith(("inf", "nan"))
        return float(text.replace(".", "") if special else text)
    return str(text)


def _read_as_ros(value: Any) -> Any:
    """Return a word of a parameter file as a boolean if ROS reads one, otherwise as text."""
    if not isinstance(value, AsInFile):
        return value
    typed_value = value_of_word(value)
    return typed_value if isinstance(typed_value, bool) else str(value)


@dataclass(frozen=True, slots=True)
class Process(PlanProcess):
    """A process of the plan, with data that only the compiler needs.

    It runs an executable of a package, a launch file, or the command ``argv``. In the first two
    cases, ``argv`` holds only arguments until ``to_plan`` builds the complete command.
    """

    nodes: tuple[str, ...] = field(init=False)
    lifecycle: dict[str, LifecycleState] = field(init=False)
    span: Span = field(kw_only=True)
    ros_nodes: tuple[Node, ...] = field(default=(), kw_only=True)
    #: The package of ``executable``.
    package: str | None = field(default=None, kw_only=True)
    executable: str | None = field(default=None, kw_only=True)
    #: A launch file: ``package/file``.
    launch: str | None = field(default=None, kw_only=True)
    #: Rate of the joint states that the process publishes, in Hz.
    rate: float | None = field(default=None, kw_only=True)
    #: The name of its ``Part``; empty for a process of the robot itself.
    part: str = field(default="", kw_only=True)
    #: Whether its parameter ``robot_description`` is the URDF, for a stock robot_state_publisher.
    describes: bool = field(default=False, kw_only=True)
    #: Whether it is a container of components.
    loads: bool = field(default=False, kw_only=True)
    #: The span of its host, if the file names one.
    host_at: Span | None = field(default=None, kw_only=True, compare=False)
    #: Parameters for each of its nodes, including unlisted ones.
    all_nodes: Node | None = field(default=None, kw_only=True)
    #: These parameters, and parameters for unlisted nodes from its parameter files, by names and
    #: patterns in order.
    other_params: dict[str, Any] = field(default_factory=dict, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", tuple(node.name for node in self.ros_nodes))
        states = {node.name: node.lifecycle for node in self.ros_nodes if node.lifecycle}
        object.__setattr__(self, "lifecycle", states)

    def to_plan(self, **made: Any) -> PlanProcess:
        """Return the process in the form of the plan.

        The form includes fields that depend on the complete robot.
        """
        return narrow(PlanProcess, self, **made)

    @property
    def takes_ros_arguments(self) -> bool:
        """Whether further arguments on the command line reach a node.

        A shell and a launch file do not pass them on.
        """
        return self.launch is None and self.argv[:2] not in {SHELL, ROS2_LAUNCH}

    def is_node(self, *, owns: bool) -> bool:
        """Return whether the process is certainly a ROS node that accepts ROS arguments.

        A plain command counts if it ``owns`` an edge or has settings that only nodes have.
        """
        if self.kind != "run" or self.package is not None or self.launch is not None:
            return True
        if not self.takes_ros_arguments:
            return False
        return (
            owns
            or self.log_level is not None
            or self.namespace is not None
            or bool(self.other_params)
            or any(node.params for node in self.ros_nodes)
            or bool(self.remap.keys() - set(GLOBAL))
            or "--ros-args" in self.argv
        )

    def with_default_level(self, level: LogLevel) -> Process:
        """Return the process with this log level, if it is a program without a log level."""
        if self.log_level or self.kind != "run" or self.launch is not None:
            return self
        return replace(self, log_level=level)

    @property
    def node(self) -> str:
        """The full name of the first node, which is usually the only node."""
        return self.nodes[0] if self.nodes else ""

    @property
    def params(self) -> dict[str, Any]:
        """The parameters of the first node."""
        return self.ros_nodes[0].params if self.ros_nodes else {}


@dataclass(frozen=True, slots=True)
class Host(PlanHost):
    """A computer of the plan, with the span of its name."""

    span: Span = field(kw_only=True, compare=False)

    def to_plan(self) -> PlanHost:
        """Return the computer in the form of the plan."""
        return narrow(PlanHost, self)


@dataclass(frozen=True, slots=True)
class Claim(PlanClaim):
    """A claim of the plan, with the parameters that stop it."""

    #: The text of ``off``.
    switch: str = field(init=False)
    #: Values of parameters that stop the claim.
    off: dict[str, Any] = field(kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "switch", switch_text(self.off))

    def to_plan(self) -> PlanClaim:
        """Return the claim in the form of the plan."""
        return PlanClaim(self.node, self.parent, self.child, self.switch)
