"""``args``, ``when``, ``for`` and ``env``.

What a robot is built with, and which entries it then has.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import pytest

from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit.plan import plan_of
from tfcompose.foundation.findings import Span
from tfcompose.spec.language import ArgValue, BuildInputs

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tfcompose.compiler.compile import Compiled
    from tfcompose.model.robot import Robot

HEAD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"
NOTHING: Mapping[str, Any] = MappingProxyType({})


def built(
    text: str,
    args: Mapping[str, Any] = NOTHING,
    environment: Mapping[str, str] = NOTHING,
    files: Mapping[str, str] = NOTHING,
    profiles: tuple[str, ...] = (),
) -> Compiled:
    inputs = BuildInputs(
        {name: ArgValue(value, Span(f"{name}:={value}")) for name, value in args.items()},
        environment,
    )
    return compile_robot(
        HEAD + text, "r.yaml", library(), profiles, read=dict(files).__getitem__, inputs=inputs
    )


def robot(compiled: Compiled) -> Robot:
    assert not compiled.errors, compiled.errors
    assert compiled.robot is not None
    return compiled.robot


def places(compiled: Compiled) -> list[tuple[str, str, int]]:
    return [
        (finding.code, finding.span.file, finding.span.line)
        for finding in compiled.findings
        if finding.span
    ]


CAMERAS = """\
args: {cameras: {default: 2, min: 0, max: 4, env: CAMERAS}}
frames:
  camera_${i}: {for: {i: "${range(args.cameras)}"}, parent: base_link, xyz: [0, "${i * 10 cm}", 0]}
"""


@pytest.mark.parametrize(
    ("values", "environment", "count"),
    [({}, {}, 2), ({"cameras": "3"}, {"CAMERAS": "1"}, 3), ({}, {"CAMERAS": "1"}, 1)],
)
def test_the_command_line_precedes_the_environment_and_that_the_default(
    values: dict[str, str], environment: dict[str, str], count: int
) -> None:
    made = robot(built(CAMERAS, values, environment))
    assert [*made.frames] == [*(f"camera_{i}" for i in range(count)), "base_link"]
    assert [edge.pose.xyz[1] for edge in made.edges] == pytest.approx(
        [0.1 * i for i in range(count)]
    )
    assert made.args == {"cameras": count}


@pytest.mark.parametrize(
    ("text", "values", "code", "names"),
    [
        ("cameras: {default: 2, max: 4}", {"cameras": "5"}, "TF106", "4"),
        ("cameras: 2", {"cameras": "two"}, "TF103", "cameras"),
        ("cameras: 2", {"cameras": "2.5"}, "TF103", "cameras"),
        ("sim: false", {"sim": "1"}, "TF103", "true"),
        ("lidar: {choices: [ouster, velodyne]}", {"lidar": "velodin"}, "TF106", "velodyne"),
        ("mast: 30 cm", {"mast": "5 kg"}, "TF104", "length"),
        ("cameras: 2", {"camera": "1"}, "TF016", "cameras"),
        ("name: {type: string}", {}, "TF102", "name"),
    ],
)
def test_a_wrong_value_is_a_finding_that_names_what_can_be(
    text: str, values: dict[str, str], code: str, names: str
) -> None:
    name = text.partition(":")[0]
    uses = "vars: {x: '${args.NAME}'}\nprocesses: {p: {run: [x, '${x}']}}\n".replace("NAME", name)
    (finding,) = built(f"args: {{{text}}}\n{uses}", values).errors
    assert finding.code == code
    assert names in finding.message + finding.help
    assert finding.span
    assert (
        finding.span.file == "".join(f"{text}:={value}" for text, value in values.items())
        or finding.span.file == "r.yaml"
    )


@pytest.mark.parametrize(
    ("declared", "code"),
    [
        ("{type: int, default: x}", "TF103"),
        ("{default: 9, max: 4}", "TF106"),
        ("{choices: [a, b], default: c}", "TF106"),
        ("{default: true, min: 1}", "TF107"),
        ("{default: [1]}", "TF103"),
        ("{defalt: 1}", "TF101"),
        ("{type: number}", "TF106"),
    ],
)
def test_a_wrong_declaration_is_one_finding_on_its_line(declared: str, code: str) -> None:
    compiled = built(
        f"args:\n  n: {declared}\nframes: {{a: {{parent: base_link, when: '${{args.n =="
        " args.n}'}}\n"
    )
    assert places(compiled) == [(code, "r.yaml", 5)]


def test_values_keep_their_types_in_arguments_parameters_and_keys() -> None:
    text = """\
args: {n: 2, sim: true, word: "007", mast: 30 cm}
processes:
  p:
    run: [x, "${args.n}", "${args.sim}", "a_${args.word}", "${args.mast}"]
    params: {n: "${args.n}", sim: "${args.sim}", word: "${args.word}", twice: "${args.mast * 2}"}
    required: ${args.sim}
