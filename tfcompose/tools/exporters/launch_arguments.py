"""Arguments of a robot file that become launch arguments in the exported launch file.

An argument of the robot file becomes a launch argument if it affects only the conditions,
command-line arguments, parameters, remappings and environment variables of processes. Any other
argument is fixed: the launch file contains the value that the argument has during the export.
"""

from __future__ import annotations

import re
from argparse import Namespace
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from tfcompose.cli.compiling import compile_file, inputs_of, load_robot, overlays_of
from tfcompose.cli.writing import destination
from tfcompose.compiler.emit import emit
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.stock import OWN_KINDS
from tfcompose.spec.language import (
    compose,
    profiles_in,
    validate,
)
from tfcompose.spec.language.args import as_given
from tfcompose.spec.language.argument_uses import HOLE, names_of, uses_of
from tfcompose.spec.language.arguments import values_that_satisfy
from tfcompose.spec.language.expressions import environment_in, names_in
from tfcompose.spec.language.values import plain
from tfcompose.tools.exporters.launch_texts import ArgumentValue, VariableValue
from tfcompose.tools.exporters.launch_values import LaunchArgument, LaunchValues, condition_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.model.files import File
    from tfcompose.model.plan import Plan, PlanProcess
    from tfcompose.spec.language import ArgSpec
    from tfcompose.spec.language.argument_uses import ArgumentUses
    from tfcompose.tools.exporters.launch_texts import Text


_ARGUMENT = re.compile(r"\s*args\.([A-Za-z_][A-Za-z0-9_]*)\s*")


def collect_launch_values(
    arguments: Namespace, plan: Plan
) -> tuple[LaunchValues, tuple[File, ...], list[str]]:
    """Return the launch file's values, the files that it needs, and the fixed arguments.

    ``plan`` is the built plan. The robot file must have no errors.
    """
    robot_file = load_robot(arguments.file)
    overlays = overlays_of(arguments, robot_file)
    source = compose(robot_file, arguments.profiles, overlays, inputs_of(arguments))
    uses = uses_of(source)
    validated = validate(source, profiles_in(source), inputs_of(arguments))
    specs, values = validated.spec.args, validated.args
    kinds = {name: spec.kind for name, spec in specs.items()}
    _fix_conditions(uses, kinds)
    managed = {process.name: process for process in plan.managed}
    combined = _Combinations(arguments, plan, specs, values)
    missing = {
        name: expression for name, expression in uses.conditions.items() if name not in managed
    }
    more = {
        name: addition
        for name, expression in missing.items()
        if (addition := combined.process(name, expression))
    }
    for name, expression in uses.conditions.items():
        if name not in managed and name not in more:
            uses.fix(f"${{{expression}}}")
    kept, conditions = _settle(uses, kinds)
    texts: dict[str, dict[str, Text]] = defaultdict(dict)
    for (process, place), text in kept.items():
        if process in managed or process in more:
            texts[process][place] = _text(text, kinds)
    used = {
        part.name
        for lines in texts.values()
        for text in lines.values()
        for part in text
        if isinstance(part, ArgumentValue)
    }
    used |= {
        name.removeprefix("args.")
        for text in conditions.values()
        for name in names_in(f"${{{text}}}")
    }
    defaults = {
        name: plain(spec.value(spec.default))
        for name, spec in specs.items()
        if spec.default is not None
    }
    defaults |= {
        name: values[name]
        for name in values
        if name in arguments.arg_values or name not in defaults
    }
    declared = tuple(
        _argument(name, spec, defaults[name]) for name, spec in specs.items() if name in used
    )
    lines = [
        f"{name} is {as_given(value)}: something depends on it that a launch file does not decide"
        for name, value in values.items()
        if name not in used and f"args.{name}" in uses.fixed
    ]
    added = {name: addition for name, addition in more.items() if name in conditions}
    files = tuple(file for _, files_added in added.values() for file in files_added)
    return (
        LaunchValues(declared, conditions, texts, tuple(process for process, _ in added.values())),
        files,
        lines,
    )


def _argument(name: str, spec: ArgSpec, value: Any) -> LaunchArgument:
    return LaunchArgument(
        name,
        spec.kind,
        as_given(value),
        choices=tuple(map(as_given, spec.choices)),
        description=" ".join((spec.description or "").split()),
        env=spec.env,
    )


