"""Robots from several files: what is laid over what, and where each value is from."""

import pytest

from tests.support.texts import reader
from tfcompose.foundation.findings import Finding, RejectedError, Span
from tfcompose.spec.language import compose, set_value, with_includes
from tfcompose.spec.load import Source, load


def included(files: dict[str, str], file: str = "robot.yaml") -> Source:
    return with_includes(load(files[file], file), reader(files))


def refused(files: dict[str, str]) -> tuple[Finding, ...]:
    with pytest.raises(RejectedError) as rejected:
        included(files)
    return rejected.value.findings


def test_a_file_is_laid_over_what_it_includes() -> None:
    files = {
        "robot.yaml": "include: [base.yaml]\nrobot: mine\nlinks: {b: {x: 3}}\n",
        "base.yaml": "robot: theirs\nlinks: {a: {}, b: {x: 1, y: 2}}\n",
    }
    source = included(files)
    assert source.data == {"robot": "mine", "links": {"a": {}, "b": {"x": 3, "y": 2}}}
    assert source.file == "robot.yaml"
    assert not source.findings


def test_each_value_knows_its_file_and_what_it_replaced() -> None:
    files = {
        "robot.yaml": "include: base.yaml\nlinks: {b: {x: 3}}\n",
        "base.yaml": "links: {b: {x: 1, y: 2}}\n",
    }
    source = included(files)
    assert (
        source.span_of(("links", "b", "x")).file,
        source.span_of(("links", "b", "y")).file,
    ) == (
        "robot.yaml",
        "base.yaml",
    )
    assert source.replaced[("links", "b", "x")] == (Span("base.yaml", 1, 16, 1, 17),)


def test_later_includes_are_laid_over_earlier_ones() -> None:
    files = {
        "robot.yaml": "include: [a.yaml, b.yaml]\n",
        "a.yaml": "robot: a\nbase: x\n",
        "b.yaml": "robot: b\n",
    }
    assert included(files).data == {"robot": "b", "base": "x"}


def test_paths_are_relative_to_the_file_that_writes_them() -> None:
    files = {
        "robots/rover.yaml": "include: [../common/base.yaml]\n",
        "common/base.yaml": "include: [frames.yaml]\n",
        "common/frames.yaml": "robot: r\n",
    }
    assert included(files, "robots/rover.yaml").data == {"robot": "r"}


def test_null_removes_what_was_included() -> None:
    files = {
        "robot.yaml": "include: [base.yaml]\nlinks: {b: null}\n",
        "base.yaml": "links: {a: {}, b: {}}\n",
    }
    assert compose(included(files)).data == {"links": {"a": {}}}


def test_null_in_a_profile_is_kept_for_the_profile() -> None:
    files = {
        "robot.yaml": "include: [base.yaml]\nprofiles: {p: {links: {b: null}}}\n",
        "base.yaml": "links: {a: {}, b: {}}\nprofiles: {p: {links: {a: {x: 1}}}}\n",
    }
    assert compose(included(files), ["p"]).data == {"links": {"a": {"x": 1}}}


def test_files_that_include_each_other_are_refused_with_the_circle() -> None:
    (finding,) = refused(
        {"robot.yaml": "include: [a.yaml]\n", "a.yaml": "include: [robot.yaml]\n"}
    )
    assert (finding.code, finding.span and finding.span.file) == ("TF015", "a.yaml")
    assert "robot.yaml → a.yaml → robot.yaml" in finding.message


def test_a_missing_file_is_reported_at_the_place_that_includes_it() -> None:
    (finding,) = refused({"robot.yaml": "robot: r\ninclude:\n  - nope.yaml\n"})
    assert finding.code == "TF001"
    assert [(note.message, str(note.span)) for note in finding.notes] == [
        ("included here", "robot.yaml:3:5")
    ]


@pytest.mark.parametrize("source_text", ["3", "[a.yaml, 3]", "{a: b}", "['']"])
def test_include_takes_names_of_files(source_text: str) -> None:
    assert [
        finding.code
        for finding in refused({"robot.yaml": f"include: {source_text}\n", "a.yaml": "robot: r"})
    ] == ["TF103"]


