"""Language of test files, ``*.test.yaml``: cases, and what each expects of its tree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import AfterValidator, BeforeValidator, Field

from tfcompose.foundation.catalogue import CATALOGUE, code_of
from tfcompose.foundation.findings import did_you_mean
from tfcompose.foundation.units import Angle, Duration, Length, Rate, Size, invalid
from tfcompose.guard.verdict.publishers import SAME_POSE
from tfcompose.model.plan import JointType
from tfcompose.spec.language.pose import Rotated
from tfcompose.spec.language.reading import SpecRefusal
from tfcompose.spec.language.spec import Spec, key
from tfcompose.spec.language.validate import validate_file
from tfcompose.spec.language.values import Axis, InARow, OneOrMore, Text, Xyz, as_list
from tfcompose.tools.treetest.injections import KINDS, FramePair, InjectionSpec

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tfcompose.spec.load import Path, Source


def _in_order(rates: tuple[float, float]) -> tuple[float, float]:
    if rates[0] > rates[1]:
        raise invalid("TF106", "the lowest rate is greater than the highest", "swap the two")
    return rates


def _find_code(text: str) -> str:
    code = code_of(text)
    if code is None:
        names = [*CATALOGUE, *(CATALOGUE[entry].name for entry in CATALOGUE)]
        advice = did_you_mean(text, names, "tfcompose explain --table lists all codes")
        raise invalid("TF106", f"{text} is not the code of a finding", advice)
    return code


def _with_angle(value: Any) -> Any:
    return value if isinstance(value, list) else [value, SAME_POSE.rot_rad]


def _is_limit(within: tuple[float, float]) -> tuple[float, float]:
    if within[1] < 0:
        raise invalid("TF106", "the angle is less than 0", "for example 0.1 deg")
    return within


def _has_any(times: tuple[float, ...]) -> tuple[float, ...]:
    if not times:
        raise invalid("TF106", "the list has no time", "name at least one, for example 1 s")
    return times


Rates = Annotated[tuple[Rate, Rate], AfterValidator(_in_order), InARow(2, "[45 Hz, 55 Hz]")]
#: A distance and an angle; the distance alone stands for both.
Within = Annotated[
    tuple[Size, Angle],
    InARow(2, "[1 mm, 0.1 deg]"),
    BeforeValidator(_with_angle, Length | tuple[Length, Angle]),
    AfterValidator(_is_limit),
]
Durations = Annotated[
    tuple[Duration, ...],
    BeforeValidator(as_list, Duration | tuple[Duration, ...]),
    AfterValidator(_has_any),
]
SomeInjections = Annotated[
    tuple[InjectionSpec, ...], BeforeValidator(as_list, InjectionSpec | tuple[InjectionSpec, ...])
]
Code = Annotated[Text, AfterValidator(_find_code)]


class JointExpectation(Rotated):
    """A joint, by the robot file and by its motion; what is not written is not compared."""

    name: Text | None = key(None, "its name, by the robot file", "wheel_left_joint")
    type: JointType | None = key(None, "its type, by the robot file", "continuous")
    axis: Axis | None = key(None, "the axis of its motion, in the child frame", [0, 0, 1])
    xyz: Xyz | None = key(None, "position of the child at joint position 0", [0, 0.2, 0])
    within: Within = key(
        (SAME_POSE.xyz_m, SAME_POSE.rot_rad),
        "the greatest deviation from a motion about or along the axis: a distance, or a distance"
        " and an angle; default: 1 mm and 0.1 deg",
        "5 mm",
        ["2 mm", "0.1 deg"],
    )


class EdgeExpectation(Spec):
    """What an edge is expected to be."""

    owner: Text | None = key(
        None, "the process that owns the edge, by the robot file", "base_drive"
    )
    rate: Rates | None = key(
        None,
        "the lowest and the highest mean rate over the recording, or over ``for``",
        ["45 Hz", "55 Hz"],
    )
    age: Duration | None = key(
        None, "the greatest age of a stamp when its transform arrives", "50 ms"
    )
    joint: JointExpectation | None = key(
        None, "the joint that moves the edge", {"type": "continuous", "axis": [0, 0, 1]}
    )


class PoseExpectation(Rotated):
    """A pose that holds whenever it can be looked up; what is not written is not compared."""

    xyz: Xyz | None = key(None, "position: x forward, y left, z up", [0.2, 0, "30 cm"])
    within: Within = key(
        (SAME_POSE.xyz_m, SAME_POSE.rot_rad),
        "the greatest deviation: a distance, or a distance and an angle;"
        " default: 1 mm and 0.1 deg",
        "5 mm",
        ["2 mm", "0.1 deg"],
    )


class LookupExpectation(Spec):
    """Lookups that succeed."""

    from_: Text = Field(
        ..., alias="from", description="the frame in which a pose is looked up", examples=["map"]
    )
    to: Text = key(..., "the frame whose pose is looked up", "laser")
    at: Durations = key(..., "times after the first transform", ["1 s", "2 s", "5 s"])
    timeout: Duration = key(1.0, "how long after that time the transforms may arrive", "200 ms")


class FindingExpectation(Spec):
    """A finding of ``verify``."""

    code: Code = key(..., "its code, or its name", "TF803", "undeclared_edge")
    names: OneOrMore = key((), "names that it mentions", "map → odom", ["base_link", "odom"])
    within: Duration | None = key(
        None,
        "without ``bag``: how long after the last injection, or else after the tree is complete,"
        " it may take; default: 5 s",
        "3 s",
    )


class Expectations(Spec):
    """What a case expects; what is not written is not judged."""

    complete: Duration | None = key(
        None, "every edge has arrived by this time after the first transform", "3 s"
    )
    edges: dict[FramePair, EdgeExpectation] = key(
        {}, "edges of the robot file", {"odom → base_link": {"rate": ["45 Hz", "55 Hz"]}}
    )
    pose: dict[FramePair, PoseExpectation] = key(
        {},
        "poses of the second frame in the first",
        {"base_link → laser": {"xyz": [0.2, 0, 0.3], "within": "1 mm"}},
    )
    lookups: tuple[LookupExpectation, ...] = key(
        (), "lookups that succeed", [{"from": "map", "to": "laser", "at": ["1 s", "2 s"]}]
    )
    like: Text | None = key(
        None,
        "a recording with the same edges, fixed poses and paths of moving edges, relative to this"
        " file",
        "golden.mcap",
    )
    within: Within = key(
        (SAME_POSE.xyz_m, SAME_POSE.rot_rad),
        "the greatest deviation from that recording: a distance, or a distance and an angle;"
        " default: 1 mm and 0.1 deg",
        "5 mm",
        ["2 mm", "0.1 deg"],
    )
    findings: tuple[FindingExpectation, ...] | None = key(
        None,
        "all findings of verify; an entry stands for each finding that it fits; default: any",
        [],
        [{"code": "TF803", "names": "map → odom"}],
    )

    @property
    def is_empty(self) -> bool:
        """Whether nothing is expected; an empty list of findings allows none."""
        return (
            self.complete is None
            and self.like is None
            and self.findings is None
            and not (self.edges or self.pose or self.lookups)
        )


class CaseSpec(Spec):
    """A recording, or else a robot that is started, and what is expected of its tree."""

    name: Text = key(..., "the name of the case", "drives without a second odometry")
    bag: Text | None = key(
        None,
        "a rosbag2 folder, .mcap or .db3, relative to this file; default: the robot is started",
        "drive.mcap",
    )
    profile: OneOrMore = key((), "profiles of the robot file", "demo")
    for_: Duration = Field(
        2.0,
        alias="for",
        description=(
            "without ``bag``: how long the complete tree is judged; rates, ages and findings may"
            " need a second attempt; default: 2 s"
        ),
        examples=["5 s"],
    )
    inject: SomeInjections = key(
        (),
        "faults to inject into the recording or into the started robot",
        {"publish": {"edge": "odom → base_link", "as": "/old_odometry"}},
        [{"publish": {"edge": "odom → base_link"}, "at": "1 s"}],
    )
    expect: Expectations = key(..., "what is expected", {"complete": "3 s", "findings": []})


class SuiteSpec(Spec):
    """The cases of one robot."""

    BEGIN: ClassVar[str] = "a test file begins with robot: and cases:"
    HABITS: ClassVar[dict[str, str]] = {"tfcompose": BEGIN}

    robot: Text = key(..., "the robot file, relative to this file", "../rover.yaml")
    cases: tuple[CaseSpec, ...] = key(
        ...,
        "the cases",
        [{"name": "starts", "profile": "demo", "expect": {"complete": "3 s"}}],
    )


def validate_suite(source: Source) -> SuiteSpec:
    """Return the typed test file.

    Raises:
        RejectedError: with every finding, if anything is wrong with it.
    """
    return validate_file(SuiteSpec, source, _check_suite)


def _check_suite(suite: SuiteSpec) -> Iterator[SpecRefusal]:
    """Yield a refusal for files without cases, repeated names, and empty expectations."""
    if not suite.cases:
        yield SpecRefusal("TF106", ("cases",), "there are no cases", "add one with name:")
    names: dict[str, int] = {}
    for index, case in enumerate(suite.cases):
        path = ("cases", index)
        first = names.setdefault(case.name, index)
        if first != index:
            message = f"another case has the name {case.name!r}"
            first_path = ("cases", first, "name")
            yield SpecRefusal(
                "TF106", (*path, "name"), message, "rename one", conflicts_with=first_path
            )
        if "within" in case.expect.model_fields_set and case.expect.like is None:
            message = "within without like compares nothing"
            advice = "add like: RECORDING, or write within at a pose"
            yield SpecRefusal("TF106", (*path, "expect", "within"), message, advice)
        elif case.expect.is_empty:
            advice = "add complete:, edges:, pose:, lookups:, like: or findings:"
            yield SpecRefusal("TF106", (*path, "expect"), "the case expects nothing", advice)
        yield from _check_injections(case, path)
        if case.bag is not None:
            yield from _check_bag_case(case, path)
        for pair, pose in case.expect.pose.items():
            if pose.xyz is None and pose.rotation is None:
                message = f"{pair} has neither a position nor a rotation to compare"
                at = (*path, "expect", "pose", pair)
                yield SpecRefusal("TF106", at, message, "add xyz:, or a rotation such as rpy:")


def _check_injections(case: CaseSpec, path: Path) -> Iterator[SpecRefusal]:
    """Yield a refusal for each injection without a fault."""
    for index, injection in enumerate(case.inject):
        place = (*path, "inject", index)
        if injection.kind is None:
            advice = f"add {', '.join(KINDS)}"
            yield SpecRefusal("TF106", place, "the injection has no fault", advice)


def _check_bag_case(case: CaseSpec, path: Path) -> Iterator[SpecRefusal]:
    """Yield a refusal for each key that only a started robot has."""
    paths: list[Path] = [("for",)] if "for_" in case.model_fields_set else []
    paths += [
        ("expect", "findings", index, "within")
        for index, each in enumerate(case.expect.findings or ())
        if each.within is not None
    ]
    for keys in paths:
        message = f"{keys[-1]} has no effect on a recording"
        yield SpecRefusal("TF106", (*path, *keys), message, "remove it, or bag:")