"""
    (process,) = [process for process in robot(built(text)).processes if process.name == "p"]
    assert process.argv == ("x", "2", "true", "a_007", "0.3")
    assert process.ros_nodes[0].params == {"n": 2, "sim": True, "word": "007", "twice": 0.6}
    assert process.required is True


def test_an_omitted_process_is_not_awaited_and_a_misspelt_one_is_found() -> None:
    text = """\
args: {sim: false, n: 2}
processes:
  world: {when: "${args.sim}", run: [w]}
  cam_${i}: {for: {i: "${range(args.n)}"}, run: [c], after: {"cam_${i - 1}": ready}}
  drive: {run: [d], after: {world: ready, cam_7: ready, cam_1: ready}}
"""
    made = {
        process.name: process.after
        for process in robot(built(text)).processes
        if process.kind == "run"
    }
    assert made == {"cam_0": {}, "cam_1": {"cam_0": "ready"}, "drive": {"cam_1": "ready"}}
    assert "world" in {process.name for process in robot(built(text, {"sim": "true"})).processes}
    wrong = built(text.replace("{world: ready", "{wrld: ready"))
    assert [finding.code for finding in wrong.errors] == ["TF813"]


@pytest.mark.parametrize(
    ("entry", "line"),
    [
        ("a: {parent: base_link, when: args.n}", 5),
        ("a: {parent: base_link, when: '${args.n}'}", 5),
        ("a: {parent: base_link, for: {i: [1, 2]}}", 5),
        ("a_${i}: {parent: base_link, for: {i: 3}}", 5),
        ("a_${i}: {parent: base_link, for: {i: '${range(1.5)}'}}", 5),
        ("a_${i}: {parent: base_link, for: {i: '${range(100000)}'}}", 5),
        ("a_${i}: {parent: base_link, for: {i: [1, 1]}}", 5),
        ("a_${v}: {parent: base_link, for: {v: [1]}}", 5),
        ("a_${i}: {parent: base_link, for: {i: [1], j: [1, 2]}}", 5),
    ],
)
def test_a_condition_or_a_loop_that_cannot_be_decided_is_one_finding(
    entry: str, line: int
) -> None:
    compiled = built(
        f"frames:\n  {entry}\nargs: {{n: 1}}\nvars: {{v: '${{args.n}}'}}\nxml: '${{v}}'\n"
    )
    conditions = [place for place in places(compiled) if place[0] == "TF105"]
    assert conditions == [("TF105", "r.yaml", line)]


@pytest.mark.parametrize(
    "entry",
    [
        "a: {parent: base_link, when: }",
        "'a_${i}': {for: {i: [1, 2]}, parent: base_link, when: }",
        "a: {for: , parent: base_link}",
    ],
)
def test_a_condition_or_a_loop_without_a_value_is_refused(entry: str) -> None:
    assert places(built(f"frames:\n  {entry}\n")) == [("TF006", "r.yaml", 5)]


def test_loops_over_several_variables_make_every_combination() -> None:
    text = (
        "frames: {'${side}_${i}': {for: {side: [left, right], i: '${range(1, 3)}'}, parent:"
        " base_link}}\n"
    )
    assert {*robot(built(text)).frames} == {"base_link", "left_1", "left_2", "right_1", "right_2"}


def test_a_conditional_profile_applies_if_it_holds_or_is_named() -> None:
    text = """\
args: {sim: false}
profiles:
  demo: {when: "${args.sim}", frames: {a: {parent: base_link}}}
"""
    assert "a" not in robot(built(text)).frames
    assert "a" in robot(built(text, {"sim": "true"})).frames
    assert "a" in robot(built(text, profiles=("demo",))).frames
    changing = built(
        "args: {sim: true}\nprofiles:\n  demo: {when: '${args.sim}', args: {sim: false}}\n"
    )
    assert [finding.code for finding in changing.errors] == ["TF107"]


def test_a_part_is_given_its_arguments_and_an_including_file_sets_defaults() -> None:
    arm = HEAD.replace("robot: r", "robot: arm") + CAMERAS
    text = "parts: {p: {spec: arm.yaml, prefix: p_, parent: base_link, args: {cameras: N}}}\n"
    made = robot(
        built(text.replace("N", "1"), environment={"CAMERAS": "3"}, files={"arm.yaml": arm})
    )
    assert {*made.frames} == {"base_link", "p_base_link", "p_camera_0"}
    wrong = built(text.replace("N", "9"), files={"arm.yaml": arm})
    assert places(wrong)[0] == ("TF106", "r.yaml", 4)
    unknown = built(text.replace("cameras: N", "camera: 1"), files={"arm.yaml": arm})
    assert places(unknown)[0] == ("TF016", "r.yaml", 4)
    over = "include: base.yaml\nargs: {cameras: N}\n"
    base = arm.replace("robot: arm", "robot: r")
    assert robot(built(over.replace("N", "3"), files={"base.yaml": base})).args == {"cameras": 3}
    assert robot(
        built(over.replace("N", "3"), {"cameras": "1"}, files={"base.yaml": base})
    ).args == {"cameras": 1}
    assert places(built(over.replace("N", "9"), files={"base.yaml": base}))[0][:2] == (
        "TF106",
        "r.yaml",
    )


def test_a_named_environment_variable_is_read_and_recorded_in_the_plan() -> None:
    text = """\
