"""From a source to a typed spec, with everything that is wrong found in one pass."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from tfcompose.findings import Edit, Finding, Note, RejectedError, finding
from tfcompose.load.choices import CHOICES
from tfcompose.validate.claims import NodePresetSpec
from tfcompose.validate.joint_units import refuse_units_of_others
from tfcompose.validate.preset import PresetSpec
from tfcompose.validate.preset_names import check_names
from tfcompose.validate.schema import BROKEN, Model, Problem, Problems, record
from tfcompose.validate.spec import RobotSpec
from tfcompose.validate.variables import compute, unused

if TYPE_CHECKING:
    from tfcompose.load import Path, Source


@dataclass(frozen=True, slots=True)
class Validated:
    """A spec without its broken parts, the findings about those, and which entries they were in.

    ``broken`` holds (section, name): what is missing because of them is not reported a second time. ``data`` is what
    was written, with every ``${…}`` computed; ``unused`` are the variables that nothing uses.
    """

    spec: RobotSpec
    source: Source
    found: tuple[Finding, ...]
    broken: frozenset[tuple[str, str]]
    data: dict[str, Any] = field(default_factory=dict)
    unused: tuple[str, ...] = ()


def validate(source: Source, aside: Any = None) -> Validated:
    """Return the typed spec; ``aside`` is data that is not laid over it now, and may use its variables too.

    Raises:
        RejectedError: if so much is missing that no robot is left (its name, or the version).
    """
    problems = Problems()
    data = compute(source.data, problems)
    spec = _read(RobotSpec, data, problems)
    _exclusive(source.data, _FORKS, (), problems)
    refuse_units_of_others(data, problems)
    said_once = [problem for problem in _once(problems.all) if not _in_a_copy(problem, source.data)]
    found = (*source.found, *(_finding(problem, source) for problem in said_once))
    if spec is BROKEN:
        raise RejectedError(found)
    broken = {(str(p.path[0]), str(p.path[1])) for p in problems.all if len(p.path) > 1}
    return Validated(spec, source, found, frozenset(broken), data, unused(source.data, aside))


def validate_preset(source: Source) -> PresetSpec:
    """Return the typed preset.

    Raises:
        RejectedError: with every finding, if anything is wrong with it.
    """
    problems = Problems()
    preset = _read(PresetSpec, source.data, problems)
    _exclusive(source.data, _FORKS, (), problems)
    if preset is not BROKEN and not problems.all:
        check_names(preset, problems)
    found = (*source.found, *(_finding(problem, source) for problem in _once(problems.all)))
    if found:
        raise RejectedError(found)
    result: PresetSpec = preset
    return result


def validate_node_preset(source: Source) -> NodePresetSpec:
    """Return the typed preset of a node.

    Raises:
        RejectedError: with every finding, if anything is wrong with it.
    """
    problems = Problems()
    preset: NodePresetSpec = _read(NodePresetSpec, source.data, problems)
    found = (*source.found, *(_finding(problem, source) for problem in _once(problems.all)))
    if found:
        raise RejectedError(found)
    return preset


def _read(cls: type[Model], data: dict[str, Any], problems: Problems) -> Any:
    return record(cls).read(data, (), problems)


def _once(problems: list[Problem]) -> list[Problem]:
    return list(dict.fromkeys(problems))


def _in_a_copy(problem: Problem, data: dict[str, Any]) -> bool:
    """Whether the problem is in ``collision: same``, and so already said of ``visual``."""
    section, name, key = (*problem.path[:3], "", "", "")[:3]
    return section == "links" and key == "collision" and data["links"][name]["collision"] == "same"


def _finding(problem: Problem, source: Source) -> Finding:
    span = source.at_key(problem.path) if problem.on_key else source.at(problem.path)
    notes = [Note("the other one", source.at_key(problem.other))] if problem.other else []
    edits = [Edit(span, problem.instead)] if problem.instead is not None else []
    return finding(problem.code, problem.message, span, help=problem.help, notes=notes, edits=edits)


@dataclass(slots=True)
class _Fork:
    """What stands at one place of the language: choices of one key, and places below, where ``*`` is any name."""

    choices: list[frozenset[str]] = field(default_factory=list)
    below: dict[str, _Fork] = field(default_factory=dict)


def _forks() -> _Fork:
    root = _Fork()
    for pattern, choice in CHOICES:
        fork = root
        for step in pattern:
            fork = fork.below.setdefault(step, _Fork())
        fork.choices.append(choice)
    return root


_FORKS = _forks()


def _exclusive(value: Any, fork: _Fork, path: Path, problems: Problems) -> None:
    """Refuse two keys of which a mapping can hold one, wherever the language has such a choice."""
    if isinstance(value, list):
        for index, item in enumerate(value):
            _exclusive(item, fork, (*path, index), problems)
        return
    if not isinstance(value, dict):
        return
    for choice in fork.choices:
        if len(choice & value.keys()) > 1:
            _refuse_all_but_one([key for key in value if key in choice], path, problems)
    for step, below in fork.below.items():
        for name in value if step == "*" else (step,):
            if name in value:
                _exclusive(value[name], below, (*path, name), problems)


def _refuse_all_but_one(present: list[str], path: Path, problems: Problems) -> None:
    for second in present[1:]:
        message = f"{second} and {present[0]} exclude each other"
        advice = f"keep one of {', '.join(present)}"
        problems.refuse("TF107", (*path, second), message, advice, on_key=True, other=(*path, present[0]))