def _fix_conditions(uses: ArgumentUses, kinds: Mapping[str, str]) -> None:
    """Fix the arguments of conditions that launch cannot compute."""
    for name, expression in list(uses.conditions.items()):
        try:
            condition_of(expression, kinds)
        except ValueError:
            uses.fix(f"${{{uses.conditions.pop(name)}}}")


def _settle(
    uses: ArgumentUses, kinds: Mapping[str, str]
) -> tuple[dict[tuple[str, str], str], dict[str, str]]:
    """Return the texts and conditions that contain only launch arguments.

    A text or condition that contains a fixed argument fixes its other arguments too. The function
    therefore repeats until no argument is added.
    """
    texts, conditions = dict(uses.texts), dict(uses.conditions)
    for path, text in uses.texts.items():
        if _parts(text, kinds) is None:
            del texts[path]
            uses.fix(text)
    before = -1
    while before != len(uses.fixed):
        before = len(uses.fixed)
        for path, text in list(texts.items()):
            if uses.fixed & names_of(text):
                uses.fix(texts.pop(path))
        for name, text in list(conditions.items()):
            if uses.fixed & names_of(f"${{{text}}}"):
                uses.fix(f"${{{conditions.pop(name)}}}")
    return texts, conditions


def _parts(text: str, kinds: Mapping[str, str]) -> Text | None:
    """Split a text into plain parts and values; return None if launch cannot compute a value."""
    parts: list[str | ArgumentValue | VariableValue] = []
    end = 0
    for hole in HOLE.finditer(text):
        parts += [text[end : hole.start()]] if text[end : hole.start()] else []
        end = hole.end()
        argument, variable = _ARGUMENT.fullmatch(hole[1]), environment_in(hole[1].strip())
        if argument and argument[1] in kinds:
            parts.append(ArgumentValue(argument[1], kinds[argument[1]]))
        elif variable:
            parts.append(VariableValue(*variable))
        else:
            return None
    return (*parts, text[end:]) if text[end:] else tuple(parts)


def _text(text: str, kinds: Mapping[str, str]) -> Text:
    return _parts(text, kinds) or (text,)


class _Combinations:
    """Builds of the robot with other arguments, for processes that the plan does not have."""

    def __init__(
        self,
        arguments: Namespace,
        plan: Plan,
        specs: Mapping[str, ArgSpec],
        values: Mapping[str, Any],
    ) -> None:
        self.arguments, self.plan, self.specs = arguments, plan, specs
        self.values = {name: as_given(value) for name, value in values.items()}
        self._built: dict[tuple[tuple[str, str], ...], tuple[Plan, tuple[File, ...]] | None] = {}

    def process(self, name: str, expression: str) -> tuple[PlanProcess, tuple[File, ...]] | None:
        """Return the process and its parameter file from a build in which its condition is true.

        Return None if that build has errors or other edges, or if launch would need the plan of
        that build to start the process.
        """
        for values in values_that_satisfy(expression, self.specs, self.values):
            plan, files = self._build(values) or (self.plan, ())
            candidate = next((process for process in plan.managed if process.name == name), None)
            if (
                candidate is not None
                and candidate.kind in {"run", "component"}
                and _own_edges(plan) == _own_edges(self.plan)
            ):
                needed = tuple(file for file in files if file.path == candidate.params_file)
                return candidate, needed
        return None

    def _build(self, values: dict[str, str]) -> tuple[Plan, tuple[File, ...]] | None:
        key = tuple(sorted(values.items()))
        if key not in self._built:
            self._built[key] = self._compile(values)
        return self._built[key]

    def _compile(self, values: dict[str, str]) -> tuple[Plan, tuple[File, ...]] | None:
        changed = {"arg_values": self.values | values}
        arguments = Namespace(**{**vars(self.arguments), **changed})
        compiled = compile_file(arguments.file, arguments)
        if compiled.robot is None or compiled.errors:
            return None
        files = emit(compiled.robot, destination(arguments, compiled.robot)[1])
        return read_plan(files[0].text, files[0].path), files


def _own_edges(plan: Plan) -> set[tuple[Any, ...]]:
    """Return the edges of tfcompose's own publishers, with their poses."""
    owners = {process.name for process in plan.started if process.kind in OWN_KINDS}
    return {
        (edge.parent, edge.child, edge.kind, edge.pose.xyz, edge.pose.quat_xyzw)
        for edge in plan.edges
        if edge.owner in owners
    }
