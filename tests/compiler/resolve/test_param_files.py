"""Parameter files that processes name.

Which parameters are taken, under which name, and how they are written.
"""

import contextlib
import json
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tests.support.cli import tfcompose_in
from tests.support.texts import reader
from tfcompose.cli.compiling import library
from tfcompose.compiler.compile import Compiled, compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.resolve.param_files import matches
from tfcompose.foundation.findings import RejectedError
from tfcompose.model.plan.file import read_plan
from tfcompose.spec.load.params import load_params

HEAD = "tfcompose: 1\nrobot: r\nros: {namespace: robot1}\nframes: {base_link: {}}\nprocesses:\n"
PLANNER = "  planner: {run: {package: p, executable: e}, params: PARAMS}\n"
FILE = """
/**: {ros__parameters: {common: 1, deep: {a: 1, b: 2}}}
robot1/planner:
  ros__parameters: {deep: {b: 3}, flag: on, octal: 012, text: "on", names: [base, "7", .5], empty: []}
/robot1/planner: {ros__parameters: {last: yes}}
planner: {ros__parameters: {not_mine: 1}}
robot1:
  planner: {ros__parameters: {nested: 1}}
  costmap: {ros__parameters: {radius: 0.3}}
/*/planner: {ros__parameters: {one_part: 1}}
"""  # noqa: E501 (a text as its reader has it)


def compiled(params: str, **files: str) -> Compiled:
    texts = {"p.yaml": FILE} | {f"{name}.yaml": text for name, text in files.items()}

    return compile_robot(
        HEAD + PLANNER.replace("PARAMS", params), "r.yaml", library(), read=reader(texts)
    )


def source_text(params: str, **files: str) -> str:
    result = compiled(params, **files)
    assert not result.errors, [finding.message for finding in result.errors]
    assert result.robot
    return {file.path: file.text for file in emit(result.robot)}["params/planner.yaml"]


def test_parameters_of_the_file_come_in_order_below_inline_ones() -> None:
    params = yaml.safe_load(source_text("{file: p.yaml, deep: {a: 9}, own: x}"))
    assert list(params)[-1] == "/robot1/planner"
    output = params["/robot1/planner"]["ros__parameters"]
    assert output["deep"] == {"a": 9, "b": 3}
    assert output["common"] == output["one_part"] == output["nested"] == 1
    assert output["own"] == "x"
    assert "not_mine" not in output


def test_sections_for_other_nodes_of_the_process_pass_on_in_order() -> None:
    params = yaml.safe_load(source_text("{file: p.yaml, own: x}"))
    assert list(params) == ["/**", "planner", "robot1/costmap", "/*/planner", "/robot1/planner"]
    assert params["robot1/costmap"]["ros__parameters"] == {"radius": 0.3}


def test_sections_of_several_files_keep_the_order_of_their_first_names() -> None:
    """As rcl keeps them: /** of the second file counts where the first one has it."""
    first = "/**: {ros__parameters: {a: 1}}\n/robot1/planner: {ros__parameters: {a: 2}}\n"
    text = source_text("{file: [p.yaml, q.yaml]}", p=first, q="/**: {ros__parameters: {a: 3}}\n")
    params = yaml.safe_load(text)
    assert params["/**"]["ros__parameters"]["a"] == 3
    assert params["/robot1/planner"]["ros__parameters"]["a"] == 2


def test_a_container_needs_no_parameters_of_its_own() -> None:
    robot = HEAD.partition("processes")[0] + ("containers: {box: {params: {file: p.yaml}}}\n")
    done = compile_robot(robot, "r.yaml", library(), read=reader({"p.yaml": FILE}))
    assert "TF334" not in {finding.code for finding in done.findings}


def test_a_file_may_be_named_as_everywhere_else() -> None:
    assert source_text('{file: "${file(p.yaml)}"}') == source_text("{file: p.yaml}")
    (missing,) = compiled('{file: "${file(q.yaml)}"}').errors
    assert (missing.code, "q.yaml" in str(missing.span), "${" in str(missing.span)) == (
        "TF001",
        True,
        False,
    )


def test_a_file_may_be_in_a_package(tmp_path: Path) -> None:
    (tmp_path / "nav").mkdir()
    (tmp_path / "nav/p.yaml").write_text(FILE, "utf-8")
    named = PLANNER.replace("PARAMS", "{file: package://nav/p.yaml}")
    robot = HEAD.replace("processes:", "packages: {nav: nav}\nprocesses:") + named
    (tmp_path / "robot.yaml").write_text(robot, "utf-8")
    assert tfcompose_in(tmp_path, "build").returncode == 0
    assert '"common": 1' in (tmp_path / "build/r/params/planner.yaml").read_text("utf-8")
    (tmp_path / "robot.yaml").write_text(HEAD + named, "utf-8")
    assert "robot.yaml:6:62: error[TF724]" in tfcompose_in(tmp_path, "lint").stdout


@pytest.mark.parametrize(
    ("params", "places"),
    [
        ("{file: sim.yaml}", ["r.yaml:6:62", "sim.yaml:1:39"]),
        ("{file: p.yaml, use_sim_time: true}", ["r.yaml:6:70"]),
        ("{file: sim.yaml, use_sim_time: true}", ["r.yaml:6:72"]),
    ],
)
def test_a_parameter_that_contradicts_the_clock_is_found_where_it_is_given(
    params: str, places: list[str]
) -> None:
    sim = "/**: {ros__parameters: {use_sim_time: true}}"
    (finding,) = (entry for entry in compiled(params, sim=sim).errors if entry.code == "TF335")
    assert [str(finding.span), *(str(note.span) for note in finding.notes)] == places
    over = compiled("{file: sim.yaml, use_sim_time: false}", sim=sim)
    assert "TF335" not in {entry.code for entry in over.findings}


