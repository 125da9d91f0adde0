"""Quantities, expressions and rotations: exact values, and refusals in one sentence."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tfcompose.foundation.geometry import angle_between
from tfcompose.foundation.units import (
    ANGULAR_VELOCITY,
    LENGTH,
    NUMBER,
    Quantity,
    UnitError,
    quantity,
)
from tfcompose.spec.language import Validated, compose, validate
from tfcompose.spec.language.expressions import ExpressionError, evaluate
from tfcompose.spec.language.robot import JointSpec
from tfcompose.spec.load import load

HEAD = "tfcompose: 1\nrobot: r\n"


def validated(text: str) -> Validated:
    return validate(compose(load(HEAD + text, "r.yaml"), []))


def value_of(source_text: str, variables: str = "{}") -> Any:
    """Return what ``xyz: [written, 0, 0]`` is read as."""
    done = validated(
        f"vars: {variables}\nframes: {{a: {{parent: b, xyz: [{source_text}, 0, 0]}}}}\n"
    )
    assert not done.findings, done.findings
    return done.spec.frames["a"].xyz[0]


def codes_of(text: str) -> list[str]:
    return [finding.code for finding in validated(text).findings]


EXACT = {
    "30 cm": 0.3,
    "30cm": 0.3,
    "1 mm": 0.001,
    "7 mm": 0.007,
    "12 in": 0.3048,
    "1 ft": 0.3048,
    "1.5e1 cm": 0.15,
    "15 deg": math.radians(15),
    "-90 deg": -math.pi / 2,
    "180 deg": math.pi,
    "60 rpm": 2 * math.pi,
    "72 g": 0.072,
    "200 ms": 0.2,
    "2 kHz": 2000.0,
    "0.3": 0.3,
}


@pytest.mark.parametrize("text", EXACT)
def test_a_quantity_is_exactly_the_nearest_number_in_si(text: str) -> None:
    assert quantity(text).value == EXACT[text]


@pytest.mark.parametrize(
    "text",
    ["", "cm", "1 2", "1,5", "0x10", "1 cm cm", "--1", "1e", "nan", "inf", "1e999", "1e308 km"],
)
def test_what_is_no_quantity_is_refused(text: str) -> None:
    with pytest.raises(UnitError):
        quantity(text)


@pytest.mark.parametrize(
    ("unit", "advice"),
    [("degrees", "write deg"), ('"', "write in"), ("hz", "write Hz"), ("kgs", "did you mean kg?")],
)
def test_an_unknown_unit_is_named_with_the_one_that_is_meant(unit: str, advice: str) -> None:
    with pytest.raises(UnitError) as refused:
        quantity(f"1 {unit}")
    assert (refused.value.unit, refused.value.advice) == (unit, advice)


@pytest.mark.parametrize(
    ("unit", "advice"),
    [
        ("degg", "units of length: m, cm"),
        ("degrees", "units of length: m, cm"),
        ("cmm", "did you mean cm or mm?"),
    ],
)
def test_the_unit_that_is_advised_has_the_dimension_that_is_wanted(unit: str, advice: str) -> None:
    (finding,) = validated(f"frames: {{a: {{parent: b, xyz: [1 {unit}, 0, 0]}}}}\n").findings
    assert finding.help.startswith(advice)


EXPRESSIONS = {
    "1 + 2 * 3": 7,
    "(1 + 2) * 3": 9,
    "2 - 3 - 4": -5,
    "8 / 4 / 2": 1,
    "--1": 1,
    "-2 * -3": 6,
    "30 cm + 2 mm": 0.302,
    "30 cm / 2": 0.15,
    "10 cm * 20 cm / 5 cm": 0.4,
    "sqrt(9 cm * 1 m)": 0.3,
    "sin(30 deg)": 0.5,
    "cos(pi)": -1,
    "tan(45 deg)": 1,
    "radians(180)": math.pi,
    "degrees(pi)": 180,
    "1.5e2": 150,
    ".5": 0.5,
}


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_an_expression_has_its_value(text: str) -> None:
    result = evaluate(text, lambda name: pytest.fail(f"{name} was looked up"))
    assert isinstance(result, Quantity)
    assert result.value == pytest.approx(EXPRESSIONS[text], abs=1e-15)


CHOICES = {
    "1 m if 2 > 1 else 2 m": 1.0,
    "0.3 if side == 'left' else -0.3": -0.3,
    "1 if side == 'left' else 2 if side == 'right' else 3": 2.0,
    "2 * (1 if not true else 3) + 1": 7.0,
    "1 if 1 == 2 or 2 == 2 else 0": 1.0,
}
NO_CHOICES = (
    "1 if true",
    "1 else 2",
    "1 if 2 else 3",
    "if true else 1",
    "1 if true else",
    "true if if else 1",
)


@pytest.mark.parametrize("text", CHOICES)
def test_an_expression_chooses_between_two_values(text: str) -> None:
    result = evaluate(text, lambda _name: "right")
    assert isinstance(result, Quantity)
    assert result.value == CHOICES[text]


def test_an_expression_chooses_between_two_texts() -> None:
    assert evaluate("'a' if side == 'right' else 'b'", lambda _name: "right") == "a"


@pytest.mark.parametrize("text", NO_CHOICES)
def test_half_a_choice_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError):
        evaluate(text, lambda _name: "right")


@pytest.mark.parametrize("name", ["in", "class", "args.lambda", "None"])
def test_words_of_python_can_name_variables(name: str) -> None:
    assert evaluate(f"2 * {name}", lambda _name: Quantity(3.0)) == Quantity(6.0)


numbers = st.integers(0, 99).map(str)
expressions = st.recursive(
    numbers,
    lambda inner: st.builds(
        lambda a, sign, b, brackets: f"({a} {sign} {b})" if brackets else f"{a} {sign} {b}",
        inner,
        st.sampled_from("+-*/"),
        inner,
        st.booleans(),
    ),
    max_leaves=8,
)


@given(expressions)
def test_arithmetic_agrees_with_pythons(text: str) -> None:
    try:
        expected = eval(text)  # noqa: S307 (digits, brackets and four signs)
    except ZeroDivisionError:
        with pytest.raises(ExpressionError, match="divides by zero"):
            evaluate(text, pytest.fail)
        return
    result = evaluate(text, pytest.fail)
    assert isinstance(result, Quantity)
    assert result.value == pytest.approx(expected, rel=1e-12)


UNCOMPUTABLE = [
    *(
        "",
        "1 +",
        "(1",
        "1)",
        "1 2",
        "a.b",
        "f(1)",
        "1 m + 1 kg",
        "sin(1 m)",
        "sqrt(-1)",
        "1 // 0",
        "2 ** 3",
        "1e400",
    ),
    *(
        "x" * 501,
        "(" * 21 + "1" + ")" * 21,
        "9" * 450,
        f"sin({'9' * 450})",
        "[1]",
        "'a' + 1",
        "1; 2",
        "__import__(1)",
    ),
    *("1 furlong", "2 m m", "1 < 2 < 3", "1, 2", "()", "sin()", "2 (3)", "1 + not true"),
]


@pytest.mark.parametrize("text", UNCOMPUTABLE)
def test_what_cannot_be_computed_is_refused_in_one_short_sentence(text: str) -> None:
    def unknown(name: str) -> Quantity:
        raise ExpressionError(f"unknown variable {name[:20]}")

    with pytest.raises(ExpressionError) as refused:
        evaluate(text, unknown)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 200


def test_dimensions_are_carried_along() -> None:
    assert evaluate("1 m * 1", pytest.fail) == Quantity(1.0, LENGTH)
    assert evaluate("2 m / 1 m", pytest.fail) == Quantity(2.0, NUMBER)
    assert evaluate("1 rad / 1 s", pytest.fail) == Quantity(1.0, ANGULAR_VELOCITY)


@pytest.mark.parametrize(
    ("source_text", "variables", "expected"),
    [
        ('"${mast}"', "{mast: 30 cm}", 0.3),
        ('"${mast + 2 cm}"', "{mast: 30 cm}", 0.32),
        ('"${top}"', '{top: "${mast * 2}", mast: 15 cm}', 0.3),
        ('"${a}${b} cm"', "{a: 3, b: 0}", 0.3),
        ('"${pi}"', "{}", math.pi),
        ('"${3 m}"', '{m: "${n}", n: "${3 m}"}', 3.0),
    ],
)
def test_variables_are_computed_in_whatever_order_they_stand(
    source_text: str, variables: str, expected: float
) -> None:
    assert value_of(source_text, variables) == pytest.approx(expected, abs=1e-15)


def test_a_chain_of_a_thousand_variables_is_computed() -> None:
    links = ", ".join(f'v{n}: "${{v{n + 1} + 1}}"' for n in range(1000))
    assert value_of('"${v0}"', f"{{{links}, v1000: 0}}") == 1000


def test_circular_variables_are_one_finding_that_shows_the_circle() -> None:
    findings = validated(
        'vars: {a: "${b}", b: "${c}", c: "${a}"}\nframes: {f: {parent: b, xyz: ["${a}", 0, 0]}}\n'
    ).findings
    (finding,) = findings
    assert finding.code == "TF105"
    assert "a → b → c → a" in finding.message


def test_a_text_does_not_grow_without_bound() -> None:
    bomb = ", ".join(f'v{n + 1}: "' + f"${{v{n}}}" * 10 + '"' for n in range(30))
    assert set(codes_of(f"vars: {{v0: xxxxxxxxxx, {bomb}}}\n")) == {"TF105"}


def test_what_was_refused_in_an_expression_is_reported_once() -> None:
    text = (
        "links: {a: {visual: {box: ['${nope}', 1, 1]}}}\nframes: {b: {parent: '${nope}', look:"
        " '${nope}'}}\n"
    )
    assert codes_of(text) == ["TF105"] * 3


def test_parameters_are_passed_on_as_they_are() -> None:
    done = validated(
        "vars: {a: 3, t: text}\nprocesses: {p: {run: [x], params: {\n"
        "  i: '${a}', f: 1.0, t: '${t}s', b: true, d: {l: [1, 30 cm]}}}}\n"
    )
    params = done.spec.processes["p"].params
    assert params == {"i": 3, "f": 1.0, "t": "texts", "b": True, "d": {"l": [1, "30 cm"]}}
    assert [type(params[key]) for key in ("i", "f", "b")] == [int, float, bool]


@pytest.mark.parametrize("source_text", ["${3}", "${1 + 2}", "${6 / 2}"])
def test_a_complete_number_can_be_computed(source_text: str) -> None:
    assert validated(f"ros: {{domain_id: '{source_text}'}}\n").spec.ros.domain_id == 3


ROTATIONS = {
    "rpy: [10 deg, 20 deg, 30 deg]": Rotation.from_euler("xyz", [10, 20, 30], degrees=True),
    "quat_xyzw: [0.5, 0.5, 0.5, 0.5]": Rotation.from_quat([0.5, 0.5, 0.5, 0.5]),
    "quat_xyzw: [0, 0, 0.7071, 0.7071]": Rotation.from_euler("z", 90, degrees=True),
    "axis_angle: {axis: [0, 0, 2], angle: 90 deg}": Rotation.from_euler("z", 90, degrees=True),
    "matrix: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]": Rotation.from_euler("z", 90, degrees=True),
    "look: forward": Rotation.identity(),
    "look: left": Rotation.from_euler("z", 90, degrees=True),
    "look: right": Rotation.from_euler("z", -90, degrees=True),
    "look: backward": Rotation.from_euler("z", 180, degrees=True),
    "look: down": Rotation.from_euler("y", 90, degrees=True),
    "look: up": Rotation.from_euler("y", -90, degrees=True),
    "look: {down: 15 deg}": Rotation.from_euler("y", 15, degrees=True),
    "look: {up: 15 deg, right: 20 deg, roll: 5 deg}": Rotation.from_euler(
        "xyz", [5, -15, -20], degrees=True
    ),
}


@pytest.mark.parametrize("source_text", ROTATIONS)
def test_each_way_to_write_a_rotation_agrees_with_scipy(source_text: str) -> None:
    done = validated(f"frames: {{a: {{parent: b, {source_text}}}}}\n")
    assert not done.findings
    quat_xyzw = done.spec.frames["a"].rotation
    assert quat_xyzw
    x, y, z, w = ROTATIONS[source_text].as_quat()
    assert angle_between(quat_xyzw, (x, y, z, w)) < 1e-9


@pytest.mark.parametrize(
    ("direction", "axis"),
    [
        ("forward", (1, 0, 0)),
        ("backward", (-1, 0, 0)),
        ("left", (0, 1, 0)),
        ("right", (0, -1, 0)),
        ("up", (0, 0, 1)),
        ("down", (0, 0, -1)),
    ],
)
def test_a_direction_points_the_x_axis_there(direction: str, axis: tuple[int, int, int]) -> None:
    quat = (
        validated(f"frames: {{a: {{parent: b, look: {direction}}}}}\n").spec.frames["a"].rotation
    )
    assert quat
    assert Rotation.from_quat(quat).apply([1, 0, 0]) == pytest.approx(axis, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("links: {a: {visual: {box: [1, 1, 1], rpy: [0, 0, 0], look: up}}}\n", ["TF107"]),
        ("links: {a: {visual: [{box: [1, 1, 1], rpy: [0, 0, 0], look: up}]}}\n", ["TF107"]),
        (
            "sensors: {s: {preset: p, parent: a, frames: {f: {rpy: [0, 0, 0], look: up}}}}\n",
            ["TF107"],
        ),
        ("processes: {p: {simulate: {fixed: {rpy: [0, 0, 0], look: up}}}}\n", ["TF107"]),
        ("processes: {p: {simulate: {fixed: {}, circle: {}}}}\n", ["TF107"]),
        ("links: {a: {visual: {box: [1e-200, 1, 1]}}}\n", ["TF106"]),
        ("links: {a: {inertial: {mass: 1e200}, visual: {box: [1, 1, 1]}}}\n", ["TF106"]),
        (
            "joints: {j: {type: continuous, parent: a, child: b, axis: [1e-320, 0, 0]}}\n",
            ["TF106"],
        ),
        ("frames: {a: {rate: 1e-9}}\n", ["TF106"]),
        ("links: {a: {visual: {boxx: [1, 1, 1]}}}\n", ["TF101"]),
        (
            "links: {a: {visual: {box: [1, 1, 1]}, collision: same, inertial: {mass: -1}}}\n",
            ["TF106"],
        ),
        ("links: {a: {visual: {box: [0, 1, 1]}, collision: same}}\n", ["TF106"]),
    ],
)
def test_what_would_be_computed_wrongly_or_ignored_is_refused(text: str, codes: list[str]) -> None:
    assert codes_of(text) == codes


@pytest.mark.parametrize(
    ("kind", "limit", "velocity", "effort"),
    [
        ("revolute", "{lower: 0, upper: 1, velocity: 180 deg/s, effort: 2 Nm}", math.pi, 2.0),
        ("prismatic", "{lower: 0, upper: 1, velocity: 0.5 m/s, effort: 20 N}", 0.5, 20.0),
        ("revolute", "{lower: 0, upper: 1, velocity: 3, effort: 4}", 3.0, 4.0),
        ("prismatic", "{lower: 0, upper: 1, velocity: 3, effort: 4}", 3.0, 4.0),
    ],
)
def test_a_joint_limit_takes_the_units_of_its_motion(
    kind: str, limit: str, velocity: float, effort: float
) -> None:
    text = (
        f"tfcompose: 1\nrobot: r\njoints: {{j: {{type: {kind}, parent: a, child: b, limit:"
        f" {limit}}}}}\n"
    )
    validated = validate(compose(load(text, "f")))
    joint = validated.spec.joints["j"]
    assert isinstance(joint, JointSpec)
    output = joint.limit
    assert output
    assert not validated.findings
    assert (output.velocity, output.effort) == pytest.approx((velocity, effort))


@pytest.mark.parametrize("name", ["pi", "a b", "ü", "1a", "build_dir", "params_file", ""])
def test_a_variable_that_no_expression_can_mean_is_refused_where_it_stands(name: str) -> None:
    (finding,) = validated(f"vars: {{{name!r}: 3}}\nframes: {{f: {{}}}}\n").findings
    assert finding.code == "TF105"
    assert (finding.span and finding.span.line) == 3


@pytest.mark.parametrize("what", ["frame(f)", "file(maps/a.yaml)", "frame(f) + 1"])
@pytest.mark.parametrize(
    "where", ["vars: {a: %s}", "frames: {f: {parent: %s}}", "base: %s", "calibrations: [%s]"]
)
def test_what_only_processes_can_use_is_refused_elsewhere(what: str, where: str) -> None:
    (finding,) = validated(where % f"'${{{what}}}'" + "\n").findings
    assert finding.code == "TF105"
    assert finding.message.endswith("is for processes only")
    assert "run, params" in finding.help


@pytest.mark.parametrize("what", ["frame(f) + 1", "2 * file(a/b.yaml)", "frame(${a})"])
def test_in_a_process_they_stand_alone(what: str) -> None:
    findings = validated(f"processes: {{p: {{run: [x, '${{{what}}}']}}}}\n").findings
    assert {finding.code for finding in findings} == {"TF105"}


def test_a_computed_number_is_a_word_of_a_command_and_of_its_environment() -> None:
    text = (
        "vars: {h: 30 cm, n: 2}\nprocesses:\n"
        "  a: {run: [x, '${h}', '${n}', 'h=${h}'], env: {H: '${n * 2}'}}\n"
        "  b: {run: {package: p, executable: e, args: ['${n}']}}\n"
    )
    spec = validated(text).spec
    assert spec
    run = spec.processes["a"].run
    assert run
    assert run.argv == ("x", "0.3", "2", "h=0.3")
    assert spec.processes["a"].env == {"H": "4"}
    again = spec.processes["b"].run
    assert again
    assert again.args == ("2",)
    assert codes_of("processes: {a: {run: [x, 3]}}\n") == ["TF103"]