vars: {mast: "${env(MAST, 30 cm)}"}
frames: {a: {parent: base_link, xyz: [0, 0, "${mast}"]}}
processes: {p: {run: [x, "dev_${env(PORT)}"]}}
"""
    plan = plan_of(robot(built(text, environment={"PORT": "0.50", "OTHER": "x"})))
    assert plan.environment == {"MAST": "30 cm", "PORT": "0.50"}
    assert plan.process("p").argv == ("x", "dev_0.50")
    assert plan.edges[0].pose.xyz == (0, 0, 0.3)
    second_plan = plan_of(robot(built(text, environment={"PORT": "0.50", "MAST": "1 m"})))
    assert second_plan.edges[0].pose.xyz == (0, 0, 1)
    assert second_plan.spec_digest != plan.spec_digest
    assert [finding.code for finding in built(text).errors] == ["TF105"]


def test_an_argument_that_nothing_uses_is_named() -> None:
    assert [finding.code for finding in built("args: {n: 1}\n").findings] == ["TF504"]


@pytest.mark.parametrize(
    ("wrong", "message", "advice"),
    [
        ("args.camera", "camera", "cameras"),
        ("args.cameras", "args.cameras", "range(args.cameras)"),
    ],
)
def test_a_loop_over_no_list_names_what_is_unknown_in_it_or_its_range(
    wrong: str, message: str, advice: str
) -> None:
    (finding,) = built(CAMERAS.replace("range(args.cameras)", wrong)).errors
    assert message in finding.message
    assert advice in finding.help


def test_entries_of_a_loop_choose_their_values() -> None:
    robot = built(CAMERAS.replace("${i * 10 cm}", "${0.1 if i == 0 else 0.2}")).robot
    assert robot
    assert {edge.pose.xyz for edge in robot.edges if edge.child.startswith("camera")} >= {
        (0, 0.1, 0),
        (0, 0.2, 0),
    }


def test_a_process_waits_on_for_one_of_a_part_that_a_loop_makes() -> None:
    arm = "tfcompose: 1\nrobot: arm\nlinks: {base: {}}\nprocesses: {drive: {run: [drive]}}\n"
    text = (
        "parts: {'arm_${i}': {for: {i: [1, 2]}, spec: arm.yaml, prefix: 'arm_${i}_', parent:"
        " base_link}}\nprocesses:\n  'other_${i}': {for: {i: [1]}, when: false, run: [other]}\n "
        " plan: {run: [plan], after: {arm_1/drive: started, other_1: started}}\n"
    )
    made = robot(built(text, files={"arm.yaml": arm}))
    (plan,) = [process for process in made.processes if process.name == "plan"]
    assert plan.after == {"arm_1/drive": "started"}


def test_loops_in_each_other_make_no_more_entries_than_one_may() -> None:
    text = (
        'frames: {"f_${i}_${j}": {for: {i: "${range(200)}", j: "${range(200)}"}, parent:'
        " base_link}}\n"
    )
    assert [finding.code for finding in built(text).errors] == ["TF105"]


def test_what_a_profile_replaced_in_an_entry_that_a_loop_makes_is_noted() -> None:
    text = (
        "frames: {'f_${i}': {for: {i: [1]}, parent: base_link, xyz: [1, 0, 0]}}\n"
        "profiles: {high: {frames: {'f_${i}': {xyz: [900, 0, 0]}}}}\n"
    )
    (far,) = [
        finding for finding in built(text, profiles=("high",)).findings if finding.code == "TF414"
    ]
    assert far.span
    assert (far.span.line, [note.span.line for note in far.notes if note.span]) == (5, [4])


@pytest.mark.parametrize(
    ("declared", "type_"), [("{type: float, default: 3}", float), ("3.0", float), ("3", int)]
)
def test_a_parameter_takes_its_arguments_type_in_any_form_of_the_value(
    declared: str, type_: type
) -> None:
    text = (
        f"args: {{rate: {declared}}}\nprocesses: {{n: {{run: [n], params: {{rate:"
        ' "${args.rate}"}}}\n'
    )
    for values in ({}, {"rate": "7"}):
        (process,) = (
            process for process in robot(built(text, values)).processes if process.name == "n"
        )
        assert type(process.ros_nodes[0].params["rate"]) is type_
