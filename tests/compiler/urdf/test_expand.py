"""xacro within bounds, in a process of its own.

What stops it is found where it is written, and so is the rest.
"""

import os
from pathlib import Path

import pytest

from tfcompose.cli.compiling import disk
from tfcompose.compiler.urdf.lint import lint_urdf, read_urdf
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.findings import Finding

HEAD = '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><link name="base_link"/>\n'


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def lint(*lines: str, file: str = "r.xacro") -> list[Finding]:
    Path(file).write_text(HEAD + "\n".join(lines) + "\n</robot>\n", "utf-8")
    return lint_urdf(file, Packages(disk()))


def place(finding: Finding) -> str:
    return str(finding.span)


EXPRESSIONS = {
    "much memory": '<link name="${[0] * 10 ** 10}"/>',
    "a long loop in C": "<link name=\"${'a' * 10 ** 11}\"/>",
}


@pytest.mark.parametrize("line", EXPRESSIONS.values(), ids=EXPRESSIONS)
def test_an_expression_that_asks_for_too_much_is_found_where_it_is(line: str) -> None:
    (finding,) = lint(line)
    assert (finding.code, place(finding)) == ("TF008", "r.xacro:2:13")
    assert "xacro r.xacro > robot.urdf" in finding.help


@pytest.mark.slow
def test_an_expression_that_does_not_end_is_ended() -> None:
    (finding,) = lint('<link name="a"/>', '<link name="${9**9**9}"/>')
    assert (finding.code, place(finding)) == ("TF008", "r.xacro:3:13")
    assert "${9**9**9}" in finding.message


def test_a_text_that_no_reader_takes_is_not_made() -> None:
    (finding,) = lint("<link name=\"${'a' * 10 ** 8}\"/>")
    assert (finding.code, "100,000," in finding.message) == ("TF008", True)


def test_a_macro_that_calls_itself_is_found_with_its_name() -> None:
    macro = (
        '<xacro:macro name="m" params="n"><link name="l${n}"/><xacro:m n="${n +'
        ' 1}"/></xacro:macro>'
    )
    (finding,) = lint(macro, '<xacro:m n="1"/>')
    assert (finding.code, place(finding)) == ("TF008", "r.xacro:2:54")
    assert [note.message.split()[-1] for note in finding.notes] == ["m"]


@pytest.mark.slow
def test_a_macro_of_hundred_million_elements_is_ended() -> None:
    call = '<xacro:if value="${n > 0}"><xacro:m n="${n - 1}"/><xacro:m n="${n - 1}"/></xacro:if>'
    macro = f'<xacro:macro name="m" params="n"><link name="l${{n}}"/>{call}</xacro:macro>'
    (finding,) = lint(macro, '<xacro:m n="27"/>')
    assert (finding.code, finding.span and finding.span.line) == ("TF008", 2)


@pytest.mark.parametrize(
    "include", ['<xacro:include filename="{}"/>', "<link name=\"${{xacro.load_yaml('{}')}}\"/>"]
)
@pytest.mark.parametrize("named", ["fifo", "folder"])
def test_what_is_no_plain_file_is_not_read(include: str, named: str) -> None:
    os.mkfifo("fifo")
    Path("folder").mkdir()
    (finding,) = lint('<link name="a"/>', include.format(named))
    assert finding.code == "TF018"
    assert named in finding.message
    assert finding.span
    assert (finding.span.file, finding.span.line) == ("r.xacro", 3)


def test_a_file_that_includes_itself_is_found() -> None:
    Path("other.xacro").write_text(HEAD + '<xacro:include filename="r.xacro"/></robot>', "utf-8")
    (finding,) = lint('<xacro:include filename="other.xacro"/>')
    assert finding.code == "TF008"
    assert {"r.xacro", "other.xacro"} <= set(finding.message.split())


def test_an_include_of_a_package_that_is_not_there_is_found_at_the_include() -> None:
    Path("inner").mkdir()
    Path("inner/a.xacro").write_text(
        HEAD + ' <xacro:include filename="$(find nowhere)/b.xacro"/></robot>', "utf-8"
    )
    (finding,) = lint('<xacro:include filename="inner/a.xacro"/>')
    assert (finding.code, place(finding)) == ("TF724", "inner/a.xacro:2:27")


def test_an_argument_without_a_value_is_found_where_it_is_used() -> None:
    (finding,) = lint('<link name="$(arg side)_a"/>')
    assert (finding.code, place(finding)) == ("TF106", "r.xacro:2:13")


def test_broken_xml_of_an_included_file_is_found_there() -> None:
    Path("inner.xacro").write_text(HEAD + "<link>\n</robot>", "utf-8")
    (finding,) = lint('<xacro:include filename="inner.xacro"/>')
    assert (finding.code, place(finding)) == ("TF018", "inner.xacro:3:3")


INNER = (
    HEAD
    + '<xacro:macro name="wheel" params="side *origin">\n  <link name="${side}_wheel"/>\n  <joint'
    ' name="${side}_joint" type="fixed"><parent link="chasis"/><child link="${side}_wheel"/>\n  '
    '  <xacro:insert_block name="origin"/></joint>\n</xacro:macro></robot>\n'
)


def test_each_finding_is_in_the_file_and_line_that_people_have() -> None:
    Path("lib").mkdir()
    Path("lib/wheel.xacro").write_text(INNER.replace('<link name="base_link"/>', ""), "utf-8")
    findings = lint(
        '<xacro:include filename="lib/wheel.xacro"/>',
        '<xacro:wheel side="left"><origin xyz="0 0"/></xacro:wheel>',
        '<xacro:wheel side="right"><origin rpy="${1 + 1} 0 0"/></xacro:wheel>',
        '<gazebo reference="nobody"/>',
    )
    assert {(finding.code, place(finding)) for finding in findings} == {
        ("TF721", "r.xacro:3:39"),
        ("TF203", "lib/wheel.xacro:4:58"),
        ("TF203", "r.xacro:5:20"),
    }


def test_an_element_that_xacro_names_is_found_where_it_names_it() -> None:
    findings = lint("<xacro:element xacro:name=\"${'li' + 'nk'}\" name=\"a b\"/>")
    assert {place(finding) for finding in findings if finding.code == "TF501"} == {"r.xacro:2:50"}


HARDWARE = """<xacro:macro name="drive" params="joint">
  <ros2_control name="base" type="system"><hardware><plugin>a/B</plugin></hardware>
    <joint name="${joint}"><command_interface name="velocity"/></joint>
  </ros2_control>
</xacro:macro>
<xacro:drive joint="whel"/>"""


def test_a_joint_of_hardware_is_found_in_the_macro() -> None:
    (finding,) = lint(HARDWARE)
    assert (finding.code, place(finding)) == ("TF703", "r.xacro:4:18")


def test_a_relative_mesh_path_starts_at_the_document_not_at_an_include() -> None:
    Path("lib").mkdir()
    mesh = '<link name="a"><visual><geometry><mesh filename="a.stl"/></geometry></visual></link>'
    Path("lib/a.xacro").write_text(
        HEAD.replace('<link name="base_link"/>', "") + mesh + "</robot>", "utf-8"
    )
    Path("a.stl").touch()
    assert lint('<xacro:include filename="lib/a.xacro"/>', file="r.xacro")[0].code == "TF209"
    document = read_urdf("r.xacro", Packages(disk()))
    (shape,) = document.robot.links["a"].visuals
    assert shape.mesh is not None
    assert (shape.mesh.path, str(shape.mesh.span)) == ("a.stl", "lib/a.xacro:2:50")