def test_a_name_in_the_file_is_full_with_or_without_a_leading_slash() -> None:
    file = "planner: {ros__parameters: {a: 1}}\nrobot1/front/planner: {ros__parameters: {b: 1}}\n"
    params = yaml.safe_load(source_text("{file: front.yaml}, namespace: front", front=file))
    assert params["/robot1/front/planner"] == {"ros__parameters": {"b": 1}}


def test_words_stay_as_in_the_source() -> None:
    text = source_text("{file: p.yaml}")
    assert '"flag": on\n' in text
    assert '"octal": 012\n' in text
    assert '"text": "on"\n' in text
    assert '"names": [base, "7", .5]\n' in text
    assert '"last": yes\n' in text


def test_later_files_are_laid_over_earlier_ones() -> None:
    text = source_text(
        "{file: [p.yaml, q.yaml]}", q="robot1/planner: {ros__parameters: {common: 2}}"
    )
    assert yaml.safe_load(text)["/robot1/planner"]["ros__parameters"]["common"] == 2


def test_the_digest_of_the_plan_changes_with_the_file() -> None:
    def digest(file: str) -> str:
        robot = compiled("{file: q.yaml}", q=file).robot
        assert robot
        return read_plan(
            next(file.text for file in emit(robot) if file.path == "plan.json"), "p"
        ).spec_digest

    first, changed = "/**: {ros__parameters: {a: 1}}", "/**: {ros__parameters: {a: 2}}"
    assert digest(first) == digest(first) != digest(changed)


@pytest.mark.parametrize(
    ("params", "file", "code", "name"),
    [
        ("{file: none.yaml}", "", "TF001", "no such file"),
        ("{file: [3]}", "", "TF103", "names of files"),
        ("{file: q.yaml}", "[1, 2]", "TF002", "mapping of nodes"),
        ("{file: q.yaml}", "a: {b: [}", "TF002", ""),
        ("{file: q.yaml}", "a: 3", "TF018", ""),
        ("{file: q.yaml}", "planer: {ros__parameters: {a: 1}}", "TF334", "/robot1/planner"),
        ("{file: q.yaml}", "x: &x [1]\n" * 1, "TF018", ""),
        ("{planner: {ros__parameters: {a: 1}}}", "", "TF334", "planner"),
        ("{ros__parameters: {a: 1}}", "", "TF334", "ros__parameters"),
    ],
)
def test_what_is_no_parameter_of_the_node_is_a_finding(
    params: str, file: str, code: str, name: str
) -> None:
    findings = compiled(params, q=file).findings
    assert [finding.code for finding in findings] == [code], [
        finding.message for finding in findings
    ]
    assert name in findings[0].message


def test_of_several_files_one_must_name_the_node_or_each_gives_a_warning() -> None:
    files = {
        "q": "/**/planner: {ros__parameters: {a: 1}}",
        "common": "other: {ros__parameters: {a: 1}}",
    }
    assert compiled("{file: [common.yaml, q.yaml]}", **files).findings == ()
    files["q"] = files["common"]
    findings = compiled("{file: [common.yaml, q.yaml]}", **files).findings
    assert [(finding.code, finding.severity) for finding in findings] == [("TF334", "warning")] * 2
    first, second = (finding.span.column for finding in findings if finding.span)
    assert second - first == len("common.yaml, ")


def test_an_alias_bomb_is_refused() -> None:
    bomb = "a: &a0 {ros__parameters: {x: [1,1,1,1,1,1,1,1,1,1]}}\n"
    lines = [bomb, "b: &b0 [1,1,1,1,1,1,1,1,1,1]\n"]
    lines += [f"b{i}: &b{i} [{', '.join([f'*b{i - 1}'] * 10)}]\n" for i in range(1, 9)]
    lines.append("planner: {ros__parameters: {x: *b8}}\n")
    errors = compiled("{file: q.yaml}", q="".join(lines)).errors
    assert "TF008" in {finding.code for finding in errors}


@pytest.mark.parametrize(
    "text",
    [
        "a: &a\n  b: *a\n",
        "a: {ros__parameters: &p {b: *p}}\n",
        "a: {ros__parameters: {b: &l [*l]}}\n",
    ],
)
def test_an_alias_inside_what_it_names_is_a_finding(text: str) -> None:
    with pytest.raises(RejectedError) as rejected:
        load_params(text, "p.yaml")
    (finding,) = rejected.value.findings
    assert (finding.code, finding.span and finding.span.file) == ("TF008", "p.yaml")


@pytest.mark.parametrize(
    ("pattern", "name", "does"),
    [
        ("/a/b", "/a/b", True),
        ("/a", "/a/b", False),
        ("/*/b", "/a/b", True),
        ("/*", "/a/b", False),
        ("/**", "/a/b", True),
        ("/**/b", "/b", True),
        ("/**/c", "/a/b", False),
    ],
)
def test_stars_are_one_part_and_two_are_any_number(pattern: str, name: str, *, does: bool) -> None:
    assert matches(pattern, name) is does


@given(
    st.text(max_size=60)
    | st.recursive(st.text(max_size=3), lambda inner: st.lists(inner, max_size=3)).map(json.dumps)
)
def test_any_text_is_a_parameter_file_or_a_finding(text: str) -> None:
    with contextlib.suppress(RejectedError):
        load_params(text, "p.yaml")


def test_a_file_nested_too_deep_is_refused_and_the_interpreter_survives() -> None:
    deep = f"p: {{ros__parameters: {{x: {'[' * 200_000}}}}}"
    with pytest.raises(RejectedError) as rejected:
        load_params(deep, "deep.yaml")
    assert [finding.code for finding in rejected.value.findings] == ["TF008"]
