"""Validation of a source into a typed spec, with all errors at once."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

from tfcompose.foundation.catalogue import can_be_allowed, code_of
from tfcompose.foundation.findings import Finding, RejectedError, without_duplicates
from tfcompose.spec.language.args import BuildInputs, RosArguments
from tfcompose.spec.language.conditions import unfold
from tfcompose.spec.language.overlay import is_for_later
from tfcompose.spec.language.preset import PresetSpec, wrong_names
from tfcompose.spec.language.reading import SpecRefusal, read
from tfcompose.spec.language.rules import RuleSpec, level_of
from tfcompose.spec.language.spec import Spec
from tfcompose.spec.language.tool_keys import problems_with, robot_model
from tfcompose.spec.language.values import plain
from tfcompose.spec.language.variables import Variables, unused_variables

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    from tfcompose.model.plan import Isolation, ParameterValue
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path, Source


_NOTHING = BuildInputs()
M = TypeVar("M", bound=Spec)


@dataclass(frozen=True, slots=True)
class Validated:
    """A spec without rejected values, and the findings about these values."""

    spec: RobotSpec
    #: The source with conditions and loops applied.
    source: Source
    findings: tuple[Finding, ...]
    #: Paths of rejected values.
    refused: frozenset[Path] = frozenset()
    #: Variables and arguments that are not used, as (section, name).
    unused: tuple[tuple[str, str], ...] = ()
    inputs: BuildInputs = _NOTHING
    #: Values of the arguments, from ``inputs`` or the defaults.
    args: dict[str, ParameterValue] = field(default_factory=dict)
    #: Values of the environment variables that the file uses.
    environment: dict[str, str] = field(default_factory=dict)
    #: Conditions that removed entries, by (section, name) of the entry.
    conditions: dict[tuple[str, str], str] = field(default_factory=dict)
    #: Entries with rejected values, as (section, name). Errors that follow from them are not
    #: reported.
    broken: frozenset[tuple[str, str]] = frozenset()
    #: The plain data of the source with arguments and environment, from which a plan's digest is
    #: computed.
    source_data: dict[str, Any] = field(default_factory=dict)


#: Sections whose entries define frames.
_BRINGS_FRAMES = frozenset({"frames", "joints", "links", "parts", "sensors"})


def _entry(path: Path) -> tuple[str, str]:
    """Return the (section, name) of a rejected path; the name is empty for a complete section.

    A section that may have defined any frame counts as a part without a prefix.
    """
    section, name = (*map(str, path[:2]), "")[:2]
    return ("parts" if not name and section in _BRINGS_FRAMES else section), name


def _children(broken: set[tuple[str, str]], joints: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield links that lack a parent because their joint was rejected."""
    for section, name in broken:
        joint = joints.get(name) if section == "joints" else None
        child = joint.get("child") if isinstance(joint, dict) else None
        if isinstance(child, str):
            yield ("links", child)


def validate(source: Source, profiles: Any = None, inputs: BuildInputs = _NOTHING) -> Validated:
    """Return the typed spec of a file, built with the ``inputs``.

    ``profiles`` are data that are not merged now, such as other profiles. They may use the
    variables.

    Raises:
        RejectedError: if the robot's name or the version is missing.
    """
    variables = Variables(source, inputs)
    idle = unused_variables(source.data, profiles)
    done = unfold(source, variables)
    source = done.source
    nulls = _nulls(source)
    data = variables.compute(source.data, done.scopes)
    already = [*(null.path for null in nulls), *variables.uncomputed]
    spec, refusals = read(robot_model(source.data), data, already)
    source_findings = _findings([*nulls, *variables.refusals, *refusals], source)
    findings = (
        *source.findings,
        *without_duplicates([*variables.findings, *done.findings]),
        *source_findings,
        *problems_with(source.data),
    )
    if spec is None:
        raise RejectedError(findings)
    spec.carry(source)
    refused = frozenset([*already, *done.refused, *(refusal.path for refusal in refusals)])
    entries = {_entry(path) for path in refused}
    args = {name: plain(value) for name, value in variables.args.items() if value is not None}
    from_outside = {
        "args inputs": args,
        "environment": variables.environment,
        "ros arguments": asdict(inputs.ros) if inputs.ros != RosArguments() else {},
    }
    return Validated(
        _with_ros_arguments(spec, inputs.ros),
        source,
        findings,
        refused=refused,
        unused=idle,
        inputs=inputs,
        args=args,
        environment=variables.environment,
        conditions=done.conditions,
        broken=frozenset((*entries, *_children(entries, source.mapping("joints")))),
        source_data=source.data | {name: used for name, used in from_outside.items() if used},
    )


