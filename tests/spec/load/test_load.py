"""YAML 1.2 with places; duplicates, merges and limits; overlays."""

import gc
import math
import re
import textwrap
import time
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tfcompose.foundation.findings import RejectedError, Span
from tfcompose.spec.language import compose, validate
from tfcompose.spec.load import Source, load
from tfcompose.spec.load.nodes import MOST_VALUES, Location

# YAML 1.2.2, section 10.3.2 (core schema). YAML 1.1 reads several of these otherwise.
SCALARS: dict[str, Any] = {
    "1e-3": 0.001,
    "1E3": 1000.0,
    "+12": 12,
    "-0": 0,
    "007": 7,
    "0o17": 15,
    "0x1F": 31,
    "1_000": "1_000",
    "0b11": "0b11",
    "1:30": "1:30",
    "1.": 1.0,
    ".5": 0.5,
    "-.5e1": -5.0,
    ".": ".",
    "1.2.3": "1.2.3",
    "on": "on",
    "off": "off",
    "yes": "yes",
    "no": "no",
    "y": "y",
    "true": True,
    "False": False,
    "tRue": "tRue",
    "2001-12-14": "2001-12-14",
    "=": "=",
    "0o8": "0o8",
    "'1'": "1",
    '"true"': "true",
    "!!str 1": "1",
    "!!float 1": 1.0,
    "30 cm": "30 cm",
}


@pytest.mark.parametrize("source_text", SCALARS)
def test_a_scalar_is_read_as_yaml_1_2_reads_it(source_text: str) -> None:
    value = load(f"a: {source_text}\n", "f").data["a"]
    assert value == SCALARS[source_text]
    assert type(value) is type(SCALARS[source_text])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_float_reads_back_as_itself(value: float) -> None:
    read = load(f"a: {value!r}\n", "f").data["a"]
    assert math.copysign(1, read) == math.copysign(1, value)
    assert read == value


@pytest.mark.parametrize("number", ["0x" + "f" * 250, "0o" + "7" * 330, "0x" + "0" * 400 + "1"])
def test_a_long_number_of_another_base_is_its_value(number: str) -> None:
    assert float(load(f"a: {number}\n", "f").data["a"]) == float(int(number, 0))


@given(st.integers(-(10**200), 10**200))
def test_every_integer_reads_back_as_itself(value: int) -> None:
    assert load(f"a: {value}\n", "f").data["a"] == value


@pytest.mark.parametrize(
    "number", [".nan", ".inf", "-.INF", "1e999", "9" * 400, "0x" + "f" * 400, "0o" + "7" * 400]
)
def test_what_is_not_finite_is_a_finding_at_its_place(number: str) -> None:
    findings = load(f"a: {number}\n", "f").findings
    assert [(finding.code, finding.span) for finding in findings] == [
        ("TF007", Span("f", 1, 4, 1, 4 + len(number)))
    ]
    assert number[:40] in findings[0].message
    assert len(findings[0].message) < 100


@pytest.mark.parametrize(
    "around",
    [
        "processes: {n: {params: {x: NUMBER}}}",
        "containers: {n: {nodes: {/m: {params: {in: {x: [1.0, NUMBER]}}}}}}",
        "sensors: {s: {driver: {params: {x: NUMBER}}}}",
        "profiles: {sim: {processes: {params: {params: {x: NUMBER}}}}}",
    ],
)
def test_parameters_of_nodes_may_be_infinite(around: str) -> None:
    for number, value in ((".inf", math.inf), ("-.INF", -math.inf), ("+.Inf", math.inf)):
        source = load(around.replace("NUMBER", number), "f")
        assert not source.findings
        assert repr(value) in repr(source.data)
    assert "nan" in repr(load(around.replace("NUMBER", ".nan"), "f").data)
    assert [finding.code for finding in load(around.replace("NUMBER", "1e999"), "f").findings] == [
        "TF007"
    ]


