"""Controls of ``nudge --interactive``: keys that move mounts, and the rows of the screen."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.cli.adjusting import describe_adjustment, moved, reset, undone
from tfcompose.cli.tables import Table, shorten
from tfcompose.compiler.render.text import BOLD, PLAIN
from tfcompose.foundation.numbers import number
from tfcompose.guard.verdict.publishers import show_pose
from tfcompose.tools.adjust.change import ANGLES, AXES, PoseChange, change_pose
from tfcompose.tools.adjust.selection import short_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from tfcompose.cli.adjusting import Edges
    from tfcompose.model.plan import Plan, PlanEdge

#: Sizes of a step, in millimetres and degrees.
STEPS_MM = (0.1, 1.0, 10.0, 100.0)
STEPS_DEG = (0.01, 0.1, 1.0, 10.0)
_KEYS = "↑↓ move · ←→ axis · + - step · Tab mount · u undo · r reset · s save · q quit"
_MOVE_KEYS = {"up": 1, "k": 1, "down": -1, "j": -1}
_AXIS_KEYS = {"right": 1, "left": -1}
_SIZE_KEYS = {"+": 1, "=": 1, "-": -1, "_": -1}
_MOUNT_KEYS = {"tab": 1, "backtab": -1}
_TABLE = Table(least={1: 12, 0: 8})
_REVERSE = "\033[7m"
#: Rows of the screen besides the mounts.
_OTHER_ROWS = 7


@dataclass(frozen=True, slots=True)
class Step:
    """A change of a mount by keys."""

    #: The mount's frame.
    child: str
    #: A value of the pose, ``undo`` or ``reset``.
    kind: str
    #: What to add, in metres or radians.
    value: float = 0.0
    #: Whether the axes are the mount's own.
    local: bool = False

    def apply(self, edge: PlanEdge) -> PlanEdge:
        """Return the edge after the step."""
        if self.kind in AXES:
            change = PoseChange(self.kind, self.value)
            return moved(edge, change_pose(edge.pose, [change], local=self.local))
        restore = undone if self.kind == "undo" else reset
        return restore(edge) if edge.earlier else edge


def apply_steps(plan: Plan, steps: Iterable[Step]) -> Edges:
    """Return the edges of a plan after steps, in order; frames that are gone stay away."""
    edges: Edges = {}
    for step in steps:
        for edge in plan.edges:
            if edge.child == step.child and plan.is_adjustable(edge):
                edges[edge.child] = step.apply(edges.get(edge.child, edge))
    return edges


@dataclass(slots=True)
class Controls:
    """What is chosen, which steps are due, and what the screen shows."""

    #: The robot's name.
    name: str
    plan: Plan
    #: The frame of the chosen mount.
    child: str
    #: Steps to take. Equal ones are joined, so that a held key is one step.
    steps: list[Step] = field(default_factory=list)
    #: Whether to save the adjusted poses.
    saves: bool = False
    #: Whether to quit.
    quits: bool = False
    #: What the last request led to.
    message: str = ""
    _axis: int = 0
    _size: int = 1
    _local: bool = False
    _confirming: bool = False

    def press(self, key: str) -> None:
        """Take a key."""
        confirmed, self._confirming = self._confirming and key == "r", False
        self.message = ""
        match key:
            case "l":
                self._local = not self._local
            case "u":
                self.steps.append(Step(self.child, "undo"))
            case "r" if confirmed:
                self.steps.append(Step(self.child, "reset"))
            case "r":
                self._confirming = True
            case "s":
                self.saves = True
            case "q" | "esc":
                self.quits = True
            case _:
                self._axis = (self._axis + _AXIS_KEYS.get(key, 0)) % len(AXES)
                size = self._size + _SIZE_KEYS.get(key, 0)
                self._size = min(max(size, 0), len(STEPS_MM) - 1)
                self._choose(_MOUNT_KEYS.get(key, 0))
                self._move(_MOVE_KEYS.get(key, 0))

    def take_steps(self) -> list[Step]:
        """Return the steps that are due, and forget them."""
        steps, self.steps = self.steps, []
        return steps

    def follow(self, plan: Plan) -> None:
        """Show another plan, which the robot runs by now."""
        self.plan = plan
        mounts = self._mounts()
        if mounts and self.child not in {edge.child for edge in mounts}:
            self.child = mounts[0].child

    def rows(self, columns: int, rows: int) -> list[str]:
        """Return the rows for a terminal of this size; none is wider."""
        mounts = self._mounts()
        number_of = next((at for at, edge in enumerate(mounts) if edge.child == self.child), 0)
        room = max(rows - _OTHER_ROWS, 1)
        first = min(max(number_of - room // 2, 0), max(len(mounts) - room, 0))
        table = [(short_name(edge), edge.name, describe_adjustment(edge)) for edge in mounts]
        lines = _TABLE.lines(table, columns - 2) if table else ["no mount can be nudged"]
        texts = [(f" {self.name}".ljust(columns), _REVERSE)]
        for at, line in [*enumerate(lines)][first : first + room]:
            texts.append((f"▸ {line}", BOLD) if at == number_of else (f"  {line}", ""))
        texts += [("", "")] * (rows - len(texts) - _OTHER_ROWS + 1)
        pose = show_pose(mounts[number_of].pose) if mounts else ""
        texts += [("", ""), (f" {pose}", ""), (f" {self._axis_row()}", ""), ("", "")]
        texts += [(f" {self._notice()}", BOLD), (f" {_KEYS}", "")]
        return [_fit(text, style, columns) for text, style in texts[-rows:]]

    def _mounts(self) -> list[PlanEdge]:
        return [edge for edge in self.plan.edges if self.plan.is_adjustable(edge)]

    def _choose(self, by: int) -> None:
        children = [edge.child for edge in self._mounts()]
        if self.child in children:
            self.child = children[(children.index(self.child) + by) % len(children)]

    def _move(self, sign: int) -> None:
        if not sign:
            return
        axis = AXES[self._axis]
        is_angle = axis in ANGLES
        size = math.radians(STEPS_DEG[self._size]) if is_angle else STEPS_MM[self._size] / 1e3
        step = Step(self.child, axis, sign * size, self._local)
        last = self.steps[-1] if self.steps else None
        if last and replace(last, value=step.value) == step:
            self.steps[-1] = replace(step, value=last.value + step.value)
        else:
            self.steps.append(step)

    def _axis_row(self) -> str:
        chosen = AXES[self._axis]
        axes = "".join(f" {axis} " for axis in AXES).replace(f" {chosen} ", f"[{chosen}]")
        is_angle = chosen in ANGLES
        size, unit = (STEPS_DEG, "deg") if is_angle else (STEPS_MM, "mm")
        about = "about" if is_angle else "along"
        of = "the mount's own axes" if self._local else "the parent's axes (l: the mount's)"
        return f"{axes}  steps of {number(size[self._size])} {unit} {about} {of}"

    def _notice(self) -> str:
        if self._confirming:
            return f"r again resets {self.child} to its built pose"
        return self.message


def _fit(text: str, style: str, columns: int) -> str:
    fitted = shorten(text, columns, at_end=True)
    return f"{style}{fitted}{PLAIN}" if style else fitted
