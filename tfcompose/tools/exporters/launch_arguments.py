"""Arguments of a robot file that the exported launch file keeps as arguments.

An argument is kept if it only decides whether processes start, and their command-line arguments,
parameters, remappings and variables. Any other argument has the value given to the export, or its
default.
"""

from __future__ import annotations

import os
import re
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from tfcompose.cli.compiling import disk_of, inputs_of, library, overlays_of
from tfcompose.cli.reading import read_text
from tfcompose.cli.writing import destination
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.foundation.findings import Span
from tfcompose.model.plan.file import read_plan
from tfcompose.model.plan.stock import OWN_KINDS
from tfcompose.spec.language import (
    ArgValue,
    BuildInputs,
    compose,
    profiles_in,
    validate,
    with_includes,
)
from tfcompose.spec.language.args import as_given
from tfcompose.spec.language.argument_uses import HOLE, names_of, uses_of
from tfcompose.spec.language.arguments import values_that_satisfy
from tfcompose.spec.language.expressions import environment_in, names_in
from tfcompose.spec.language.values import plain
from tfcompose.spec.load import load
from tfcompose.tools.exporters.launch_values import (
    ArgumentValue,
    LaunchArgument,
    LaunchValues,
    Text,
    VariableValue,
    condition_code,
)

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

    from tfcompose.model.files import File
    from tfcompose.model.plan import Plan, PlanProcess
    from tfcompose.spec.language import ArgSpec
    from tfcompose.spec.language.argument_uses import ArgumentUses

_ARGUMENT = re.compile(r"\s*args\.([A-Za-z_][A-Za-z0-9_]*)\s*")


def collect_launch_values(
    arguments: Namespace, plan: Plan
) -> tuple[LaunchValues, tuple[File, ...], list[str]]:
    """Return the launch file's values, the files it needs, and the fixed arguments.

    ``plan`` is the built one. The robot file has no errors.
    """
    source = compose(
        with_includes(load(read_text(arguments.file), arguments.file), read_text),
        arguments.profiles,
        overlays_of(arguments),
        inputs_of(arguments),
    )
    uses = uses_of(source)
    validated = validate(source, profiles_in(source), inputs_of(arguments))
    specs, values = validated.spec.args, validated.args
    kinds = {name: spec.kind for name, spec in specs.items()}
    _fix_conditions(uses, kinds)
    there = {process.name: process for process in plan.managed}
    combined = _Combinations(arguments, plan, specs, values)
    missing = {
        name: expression for name, expression in uses.conditions.items() if name not in there
    }
    more = {
        name: found
        for name, expression in missing.items()
        if (found := combined.process(name, expression))
    }
    for name, expression in uses.conditions.items():
        if name not in there and name not in more:
            uses.fix(f"${{{expression}}}")
    kept, conditions = _settle(uses, kinds)
    texts: dict[str, dict[str, Text]] = defaultdict(dict)
    for (process, place), text in kept.items():
        if process in there or process in more:
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
    added = {name: found for name, found in more.items() if name in conditions}
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
    """Take conditions that launch cannot compute as something else that needs their arguments."""
    for name, expression in list(uses.conditions.items()):
        try:
            condition_code(expression, kinds)
        except ValueError:
            uses.fix(f"${{{uses.conditions.pop(name)}}}")


def _settle(
    uses: ArgumentUses, kinds: Mapping[str, str]
) -> tuple[dict[tuple[str, str], str], dict[str, str]]:
    """Return the texts and conditions that launch computes.

    Those of which nothing else needs an argument.
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
    """Return what a text consists of, or None where launch cannot compute something of it."""
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
    """Processes that are there with other values of the arguments alone."""

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
        """Return a process as it is where its condition holds, with its parameter file.

        None where it cannot be added.

        It cannot where the robot has errors or another tree then, or launch would need its plan.
        """
        for values in values_that_satisfy(expression, self.specs, self.values):
            plan, files = self._build(values) or (self.plan, ())
            found = next((process for process in plan.managed if process.name == name), None)
            if (
                found is not None
                and found.kind in {"run", "component"}
                and _own_edges(plan) == _own_edges(self.plan)
            ):
                needed = tuple(file for file in files if file.path == found.params_file)
                return found, needed
        return None

    def _build(self, values: dict[str, str]) -> tuple[Plan, tuple[File, ...]] | None:
        key = tuple(sorted(values.items()))
        if key not in self._built:
            self._built[key] = self._compile(values)
        return self._built[key]

    def _compile(self, values: dict[str, str]) -> tuple[Plan, tuple[File, ...]] | None:
        arguments = self.arguments
        args = {
            name: ArgValue(value, Span(f"{name}:={value}"))
            for name, value in (self.values | values).items()
        }
        compiled: Compiled = compile_robot(
            read_text(arguments.file),
            arguments.file,
            library(),
            arguments.profiles,
            overlays=overlays_of(arguments),
            read=read_text,
            disk=disk_of(arguments.file, arguments),
            inputs=BuildInputs(args, os.environ),
        )
        if compiled.robot is None or compiled.errors:
            return None
        files = emit(compiled.robot, destination(arguments, compiled.robot)[1])
        return read_plan(files[0].text, files[0].path), files


def _own_edges(plan: Plan) -> set[tuple[Any, ...]]:
    """Return what tfcompose's own publishers send."""
    own = {process.name for process in plan.started if process.kind in OWN_KINDS}
    return {
        (edge.parent, edge.child, edge.kind, edge.pose.xyz, edge.pose.quat_xyzw)
        for edge in plan.edges
        if edge.owner in own
    }