@pytest.mark.parametrize(
    "around",
    [
        "frames: {params: {xyz: [.inf, 0, 0]}}",
        "processes: {params: {restart_delay: .inf}}",
        "sensors: {s: {frames: {params: {xyz: [.inf, 0, 0]}}}}",
        "parts: {arm: {params: {x: .inf}}}",
        "xml: {params: {x: .inf}}",
    ],
)
def test_what_is_named_params_elsewhere_may_not_be_infinite(around: str) -> None:
    assert [finding.code for finding in load(around, "f").findings] == ["TF007"]


TEXT = """\
robot: r
links:
  base_link: {visual: [1, 30 cm]}
"käse": |
  two
  lines
"""


def test_keys_and_values_know_where_they_stand() -> None:
    source = load(TEXT, "f")
    assert source.span_of(("robot",)) == Span("f", 1, 8, 1, 9)
    assert source.key_span(("robot",)) == Span("f", 1, 1, 1, 6)
    assert source.key_span(("links", "base_link")) == Span("f", 3, 3, 3, 12)
    assert source.span_of(("links", "base_link")) == Span("f", 3, 14, 3, 34)
    assert source.span_of(("links", "base_link", "visual", 1)) == Span("f", 3, 27, 3, 32)
    assert source.key_span(("käse",)) == Span("f", 4, 1, 4, 7)


def test_what_is_not_there_has_the_place_of_what_is_around_it() -> None:
    source = load(TEXT, "f")
    assert source.span_of(("links", "base_link", "mass", "kg")) == source.span_of(
        ("links", "base_link")
    )
    assert source.key_span(("links", "arm")) == source.key_span(("links",))
    assert Source("f", Location(Span("f")), {}).span_of(("a",)) == Span("f")


def test_a_duplicate_key_is_a_finding_that_shows_the_first_which_counts() -> None:
    source = load("a: 1\nb: 2\na: 3\n", "f")
    assert source.data == {"a": 1, "b": 2}
    (finding,) = source.findings
    assert (finding.code, finding.span, finding.notes[0].span) == (
        "TF003",
        Span("f", 3, 1, 3, 2),
        Span("f", 1, 1, 1, 2),
    )


MERGED = """\
x-one: &one {a: 1, b: 1}
x-two: &two {b: 2, c: 2}
own: {<<: *one, b: 0}
first: {<<: [*one, *two]}
deep: {<<: {<<: *two, a: 3}, d: 3}
quoted: {"<<": 1}
"""


def test_merges_give_what_is_missing_and_the_first_wins() -> None:
    source = load(MERGED, "f")
    assert not source.findings
    assert source.data == {
        "own": {"a": 1, "b": 0},
        "first": {"a": 1, "b": 1, "c": 2},
        "deep": {"a": 3, "b": 2, "c": 2, "d": 3},
        "quoted": {"<<": 1},
    }
    assert source.span_of(("own", "a")).line == 1
    assert source.span_of(("own", "b")).line == 3


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("a: {<<: 1}\n", "TF011"),
        ("a: {<<: [{b: 1}, 2]}\n", "TF011"),
        ("x-a: &a {b: 1, b: 2}\na: {<<: *a}\n", "TF003"),
        ("x-a: &a {1: b}\na: {<<: *a}\n", "TF004"),
        ("a: {<<: {b: 1}, <<: {c: 1}}\n", "TF003"),
        ("1: a\n", "TF004"),
        ("true: a\n", "TF004"),
        ("[a]: b\n", "TF004"),
        ("? {a: !mine b}\n: c\n", "TF004"),
        ("a: !mine b\n", "TF005"),
        ("a: !!python/object:os.system b\n", "TF005"),
        ("a: !!int b\n", "TF005"),
        ("a: !!set {b, c}\n", "TF005"),
    ],
)
def test_what_yaml_allows_and_a_robot_does_not_is_one_finding(text: str, code: str) -> None:
    assert {finding.code for finding in load(text, "f").findings} == {code}


