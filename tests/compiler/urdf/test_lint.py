"""A URDF that somebody else wrote is judged with the lines of that file."""

import json
import re
import subprocess
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.cli import tfcompose_in
from tests.support.findings import words, words_of
from tfcompose.cli.compiling import disk, library
from tfcompose.compiler.check import RULES
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.urdf.convert import robot_of
from tfcompose.compiler.urdf.lint import lint_urdf as lint_with
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.compiler.urdf.read import read_xml
from tfcompose.foundation.findings import Finding, RejectedError, Span

ROOT = Path(__file__).parents[3]
FILES = sorted((Path(__file__).parent / "urdfs").glob("*.urdf"))
MARK = re.compile(r"<!-- expect: (TF\d{3}(?: TF\d{3})*) -->")
FINE = '<robot name="r"><link name="base_link"/></robot>'


def marks(text: str) -> list[tuple[int, str]]:
    lines = enumerate(text.splitlines(), 1)
    return [
        (number, code)
        for number, line in lines
        for hit in MARK.findall(line)
        for code in hit.split()
    ]


def lint_urdf(file: str) -> list[Finding]:
    return lint_with(file, Packages(disk()))


def lint_text(text: str) -> tuple[Finding, ...]:
    try:
        return robot_of(read_xml(text, "r.urdf"), "r.urdf", Packages().asset).findings
    except RejectedError as error:
        return error.findings


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return tfcompose_in(folder, "lint", *words)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_each_marked_line_gives_its_findings_and_no_other_line_gives_one(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/nowhere")
    findings = lint_urdf(str(file))
    assert [(finding.span.line, finding.code) for finding in findings if finding.span] == marks(
        file.read_text("utf-8")
    )


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_each_finding_points_at_the_word_that_is_wrong(file: Path) -> None:
    lines = file.read_text("utf-8").splitlines()
    for finding in lint_urdf(str(file)):
        assert finding.span
        source_text = lines[finding.span.line - 1][
            finding.span.column - 1 : finding.span.end_column - 1
        ]
        if source_text.startswith("<!--"):  # a comment may have several lines
            continue
        assert finding.span.line == finding.span.end_line
        assert source_text.startswith("<") or source_text in re.findall(
            r"\"([^\"]+)\"", lines[finding.span.line - 1]
        )


def test_the_nearest_name_is_the_advice() -> None:
    findings = [finding for file in FILES for finding in lint_urdf(str(file))]
    for code, name, near in (
        ("TF720", "orign", "origin"),
        ("TF720", "xzy", "xyz"),
        ("TF203", "base_lnk", "base_link"),
        ("TF701", "no_limt", "no_limit"),
    ):
        (advice,) = {
            finding.help
            for finding in findings
            if finding.code == code and re.search(rf"\b{name}\b", finding.message)
        }
        assert re.search(rf"\b{near}\b", advice), name


def test_advice_is_in_the_words_of_urdf() -> None:
    """Rules know YAML and URDF: whoever wrote XML is told what to write in XML."""
    advice = {finding.code: finding.help for file in FILES for finding in lint_urdf(str(file))}
    for code, element in (("TF401", "<origin "), ("TF704", "<limit ")):
        assert element in advice[code]
    assert not [code for code in RULES if "{" in advice.get(code, "")]


@pytest.mark.parametrize("robot", ["my_robot", "autonomous_robot"])
def test_what_build_writes_has_no_findings(robot: str, tmp_path: Path) -> None:
    text = (ROOT / "robots" / f"{robot}.yaml").read_text("utf-8")
    compiled = compile_robot(text, "r.yaml", library())
    assert compiled.robot
    for file in emit(compiled.robot):
        if file.path.endswith(".urdf"):
            (tmp_path / file.path).write_text(file.text, encoding="utf-8")
            findings = lint_urdf(str(tmp_path / file.path))
            root_body = (
                {"TF712"} if file.path == "robot.urdf" and robot == "autonomous_robot" else set()
            )
            assert {finding.code for finding in findings} == root_body


BOMB = (
    '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY b{n} "&a;&a;&a;">' for n in range(9))
    + ']><robot name="&b1;"/>'
)
REFUSED = {
    "an entity bomb": (BOMB, "document type"),
    "an external entity": (
        '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot>&a;</robot>',
        "document type",
    ),
    "an external type": (
        '<!DOCTYPE robot SYSTEM "http://localhost/x.dtd"><robot/>',
        "document type",
    ),
    "a tag that is not closed": ('<robot name="r">\n<link name="a">\n</robot>', "mismatched tag"),
    "nothing": ("", "no element found"),
    "another document": ("<sdf/>", "not <robot>"),
    "too deep": ("<a>" * 2000 + "</a>" * 2000, "deeper than"),
    "a NUL byte": ("<robot\0/>", "NUL"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_no_urdf_or_could_do_harm_is_one_finding(what: str) -> None:
    text, output = REFUSED[what]
    (finding,) = lint_text(text)
    assert output in finding.message


@pytest.mark.parametrize("encoding", ["ISO-8859-1", "windows-1252", "GB2312"])
def test_a_file_is_read_in_the_encoding_that_it_declares(encoding: str, tmp_path: Path) -> None:
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    source_text = "轮子" if encoding == "GB2312" else "grün"
    file = tmp_path / "r.urdf"
    file.write_bytes(
        f'{head}<robot name="r"><link name="{source_text}"/></robot>'.encode(encoding)
    )
    assert [(entry.code, source_text in entry.message) for entry in lint_urdf(str(file))] == [
        ("TF501", True)
    ]
    file.write_bytes(file.read_bytes().replace(encoding.encode(), b"UTF-8"))
    (finding,) = lint_urdf(str(file))
    assert (finding.code, finding.help[:16]) == ("TF001", "save it as UTF-8")


def test_where_a_tag_does_not_match_is_reported() -> None:
    (finding,) = lint_text(REFUSED["a tag that is not closed"][0])
    assert finding.code == "TF018"
    assert finding.span
    assert finding.span.line == 3
    assert "<link>" in finding.message
    assert [note.span and note.span.line for note in finding.notes] == [2]


def test_the_command_line_knows_a_urdf_by_its_name_or_by_its_option(tmp_path: Path) -> None:
    text = (FILES[0].parent / "tree.urdf").read_text("utf-8")
    (tmp_path / "a.urdf").write_text(text, encoding="utf-8")
    (tmp_path / "b.xml").write_text(text, encoding="utf-8")
    by_name = json.loads(run(tmp_path, "a.urdf", "--format", "json").stdout)
    by_option = json.loads(run(tmp_path, "--urdf", "b.xml", "--format", "json").stdout)
    assert [entry | {"file": ""} for entry in by_name] != []
    assert [(entry["code"], entry["line"]) for entry in by_name] == [
        (entry["code"], entry["line"]) for entry in by_option
    ]
    done = run(tmp_path, "a.urdf")
    assert done.returncode == 1
    assert re.search(
        r"^a\.urdf:13:48: error\[TF201\] .*\btool\b.*\bbase_link\b.*\bother_root$",
        done.stdout,
        re.MULTILINE,
    )
    (tmp_path / "fine.urdf").write_text(FINE)
    assert (run(tmp_path, "fine.urdf").returncode, run(tmp_path, "none.urdf").returncode) == (0, 2)


@pytest.mark.parametrize(
    "source_text",
    [
        "$(find mine)/meshes/a.stl",
        "file://$(find mine)/meshes/a.stl",
        "$(find-pkg-share mine)/meshes/a.stl",
        "package:/mine/meshes/a.stl",
        "package:mine//meshes/a.stl",
        "package:///mine/meshes/a.stl",
    ],
)
def test_a_near_miss_of_a_package_address_gets_the_right_form(
    source_text: str,
) -> None:
    _, finding = Packages(disk()).asset(source_text, Span("a.urdf"))
    assert finding
    assert finding.message.startswith(source_text)
    assert finding.help.endswith("package://mine/meshes/a.stl")


def test_a_package_is_searched_where_ros_searches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = tmp_path / "share" / "mine" / "meshes" / "a.stl"
    mesh.parent.mkdir(parents=True)
    mesh.touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path}")

    def missing(name: str) -> Finding | None:
        return Packages(disk()).asset(name, Span(str(tmp_path / "a.urdf")))[1]

    assert missing("package://mine/meshes/a.stl") is None
    assert missing(f"file://{mesh}") is None
    assert missing("share/mine/meshes/a.stl") is None
    gone = missing("package://mine/b.stl")
    assert gone
    assert (gone.code, str(tmp_path / "share/mine/b.stl") in gone.help) == ("TF723", True)
    finding = missing("package://other/b.stl")
    assert finding
    assert (finding.code, "/nowhere/share/other" in finding.help) == ("TF724", True)
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    unset = missing("package://mine/meshes/a.stl")
    assert unset
    assert "AMENT_PREFIX_PATH" in unset.help


XACRO = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="leg" params="n"><link name="leg_${n}"/>
    <joint name="j_${n}" type="fixed"><parent link="base_lnk"/><child link="leg_${n}"/></joint></xacro:macro>
  <link name="base_link"/>
  <xacro:leg n="1"/>
</robot>
"""  # noqa: E501 (a text as its reader has it)


def test_a_xacro_file_is_expanded_and_places_are_those_in_it(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf.xacro"
    file.write_text(XACRO)
    findings = lint_urdf(str(file))
    assert [finding.code for finding in findings] == ["TF203"]
    assert findings[0].span == Span(str(file), 3, 53, 3, 61)
    file.write_text(XACRO.replace("${n}", "${m}", 1))
    (refused,) = lint_urdf(str(file))
    assert refused.code == "TF018"
    assert "'m' is not defined" in refused.message
    assert refused.span
    assert refused.span.file == str(file)
    assert (
        file.read_text()
        .splitlines()[refused.span.line - 1][refused.span.column - 1 :]
        .startswith("${m}")
    )
    file.write_text(XACRO.replace("<xacro:leg", "<xacro:lag", 1))
    (unknown,) = lint_urdf(str(file))
    assert unknown.span
    assert (
        file.read_text()
        .splitlines()[unknown.span.line - 1][unknown.span.column - 1 :]
        .startswith("<xacro:lag")
    )


ALLOWED = """<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:macro name="leg" params="n">
    <link name="the leg ${n}"/> <!-- tfcompose: allow TF501 because of the drawing -->
    <joint name="j_${n}" type="fixed"> <!-- tfcompose: allow TF205 because of nothing -->
      <parent link="base_link"/> <child link="the leg ${n}"/>
    </joint>
  </xacro:macro>
  <link name="base_link"/>
  <!-- tfcompose: allow TF501 because it stands in no macro -->
  <link name="the hand"/>
  <joint name="hand" type="fixed"> <parent link="base_link"/> <child link="the hand"/> </joint>
  <xacro:leg n="1"/>
  <xacro:leg n="2"/>
</robot>
"""


def test_a_comment_in_a_xacro_file_counts_for_its_line_in_every_expansion(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf.xacro"
    file.write_text(ALLOWED)
    assert [
        (finding.code, "TF205" in finding.message, str(finding.span))
        for finding in lint_urdf(str(file))
    ] == [("TF012", True, f"{file}:4:40")]


RATES = 'effort="1" velocity="1"'
LIMIT = f'<limit {RATES} {{}} {{}}="1"/>'
#: What is wrong with somebody's URDF, and how severe that is: an error only where a reader refuses
#: the robot, or takes it for another one.
JOINT = (
    '<joint name="{}" type="{}"><parent link="base_link"/><child link="a"/>'
    '<axis xyz="0 0 1"/>{}</joint>'
)
LEVELS = {
    "hyphens, as every UR has them": (f'<link name="a"/>{JOINT.format("base_link-a_joint", "continuous", "")}', "warning"),  # noqa: E501 (a text as its reader has it)
    "a space": (f'<link name="a"/>{JOINT.format("my joint", "fixed", "")}', "warning"),
    "a slash that no lookup takes": (f'<link name="a"/>{JOINT.format("/j", "fixed", "")}', "error"),  # noqa: E501 (a text as its reader has it)
    "an extension": ('<material name="m" gloss="1"><color rgba="1 1 1 1"/></material>', "warning"),
    "an extension that is like a word": (
        f'<link name="a"/>{JOINT.format("j", "continuous", LIMIT.format("", "command_effort"))}',
        "warning",
    ),
    "a safety controller without its gain": (
        '<link name="a"/>' + JOINT.format("j", "continuous", '<safety_controller soft_upper_limit="1"/>'), "error"),  # noqa: E501 (a text as its reader has it)
    "a slip": (f'<link name="a"/>{JOINT.format("j", "continuous", LIMIT.format("", "uper"))}', "error"),  # noqa: E501 (a text as its reader has it)
    "a limit without ends": (f'<link name="a"/>{JOINT.format("j", "revolute", f"<limit {RATES}/>")}', "warning"),  # noqa: E501 (a text as its reader has it)
    "a limit of the largest float": (
        '<link name="a"/>' + JOINT.format("j", "revolute", LIMIT.format('lower="-1e308"', "upper")), "warning"),  # noqa: E501 (a text as its reader has it)
    "a place beyond all numbers": (
        '<link name="a"/>' + JOINT.format("j", "fixed", '<origin xyz="1e300 0 0"/>'), "error"),
    "no limit": (f'<link name="a"/>{JOINT.format("j", "revolute", "")}', "error"),
    "a body of no size": ('<link name="a"><collision><geometry><sphere radius="0"/></geometry></collision></link>'  # noqa: E501 (a text as its reader has it)
        + JOINT.format("j", "fixed", ""), "warning"),
    "a body of less": ('<link name="a"><collision><geometry><sphere radius="-1"/></geometry></collision></link>'  # noqa: E501 (a text as its reader has it)
        + JOINT.format("j", "fixed", ""), "error"),
    "a shape that simulators have and Jazzy has not": (
        '<link name="a"><visual><geometry><capsule radius="1" length="1"/></geometry></visual></link>'  # noqa: E501 (a text as its reader has it)
        + JOINT.format("j", "fixed", ""), "warning"),
    "a tab between numbers": (
        '<link name="a"/>' + JOINT.format("j", "fixed", '<origin xyz="1\t0 0" rpy=" 0 0 0 "/>'), "warning"),  # noqa: E501 (a text as its reader has it)
    "a line break": ('<link name="a"/>' + JOINT.format("j", "fixed", "<origin xyz='1 0 0\n'/>"), "warning"),  # noqa: E501 (a text as its reader has it)
    "xacro without its prefix": (
        '<link name="a"/>' + JOINT.format("j", "fixed", '<insert_block name="origin"/>'), "error"),
    "xacro that was not expanded": ('<xacro:wheel n="1" xmlns:xacro="http://www.ros.org/wiki/xacro"/>', "error"),  # noqa: E501 (a text as its reader has it)
    "a block about nothing": ('<gazebo reference="gone"/>', "warning"),
    "a transmission of nothing": ('<transmission name="t"><joint name="gone"/></transmission>', "warning"),  # noqa: E501 (a text as its reader has it)
}  # fmt: skip


@pytest.mark.parametrize("what", LEVELS)
def test_what_readers_take_is_a_warning_and_no_error(what: str, tmp_path: Path) -> None:
    inside, severity = LEVELS[what]
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="base_link"/>{inside}</robot>')
    findings = [
        finding for finding in lint_urdf(str(tmp_path / "r.urdf")) if finding.code != "TF706"
    ]
    assert [finding.severity for finding in findings] == [severity], [
        finding.message for finding in findings
    ]


QUAT = """<robot name="r"{}><link name="base_link"/><link name="a"/><joint name="j" type="fixed">
<parent link="base_link"/><child link="a"/><origin {}/></joint></robot>"""
ROTATION = 'quat_xyzw="0 0 3 3"'


@pytest.mark.parametrize(
    ("version", "origin", "severity", "word"),
    [
        ("", ROTATION, "error", "quat_xyzw"),
        (' version="1.0"', ROTATION, "error", "quat_xyzw"),
        (' version="1.1"', ROTATION, "warning", "1.1"),
        (' version="1"', "", "error", "'1'"),
        ("", 'quat_xyzw="0 0 1"', "error", "quat_xyzw='0 0 1'"),
        ("", 'quat_xyzw="0 0 0 0"', "error", "quaternion"),
        ("", f'{ROTATION} rpy="0 0 0"', "error", "rpy"),
    ],
)
def test_a_rotation_as_a_quaternion_is_read_and_is_one_finding(
    version: str, origin: str, severity: str, word: str
) -> None:
    text = QUAT.format(version, origin)
    converted = robot_of(read_xml(text, "r.urdf"), "r.urdf", Packages().asset)
    (finding,) = converted.findings
    assert (finding.code, finding.severity, word in finding.message) == ("TF721", severity, True)
    if ROTATION in origin:
        assert converted.robot.edges[0].pose.quat_xyzw == pytest.approx((0, 0, 0.5**0.5, 0.5**0.5))


def test_xacro_in_a_file_that_is_named_as_a_urdf_is_expanded_too(tmp_path: Path) -> None:
    """As those of TurtleBot 3 are named."""
    file = tmp_path / "r.urdf"
    file.write_text(XACRO.replace("base_lnk", "base_link"))
    assert lint_urdf(str(file)) == []
    file.write_text(XACRO)
    assert [finding.code for finding in lint_urdf(str(file))] == ["TF203"]


def test_of_a_file_that_only_defines_macros_these_are_named(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf.xacro"
    file.write_text(
        XACRO.replace('<link name="base_link"/>', "").replace('<xacro:leg n="1"/>', "")
    )
    (finding,) = lint_urdf(str(file))
    assert (finding.code, "leg" in words(finding)) == ("TF206", True)


def test_a_xacro_file_that_cannot_be_read_is_refused_as_every_other(tmp_path: Path) -> None:
    assert [finding.code for finding in lint_urdf(str(tmp_path / "none.xacro"))] == ["TF001"]


TEXTS = [file.read_text("utf-8") for file in FILES]
ODD = [
    "",
    "<",
    ">",
    '"',
    "&amp;",
    "&x;",
    "1e999",
    "nan",
    "-1",
    "<robot>",
    "</link>",
    "\x01",
    "]]>",
    "<!--",
    "1e200",
    "ä",
]


@st.composite
def mutated(draw: st.DrawFn) -> str:
    text = draw(st.sampled_from(TEXTS))
    for _ in range(draw(st.integers(1, 5))):
        words = re.split(r"(\s+|\"|=)", text)
        index = draw(st.integers(0, len(words) - 1))
        words[index] = draw(st.sampled_from(ODD) | st.sampled_from(words) | st.text(max_size=3))
        text = "".join(words)
    return text


@given(mutated() | st.text())
@settings(max_examples=150, deadline=None)
def test_any_text_gives_findings_or_a_robot(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    file = tmp_path_factory.getbasetemp() / "any.urdf"
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    for finding in lint_urdf(str(file)):
        assert finding.code != "TF903", finding.message
        assert finding.span
        assert finding.span.line >= 1
        assert finding.span.column >= 1


def test_the_rules_that_are_named_are_known() -> None:
    assert {finding.code for file in FILES for finding in lint_urdf(str(file))} >= {
        code for code, rule in RULES.items() if rule.of_urdf
    } - {
        "TF206",
        "TF702",
        "TF708",
        "TF709",
    }


def large(links: int, first: str) -> str:
    """Return a URDF of a base and so many links on it, with a comment in the beginning."""
    parts = [
        f'<link name="l{index}"/><joint name="j{index}" type="fixed"><parent link="b"/><child'
        f' link="l{index}"/></joint>'
        for index in range(links)
    ]
    return (
        f'<!-- {first} --><robot name="r"><link name="b"/>{"".join(parts)}<joint'
        ' nmae="end"/></robot>'
    )


def test_non_ascii_costs_nothing_extra_and_keeps_later_places_right() -> None:
    seconds = {}
    for first in ("u", "ü"):
        text = large(8000, first)
        began = time.process_time()
        finding, *_ = [finding for finding in lint_text(text) if "nmae" in finding.message]
        seconds[first] = time.process_time() - began
        assert finding.span
        assert text[finding.span.column - 1 : finding.span.end_column - 1] in {"<joint", "end"}
    assert seconds["ü"] < 3 * seconds["u"]


def test_a_urdf_of_10_000_frames_is_read_and_a_larger_one_is_refused() -> None:
    text = large(2, "x" * 6_000_000)
    assert "TF008" not in {finding.code for finding in lint_text(text)}
    assert [finding.code for finding in lint_text(large(2, "x" * 16_000_000))] == ["TF008"]


def test_a_package_absent_from_its_path_is_not_its_own_misspelling() -> None:
    named = Packages(named={"arm_description": ("nowhere", Span("r.yaml"))})
    assert "mean" not in words_of(named.not_found("arm_description", None).help)
    assert "mean" in words_of(named.not_found("arm_descriptoin", None).help)


def test_a_package_is_found_from_a_file_deep_inside_it(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>")
    (tmp_path / "a.stl").touch()
    deep = tmp_path / "robots" / "arms" / "long" / "urdf"
    _, finding = Packages(disk()).asset("package://mine/a.stl", Span(str(deep / "a.urdf")))
    assert finding is None


def test_a_number_that_no_robot_has_is_refused() -> None:
    """Products of three smaller numbers stay in the range of floats."""
    urdf = (
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="fixed"><parent'
        ' link="a"/>'
    )
    urdf += '<child link="b"/><origin xyz="{} 0 0"/></joint></robot>'
    codes = {
        size: {
            finding.code
            for finding in robot_of(
                read_xml(urdf.format(size), "r"), "r", Packages().asset
            ).findings
        }
        for size in ("1e29", "1e31", "-1e31")
    }
    assert codes == {"1e29": set(), "1e31": {"TF721"}, "-1e31": {"TF721"}}