def _with_ros_arguments(spec: RobotSpec, arguments: RosArguments) -> RobotSpec:
    """Return the robot with namespace and clock from the ROS arguments.

    Frame names do not change, not even those with the namespace of the file.
    """
    if arguments == RosArguments():
        return spec
    ros, ros_namespace = spec.ros, spec.ros.namespace.strip("/")
    if arguments.namespace:
        isolate, prefix = ros.isolate, ros.frame_prefix
        if ros_namespace and not prefix and isolate in {"frames", "both"}:
            prefix = f"{ros_namespace}/"
        if not prefix:
            isolate = _WITHOUT_FRAMES.get(isolate, isolate)
        namespace = "/".join(filter(None, (arguments.namespace, ros_namespace)))
        ros = replace(ros, namespace=namespace, frame_prefix=prefix, isolate=isolate)
    if arguments.use_sim_time is not None:
        ros = replace(ros, clock="sim" if arguments.use_sim_time else "wall")
    return spec.model_copy(update={"ros": ros})


#: The isolation that remains without isolation of frames.
_WITHOUT_FRAMES: dict[Isolation, Isolation] = {"frames": "none", "both": "topics"}


def validate_preset(source: Source) -> PresetSpec:
    """Return the typed preset.

    Raises:
        RejectedError: with all findings, if the preset is invalid.
    """
    return validate_file(PresetSpec, source, wrong_names)


def validate_file(
    kind: type[M], source: Source, check: Callable[[M], Iterable[SpecRefusal]] = lambda _: ()
) -> M:
    """Return the typed content of a file in a language that needs only its model.

    ``check`` yields further faults of a file whose keys and values are valid.

    Raises:
        RejectedError: with all findings, if the file is invalid.
    """
    nulls = _nulls(source)
    spec, refused = read(kind, source.data, [null.path for null in nulls])
    refusals = [*nulls, *refused]
    if spec is not None and not refusals:
        refusals = list(check(spec))
    findings = (*source.findings, *_findings(refusals, source))
    if findings or spec is None:
        raise RejectedError(findings)
    return spec


def levels_of(validated: Validated, limits: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield each entry of ``rules`` with its severity, empty for the code's own severity.

    A code is off if its entry was rejected or its limit is not in ``limits``, because its default
    limit would be wrong.
    """
    for section, level in sorted(validated.broken):
        if section == "rules" and (code := code_of(level)) and can_be_allowed(code):
            yield level, "off"
    for name, setting in validated.spec.rules.items():
        is_limited = isinstance(setting, RuleSpec) and setting.limit is not None
        yield (
            name,
            "off" if is_limited and code_of(name) not in (*limits, None) else level_of(setting),
        )


def _nulls(source: Source) -> list[SpecRefusal]:
    """Return a refusal for each key and item without a value.

    Null is valid only in an overlay, where it removes a value.
    """
    refusals: list[SpecRefusal] = []

    def visit(value: Any, path: Path) -> None:
        for step, item in value.items() if isinstance(value, dict) else enumerate(value):
            path_of_value = (*path, step)
            if isinstance(item, (dict, list)):
                visit(item, path_of_value)
            elif item is None and isinstance(value, list):
                message = "an item of the list has no value"
                refusals.append(
                    SpecRefusal(
                        "TF006", path_of_value, message, "give a value, or remove the item"
                    )
                )
            elif item is None and not is_for_later(path):
                message = f"{step} has no value"
                advice = f"write {step}: {{}}, remove it, or indent what belongs to it"
                if _AFTER_A_COMMA.fullmatch(str(step)):
                    advice = "decimals take a point, such as 1.5 kg; or a mapping is not closed"
                elif glued := _WITHOUT_SPACE.fullmatch(str(step)):
                    advice = f"a space belongs after the colon: {glued[1]}: {glued[2]}"
                refusals.append(SpecRefusal("TF006", path_of_value, message, advice, on_key=True))

    if source.has_nulls:
        visit(source.data, ())
    return refusals


#: A key and its value without a space between them. A frame's name with a colon, such as
#: tag36h11:7, is no match.
_WITHOUT_SPACE = re.compile(r"([a-z_]+):(\S+)")
#: The part after the comma in a quantity such as 1,5 kg.
_AFTER_A_COMMA = re.compile(r"\d+(\s*[a-zA-Z°/^0-9]+)?")


def _findings(refusals: Iterable[SpecRefusal], source: Source) -> list[Finding]:
    """Return the findings without duplicates.

    Otherwise, a fault in an anchor would be reported again for each alias.
    """
    return list(dict.fromkeys(refusal.finding(source) for refusal in refusals))