@pytest.mark.parametrize(
    ("text", "code", "line", "column"),
    [
        ("a: [1\nb: 2\n", "TF002", 1, 4),
        ("a:\n  b: {c: [1, '}'], # }\nd: {}\n", "TF002", 2, 6),
        ("a: {\n  b: 1\n  c: 2\n}\n", "TF002", 3, 4),
        ("a: 'b\n", "TF002", 1, 4),
        ("\ta: 1\n", "TF002", 1, 1),
        ("a:\n  b: 1\n c: 2\n", "TF002", 3, 2),
        ("a: *b\n", "TF002", 1, 4),
        ("a: 1\n--- \nb: 1\n", "TF002", 2, 1),
        ("- 1\n", "TF002", 1, 1),
        ("text\n", "TF002", 1, 1),
        ("", "TF002", 1, 1),
        ("ä: \x07\n", "TF002", 1, 4),
        ('a: "x\\0y"\n', "TF002", 1, 4),
        ('a: "\\ud800"\n', "TF002", 1, 7),
        ("a: \ud800\n", "TF001", 1, 1),
        ("a: \0\n", "TF001", 1, 1),
    ],
)
def test_what_is_no_yaml_is_one_finding_with_its_place(
    text: str, code: str, line: int, column: int
) -> None:
    with pytest.raises(RejectedError) as rejected:
        load(text, "f")
    (finding,) = rejected.value.findings
    assert (finding.code, finding.span and (finding.span.line, finding.span.column)) == (
        code,
        (line, column),
    )


@pytest.mark.parametrize(
    ("text", "message", "advice"),
    [
        ('<robot name="r"/>', "this is XML", "parts: {NAME: {urdf: f}}"),
        (
            '\n<!-- a -->\n<robot xmlns:xacro="http://www.ros.org/wiki/xacro"/>',
            "this is XML",
            "{xacro: f}",
        ),
        ("<launch/>", "this is XML", ""),
        (
            '{"version": 1, "spec_digest": "sha256:0", "processes": [], "rate": null}',
            "this is a built plan",
            "verify",
        ),
    ],
)
def test_a_file_for_another_command_is_one_finding_that_says_which(
    text: str, message: str, advice: str
) -> None:
    with pytest.raises(RejectedError) as rejected:
        load(text, "f")
    (finding,) = rejected.value.findings
    assert finding.message.startswith(message)
    assert advice in finding.help
    assert bool(finding.help) == bool(advice)


def bomb(kind: str) -> str:
    lines = ["a0: &a0 {k: 1}"]
    for n in range(60):
        inner = {
            "lists": f"[{', '.join([f'*a{n}'] * 9)}]",
            "maps": f"{{a: *a{n}, b: *a{n}, c: *a{n}}}",
        }
        merge = f"{{<<: [*a{n}, *a{n}, *a{n}], k{n}: 1}}"
        lines.append(f"a{n + 1}: &a{n + 1} {inner.get(kind, merge)}")
    return "\n".join([*lines, ""])


LARGE = {
    "aliases in lists": bomb("lists"),
    "aliases in mappings": bomb("maps"),
    "aliases in merges": bomb("merges"),
    "an alias to itself": "a: &a {b: *a, c: *a}\n",
    "depth through aliases": "".join(
        f"x-{n}: &a{n} {{a: {f'*a{n - 1}' if n else 1}}}\n" for n in range(50)
    ),
    "a merge of itself": "a: &a {<<: *a}\n",
    "aliases that nothing uses": "x-bomb:\n" + textwrap.indent(bomb("lists"), "  ") + "a: 1\n",
    "aliases that nothing uses, key by key": (
        re.sub("^a", "x-a", bomb("maps"), flags=re.MULTILINE) + "a: 1\n"
    ),
    "an alias to itself that nothing uses": "x-a: &a [*a]\na: 1\n",
    "brackets": "a: " + "[" * 500_000,
    "braces": "a: " + "{a: " * 200_000,
    "indentation": "\n".join(" " * n + "a:" for n in range(2000)),
    "values": "a: [" + "1," * 400_000 + "]\n",
    "characters": "# " + "x" * 5_000_000,
}