def test_many_files_are_bounded() -> None:
    files = {"robot.yaml": "include: [a0.yaml, a0.yaml]\n"}
    files |= {f"a{n}.yaml": f"include: [a{n + 1}.yaml, a{n + 1}.yaml]\n" for n in range(30)}
    files["a30.yaml"] = "robot: r\n"
    assert [finding.code for finding in refused(files)] == ["TF015"]


def test_overlays_come_after_profiles_and_settings_last() -> None:
    source = load("a: {x: 0}\nprofiles: {p: {a: {x: 1, y: 1, z: 1}}}\n", "f")
    overlays = [load("a: {y: 2, z: 2}\n", "o"), set_value("a.z=3")]
    assert compose(source, ["p"], overlays).data == {"a": {"x": 1, "y": 2, "z": 3}}


def test_an_overlay_can_bring_a_profile() -> None:
    source = load("a: 0\n", "f")
    made = compose(source, ["p"], [load("profiles: {p: {a: 1}}\n", "o")])
    assert (made.data, made.findings) == ({"a": 1}, ())


def test_an_overlay_that_changes_nothing_is_a_finding_at_both_places() -> None:
    findings = compose(load("a: {x: 1}\n", "f"), [], [load("a: {x: 1}\n", "o")]).findings
    assert [
        (finding.code, str(finding.span), [str(note.span) for note in finding.notes])
        for finding in findings
    ] == [("TF014", "o:1:8", ["f:1:8"])]


@pytest.mark.parametrize(
    ("overlay", "place"),
    [
        ("{}", "o:1:1"),
        ("a: {}\n", "o:1:4"),
        ("a: {b: {}}\n", "o:1:8"),
        ("a: {b: {}, x: 2}\n", "o:1:8"),
    ],
)
def test_an_overlay_that_is_empty_where_something_stands_is_a_finding(
    overlay: str, place: str
) -> None:
    (finding,) = compose(load("a: {x: 1, b: {y: 2}}\n", "f"), [], [load(overlay, "o")]).findings
    assert (finding.code, str(finding.span)) == ("TF014", place)


def test_an_overlay_may_name_its_language_and_bring_new_or_empty_values() -> None:
    assert not compose(
        load("tfcompose: 1\na: {}\n", "f"), [], [load("tfcompose: 1\na: {b: {}}\n", "o")]
    ).findings


def test_an_included_file_may_be_completed_by_what_stands_there_already() -> None:
    files = {"base": "links: {a: {}, b: {}}\n"}
    assert not with_includes(
        load("include: [base]\nlinks: {a: {}}\n", "f"), files.__getitem__
    ).findings


def test_a_setting_cannot_include() -> None:
    with pytest.raises(RejectedError) as refused:
        set_value("include=[a.yaml]")
    assert [finding.code for finding in refused.value.findings] == ["TF016"]


def test_true_is_not_one() -> None:
    assert not compose(load("a: 1\n", "f"), [], [load("a: true\n", "o")]).findings


@pytest.mark.parametrize(
    ("setting", "data"),
    [
        ("a.b=1", {"a": {"b": 1}}),
        ("a=[0, 0, 10 cm]", {"a": [0, 0, "10 cm"]}),
        ("a.b={c: d}", {"a": {"b": {"c": "d"}}}),
        ("a=x=y", {"a": "x=y"}),
        ("a=", {"a": None}),
        ("a=null", {"a": None}),
    ],
)
def test_a_setting_is_a_path_and_a_yaml_value(setting: str, data: dict[str, object]) -> None:
    assert set_value(setting).data == data


@pytest.mark.parametrize("setting", ["", "a", "=1", "a..b=1", ".a=1"])
def test_what_is_no_setting_is_refused(setting: str) -> None:
    with pytest.raises(RejectedError) as rejected:
        set_value(setting)
    assert [finding.code for finding in rejected.value.findings] == ["TF016"]


def test_a_fault_in_a_setting_is_placed_at_the_setting() -> None:
    source = compose(load("links: {}\n", "f"), [], [set_value("links.a.x=3")])
    assert source.span_of(("links", "a", "x")).file == "--set links.a.x=3"