def test_an_oversized_input_is_refused_before_the_largest_file_is_read() -> None:
    def seconds(text: str) -> float:
        began = time.process_time()
        load(text, "f")
        return time.process_time() - began

    longest = 3 * seconds("a: [" + "1," * (MOST_VALUES - 10) + "]\n")
    for case, text in LARGE.items():
        began = time.process_time()
        with pytest.raises(RejectedError) as rejected:
            load(text, "f")
        assert [finding.code for finding in rejected.value.findings] == ["TF008"], case
        assert time.process_time() - began < longest, case


@pytest.mark.parametrize(
    ("case", "text", "expected"),
    [
        ("brackets", "a: 1\nb: " + "[" * 2000, ("TF008", 2, 43)),
        ("braces", "{" * 20_000, ("TF008", 1, 41)),
        ("after other levels", "x: [1]\ny: {ü: " + "[ ää, " * 300 + "[" * 1500, ("TF008", 2, 236)),
        ("closed", "- " + "[" * 5000 + "]" * 5000, ("TF008", 1, 42)),
        ("a string", "b: " + "[" * 100 + '"' + " " * 60 + '", ' + "[" * 1200, ("TF008", 1, 43)),
        ("no key where one must be", "a: 1\n" + "[" * 2000, ("TF002", 2, 1)),
    ],
)
def test_text_nested_too_deep_is_refused_at_the_first_excess_level(
    case: str, text: str, expected: tuple[str, int, int]
) -> None:
    """Versions of PyYAML differ in how far they read ahead, and in how deep they go themselves."""
    with pytest.raises(RejectedError) as rejected:
        load(text, "f")
    places = [
        (finding.code, finding.span.line, finding.span.column)
        for finding in rejected.value.findings
        if finding.span
    ]
    assert places == [expected], case


def laid(text: str, *profiles: str) -> Source:
    return compose(load(text, "f"), profiles)


BASE = """\
a: {b: 1, c: [1, 2], d: {e: 1}}
frames: {f: {parent: p, rpy: [0, 0, 1]}}
processes: {p: {run: [x], restart: always}}
profiles:
  merge: {a: {b: 2, g: 3}}
  list: {a: {c: [3]}}
  remove: {a: {d: null}}
  nothing: {a: {x: null}}
  within: {new: {y: {z: null}}}
  replace: {a: {d: 5}}
  deepen: {a: {b: {h: 1}}}
  turn: {frames: {f: {look: down}}}
  simulate: {processes: {p: {simulate: {joints: zero}}}}
"""


def test_mappings_merge_and_scalars_and_lists_replace() -> None:
    assert laid(BASE, "merge").data["a"] == {"b": 2, "c": [1, 2], "d": {"e": 1}, "g": 3}
    assert laid(BASE, "list").data["a"]["c"] == [3]
    assert laid(BASE, "replace").data["a"]["d"] == 5
    assert laid(BASE, "deepen").data["a"]["b"] == {"h": 1}
    assert laid(BASE, "merge", "list").data["a"] == {"b": 2, "c": [3], "d": {"e": 1}, "g": 3}


def test_null_removes_and_says_so_where_nothing_was() -> None:
    removed = laid(BASE, "remove")
    assert removed.data["a"] == {"b": 1, "c": [1, 2]}
    assert not removed.findings
    for profile, name, line in (("nothing", "a.x", 8), ("within", "new.y.z", 9)):
        (finding,) = laid(BASE, profile).findings
        assert (finding.code, finding.severity, finding.span and finding.span.line) == (
            "TF010",
            "warning",
            line,
        )
        assert name in finding.message


def test_one_choice_out_of_several_drops_the_others() -> None:
    assert laid(BASE, "turn").data["frames"]["f"] == {"parent": "p", "look": "down"}
    assert laid(BASE, "simulate").data["processes"]["p"] == {
        "restart": "always",
        "simulate": {"joints": "zero"},
    }


def test_a_key_remembers_where_it_is_from() -> None:
    merged = laid(BASE, "merge", "list")
    assert merged.span_of(("a", "b")).line == 5
    assert merged.span_of(("a", "c", 0)).line == 6
    assert merged.span_of(("a", "d", "e")).line == 1
    assert not merged.has(("a", "c", 1))


def spans_of(source: Source) -> dict[Any, Span]:
    return {path: location.span for path, location in source.places.walk()}


def test_laying_a_profile_over_leaves_the_source_as_it_was() -> None:
    source = load(BASE, "f")
    before = (str(source.data), spans_of(source))
    compose(source, ["merge", "remove", "turn"])
    assert (str(source.data), spans_of(source)) == before


def test_a_null_that_removes_nothing_is_a_finding_even_in_a_list() -> None:
    findings = validate(
        laid("tfcompose: 1\nrobot: r\nbase:\nvars: {c: ~}\ninclude: [a, null]\n")
    ).findings
    assert [(finding.code, finding.span and finding.span.line) for finding in findings] == [
        ("TF006", n) for n in (3, 4, 5)
    ]


@pytest.mark.parametrize("profiles", ["5", "[a]", "{a: 5}", "{a: {profiles: {b: {}}}}"])
def test_profiles_of_a_wrong_form_are_found_without_choosing_one(profiles: str) -> None:
    assert {finding.code for finding in laid(f"profiles: {profiles}\n").findings} <= {
        "TF103",
        "TF101",
    }
    assert laid(f"profiles: {profiles}\n").findings


def test_an_unknown_profile_is_refused_once_with_the_nearest_name() -> None:
    with pytest.raises(RejectedError) as rejected:
        laid(BASE, "merg", "merg")
    (finding,) = rejected.value.findings
    assert (finding.code, finding.help) == ("TF009", "did you mean merge?")


def test_a_large_profile_is_laid_over_in_time_that_grows_with_its_size() -> None:
    def seconds(count: int) -> float:
        keys = "".join(f"  k{n}: {{a: 1}}\n" for n in range(count))
        source = load(
            f"base:\n{keys}profiles:\n  p:\n    base:\n" + keys.replace("  k", "      k"), "f"
        )
        gc.disable()  # it is turned down on the command line too, and grows with everything else that is alive  # noqa: E501 (a text as its reader has it)
        began = time.process_time()
        compose(source, ["p"])
        taken = time.process_time() - began
        gc.enable()
        return taken

    few, many = (min(seconds(count) for _ in range(2)) for count in (1_000, 8_000))
    assert many < 16 * max(few, 0.01)


ASIDE = """\
x-unused: {1: a, b: !mine c, d: 1, d: 2, e: .nan}
x-used: &used {a: !mine b, 2: x, e: [.inf]}
one: *used
two: {<<: *used, 3: {a: !mine b}}
"""


def test_faults_below_an_anchor_are_reported_once_and_only_if_it_is_used() -> None:
    findings = load(ASIDE, "f").findings
    places = sorted(
        (finding.code, finding.span.line, finding.span.column)
        for finding in findings
        if finding.span
    )
    assert places == [("TF004", 2, 28), ("TF004", 4, 18), ("TF005", 2, 19), ("TF007", 2, 38)]


def test_an_alias_has_the_value_and_place_of_its_anchor_and_its_own_key() -> None:
    source = load("x-a: &a {k: [1]}\none: *a\ntwo: {b: *a}\n", "f")
    assert source.data["one"] is source.data["two"]["b"]
    assert source.span_of(("two", "b", "k", 0)) == Span("f", 1, 14, 1, 15)
    assert source.key_span(("two", "b")) == Span("f", 3, 7, 3, 8)
    assert source.has_key(("two", "b", "k"))
    assert not source.has_key(("two", "b", "k", 0))
    assert not source.has_key(())
    assert not source.has(("two", "b", "k", 1))
    assert load("a: &n b\n*n : 1\n", "f").data == {"a": "b", "b": 1}
